#include "read_files.h"

#include <fnmatch.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "option.h"
#include "report.h"

struct read_file {
    dev_t device;
    ino_t inode;
};

int read_files_add(read_files *r, const char *path)
{
    struct stat st;
    if (!path || stat(path, &st) != 0 || (!S_ISREG(st.st_mode) && !S_ISDIR(st.st_mode)))
        return 0;
    if (r->count == r->room) {
        const size_t room = r->room ? 2 * r->room : 16;
        struct read_file *files = reallocarray(r->files, room, sizeof *files);
        if (!files)
            return trip_fail(TRIP_ERROR, "read", path, "out of memory for the list of input files");
        r->files = files;
        r->room = room;
    }
    r->files[r->count++] = (struct read_file){ st.st_dev, st.st_ino };
    return 0;
}

int read_files_add_function(read_files *r, const char *name)
{
    const char *part = name ? strrchr(name, '#') : NULL;
    char *file = part ? strndup(name, (size_t)(part - name)) : NULL;
    int status = read_files_add(r, name);
    if (!status)
        status = read_files_add(r, file);
    free(file);
    return status;
}

static bool is_folder(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && S_ISDIR(st.st_mode);
}

void read_files_release(read_files *r)
{
    free(r->files);
    *r = (read_files){ 0 };
}

static bool has(const read_files *r, const char *path)
{
    struct stat st;
    bool found = false;
    if (stat(path, &st) != 0)
        return false;
    for (size_t i = 0; i < r->count && !found; i++)
        found = r->files[i].device == st.st_dev && r->files[i].inode == st.st_ino;
    return found;
}

/* Copies the path of the folder that contains a file. Returns false if it is too long. */
static bool folder_of(const char *path, char folder[PATH_MAX])
{
    const char *slash = strrchr(path, '/');
    int length = slash ? snprintf(folder, PATH_MAX, "%.*s", (int)(slash + 1 - path), path)
                       : snprintf(folder, PATH_MAX, ".");
    return length < PATH_MAX;
}

int read_files_check_replaced(const read_files *r, const char *output)
{
    return !is_folder(output) &&
                   has(r, output) /* an existing folder is reported when it is written */
               ? trip_option_fail(output, "is an input file; give another name for the output")
               : 0;
}

int read_files_check(const read_files *r, const char *output)
{
    char folder[PATH_MAX];
    int status = read_files_check_replaced(r, output);
    if (status || is_folder(output))
        return status;
    if (folder_of(output, folder) && has(r, folder))
        return trip_option_fail(output, "would lie among the input files; choose another folder");
    if (r->pattern && fnmatch(r->pattern, output, FNM_PATHNAME | FNM_PERIOD) == 0)
        return trip_option_fail(output,
                                "would match the pattern of the input slices; choose another name");
    return 0;
}

bool read_files_are_one(const char *a, const char *b)
{
    char folder_a[PATH_MAX], folder_b[PATH_MAX];
    struct stat at_a, at_b;
    const char *slash_a = strrchr(a, '/'), *slash_b = strrchr(b, '/');
    if (strcmp(slash_a ? slash_a + 1 : a, slash_b ? slash_b + 1 : b) != 0)
        return false;
    return folder_of(a, folder_a) && folder_of(b, folder_b) && stat(folder_a, &at_a) == 0 &&
           stat(folder_b, &at_b) == 0 && at_a.st_dev == at_b.st_dev && at_a.st_ino == at_b.st_ino;
}
