#include "memory_limits.h"

#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Reads a limit. "max", an empty file or no file means no limit. */
static uint64_t read_limit(const char *path)
{
    uint64_t limit = UINT64_MAX;
    FILE *f = fopen(path, "re");
    if (!f)
        return limit;
    if (fscanf(f, "%" SCNu64, &limit) != 1)
        limit = UINT64_MAX;
    fclose(f);
    return limit;
}

/* Returns the smallest limit of `group` ("/a/b") and the groups above it. */
static uint64_t smallest_limit(const char *root, const char *mount, char *group, const char *file)
{
    uint64_t smallest = UINT64_MAX;
    for (;;) {
        char path[4096];
        int n = snprintf(path, sizeof path, "%s%s%s/%s", root, mount, group, file);
        uint64_t limit = n > 0 && (size_t)n < sizeof path ? read_limit(path) : UINT64_MAX;
        smallest = limit < smallest ? limit : smallest;
        char *slash = strrchr(group, '/');
        if (!slash)
            return smallest;
        *slash = 0;
    }
}

static bool names_memory_controller(const char *controllers)
{
    for (const char *p = controllers; p; p = strchr(p, ',')) {
        p += *p == ',';
        if (strncmp(p, "memory", 6) == 0 && (p[6] == 0 || p[6] == ','))
            return true;
    }
    return false;
}

/* A line of /proc/self/cgroup is "ID:CONTROLLERS:/GROUP". Version 2 has ID 0 and no controllers. */
static uint64_t limit_of_line(const char *root, char *text)
{
    char *controllers = strchr(text, ':');
    char *group = controllers ? strchr(controllers + 1, ':') : NULL;
    if (!group)
        return UINT64_MAX;
    *controllers++ = 0;
    *group++ = 0;
    group[strcspn(group, "\n")] = 0;
    if (*controllers == 0)
        return smallest_limit(root, "/sys/fs/cgroup", group, "memory.max");
    if (names_memory_controller(controllers))
        return smallest_limit(root, "/sys/fs/cgroup/memory", group, "memory.limit_in_bytes");
    return UINT64_MAX;
}

uint64_t trip_cgroup_limit_bytes(const char *root)
{
    char path[4096], *text = NULL;
    size_t room = 0;
    uint64_t smallest = UINT64_MAX;
    int n = snprintf(path, sizeof path, "%s/proc/self/cgroup", root);
    FILE *f = n > 0 && (size_t)n < sizeof path ? fopen(path, "re") : NULL;
    if (!f)
        return smallest;
    while (getline(&text, &room, f) > 0) {
        uint64_t limit = limit_of_line(root, text);
        smallest = limit < smallest ? limit : smallest;
    }
    free(text);
    fclose(f);
    return smallest;
}

uint64_t trip_proc_field_bytes(const char *path, const char *name)
{
    char text[256];
    uint64_t kib = 0;
    size_t length = strlen(name);
    FILE *f = fopen(path, "re");
    if (!f)
        return 0;
    while (fgets(text, sizeof text, f)) {
        if (strncmp(text, name, length) == 0 && text[length] == ':') {
            if (sscanf(text + length + 1, "%" SCNu64, &kib) != 1)
                kib = 0;
            break;
        }
    }
    fclose(f);
    return kib > UINT64_MAX / 1024 ? 0 : kib * 1024;
}
