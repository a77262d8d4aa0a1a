#include "companion.h"

#include <dlfcn.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* `folder` is relative to the folder of `file`. */
static bool is_at(char path[PATH_MAX], const char *file, const char *folder, const char *name,
                  int access_mode)
{
    const char *slash = strrchr(file, '/');
    int start = slash ? (int)(slash + 1 - file) : 0;
    int length = snprintf(path, PATH_MAX, "%.*s%s%s", start, file, folder, name);
    return slash && length < PATH_MAX && access(path, access_mode) == 0;
}

bool trip_companion_find(char path[PATH_MAX], const char *name, const char *built, int access_mode)
{
    static const char here[] = "an address in this program or library";
    char self[PATH_MAX];
    Dl_info library;
    ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    self[n > 0 ? n : 0] = 0;
    if (is_at(path, self, "", name, access_mode) ||
        is_at(path, self, "../libexec/triptych/", name, access_mode))
        return true;
    if (dladdr(here, &library) && library.dli_fname &&
        is_at(path, library.dli_fname, TRIP_COMPANIONS_FROM_LIBRARY, name, access_mode))
        return true;
    snprintf(path, PATH_MAX, "%s", built);
    return access(path, access_mode) == 0;
}
