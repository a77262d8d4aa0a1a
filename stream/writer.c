#include "writer.h"

#include "dataset.h"
#include "folder.h"
#include "output.h"
#include "report.h"
#include "slab.h"

#include <assert.h>
#include <errno.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

enum { PLANE_BUFFER_BYTES = 1 << 20, SPOOL_BUFFER_BYTES = 1 << 16 };

/* One list being written. Its tables go to unnamed files until the index is put together, so that
 * memory does not grow with the data. */
typedef struct list_writer {
    trip_output planes[TRIP_PLANES];
    trip_output checksums[TRIP_PLANES];
    trip_output slabs, bricks, counts;
    trip_slab slab;
    uint64_t splats, slab_count, brick_count;
    uint64_t slab_first_splat;
    uint64_t last_tile;     /* Morton code of the tile of the last run */
    int64_t sheet;          /* of the last run; -1 before the first */
    _Atomic uint64_t bytes; /* progress for other threads: relaxed */
} list_writer;

struct trip_writer {
    trip_writer_params params;
    trip_budget *budget;
    trip_folder folder;
    trip_flusher *flusher;
    atomic_bool failed; /* of the outputs */
    trip_file_header header;
    unsigned planes;
    list_writer lists[3];
};

static bool is_power_of_two(unsigned x)
{
    return x && !(x & (x - 1));
}

static void set_defaults(trip_writer_params *p)
{
    p->tile_voxels = p->tile_voxels ? p->tile_voxels : 64;
    p->slab_sheets = p->slab_sheets ? p->slab_sheets : 8;
    p->page_bytes = p->page_bytes ? p->page_bytes : 16384;
}

static int check_codes(const trip_writer_params *p, const char *path)
{
    if (!isfinite(p->code_lo) || !isfinite(p->code_hi) || p->code_lo > p->code_hi)
        return trip_fail(TRIP_ERROR, "write", path, "value range %g to %g", p->code_lo, p->code_hi);
    if (!isfinite(p->gradient_scale) || p->gradient_scale < 0)
        return trip_fail(TRIP_ERROR, "write", path, "gradient scale %g", p->gradient_scale);
    return TRIP_OK;
}

static int check_params(const trip_writer_params *p, const char *path)
{
    trip_affine inverse;
    for (int a = 0; a < 3; a++)
        if (p->dims[a] < 1 || p->dims[a] > INT32_MAX)
            return trip_fail(TRIP_ERROR, "write", path,
                             "%lld voxels along axis %d: 1 to %d are possible",
                             (long long)p->dims[a], a, INT32_MAX);
    if (!is_power_of_two(p->tile_voxels) || p->tile_voxels < 16 || p->tile_voxels > 128)
        return trip_fail(TRIP_USAGE, "write", path, "tile of %u voxels: 16, 32, 64 or 128",
                         p->tile_voxels);
    if (p->slab_sheets > 64)
        return trip_fail(TRIP_USAGE, "write", path, "slab of %u sheets: 1 to 64", p->slab_sheets);
    if (!is_power_of_two(p->page_bytes) || p->page_bytes < 4096 || p->page_bytes > 1 << 24)
        return trip_fail(TRIP_USAGE, "write", path,
                         "page of %u bytes: a power of two from 4096 to 16777216", p->page_bytes);
    if (!trip_affine_invert(&p->index_to_world, &inverse))
        return trip_fail(TRIP_ERROR, "write", path,
                         "the index-to-world map is singular or not finite");
    return check_codes(p, path);
}

/* The parts of the header known from the start. */
static void fill_header(trip_writer *w)
{
    const trip_writer_params *p = &w->params;
    trip_file_header *h = &w->header;
    memcpy(h->magic, TRIP_MAGIC, sizeof h->magic);
    h->version = TRIP_FORMAT_VERSION;
    h->header_bytes = TRIP_HEADER_BYTES;
    for (int a = 0; a < 3; a++)
        h->dims[a] = (uint64_t)p->dims[a];
    memcpy(h->index_to_world, p->index_to_world.m, sizeof h->index_to_world);
    h->code_lo = p->code_lo;
    h->code_hi = p->code_hi;
    h->gradient_scale = p->gradient_scale;
    h->tile_log2 = (uint32_t)__builtin_ctz(p->tile_voxels);
    h->slab_sheets = p->slab_sheets;
    h->page_log2 = (uint32_t)__builtin_ctz(p->page_bytes);
    h->planes = w->planes;
    h->list_count = 3;
}

static int open_spool(trip_writer *w, trip_output *o)
{
    return trip_output_create(o,
                              &(trip_output_params){ .folder = w->folder.partial,
                                                     .name = TRIP_SPOOL_NAME,
                                                     .buffer_bytes = SPOOL_BUFFER_BYTES,
                                                     .failed = &w->failed,
                                                     .unnamed = true },
                              w->budget);
}

static size_t larger(size_t a, size_t b)
{
    return a > b ? a : b;
}

static int open_plane(trip_writer *w, int axis, int plane)
{
    char name[32];
    list_writer *l = &w->lists[axis];
    size_t page = w->params.page_bytes;
    int status = open_spool(w, &l->checksums[plane]);
    if (status < 0)
        return status;
    return trip_output_create(
        &l->planes[plane],
        &(trip_output_params){ .folder = w->folder.partial,
                               .name = trip_dataset_plane_name(axis, plane, name),
                               .buffer_bytes = larger(page, PLANE_BUFFER_BYTES),
                               .flusher = w->flusher,
                               .failed = &w->failed,
                               .page_bytes = page,
                               .checksums = &l->checksums[plane] },
        w->budget);
}

static int open_list(trip_writer *w, int axis)
{
    list_writer *l = &w->lists[axis];
    int status = open_spool(w, &l->slabs);
    trip_slab_init(&l->slab, w->params.slab_sheets, w->budget);
    l->sheet = -1;
    if (status == TRIP_OK)
        status = open_spool(w, &l->bricks);
    if (status == TRIP_OK)
        status = open_spool(w, &l->counts);
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        if (status == TRIP_OK && w->planes >> plane & 1)
            status = open_plane(w, axis, plane);
    return status;
}

int trip_writer_open(trip_writer **out, const char *path, const trip_writer_params *params,
                     trip_budget *budget)
{
    trip_writer *w = calloc(1, sizeof *w);
    *out = NULL;
    if (!w)
        return trip_fail(TRIP_ERROR, "write", path, "out of memory");
    w->params = *params;
    w->budget = budget;
    w->planes = 1u << TRIP_PLANE_VOXELS | (params->normals ? 1u << TRIP_PLANE_NORMALS : 0);
    w->folder.fd = -1;
    set_defaults(&w->params);
    fill_header(w);
    int status = check_params(&w->params, path);
    if (status == TRIP_OK)
        status = trip_folder_begin(&w->folder, path, params->replace);
    if (status == TRIP_OK && (errno = trip_flusher_create(&w->flusher)))
        status = trip_fail_errno("write", path, "cannot start threads");
    for (int axis = 0; axis < 3 && status == TRIP_OK; axis++)
        status = open_list(w, axis);
    if (status < 0) {
        trip_writer_abort(w);
        return status;
    }
    *out = w;
    return TRIP_OK;
}

static int end_slab(trip_writer *w, list_writer *l)
{
    size_t n = l->slab.brick_count;
    if (n == 0)
        return TRIP_OK;
    trip_slab_end_sheet(&l->slab);
    trip_file_slab slab = { .first_brick = l->brick_count,
                            .first_splat = l->slab_first_splat,
                            .brick_count = (uint32_t)n,
                            .slab = (uint32_t)(l->sheet / w->params.slab_sheets) };
    int status = trip_output_append(&l->slabs, &slab, sizeof slab);
    for (size_t i = 0; i < n && status == TRIP_OK; i++)
        status = trip_output_append(&l->bricks, &l->slab.bricks[i].brick, sizeof(trip_file_brick));
    if (status == TRIP_OK)
        status = trip_output_append(&l->counts, l->slab.counts,
                                    n * w->params.slab_sheets * sizeof(uint16_t));
    l->slab_count++;
    l->brick_count += n;
    l->slab_first_splat = l->splats;
    trip_slab_clear(&l->slab);
    return status;
}

/* A run starts; ends the sheet and the slab before it where it is in another. */
static int enter_sheet(trip_writer *w, list_writer *l, uint32_t sheet, uint64_t tile)
{
    int status = TRIP_OK;
    if (sheet != l->sheet) {
        if (l->sheet >= 0 && sheet / w->params.slab_sheets == l->sheet / w->params.slab_sheets)
            trip_slab_end_sheet(&l->slab);
        else
            status = end_slab(w, l);
    }
    l->sheet = sheet;
    l->last_tile = tile;
    return status;
}

static int check_run(const trip_writer *w, int axis, uint32_t sheet, uint32_t tile_u,
                     uint32_t tile_v, uint32_t count)
{
    const list_writer *l = &w->lists[axis];
    const int64_t *dims = w->params.dims;
    unsigned log2 = w->header.tile_log2;
    bool inside = sheet < dims[axis] && (int64_t)tile_u << log2 < dims[(axis + 1) % 3] &&
                  (int64_t)tile_v << log2 < dims[(axis + 2) % 3];
    bool after =
        sheet > l->sheet || (sheet == l->sheet && trip_morton(tile_u, tile_v) > l->last_tile);
    if (inside && after && count <= 1u << 2 * log2)
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "write", w->folder.path,
                     "list %c: run of %u splats in tile (%u, %u) of sheet %u is %s", 'x' + axis,
                     count, tile_u, tile_v, sheet, inside ? "out of order" : "outside the grid");
}

/* A tile at the border reaches beyond the grid; its splats do not. */
static int check_bounds(const trip_writer *w, int axis, uint32_t sheet, const trip_file_brick *b)
{
    const int64_t *dims = w->params.dims;
    unsigned log2 = w->header.tile_log2;
    if (((int64_t)b->tile_u << log2) + b->u_max < dims[(axis + 1) % 3] &&
        ((int64_t)b->tile_v << log2) + b->v_max < dims[(axis + 2) % 3])
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "write", w->folder.path,
                     "list %c: splats of tile (%u, %u) of sheet %u are outside the grid",
                     'x' + axis, b->tile_u, b->tile_v, sheet);
}

static int add_to_slab(trip_writer *w, int axis, uint32_t sheet, uint32_t tile_u, uint32_t tile_v,
                       const uint32_t *voxels, uint32_t count)
{
    const trip_file_brick *b = trip_slab_add(&w->lists[axis].slab, sheet % w->params.slab_sheets,
                                             tile_u, tile_v, voxels, count);
    return b ? check_bounds(w, axis, sheet, b) : TRIP_ERROR;
}

int trip_writer_append(trip_writer *w, int axis, uint32_t sheet, uint32_t tile_u, uint32_t tile_v,
                       const uint32_t *voxels, const uint32_t *normals, uint32_t count)
{
    list_writer *l = &w->lists[axis];
    size_t bytes = (size_t)count * TRIP_RECORD_BYTES;
    assert(!normals == !(w->planes >> TRIP_PLANE_NORMALS & 1));
    if (count == 0)
        return TRIP_OK;
    int status = check_run(w, axis, sheet, tile_u, tile_v, count);
    if (status == TRIP_OK)
        status = enter_sheet(w, l, sheet, trip_morton(tile_u, tile_v));
    if (status == TRIP_OK)
        status = add_to_slab(w, axis, sheet, tile_u, tile_v, voxels, count);
    if (status == TRIP_OK)
        status = trip_output_append(&l->planes[TRIP_PLANE_VOXELS], voxels, bytes);
    if (status == TRIP_OK && normals)
        status = trip_output_append(&l->planes[TRIP_PLANE_NORMALS], normals, bytes);
    if (status < 0)
        return status;
    l->splats += count;
    atomic_fetch_add_explicit(&l->bytes, normals ? 2 * bytes : bytes, memory_order_relaxed);
    return TRIP_OK;
}

int trip_writer_set_codes(trip_writer *w, double code_lo, double code_hi, double gradient_scale)
{
    w->params.code_lo = w->header.code_lo = code_lo;
    w->params.code_hi = w->header.code_hi = code_hi;
    w->params.gradient_scale = w->header.gradient_scale = gradient_scale;
    return check_codes(&w->params, w->folder.path);
}

static double grid_voxels(const trip_writer *w)
{
    const int64_t *dims = w->params.dims;
    return (double)dims[0] * (double)dims[1] * (double)dims[2];
}

static int check_summary(const trip_writer *w, const trip_writer_summary *s)
{
    uint64_t kept = w->lists[0].splats;
    if (w->lists[1].splats != kept || w->lists[2].splats != kept)
        return trip_fail(TRIP_ERROR, "write", w->folder.path,
                         "the lists hold %llu, %llu and %llu splats: they must hold the same",
                         (unsigned long long)kept, (unsigned long long)w->lists[1].splats,
                         (unsigned long long)w->lists[2].splats);
    if (!isfinite(s->value_min) || !isfinite(s->value_max) || s->value_min > s->value_max)
        return trip_fail(TRIP_ERROR, "write", w->folder.path, "value range %g to %g", s->value_min,
                         s->value_max);
    if (s->voxels < kept || (double)s->voxels > grid_voxels(w))
        return trip_fail(TRIP_ERROR, "write", w->folder.path,
                         "%llu splats kept of %llu voxels read, of %.0f in the grid",
                         (unsigned long long)kept, (unsigned long long)s->voxels, grid_voxels(w));
    return TRIP_OK;
}

static int sync_planes(trip_writer *w)
{
    int status = TRIP_OK;
    for (int axis = 0; axis < 3; axis++) {
        list_writer *l = &w->lists[axis];
        if (status == TRIP_OK)
            status = end_slab(w, l);
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            if (status == TRIP_OK && w->planes >> plane & 1)
                status = trip_output_sync(&l->planes[plane]);
    }
    return status;
}

/* Appends a table at the next multiple of 8 bytes and notes where it starts. */
static int append_table(trip_output *index, trip_output *table, uint64_t *offset)
{
    int status = trip_output_align(index, 8);
    *offset = index->bytes;
    return status == TRIP_OK ? trip_output_append_output(index, table) : status;
}

static int append_list(trip_writer *w, trip_output *index, int axis, trip_file_list *f)
{
    list_writer *l = &w->lists[axis];
    f->axis = (uint32_t)axis;
    f->splats = l->splats;
    f->slab_count = l->slab_count;
    f->brick_count = l->brick_count;
    int status = append_table(index, &l->slabs, &f->slabs_offset);
    if (status == TRIP_OK)
        status = append_table(index, &l->bricks, &f->bricks_offset);
    if (status == TRIP_OK)
        status = append_table(index, &l->counts, &f->counts_offset);
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        if (status == TRIP_OK && w->planes >> plane & 1)
            status = append_table(index, &l->checksums[plane], &f->page_checksums_offset[plane]);
    return status;
}

/* The descriptors follow the tables, whose places they give. */
static int append_tables(trip_writer *w, trip_output *index, const char *text)
{
    trip_file_list lists[3] = { 0 };
    int status = TRIP_OK;
    for (int axis = 0; axis < 3 && status == TRIP_OK; axis++)
        status = append_list(w, index, axis, &lists[axis]);
    if (status == TRIP_OK)
        status = trip_output_align(index, 8);
    w->header.lists_offset = index->bytes;
    if (status == TRIP_OK)
        status = trip_output_append(index, lists, sizeof lists);
    w->header.text_offset = index->bytes;
    w->header.text_bytes = strlen(text);
    if (status == TRIP_OK)
        status = trip_output_append(index, text, strlen(text));
    return status == TRIP_OK ? trip_output_align(index, 8) : status;
}

static int hash_range(trip_output *o, uint64_t first, uint64_t end, uint64_t *hash)
{
    unsigned char block[16384];
    XXH64_state_t *state = XXH64_createState();
    int status = TRIP_OK;
    if (!state)
        return trip_fail(TRIP_ERROR, "write", o->path, "out of memory");
    XXH64_reset(state, 0);
    while (first < end && status == TRIP_OK) {
        size_t n = end - first < sizeof block ? (size_t)(end - first) : sizeof block;
        status = trip_output_read(o, first, block, n);
        XXH64_update(state, block, n);
        first += n;
    }
    *hash = XXH64_digest(state);
    XXH64_freeState(state);
    return status;
}

/* Appends the index's own page checksums and writes the header. */
static int seal_index(trip_writer *w, trip_output *index, trip_output *checksums)
{
    trip_file_header *h = &w->header;
    int status = trip_output_flush(index);
    index->page_bytes = 0;
    h->checksums_offset = index->bytes;
    if (status == TRIP_OK)
        status = trip_output_append_output(index, checksums);
    if (status == TRIP_OK)
        status = trip_output_flush(index);
    h->index_bytes = index->bytes;
    if (status == TRIP_OK)
        status = hash_range(index, h->checksums_offset, h->index_bytes, &h->checksums_checksum);
    h->header_checksum = 0;
    h->header_checksum = XXH64(h, sizeof *h, 0);
    if (status == TRIP_OK)
        status = trip_output_patch(index, 0, h, sizeof *h);
    return status == TRIP_OK ? trip_output_sync(index) : status;
}

static int write_index(trip_writer *w, const char *text)
{
    trip_output index = { .fd = -1 }, checksums = { .fd = -1 };
    size_t page = w->params.page_bytes;
    int status = open_spool(w, &checksums);
    if (status == TRIP_OK)
        status = trip_output_create(
            &index,
            &(trip_output_params){ .folder = w->folder.partial,
                                   .name = TRIP_INDEX_NAME,
                                   .buffer_bytes = larger(page, SPOOL_BUFFER_BYTES),
                                   .skip_bytes = TRIP_HEADER_BYTES,
                                   .page_bytes = page,
                                   .checksums = &checksums },
            w->budget);
    if (status == TRIP_OK)
        status = append_tables(w, &index, text);
    if (status == TRIP_OK)
        status = seal_index(w, &index, &checksums);
    trip_output_close(&index);
    trip_output_close(&checksums);
    return status;
}

int trip_writer_finish(trip_writer *w, const trip_writer_summary *summary)
{
    int status = check_summary(w, summary);
    w->header.value_min = summary->value_min;
    w->header.value_max = summary->value_max;
    w->header.voxels = summary->voxels;
    w->header.kept = w->lists[0].splats;
    if (status == TRIP_OK)
        status = sync_planes(w);
    if (status == TRIP_OK)
        status = write_index(w, summary->text ? summary->text : "{}");
    if (status == TRIP_OK)
        status = trip_folder_commit(&w->folder);
    if (status == TRIP_OK)
        trip_writer_abort(w);
    return status;
}

static void close_list(list_writer *l)
{
    for (int plane = 0; plane < TRIP_PLANES; plane++) {
        trip_output_close(&l->planes[plane]);
        trip_output_close(&l->checksums[plane]);
    }
    trip_output_close(&l->slabs);
    trip_output_close(&l->bricks);
    trip_output_close(&l->counts);
    trip_slab_free(&l->slab);
}

/* After a commit nothing stands under the partial name, so this only frees. */
void trip_writer_abort(trip_writer *w)
{
    if (!w)
        return;
    for (int axis = 0; axis < 3; axis++)
        close_list(&w->lists[axis]);
    trip_flusher_destroy(w->flusher);
    trip_folder_close(&w->folder);
    free(w);
}

uint64_t trip_writer_bytes(const trip_writer *w)
{
    uint64_t bytes = 0;
    for (int axis = 0; axis < 3; axis++)
        bytes += atomic_load_explicit(&w->lists[axis].bytes, memory_order_relaxed);
    return bytes;
}
