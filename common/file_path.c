#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include "file_path.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Returns the length of the folder at the start of a path, with its last slash. */
static size_t folder_length(const char *path)
{
    size_t length = strlen(path);
    while (length > 1 && path[length - 1] == '/')
        length--;
    while (length > 0 && path[length - 1] != '/')
        length--;
    return length;
}

/* Returns the absolute path of the folder that contains a file, with a slash at its end. */
static char *absolute_folder(const char *path)
{
    char *folder = strndup(path, folder_length(path)), *out = NULL;
    char *real = folder ? realpath(*folder ? folder : ".", NULL) : NULL;
    if (real && asprintf(&out, "%s%s", real, strcmp(real, "/") ? "/" : "") < 0)
        out = NULL;
    free(real);
    free(folder);
    return out;
}

char *trip_path_relative(const char *from, const char *to)
{
    char *here = absolute_folder(from), *there = absolute_folder(to), *out = NULL;
    size_t common = 0, bytes;
    FILE *f = here && there ? open_memstream(&out, &bytes) : NULL;
    if (f) {
        for (size_t i = 0; here[i] && here[i] == there[i]; i++)
            common = here[i] == '/' ? i + 1 : common;
        for (const char *p = here + common; *p; p++)
            if (*p == '/')
                fputs("../", f);
        fprintf(f, "%s%s", there + common, to + folder_length(to));
        if (fclose(f) != 0) {
            free(out);
            out = NULL;
        }
    }
    free(here);
    free(there);
    return out;
}

static bool is_same_file(const char *a, const char *b)
{
    struct stat at_a, at_b;
    return stat(a, &at_a) == 0 && stat(b, &at_b) == 0 && at_a.st_dev == at_b.st_dev &&
           at_a.st_ino == at_b.st_ino;
}

/* Removes the first "X/../" of a path, where X is not "..". Returns false if there is none. */
static bool shorten(char *path)
{
    for (char *up = strstr(path, "/../"); up; up = strstr(up + 1, "/../")) {
        char *begin = up;
        while (begin > path && begin[-1] != '/')
            begin--;
        if (begin == up || !strncmp(begin, "../", 3) || !strncmp(begin, "./", 2))
            continue;
        memmove(begin, up + 4, strlen(up + 4) + 1);
        return true;
    }
    return false;
}

char *trip_path_beside(const char *from, const char *name)
{
    const size_t length = *name == '/' ? 0 : folder_length(from);
    char *path = NULL;
    if (asprintf(&path, "%.*s%s", (int)length, from, name) < 0)
        return NULL;
    char *brief = strdup(path);
    bool shorter = false;
    while (brief && shorten(brief))
        shorter = true;
    if (shorter && is_same_file(brief, path)) {
        free(path);
        return brief;
    }
    free(brief);
    return path;
}
