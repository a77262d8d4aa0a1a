/* Reads .vol files of the DGtal and VolGallery projects. Header lines are "Name: value" up to a
 * line with a single ".". X * Y * Z bytes follow, plain in version 2, as one zlib stream in version
 * 3.
 * - If no line gives the version, the sizes follow the header again before the values. They are
 *   three 4-byte integers in the byte order of the machine that wrote them, then a line feed.
 * - Voxel-Size is the number of bytes per voxel; only 1 is supported.
 * - The format stores no spacing. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "byte_stream.h"
#include "dense_file.h"
#include "report.h"
#include "volume_reader.h"

#define LINE_BYTES 256
#define LINES_MAX 200

/* Length of the repeated sizes in files without a version. */
enum { REPEATED_BYTES = 3 * 4 + 1 };

typedef struct vol_header {
    int64_t dims[3], version;
    bool has_version;
    uint64_t bytes; /* before the voxels */
} vol_header;

/* Returns whether the file begins with a line that is the first of known headers. */
static bool vol_probe(const char *path, const unsigned char *head, size_t bytes,
                      const trip_volume_params *params)
{
    static const char *const starts[] = { "Center-X:", "X:", "Version:", "Voxel-Size:" };
    (void)path;
    (void)params;
    for (size_t i = 0; i < sizeof starts / sizeof starts[0]; i++)
        if (bytes > strlen(starts[i]) && memcmp(head, starts[i], strlen(starts[i])) == 0)
            return true;
    return false;
}

/* Parses one "Name: value" line; ignores other names. */
static int take_field(vol_header *h, const char *path, int number, const char *line)
{
    static const char *const axes[3] = { "X", "Y", "Z" };
    char name[32], value[64], *end = NULL;
    if (sscanf(line, "%31[^:]: %63s", name, value) != 2)
        return trip_fail_line("read", path, number, "not a \"Name: value\" line");
    for (int a = 0; a < 3; a++)
        if (strcmp(name, axes[a]) == 0)
            h->dims[a] = strtoll(value, &end, 10);
    if (strcmp(name, "Version") == 0) {
        h->version = strtoll(value, &end, 10);
        h->has_version = true;
    }
    if (end && (end == value || *end))
        return trip_fail_line("read", path, number, "%s must be a whole number", name);
    const bool is_long = strcmp(name, "Lvoxel-Size") == 0;
    if (is_long || (strcmp(name, "Voxel-Size") == 0 && strcmp(value, "1") != 0))
        return trip_fail_line("read", path, number,
                              "\"%s: %s\" bytes per voxel: only .vol files with one byte per voxel "
                              "can be read",
                              name, value);
    return 0;
}

/* Returns whether the three integers are the sizes, in either byte order. */
static bool are_sizes(const unsigned char *at, const int64_t dims[3])
{
    bool little = true, big = true;
    for (int a = 0; a < 3; a++, at += 4) {
        little = little && dims[a] == ((int64_t)at[3] << 24 | at[2] << 16 | at[1] << 8 | at[0]);
        big = big && dims[a] == ((int64_t)at[0] << 24 | at[1] << 16 | at[2] << 8 | at[3]);
    }
    return little || big;
}

static int take_repeated_sizes(vol_header *h, const char *path, FILE *file)
{
    unsigned char repeated[REPEATED_BYTES];
    if (fread(repeated, 1, sizeof repeated, file) != sizeof repeated ||
        !are_sizes(repeated, h->dims) || repeated[REPEATED_BYTES - 1] != '\n')
        return trip_fail(TRIP_ERROR, "read", path,
                         "its header has no \"Version\" line, and the sizes are not repeated "
                         "after it");
    h->bytes += REPEATED_BYTES;
    return 0;
}

static int read_header(const char *path, FILE *file, vol_header *h)
{
    char line[LINE_BYTES];
    *h = (vol_header){ .version = 2 };
    for (int n = 1; n <= LINES_MAX; n++) {
        if (!fgets(line, sizeof line, file))
            return trip_fail_line("read", path, n, "the file ends within the header");
        size_t length = strcspn(line, "\r\n");
        if (!line[length])
            return trip_fail_line("read", path, n, "not a line of a .vol header");
        line[length] = '\0';
        if (strcmp(line, ".") == 0) {
            h->bytes = (uint64_t)ftello(file);
            return h->has_version ? 0 : take_repeated_sizes(h, path, file);
        }
        int status = take_field(h, path, n, line);
        if (status < 0)
            return status;
    }
    return trip_fail_line("read", path, LINES_MAX, "the header does not end with a line \".\"");
}

static int open_header(const char *path, vol_header *h)
{
    enum { ROOM = LINE_BYTES * LINES_MAX + REPEATED_BYTES };
    char *text = malloc(ROOM);
    size_t bytes = 0;
    int status = text ? trip_byte_stream_head(path, text, ROOM, false, &bytes)
                      : trip_fail(TRIP_ERROR, "read", path, "out of memory for its header");
    FILE *file = status == 0 && bytes > 0 ? fmemopen(text, bytes, "rb") : NULL;
    if (status == 0)
        status = file ? read_header(path, file, h)
                      : trip_fail(TRIP_ERROR, "read", path, "the file ends within the header");
    if (file)
        fclose(file);
    free(text);
    return status;
}

static int vol_open(const char *path, const trip_volume_params *params, trip_budget *budget,
                    trip_volume_info *info, void **state)
{
    (void)params;
    (void)budget;
    vol_header h;
    const trip_byte_encoding whole = trip_byte_encoding_of(path);
    int status = open_header(path, &h);
    if (status < 0)
        return status;
    if (h.version == 3 && whole != TRIP_BYTES_PLAIN)
        return trip_byte_stream_refuse_twice(path, whole);
    if (h.version != 2 && h.version != 3)
        return trip_fail(TRIP_ERROR, "read", path,
                         ".vol version %" PRId64 " is unknown; only versions 2 and 3 can be read",
                         h.version);
    memcpy(info->dims, h.dims, sizeof info->dims);
    info->type = TRIP_U8;
    trip_byte_source source = { .path = path,
                                .encoding = h.version == 3 ? TRIP_BYTES_ZLIB : whole };
    if (whole == TRIP_BYTES_PLAIN)
        source.offset_bytes = h.bytes;
    else
        source.skip_bytes = h.bytes;
    return trip_dense_open(state, &source, 1, info, NULL, false);
}

const trip_volume_reader trip_read_vol = {
    .format = "vol",
    .probe = vol_probe,
    .open = vol_open,
    .decompresses = true,
    .close = trip_dense_close,
    .rewind = trip_dense_rewind,
    .read_slices = trip_dense_read_slices,
    .skip_slices = trip_dense_skip_slices,
    .swap = trip_dense_swap,
};
