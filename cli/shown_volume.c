#include "shown_volume.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "report.h"

static triptych_brick_options options_of(const shown_volume *s, bool keep_all)
{
    triptych_brick_options wanted = s->options;
    wanted.functions = &s->function;
    wanted.function_count = s->function && !keep_all;
    wanted.automatic = !keep_all;
    wanted.keep_all = keep_all;
    return wanted;
}

/* The folder that it lies in, with the last slash, for free(). */
static char *folder_of(const char *path)
{
    char *folder = strdup(path);
    size_t n = folder ? strlen(folder) : 0;
    while (n > 1 && folder[n - 1] == '/')
        n--;
    while (n > 0 && folder[n - 1] != '/')
        n--;
    if (folder)
        folder[n] = 0;
    return folder;
}

/* What a data set was made of, for free(); NULL where that is reported not to lie beside it. */
static char *source_of(triptych *t, const char *data_set)
{
    char *name = triptych_open(t, data_set, NULL) == 0 ? library_note(t, "source") : NULL;
    char *folder = name ? folder_of(data_set) : NULL, *path = NULL;
    triptych_close(t);
    if (folder && asprintf(&path, "%s%s", folder, name) < 0)
        path = NULL;
    if (!path || access(path, R_OK)) {
        trip_fail(TRIP_ERROR, "brick", name ? name : data_set,
                  "the volume it was made of is not beside it");
        free(path);
        path = NULL;
    }
    free(folder);
    free(name);
    return path;
}

static int open_volume(const shown_volume *s, cached_volume *cached, triptych *t, const char *input,
                       bool keep_all)
{
    const triptych_brick_options wanted = options_of(s, keep_all);
    char *volume = cached_volume_wanted(input) ? strdup(input) : source_of(t, input);
    const int status = volume ? cached_volume_open(cached, t, volume, &wanted) : TRIP_ERROR;
    free(volume);
    return status;
}

int shown_volume_find(void *user, triptych *t, const char *input, bool keep_all, const char **path)
{
    shown_volume *s = user;
    *path = input;
    if (!keep_all && !cached_volume_wanted(input))
        return 0;
    const int status = open_volume(s, &s->cached, t, input, keep_all);
    *path = s->cached.path;
    return status;
}

void shown_volume_release(void *user)
{
    shown_volume *s = user;
    cached_volume_close(&s->cached);
}

int shown_volume_make(void *user, triptych *t, const char *input)
{
    cached_volume made = { .hold = -1 };
    const int status = open_volume(user, &made, t, input, true);
    cached_volume_close(&made);
    return status;
}
