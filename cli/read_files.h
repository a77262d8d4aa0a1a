/* What a command reads, held against what it is to write: a name that is given twice by mistake
 * must not cost what stands there. One thread. */
#ifndef TRIP_CLI_READ_FILES_H
#define TRIP_CLI_READ_FILES_H

#include <stdbool.h>
#include <stddef.h>

/* Zeroed at first. */
typedef struct read_files {
    struct read_file *files; /* and folders */
    size_t count, room;
    const char *pattern; /* of slices, the caller's; NULL: none */
} read_files;

/* A file or a folder that is read, a data set among these, by any of its names; nothing where there
 * is none, or for NULL. Volumes: read_data.h. */
int read_files_add(read_files *r, const char *path);
/* A transfer function as options have it: a file, one of several in a file, "FILE#NAME", or a
 * preset, which is nothing; the same for NULL. */
int read_files_add_function(read_files *r, const char *name);
void read_files_release(read_files *r);

/* TRIP_USAGE, once reported, where `output` would take the place of something that is read, or come
 * among the files of a data set or the slices of a volume. */
int read_files_check(const read_files *r, const char *output);
/* The same of what it would take the place of alone. */
int read_files_check_replaced(const read_files *r, const char *output);

/* Whether two files that are to be written get one name; neither need be there. */
bool read_files_are_one(const char *a, const char *b);

#endif
