/* Loads transfer functions by name or from files. */
#include "tf_internal.h"

#include "input_file.h"
#include "report.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Returns the file name without folder and extension, for free(). */
static char *stem_of(const char *path)
{
    const char *slash = strrchr(path, '/'), *base = slash ? slash + 1 : path;
    const char *dot = strchr(base, '.');
    return strndup(base, dot ? (size_t)(dot - base) : strlen(base));
}

static int fail_to_open(const char *path)
{
    int error = errno;
    char *stem = error == ENOENT ? stem_of(path) : NULL;
    const char *nearest = stem ? trip_tf_nearest_preset(stem) : NULL;
    free(stem);
    errno = error;
    if (!nearest && error == ENOENT && !strpbrk(path, "/.")) /* no preset has a slash or a dot */
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, path,
                         "no such file or preset; `triptych tf list` lists the presets");
    if (!nearest)
        return trip_fail_errno(TRIP_TF_STAGE, path, "cannot open");
    return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, path,
                     "no such file; did you mean preset:%s? `triptych tf list` lists the presets",
                     nearest);
}

/* Reads at most TRIP_TF_MAX_FILE_BYTES. The caller frees *text. */
static int read_file(const char *path, char **text, size_t *bytes)
{
    int fd = trip_input_open(path);
    if (fd < 0)
        return fail_to_open(path);
    char *buffer = malloc(TRIP_TF_MAX_FILE_BYTES + 1);
    ssize_t n = buffer ? trip_input_read(fd, buffer, TRIP_TF_MAX_FILE_BYTES + 1) : 0;
    int status = TRIP_OK;
    if (!buffer)
        status = trip_fail(TRIP_ERROR, TRIP_TF_STAGE, path, "out of memory");
    else if (n < 0 && trip_interrupted())
        status = trip_fail(TRIP_INTERRUPTED, TRIP_TF_STAGE, path, "interrupted");
    else if (n < 0)
        status = trip_fail_errno(TRIP_TF_STAGE, path, "cannot read");
    else if (n > TRIP_TF_MAX_FILE_BYTES)
        status = trip_fail(TRIP_ERROR, TRIP_TF_STAGE, path,
                           "longer than %d MiB; this is not a transfer function",
                           TRIP_TF_MAX_FILE_BYTES >> 20);
    *bytes = n > 0 ? (size_t)n : 0;
    close(fd);
    if (status) {
        free(buffer);
        buffer = NULL;
    }
    *text = buffer;
    return status;
}

/* A .vp starts with a line of a single number, which no `.tf` has. */
static bool is_vp(const char *text, size_t bytes)
{
    size_t i = 0;
    while (i < bytes && text[i] >= '0' && text[i] <= '9')
        i++;
    size_t digits = i;
    while (i < bytes && (text[i] == ' ' || text[i] == '\t' || text[i] == '\r'))
        i++;
    return digits > 0 && i < bytes && text[i] == '\n';
}

int trip_tf_parse_any(trip_tf **out, const char *name, const char *text, size_t bytes,
                      const char *preset)
{
    size_t i = bytes >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0 ? 3 : 0;
    while (i < bytes && text[i] && strchr(" \t\r\n", text[i]))
        i++;
    char first = i < bytes ? text[i] : 0; /* a `.tf` never starts with a bracket */
    *out = NULL;
    if (first == '{' || first == '[')
        return trip_tf_parse_colormap(out, name, text, bytes, preset);
    if (first == '<')
        return trip_tf_parse_xml(out, name, text, bytes, preset);
    if (preset)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, name,
                         "#%s selects one of several functions, but the file has a single function",
                         preset);
    return is_vp(text + i, bytes - i) ? trip_tf_parse_vp(out, name, text, bytes)
                                      : trip_tf_parse(out, name, text, bytes);
}

static int load_file(trip_tf **out, const char *path, const char *preset)
{
    char *text = NULL;
    size_t bytes = 0;
    int status = read_file(path, &text, &bytes);
    if (!status)
        status = trip_tf_parse_any(out, path, text, bytes, preset);
    free(text);
    return status;
}

/* Loads preset NAME of FILE from "FILE#NAME". A file with the complete name "FILE#NAME" has
 * precedence. */
static int load_path(trip_tf **out, const char *path)
{
    const char *hash = strrchr(path, '#');
    if (!hash || access(path, F_OK) == 0)
        return load_file(out, path, NULL);
    char *file = strndup(path, (size_t)(hash - path));
    if (!file)
        return trip_fail(TRIP_ERROR, TRIP_TF_STAGE, path, "out of memory");
    int status = load_file(out, file, hash + 1);
    free(file);
    return status;
}

int trip_tf_load(trip_tf **out, const char *path_or_preset)
{
    static const char prefix[] = "preset:";
    *out = NULL;
    if (strncmp(path_or_preset, prefix, sizeof prefix - 1) == 0)
        return trip_tf_from_preset(out, path_or_preset + sizeof prefix - 1);
    if (trip_tf_is_preset(path_or_preset)) /* no preset has a slash or a dot */
        return trip_tf_from_preset(out, path_or_preset);
    return load_path(out, path_or_preset);
}
