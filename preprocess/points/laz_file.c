#include "laz_file.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "laz_points.h"
#include "little_endian.h"
#include "read_at.h"
#include "report.h"

enum {
    POINTWISE = 1,
    POINTWISE_CHUNKS = 2,
    LAYERED_CHUNKS = 3,
    DESCRIPTION_BYTES = 34, /* before the items */
    ITEM_BYTES = 6,
    SIZES_MAX = 4 * (TRIP_LAZ_LAYERS_MAX + 3 + UINT16_MAX),
};

struct trip_laz_file {
    trip_laz_params p;
    unsigned compressor;
    uint32_t chunk_points; /* UINT32_MAX: the table tells it for each chunk */
    trip_laz_items items;
    trip_laz_room *room;
    trip_laz_decoder bytes, table; /* of the points, and of the table of chunks */
    trip_laz_integers table_sizes;
    uint64_t table_at;
    uint32_t chunks, chunk; /* in the table; the number of the next one */
    int32_t table_points, table_bytes;
    uint64_t chunk_at, chunk_end; /* in the file */
    uint64_t left;                /* points of this chunk */
    uint64_t done;
    uint32_t epoch;
    trip_laz_pointwise *pointwise;
    trip_laz_layered *layered;
    unsigned char *record, *sizes;
};

static int damaged(const trip_laz_file *z, const char *what)
{
    return trip_fail(TRIP_ERROR, "read", z->p.path, "%s; is it damaged or truncated?", what);
}

static int damaged_chunk(const trip_laz_file *z)
{
    return trip_fail(TRIP_ERROR, "read", z->p.path,
                     "chunk %" PRIu32 " ends before its points; is it damaged or truncated?",
                     z->chunk);
}

/* ---- the description ---- */

/* The items of each point format, without further bytes. */
static const trip_laz_item format_items[11][4] = {
    { { TRIP_LAZ_POINT_10, 20, 0 } },
    { { TRIP_LAZ_POINT_10, 20, 0 }, { TRIP_LAZ_TIME, 8, 0 } },
    { { TRIP_LAZ_POINT_10, 20, 0 }, { TRIP_LAZ_COLOUR, 6, 0 } },
    { { TRIP_LAZ_POINT_10, 20, 0 }, { TRIP_LAZ_TIME, 8, 0 }, { TRIP_LAZ_COLOUR, 6, 0 } },
    { { TRIP_LAZ_POINT_10, 20, 0 }, { TRIP_LAZ_TIME, 8, 0 }, { TRIP_LAZ_WAVE, 29, 0 } },
    { { TRIP_LAZ_POINT_10, 20, 0 },
      { TRIP_LAZ_TIME, 8, 0 },
      { TRIP_LAZ_COLOUR, 6, 0 },
      { TRIP_LAZ_WAVE, 29, 0 } },
    { { TRIP_LAZ_POINT_14, 30, 0 } },
    { { TRIP_LAZ_POINT_14, 30, 0 }, { TRIP_LAZ_COLOUR_14, 6, 0 } },
    { { TRIP_LAZ_POINT_14, 30, 0 }, { TRIP_LAZ_COLOUR_NIR_14, 8, 0 } },
    { { TRIP_LAZ_POINT_14, 30, 0 }, { TRIP_LAZ_WAVE_14, 29, 0 } },
    { { TRIP_LAZ_POINT_14, 30, 0 }, { TRIP_LAZ_COLOUR_NIR_14, 8, 0 }, { TRIP_LAZ_WAVE_14, 29, 0 } },
};

/* Returns whether the items fit the point format. Further bytes may be at the end. */
static bool items_fit(const trip_laz_items *items, unsigned format)
{
    unsigned i = 0;
    for (; i < 4 && format_items[format][i].bytes; i++)
        if (i >= items->count || items->items[i].type != format_items[format][i].type ||
            items->items[i].bytes != format_items[format][i].bytes)
            return false;
    const unsigned further = format < 6 ? TRIP_LAZ_BYTES : TRIP_LAZ_BYTES_14;
    return i == items->count || (i + 1 == items->count && items->items[i].type == further);
}

static int check_versions(const trip_laz_file *z)
{
    const bool layered = z->compressor == LAYERED_CHUNKS;
    for (unsigned i = 0; i < z->items.count; i++) {
        const trip_laz_item *item = &z->items.items[i];
        const unsigned first = layered ? 3 : item->type == TRIP_LAZ_WAVE ? 1 : 2;
        const unsigned last = layered ? 4 : first;
        if (item->version < first || item->version > last)
            return trip_fail(TRIP_ERROR, "read", z->p.path,
                             "is compressed by version %u of LAZ's item %u, and versions %u to %u "
                             "are read; `laszip -i FILE -o NAME.las` unpacks it",
                             item->version, item->type, first, last);
    }
    return 0;
}

static int parse_description(trip_laz_file *z)
{
    const unsigned char *d = z->p.description;
    if (z->p.description_bytes < DESCRIPTION_BYTES)
        return damaged(z, "the description of its compression is too short");
    z->compressor = trip_le_u16(d);
    z->chunk_points = trip_le_u32(d + 12);
    const unsigned coder = trip_le_u16(d + 2), count = trip_le_u16(d + 32);
    if (z->compressor < POINTWISE || z->compressor > LAYERED_CHUNKS || coder != 0)
        return trip_fail(TRIP_ERROR, "read", z->p.path,
                         "is compressed by method %u with coder %u of LAZ; methods 1 to 3 with "
                         "coder 0 are read",
                         z->compressor, coder);
    if (count == 0 || count > TRIP_LAZ_ITEMS_MAX ||
        z->p.description_bytes < DESCRIPTION_BYTES + ITEM_BYTES * (size_t)count)
        return damaged(z, "the description of its compression has a wrong number of items");
    z->items.count = count;
    for (unsigned i = 0; i < count; i++) {
        const unsigned char *item = d + DESCRIPTION_BYTES + ITEM_BYTES * i;
        z->items.items[i] =
            (trip_laz_item){ trip_le_u16(item), trip_le_u16(item + 2), trip_le_u16(item + 4) };
        z->items.record_bytes += z->items.items[i].bytes;
    }
    if (z->items.record_bytes != z->p.record_bytes || !items_fit(&z->items, z->p.format) ||
        (z->compressor == LAYERED_CHUNKS) != (z->p.format >= 6))
        return damaged(z, "the description of its compression does not fit its point format");
    if (z->compressor != POINTWISE && z->chunk_points == 0)
        return damaged(z, "the description of its compression has empty chunks");
    return check_versions(z);
}

/* ---- the table of chunks ---- */

static uint32_t next_epoch(trip_laz_file *z)
{
    z->epoch += z->epoch == UINT32_MAX ? 2 : 1;
    return z->epoch;
}

static int read_exactly(const trip_laz_file *z, void *to, size_t bytes, uint64_t at)
{
    if (at > z->p.end || bytes > z->p.end - at ||
        trip_read_at(z->p.fd, to, bytes, bytes, at) != (ssize_t)bytes)
        return damaged(z, "ends early");
    return 0;
}

static void rewind_table(trip_laz_file *z)
{
    trip_laz_decoder_aim(&z->table, z->table_at + 8, z->p.end, next_epoch(z));
    trip_laz_decoder_begin(&z->table);
    z->chunk = 0;
    z->table_points = z->table_bytes = 0;
}

/* Finds the table. The end of the file tells its place if the begin of the points does not. */
static int find_table(trip_laz_file *z)
{
    unsigned char head[8];
    int status = read_exactly(z, head, 8, z->p.data_at);
    if (status < 0)
        return status;
    z->table_at = trip_le_u64(head);
    if (z->table_at == UINT64_MAX && z->p.end >= 8) {
        status = read_exactly(z, head, 8, z->p.end - 8);
        z->table_at = trip_le_u64(head);
    }
    if (status < 0)
        return status;
    if (z->table_at < z->p.data_at + 8 || z->table_at > z->p.end || z->p.end - z->table_at < 8)
        return damaged(z, "its table of chunks lies outside of the file");
    status = read_exactly(z, head, 8, z->table_at);
    if (status < 0)
        return status;
    z->chunks = trip_le_u32(head + 4);
    if (trip_le_u32(head) != 0 ||
        z->chunks > (z->table_at - z->p.data_at - 8) / z->items.record_bytes)
        return damaged(z, "its table of chunks has a wrong version or length");
    if (z->chunks == 0 && z->p.count > 0)
        return damaged(z, "its table of chunks is empty");
    return 0;
}

/* The stated number of points may be too large. */
static int check_count(trip_laz_file *z)
{
    const uint64_t most = (uint64_t)z->chunks * z->chunk_points;
    if (z->compressor == POINTWISE || z->chunk_points == UINT32_MAX || z->p.count <= most)
        return 0;
    return trip_fail(TRIP_ERROR, "read", z->p.path,
                     "states %" PRIu64 " points, but its %" PRIu32 " chunks hold at most %" PRIu64
                     "; is it damaged or truncated?",
                     z->p.count, z->chunks, most);
}

/* Sets the range and the points of the next chunk from the table. */
static int next_entry(trip_laz_file *z)
{
    uint64_t points = z->chunk_points;
    if (z->compressor == POINTWISE) {
        z->chunk_end = z->p.end;
        z->left = z->p.count;
        z->chunk = 1;
        return 0;
    }
    if (z->chunk == z->chunks)
        return trip_fail(TRIP_ERROR, "read", z->p.path,
                         "states %" PRIu64 " points, but its chunks hold only %" PRIu64
                         "; is it damaged?",
                         z->p.count, z->done);
    z->chunk++;
    if (z->chunk_points == UINT32_MAX) {
        z->table_points = trip_laz_integer(&z->table, &z->table_sizes, 32, z->table_points, 0);
        points = (uint32_t)z->table_points;
    }
    z->table_bytes = trip_laz_integer(&z->table, &z->table_sizes, 32, z->table_bytes, 1);
    const uint32_t bytes = (uint32_t)z->table_bytes;
    z->chunk_at = z->chunk_end;
    if (!trip_laz_sound(&z->table) || bytes > z->table_at - z->chunk_at ||
        (points > 0 && bytes < z->items.record_bytes))
        return damaged(z, "its table of chunks has a wrong size");
    z->chunk_end = z->chunk_at + bytes;
    z->left = points < z->p.count - z->done ? points : z->p.count - z->done;
    return 0;
}

/* ---- chunks ---- */

static int begin_layers(trip_laz_file *z)
{
    const size_t bytes = trip_laz_layered_sizes_bytes(z->layered);
    const uint64_t at = z->chunk_at + z->items.record_bytes;
    unsigned char count[4];
    int status = read_exactly(z, count, 4, at);
    if (status == 0)
        status = read_exactly(z, z->sizes, bytes, at + 4);
    if (status < 0)
        return status;
    if (trip_le_u32(count) < z->left ||
        !trip_laz_layered_begin(z->layered, z->record, z->sizes, at + 4 + bytes, z->chunk_end))
        return damaged_chunk(z);
    return 0;
}

static int begin_chunk(trip_laz_file *z)
{
    int status = 0;
    do
        status = trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "read", z->p.path, "interrupted")
                                    : next_entry(z);
    while (status == 0 && z->left == 0);
    if (status == 0)
        status = read_exactly(z, z->record, z->items.record_bytes, z->chunk_at);
    if (status < 0)
        return status;
    if (z->layered)
        return begin_layers(z);
    trip_laz_decoder_aim(&z->bytes, z->chunk_at + z->items.record_bytes, z->chunk_end,
                         next_epoch(z));
    trip_laz_decoder_begin(&z->bytes);
    trip_laz_pointwise_begin(z->pointwise, z->record);
    return 0;
}

static int read_one(trip_laz_file *z, unsigned char *record)
{
    if (z->left == 0) {
        const int status = begin_chunk(z);
        if (status < 0)
            return status;
    } else if (z->layered) {
        trip_laz_layered_next(z->layered, z->record);
    } else {
        trip_laz_pointwise_next(z->pointwise, &z->bytes, z->record);
    }
    z->left--;
    z->done++;
    memcpy(record, z->record, z->items.record_bytes);
    return 0;
}

int trip_laz_file_read(trip_laz_file *z, unsigned char *records, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        const int status = read_one(z, records + i * z->items.record_bytes);
        if (status < 0)
            return status;
        const bool sound =
            z->layered ? trip_laz_layered_sound(z->layered) : trip_laz_sound(&z->bytes);
        if (!sound)
            return damaged_chunk(z);
    }
    return 0;
}

int trip_laz_file_rewind(trip_laz_file *z)
{
    z->done = z->left = 0;
    z->chunk_at = z->chunk_end = z->p.data_at;
    if (z->compressor == POINTWISE)
        return 0;
    z->chunk_at = z->chunk_end = z->p.data_at + 8;
    rewind_table(z);
    return 0;
}

static int open_parts(trip_laz_file *z)
{
    const char *path = z->p.path;
    int status = parse_description(z);
    z->p.description = NULL;
    if (status == 0)
        status = trip_laz_room_create(&z->room, path);
    if (status == 0)
        status = trip_laz_decoder_create(&z->bytes, z->room, z->p.fd, path);
    if (status == 0)
        status = trip_laz_decoder_create(&z->table, z->room, z->p.fd, path);
    if (status == 0)
        status = z->compressor == LAYERED_CHUNKS
                     ? trip_laz_layered_create(&z->layered, &z->items, z->p.fd, path)
                     : trip_laz_pointwise_create(&z->pointwise, &z->items, path);
    if (status < 0)
        return status;
    z->record = malloc(z->items.record_bytes);
    z->sizes = malloc(SIZES_MAX);
    if (!z->record || !z->sizes)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    if (z->compressor != POINTWISE)
        status = find_table(z);
    if (status == 0)
        status = check_count(z);
    return status < 0 ? status : trip_laz_file_rewind(z);
}

int trip_laz_file_open(trip_laz_file **out, const trip_laz_params *params)
{
    trip_laz_file *z = *out = calloc(1, sizeof *z);
    if (!z)
        return trip_fail(TRIP_ERROR, "read", params->path, "out of memory");
    z->p = *params;
    const int status = open_parts(z);
    if (status < 0) {
        trip_laz_file_close(z);
        *out = NULL;
    }
    return status;
}

void trip_laz_file_close(trip_laz_file *z)
{
    if (!z)
        return;
    trip_laz_pointwise_destroy(z->pointwise);
    trip_laz_layered_destroy(z->layered);
    trip_laz_decoder_release(&z->bytes);
    trip_laz_decoder_release(&z->table);
    trip_laz_room_destroy(z->room);
    free(z->record);
    free(z->sizes);
    free(z);
}
