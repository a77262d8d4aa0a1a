/* .vol of the DGtal and VolGallery projects: header lines "Name: value" up to a line with a single
 * ".", then one zlib stream of X * Y * Z bytes (version 3), or the bytes themselves (version 2). */
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

typedef struct vol_header {
    int64_t dims[3], version;
    double spacing;
    uint64_t bytes; /* with the "." line */
} vol_header;

/* Whether the file begins with one of the lines that headers begin with. */
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

static int fail_line(const char *path, int line, const char *why)
{
    char where[4200];
    snprintf(where, sizeof where, "%s: line %d", path, line);
    return trip_fail(TRIP_ERROR, "read", where, "%s", why);
}

/* Takes one "Name: value" line; other names are ignored. */
static int take_field(vol_header *h, const char *line)
{
    static const char *const axes[3] = { "X", "Y", "Z" };
    char name[32], value[64], *end = NULL;
    if (sscanf(line, "%31[^:]: %63s", name, value) != 2)
        return -1;
    for (int a = 0; a < 3; a++)
        if (strcmp(name, axes[a]) == 0)
            h->dims[a] = strtoll(value, &end, 10);
    if (strcmp(name, "Version") == 0)
        h->version = strtoll(value, &end, 10);
    else if (strcmp(name, "Voxel-Size") == 0)
        h->spacing = strtod(value, &end);
    return end && (end == value || *end) ? -1 : 0;
}

static int read_header(const char *path, FILE *file, vol_header *h)
{
    char line[LINE_BYTES];
    *h = (vol_header){ .spacing = 1, .version = 2 };
    for (int n = 1; n <= LINES_MAX; n++) {
        if (!fgets(line, sizeof line, file))
            return fail_line(path, n, "the file ends within the header");
        size_t length = strcspn(line, "\r\n");
        if (!line[length])
            return fail_line(path, n, "not a line of a .vol header");
        line[length] = '\0';
        if (strcmp(line, ".") == 0) {
            h->bytes = (uint64_t)ftello(file);
            return 0;
        }
        if (take_field(h, line) < 0)
            return fail_line(path, n, "not a \"Name: value\" line");
    }
    return fail_line(path, LINES_MAX, "the header has no end, a line with a single \".\"");
}

static int vol_open(const char *path, const trip_volume_params *params, trip_budget *budget,
                    trip_volume_info *info, void **state)
{
    (void)params;
    (void)budget;
    FILE *file = fopen(path, "rbe");
    if (!file)
        return trip_fail_errno("read", path, "cannot open");
    vol_header h;
    int status = read_header(path, file, &h);
    fclose(file);
    if (status < 0)
        return status;
    if (h.version != 2 && h.version != 3)
        return trip_fail(TRIP_ERROR, "read", path,
                         ".vol version %" PRId64 " is not known, only 2 and 3 are", h.version);
    memcpy(info->dims, h.dims, sizeof info->dims);
    info->type = TRIP_U8;
    for (int a = 0; a < 3; a++)
        info->index_to_world.m[a][a] = h.spacing;
    trip_byte_source source = { .path = path,
                                .encoding = h.version == 3 ? TRIP_BYTES_ZLIB : TRIP_BYTES_PLAIN,
                                .offset_bytes = h.bytes };
    return trip_dense_open(state, &source, 1, info, false);
}

const trip_volume_reader trip_read_vol = {
    .format = "vol",
    .probe = vol_probe,
    .open = vol_open,
    .close = trip_dense_close,
    .rewind = trip_dense_rewind,
    .read_slices = trip_dense_read_slices,
    .skip_slices = trip_dense_skip_slices,
    .swap = trip_dense_swap,
};
