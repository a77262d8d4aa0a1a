/* Compares the files that a command reads to the files that it will write, so that a mistaken name
 * does not destroy an input. One thread. */
#ifndef TRIP_CLI_READ_FILES_H
#define TRIP_CLI_READ_FILES_H

#include <stdbool.h>
#include <stddef.h>

/* Zeroed before its first use. */
typedef struct read_files {
    struct read_file *files; /* files and folders */
    size_t count, room;
    const char *pattern; /* pattern of input slices, owned by the caller, or NULL */
} read_files;

/* Adds an input file or folder, such as a data set. Other names of the same file are recognised.
 * Ignores NULL and missing files. read_data.h adds volumes. */
int read_files_add(read_files *r, const char *path);
/* Adds a transfer function as options name it: a file, or "FILE#NAME" for one of several in a file.
 * Ignores presets and NULL. */
int read_files_add_function(read_files *r, const char *name);
void read_files_release(read_files *r);

/* Reports TRIP_USAGE if `output` would replace an input, or if it would lie in a data set or among
 * the slices of a volume. */
int read_files_check(const read_files *r, const char *output);
/* Reports TRIP_USAGE if `output` would replace an input. */
int read_files_check_replaced(const read_files *r, const char *output);

/* Returns whether two output paths name the same file. The files need not exist. */
bool read_files_are_one(const char *a, const char *b);

#endif
