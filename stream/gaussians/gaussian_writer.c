#include "gaussian_writer.h"

#include "dataset.h"
#include "folder.h"
#include "gaussian_code.h"
#include "gaussian_set.h"
#include "output.h"
#include "report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

enum { BUFFER_BYTES = 1 << 15, BRICKS_BUFFER_BYTES = 1 << 13 };

struct trip_gaussian_writer {
    trip_budget *budget;
    trip_folder folder;
    trip_file_gaussian_header header;
    const char *text;
    bool opened; /* the planes */
    trip_output planes[3][TRIP_GAUSSIAN_PLANES];
    trip_output bricks[3]; /* unnamed */
    trip_file_gaussian_node *nodes;
    trip_gaussian_palette palette;
    uint64_t records[3];
};

/* Returns the bytes of a record in all planes. */
static size_t record_bytes(const trip_file_gaussian_header *h)
{
    size_t bytes = 0;
    for (unsigned n = 0; n < trip_gaussian_plane_count(h, (int)h->degree); n++)
        bytes += trip_gaussian_plane_bytes(h, n);
    return bytes;
}

static int begin(trip_gaussian_writer *w, const trip_gaussian_writer_params *params)
{
    int status = trip_folder_begin(&w->folder, params->path, params->replace);
    if (status < 0)
        return status;
    for (int a = 0; a < 3 && status == TRIP_OK; a++)
        status = trip_output_create(&w->bricks[a],
                                    &(trip_output_params){ .folder = w->folder.partial,
                                                           .name = TRIP_SPOOL_NAME,
                                                           .buffer_bytes = BRICKS_BUFFER_BYTES,
                                                           .unnamed = true },
                                    w->budget);
    return status;
}

int trip_gaussian_writer_open(trip_gaussian_writer **out, const trip_gaussian_writer_params *params,
                              trip_budget *budget)
{
    trip_gaussian_writer *w = *out = calloc(1, sizeof *w);
    if (!w)
        return trip_fail(TRIP_ERROR, "brick", params->path, "out of memory");
    trip_file_gaussian_header *h = &w->header;
    w->budget = budget;
    w->folder.fd = -1;
    w->text = params->text ? params->text : "{}";
    h->degree = (uint32_t)params->degree;
    h->flags = params->flags;
    for (int a = 0; a < 3; a++) {
        h->centre_lo[a] = h->reach_lo[a] = INFINITY;
        h->centre_hi[a] = h->reach_hi[a] = -INFINITY;
    }
    const int status = begin(w, params);
    if (status < 0) {
        trip_gaussian_writer_close(w);
        *out = NULL;
    }
    return status;
}

const char *trip_gaussian_writer_folder(const trip_gaussian_writer *w)
{
    return w->folder.partial;
}

size_t trip_gaussian_writer_codes_bytes(const trip_gaussian_writer *w)
{
    return TRIP_GAUSSIAN_BRICK_RECORDS_MAX * record_bytes(&w->header);
}

static unsigned plane_count(const trip_gaussian_writer *w)
{
    return trip_gaussian_plane_count(&w->header, (int)w->header.degree);
}

void trip_gaussian_writer_set_palette(trip_gaussian_writer *w, const trip_gaussian_palette *palette)
{
    w->palette = *palette;
    w->header.flags |= TRIP_GAUSSIAN_PALETTE;
    w->header.palette_count = palette->count;
}

static void write_entries(const trip_gaussian_writer *w, const unsigned char *const *splats,
                          unsigned count, unsigned char *to)
{
    for (unsigned i = 0; i < count; i++) {
        const unsigned number = w->palette.find(w->palette.user, splats[i]);
        *to++ = (unsigned char)number;
        *to++ = (unsigned char)(number >> 8);
    }
}

static int finish_planes(trip_gaussian_writer *w)
{
    int status = TRIP_OK;
    for (int a = 0; a < 3; a++)
        for (unsigned n = 0; n < plane_count(w); n++) {
            trip_output *o = &w->planes[a][n];
            if (status == TRIP_OK && w->opened)
                status = trip_output_flush(o);
            if (status == TRIP_OK && w->opened)
                status = trip_output_sync(o);
            trip_output_close(o);
        }
    return status;
}

static int open_planes(trip_gaussian_writer *w)
{
    char name[32];
    int status = TRIP_OK;
    w->opened = true;
    for (int a = 0; a < 3; a++)
        for (unsigned n = 0; n < plane_count(w) && status == TRIP_OK; n++)
            status = trip_output_create(
                &w->planes[a][n],
                &(trip_output_params){ .folder = w->folder.partial,
                                       .name = trip_gaussian_plane_name(&w->header, a, n, name),
                                       .buffer_bytes = BUFFER_BYTES },
                w->budget);
    return status;
}

static void include(trip_file_gaussian_header *h, const trip_file_gaussian_brick *b)
{
    for (int a = 0; a < 3; a++) {
        h->centre_lo[a] = fmin(h->centre_lo[a], b->centre_lo[a]);
        h->centre_hi[a] = fmax(h->centre_hi[a], b->centre_hi[a]);
        h->reach_lo[a] = fmin(h->reach_lo[a], b->reach_lo[a]);
        h->reach_hi[a] = fmax(h->reach_hi[a], b->reach_hi[a]);
    }
}

void trip_gaussian_writer_set_nodes(trip_gaussian_writer *w, trip_file_gaussian_node *nodes,
                                    uint64_t count)
{
    w->nodes = nodes;
    w->header.node_count = count;
}

static void add_to_node(trip_file_gaussian_header *h, trip_file_gaussian_node *n, int axis,
                        const trip_file_gaussian_brick *b)
{
    const bool first = axis == 0 && n->brick_count[axis] == 0;
    for (int a = 0; a < 3; a++) {
        n->lo[a] = first ? b->centre_lo[a] : fmin(n->lo[a], b->centre_lo[a]);
        n->hi[a] = first ? b->centre_hi[a] : fmax(n->hi[a], b->centre_hi[a]);
    }
    if (n->brick_count[axis]++ == 0)
        n->first_brick[axis] = h->brick_count[axis];
    if (axis == 0 && n->nodes == 1)
        h->records += b->records;
}

/* Widens each node by the nodes inside it. They follow it. */
static void widen_nodes(trip_gaussian_writer *w)
{
    for (uint64_t i = w->header.node_count; i-- > 0;) {
        trip_file_gaussian_node *n = &w->nodes[i];
        for (uint64_t j = i + 1; j < i + n->nodes; j += w->nodes[j].nodes)
            for (int a = 0; a < 3; a++) {
                n->lo[a] = fmin(n->lo[a], w->nodes[j].lo[a]);
                n->hi[a] = fmax(n->hi[a], w->nodes[j].hi[a]);
            }
    }
}

void trip_gaussian_writer_encode(const trip_gaussian_writer *w, int size_class,
                                 const unsigned char *const *splats, unsigned count,
                                 trip_file_gaussian_brick *brick, unsigned char *codes)
{
    unsigned char *planes[TRIP_GAUSSIAN_PLANES] = { codes };
    *brick = (trip_file_gaussian_brick){ .size_class = size_class };
    for (unsigned n = 1; n < plane_count(w); n++)
        planes[n] = planes[n - 1] + (size_t)count * trip_gaussian_plane_bytes(&w->header, n - 1);
    if (w->palette.entries)
        write_entries(w, splats, count, planes[1]);
    trip_gaussian_encode(brick, &w->header, splats, count, planes);
}

int trip_gaussian_writer_append(trip_gaussian_writer *w, int axis, uint64_t node,
                                const trip_file_gaussian_brick *brick, const unsigned char *codes)
{
    trip_file_gaussian_brick b = *brick;
    int status = w->opened ? TRIP_OK : open_planes(w);
    for (unsigned n = 0; n < plane_count(w) && status == TRIP_OK; n++) {
        const size_t bytes = b.records * (size_t)trip_gaussian_plane_bytes(&w->header, n);
        status = trip_output_append(&w->planes[axis][n], codes, bytes);
        codes += bytes;
    }
    b.first_record = w->records[axis];
    include(&w->header, &b);
    w->records[axis] += b.records;
    add_to_node(&w->header, &w->nodes[node], axis, &b);
    w->header.brick_count[axis]++;
    return status == TRIP_OK ? trip_output_append(&w->bricks[axis], &b, sizeof b) : status;
}

/* Appends the bricks of a list to the index. */
static int append_bricks(trip_output *bricks, trip_output *index, XXH64_state_t *hash)
{
    unsigned char piece[4096];
    int status = trip_output_flush(bricks);
    for (uint64_t at = 0; at < bricks->bytes && status == TRIP_OK;) {
        const uint64_t left = bricks->bytes - at;
        const size_t bytes = left < sizeof piece ? (size_t)left : sizeof piece;
        status = trip_output_read(bricks, at, piece, bytes);
        if (status == TRIP_OK)
            status = trip_output_append(index, piece, bytes);
        XXH64_update(hash, piece, bytes);
        at += bytes;
    }
    return status;
}

static int append_index(trip_gaussian_writer *w, trip_output *index)
{
    trip_file_gaussian_header *h = &w->header;
    XXH64_state_t *hash = XXH64_createState();
    if (!hash)
        return trip_fail(TRIP_ERROR, "brick", w->folder.path, "out of memory");
    XXH64_reset(hash, 0);
    const size_t nodes_bytes = h->node_count * sizeof *w->nodes;
    int status = trip_output_append(index, h, sizeof *h); /* replaced below */
    if (status == TRIP_OK)
        status = trip_output_append(index, w->nodes, nodes_bytes);
    XXH64_update(hash, w->nodes, nodes_bytes);
    for (int a = 0; a < 3 && status == TRIP_OK; a++)
        status = append_bricks(&w->bricks[a], index, hash);
    const size_t palette_bytes = h->palette_count * trip_gaussian_entry_bytes((int)h->degree);
    if (status == TRIP_OK && palette_bytes)
        status = trip_output_append(index, w->palette.entries, palette_bytes);
    if (palette_bytes)
        XXH64_update(hash, w->palette.entries, palette_bytes);
    if (status == TRIP_OK)
        status = trip_output_append(index, w->text, h->text_bytes);
    XXH64_update(hash, w->text, h->text_bytes);
    h->tables_checksum = XXH64_digest(hash);
    XXH64_freeState(hash);
    h->header_checksum = XXH64(h, sizeof *h, 0);
    if (status == TRIP_OK)
        status = trip_output_flush(index);
    if (status == TRIP_OK)
        status = trip_output_patch(index, 0, h, sizeof *h);
    return status == TRIP_OK ? trip_output_sync(index) : status;
}

static void complete_header(trip_gaussian_writer *w, const double lo[3], const double hi[3])
{
    trip_file_gaussian_header *h = &w->header;
    uint64_t at = TRIP_GAUSSIAN_HEADER_BYTES;
    memcpy(h->magic, TRIP_GAUSSIAN_MAGIC, sizeof h->magic);
    h->version = TRIP_GAUSSIAN_VERSION;
    h->header_bytes = TRIP_GAUSSIAN_HEADER_BYTES;
    h->list_records = w->records[0];
    h->nodes_offset = at;
    at += h->node_count * sizeof(trip_file_gaussian_node);
    for (int a = 0; a < 3; a++) {
        h->bricks_offset[a] = at;
        at += h->brick_count[a] * sizeof(trip_file_gaussian_brick);
        h->typical_lo[a] = fmin(fmax(lo[a], h->centre_lo[a]), h->centre_hi[a]);
        h->typical_hi[a] = fmax(fmin(hi[a], h->centre_hi[a]), h->typical_lo[a]);
    }
    h->palette_offset = h->palette_count ? at : 0;
    at += h->palette_count * trip_gaussian_entry_bytes((int)h->degree);
    h->text_offset = at;
    h->text_bytes = strlen(w->text);
    h->index_bytes = at + h->text_bytes;
}

int trip_gaussian_writer_finish(trip_gaussian_writer *w, const double typical_lo[3],
                                const double typical_hi[3])
{
    trip_output index = { .fd = -1 };
    widen_nodes(w);
    complete_header(w, typical_lo, typical_hi);
    int status = finish_planes(w);
    if (status == TRIP_OK)
        status = trip_output_create(&index,
                                    &(trip_output_params){ .folder = w->folder.partial,
                                                           .name = TRIP_INDEX_NAME,
                                                           .buffer_bytes = BRICKS_BUFFER_BYTES },
                                    w->budget);
    if (status < 0)
        return status;
    status = append_index(w, &index);
    trip_output_close(&index);
    return status == TRIP_OK ? trip_folder_commit(&w->folder) : status;
}

void trip_gaussian_writer_close(trip_gaussian_writer *w)
{
    if (!w)
        return;
    for (int a = 0; a < 3; a++) {
        for (unsigned n = 0; n < TRIP_GAUSSIAN_PLANES; n++)
            trip_output_close(&w->planes[a][n]);
        trip_output_close(&w->bricks[a]);
    }
    trip_folder_close(&w->folder);
    free(w);
}
