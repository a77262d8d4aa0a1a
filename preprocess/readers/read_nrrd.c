/* Reads NRRD files with attached (.nrrd) and detached (.nhdr) headers, in all encodings of the
 * format, with one data file or many. A file with header and values may be compressed. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "byte_stream.h"
#include "dense_file.h"
#include "nrrd_header.h"
#include "report.h"
#include "volume_coordinates.h"
#include "volume_reader.h"

static bool nrrd_probe(const char *path, const unsigned char *head, size_t bytes,
                       const trip_volume_params *params)
{
    (void)path;
    (void)params;
    return bytes >= 8 && memcmp(head, "NRRD", 4) == 0;
}

static int read_header(const char *path, trip_nrrd_header *h)
{
    char *text = malloc(TRIP_NRRD_HEADER_BYTES_MAX + 1);
    size_t bytes = 0;
    int status = text ? trip_byte_stream_head(path, text, TRIP_NRRD_HEADER_BYTES_MAX, false, &bytes)
                      : trip_fail(TRIP_ERROR, "read", path, "out of memory for its header");
    if (status == 0)
        status = trip_nrrd_header_parse(h, path, text, bytes, bytes < TRIP_NRRD_HEADER_BYTES_MAX);
    free(text);
    return status;
}

/* Bytes between checks for an interruption. */
#define PATIENCE_BYTES (1 << 20)

/* Sets *offset to the end of the next `lines` lines from byte `start` on. */
static int skip_lines(const char *path, uint64_t start, int64_t lines, uint64_t *offset)
{
    uint64_t bytes;
    int status = trip_file_size(path, &bytes); /* refuses files without a size, such as pipes */
    if (status < 0)
        return status;
    FILE *file = fopen(path, "rbe");
    if (!file)
        return trip_fail_errno("read", path, "cannot open");
    int64_t left = lines;
    bool stopped = false;
    int c = fseeko(file, (off_t)start, SEEK_SET) == 0 ? 0 : EOF;
    *offset = start;
    while (left > 0 && c != EOF && !stopped) {
        stopped = (*offset - start) % PATIENCE_BYTES == 0 && trip_interrupted();
        c = getc_unlocked(file);
        *offset += c != EOF;
        left -= c == '\n';
    }
    fclose(file);
    if (stopped)
        return trip_fail(TRIP_INTERRUPTED, "read", path, "interrupted");
    if (left > 0)
        return trip_fail(TRIP_ERROR, "read", path, "ends within the %" PRId64 " lines to skip",
                         lines);
    return 0;
}

/* Joins a name in the header to the header's folder. */
static char *join(const char *header_path, const char *name)
{
    const char *slash = strrchr(header_path, '/');
    char *path;
    if (name[0] == '/' || !slash)
        return strdup(name);
    return asprintf(&path, "%.*s/%s", (int)(slash - header_path), header_path, name) < 0 ? NULL
                                                                                         : path;
}

/* Finds the start of the values. The format skips lines in the file, and bytes after decompression.
 */
static int locate(trip_byte_source *source, const trip_nrrd_header *h, uint64_t part_bytes)
{
    int status = 0;
    uint64_t file_bytes;
    if (h->line_skip > 0)
        status =
            skip_lines(source->path, source->offset_bytes, h->line_skip, &source->offset_bytes);
    if (h->byte_skip >= 0 || status < 0) {
        source->skip_bytes = (uint64_t)(h->byte_skip > 0 ? h->byte_skip : 0);
        return status;
    }
    status = trip_file_size(source->path, &file_bytes);
    if (status == 0 && file_bytes >= part_bytes &&
        file_bytes - part_bytes >= source->offset_bytes) /* after header and skipped lines */
        source->offset_bytes = file_bytes - part_bytes;
    return status; /* opening reports a file that is too short */
}

/* Finds the values in a compressed file. They follow its header after decompression. */
static int locate_compressed(trip_byte_source *source, const trip_nrrd_header *h,
                             trip_byte_encoding whole)
{
    if (h->encoding != TRIP_BYTES_PLAIN)
        return trip_byte_stream_refuse_twice(source->path, whole);
    if (h->line_skip || h->byte_skip < 0)
        return trip_fail(TRIP_ERROR, "read", source->path,
                         "skips lines and is compressed with %s: unpack it first, with "
                         "`%s -dc FILE >NAME`",
                         trip_byte_encoding_name(whole), trip_byte_encoding_name(whole));
    source->encoding = whole;
    source->offset_bytes = 0;
    if (__builtin_add_overflow(h->header_bytes, (uint64_t)h->byte_skip, &source->skip_bytes))
        return trip_fail(TRIP_ERROR, "read", source->path, "\"byte skip\" is impossibly large");
    return 0;
}

/* Returns the bytes of all values in each of the `count` files. */
static uint64_t part_bytes_of(const trip_nrrd_header *h, size_t count)
{
    uint64_t bytes = trip_scalar_bytes(h->type);
    for (int axis = 0; axis < h->axes; axis++)
        bytes *= (uint64_t)h->sizes[axis];
    return bytes / count;
}

static int open_sources(const char *path, const trip_nrrd_header *h,
                        const trip_volume_params *params, const trip_volume_info *info,
                        trip_byte_source *sources, void **state)
{
    size_t count = h->file_count ? h->file_count : 1;
    trip_dense_layout layout;
    const trip_byte_encoding whole = h->file_count ? TRIP_BYTES_PLAIN : trip_byte_encoding_of(path);
    for (size_t i = 0; i < count; i++) {
        char *name = h->file_count ? join(path, h->files[i]) : strdup(path);
        if (!name)
            return trip_fail(TRIP_ERROR, "read", path, "out of memory for its data files");
        sources[i] = (trip_byte_source){ .path = name,
                                         .encoding = h->encoding,
                                         .text = h->text,
                                         .text_type = h->type,
                                         .offset_bytes = h->file_count ? 0 : h->header_bytes };
        int status = whole == TRIP_BYTES_PLAIN ? locate(&sources[i], h, part_bytes_of(h, count))
                                               : locate_compressed(&sources[i], h, whole);
        if (status < 0)
            return status;
    }
    trip_nrrd_header_layout(h, params->channel, params->time, &layout);
    return trip_dense_open(state, sources, (int64_t)count, info, &layout,
                           h->big_endian != trip_machine_is_big_endian());
}

static int open_data(const char *path, const trip_nrrd_header *h, const trip_volume_params *params,
                     const trip_volume_info *info, void **state)
{
    size_t count = h->file_count ? h->file_count : 1;
    int status = trip_volume_check_dims(path, info);
    if (status < 0)
        return status;
    trip_byte_source *sources = calloc(count, sizeof *sources);
    if (!sources)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory for its data files");
    status = open_sources(path, h, params, info, sources, state);
    for (size_t i = 0; i < count; i++)
        free((char *)(uintptr_t)sources[i].path);
    free(sources);
    return status;
}

/* Checks --channel and --time, and notes the chosen entries. */
static int choose_entries(const char *path, const trip_nrrd_header *h,
                          const trip_volume_params *params, trip_volume_info *info)
{
    const int64_t channels = h->channel_axis >= 0 && !h->colour ? h->sizes[h->channel_axis] : 1;
    const int64_t times = h->time_axis >= 0 ? h->sizes[h->time_axis] : 1;
    int status = trip_volume_check_entry(path, "channel", params->channel, channels);
    if (status == 0)
        status = trip_volume_check_entry(path, "time", params->time, times);
    if (h->colour)
        trip_append_note(info->note, sizeof info->note, TRIP_VOLUME_COLOUR_NOTE);
    char axis[32];
    snprintf(axis, sizeof axis, " (axis %d)", h->channel_axis);
    trip_entry_note(info->note, sizeof info->note, "channel", params->channel, channels, axis);
    snprintf(axis, sizeof axis, " (axis %d)", h->time_axis);
    trip_entry_note(info->note, sizeof info->note, "time", params->time, times, axis);
    return status;
}

static int nrrd_open(const char *path, const trip_volume_params *params, trip_budget *budget,
                     trip_volume_info *info, void **state)
{
    (void)budget;
    trip_nrrd_header h = { 0 };
    int status = read_header(path, &h);
    if (status < 0)
        return status;
    memcpy(info->dims, h.dims, sizeof info->dims);
    info->index_to_world = h.index_to_world;
    info->oriented = h.oriented;
    memcpy(info->space, h.space, sizeof info->space);
    info->type = h.colour ? TRIP_F32 : h.type;
    status = choose_entries(path, &h, params, info);
    if (status == 0)
        status = open_data(path, &h, params, info, state);
    for (int a = 0; a < 3 && status == 0; a++)
        if (h.coordinates[a])
            status = trip_volume_set_coordinates(info, a, h.coordinates[a], path);
    trip_nrrd_header_free(&h);
    return status;
}

static int nrrd_list(const char *path, int (*visit)(void *user, const char *file), void *user)
{
    trip_nrrd_header h = { 0 };
    int status = read_header(path, &h);
    if (status == 0)
        status = visit(user, path);
    for (size_t i = 0; i < h.file_count && status == 0; i++) {
        char *name = join(path, h.files[i]);
        status = name ? visit(user, name)
                      : trip_fail(TRIP_ERROR, "read", path, "out of memory for its data files");
        free(name);
    }
    trip_nrrd_header_free(&h);
    return status;
}

const trip_volume_reader trip_read_nrrd = {
    .format = "nrrd",
    .probe = nrrd_probe,
    .list = nrrd_list,
    .open = nrrd_open,
    .decompresses = true,
    .close = trip_dense_close,
    .rewind = trip_dense_rewind,
    .read_slices = trip_dense_read_slices,
    .skip_slices = trip_dense_skip_slices,
    .swap = trip_dense_swap,
};
