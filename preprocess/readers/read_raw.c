/* Reads values without a header. Options describe them, or a file name such as
 * engine_256x256x128_uint8.raw, as the Open SciVis Datasets use them. */
#include <ctype.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "byte_stream.h"
#include "dense_file.h"
#include "report.h"
#include "volume_reader.h"
#include "text.h"

/* Returns the length of the path without ".gz" or ".bz2". */
static size_t uncompressed_length(const char *path)
{
    const char *dot = strrchr(path, '.');
    const bool packed = dot && (strcasecmp(dot, ".gz") == 0 || strcasecmp(dot, ".bz2") == 0);
    return packed ? (size_t)(dot - path) : strlen(path);
}

static bool is_raw_name(const char *path)
{
    size_t length = uncompressed_length(path);
    return length >= 4 && strncasecmp(path + length - 4, ".raw", 4) == 0;
}

/* Parses "WxHxD" and the type after the last two underscores. Starts from the end, since the rest
 * of the name is free. */
static bool parse_name(const char *path, int64_t dims[3], int *type)
{
    char name[256];
    const char *base = strrchr(path, '/') ? strrchr(path, '/') + 1 : path;
    size_t length = uncompressed_length(base);
    if (length < 4 || length - 4 >= sizeof name)
        return false;
    snprintf(name, sizeof name, "%.*s", (int)(length - 4), base);
    char *type_name = strrchr(name, '_');
    if (!type_name)
        return false;
    *type_name++ = '\0';
    char *size = strrchr(name, '_');
    int used = 0;
    size = size ? size + 1 : name;
    if (!isdigit((unsigned char)*size) ||
        sscanf(size, "%9" SCNd64 "x%9" SCNd64 "x%9" SCNd64 "%n", &dims[0], &dims[1], &dims[2],
               &used) != 3 ||
        size[used])
        return false;
    *type = trip_scalar_from_name(type_name);
    return *type >= 0;
}

static bool raw_probe(const char *path, const unsigned char *head, size_t bytes,
                      const trip_volume_params *params)
{
    (void)head;
    return bytes > 0 && (params->raw_dims[0] || is_raw_name(path));
}

static int no_size(const char *path)
{
    char header[4096], *word = NULL;
    size_t stem = uncompressed_length(path);
    if (stem > 4 && stem < sizeof header - 8) {
        snprintf(header, sizeof header, "%.*s.nhdr", (int)(stem - 4), path);
        if (access(header, R_OK) == 0)
            return trip_fail(TRIP_USAGE, "read", path,
                             "has no header of its own: open %s instead, or give --size X,Y,Z and "
                             "--type to `triptych brick`",
                             header);
    }
    word = trip_text_word(path);
    int status = trip_fail(TRIP_USAGE, "read", path,
                           "has no header: describe it with `triptych brick %s --size X,Y,Z --type "
                           "uint8` (also --spacing, --endian and --offset)",
                           word ? word : "FILE");
    free(word);
    return status;
}

/* Refuses the default type if the file has exactly 2, 4 or 8 bytes for each voxel. */
static int check_default_type(const char *path, const trip_volume_params *params,
                              const int64_t dims[3])
{
    uint64_t bytes = 0;
    if (trip_byte_encoding_of(path) != TRIP_BYTES_PLAIN || trip_file_size(path, &bytes) < 0)
        return 0;
    const double each = ((double)bytes - (double)params->raw_offset_bytes) /
                        ((double)dims[0] * (double)dims[1] * (double)dims[2]);
    if (each != 2 && each != 4 && each != 8)
        return 0;
    return trip_fail(TRIP_USAGE, "read", path,
                     "has %.0f bytes for each voxel, so that the default type uint8 does not fit; "
                     "give --type, for example %s",
                     each,
                     each == 2   ? "uint16"
                     : each == 4 ? "float"
                                 : "double");
}

/* Takes the layout from the options, and missing parts from the file's name. */
static int find_layout(const char *path, const trip_volume_params *params, trip_volume_info *info)
{
    int64_t dims[3] = { 0 };
    int named_type = -1, type = -1;
    bool named = is_raw_name(path) && parse_name(path, dims, &named_type);
    if (params->raw_dims[0])
        memcpy(dims, params->raw_dims, sizeof dims);
    else if (!named)
        return no_size(path);
    type = params->raw_type ? trip_scalar_from_name(params->raw_type)
           : named          ? named_type
                            : TRIP_U8;
    if (type < 0)
        return trip_fail(
            TRIP_USAGE, "read", path,
            "unknown --type \"%s\"; use uint8, int8, uint16, int16, uint32, int32, uint64, "
            "int64, half, float or double",
            params->raw_type);
    memcpy(info->dims, dims, sizeof dims);
    info->type = (trip_scalar)type;
    return params->raw_type || named ? 0 : check_default_type(path, params, dims);
}

/* The content tells whether a file is compressed. Values can look like the start of a compressed
 * file by chance. A file of the exact length of the values is therefore plain, unless its name
 * ends in .gz or .bz2. A file with such a name may be plain if it has that length. */
static int find_encoding(const char *path, const trip_volume_params *params,
                         const trip_volume_info *info, trip_byte_encoding *out)
{
    uint64_t bytes = 0;
    const bool named = uncompressed_length(path) < strlen(path);
    int status = trip_volume_check_dims(path, info);
    if (status == 0)
        status = trip_file_size(path, &bytes);
    if (status < 0)
        return status;
    const uint64_t expected =
        params->raw_offset_bytes + trip_scalar_bytes(info->type) * (uint64_t)info->dims[0] *
                                       (uint64_t)info->dims[1] * (uint64_t)info->dims[2];
    *out = trip_byte_encoding_of(path);
    if (!named && bytes == expected)
        *out = TRIP_BYTES_PLAIN;
    if (named && *out == TRIP_BYTES_PLAIN && bytes != expected)
        return trip_fail(TRIP_ERROR, "read", path,
                         "its name says that it is compressed, but its content is neither gzip nor "
                         "bzip2 data; the file may be damaged");
    return 0;
}

static int raw_open(const char *path, const trip_volume_params *params, trip_budget *budget,
                    trip_volume_info *info, void **state)
{
    (void)budget;
    int status = find_layout(path, params, info);
    if (status < 0)
        return status;
    int native = trip_machine_is_big_endian() ? 2 : 1;
    trip_byte_source source = { .path = path };
    status = find_encoding(path, params, info, &source.encoding);
    if (status < 0)
        return status;
    if (source.encoding == TRIP_BYTES_PLAIN)
        source.offset_bytes = params->raw_offset_bytes;
    else
        source.skip_bytes = params->raw_offset_bytes;
    return trip_dense_open(state, &source, 1, info, NULL,
                           params->raw_endian && params->raw_endian != native);
}

const trip_volume_reader trip_read_raw = {
    .format = "raw",
    .probe = raw_probe,
    .open = raw_open,
    .decompresses = true,
    .close = trip_dense_close,
    .rewind = trip_dense_rewind,
    .read_slices = trip_dense_read_slices,
    .skip_slices = trip_dense_skip_slices,
    .swap = trip_dense_swap,
};
