#include "writer.h"

#include "block.h"
#include "dataset.h"
#include "folder.h"
#include "output.h"
#include "report.h"
#include "writer_state.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

enum { PLANE_BUFFER_BYTES = 1 << 20, SPOOL_BUFFER_BYTES = 1 << 16, COARSE_SPOOL_BYTES = 1 << 12 };

static bool is_power_of_two(unsigned x)
{
    return x && !(x & (x - 1));
}

static void set_defaults(trip_writer_params *p)
{
    p->tile_voxels = p->tile_voxels ? p->tile_voxels : 64;
    p->slab_sheets = p->slab_sheets ? p->slab_sheets : 8;
    p->page_bytes = p->page_bytes ? p->page_bytes : 16384;
    p->code_bytes = p->code_bytes ? p->code_bytes : 2;
}

static int check_codes(const trip_writer_codes *c, const char *path)
{
    const char *fault =
        c->table ? trip_codes_fault(c->table, c->table_entries, c->table_step_log2) : NULL;
    if (fault)
        return trip_fail(TRIP_ERROR, "write", path, "%s", fault);
    if (!isfinite(c->code_lo) || !isfinite(c->code_hi) || c->code_lo > c->code_hi)
        return trip_fail(TRIP_ERROR, "write", path, "invalid value range %g to %g", c->code_lo,
                         c->code_hi);
    const double gradients[] = { c->gradient_step[0], c->gradient_step[1], c->gradient_step[2],
                                 c->gradient_full };
    for (size_t i = 0; i < sizeof gradients / sizeof *gradients; i++)
        if (!isfinite(gradients[i]) || gradients[i] < 0)
            return trip_fail(TRIP_ERROR, "write", path, "invalid gradient scale %g", gradients[i]);
    return TRIP_OK;
}

/* Whether two lists of a level have the same grid. */
static bool same_grid(const trip_writer_list *a, const trip_writer_list *b)
{
    return memcmp(a->dims, b->dims, sizeof a->dims) == 0 &&
           memcmp(&a->index_to_world, &b->index_to_world, sizeof a->index_to_world) == 0 &&
           (a->axis != b->axis ||
            (a->sheet_first == b->sheet_first && a->sheet_step == b->sheet_step));
}

/* Returns a list of level 0 along an axis. */
static trip_writer_list level_0(const trip_writer_params *p, int axis)
{
    return (trip_writer_list){ .axis = axis,
                               .dims = { p->dims[0], p->dims[1], p->dims[2] },
                               .index_to_world = p->index_to_world,
                               .sheet_step = 1 };
}

static int fail_list(const char *path, unsigned i, const char *why)
{
    return trip_fail(TRIP_ERROR, "write", path, "list %u: %s", i, why);
}

static bool same_list(const trip_writer_list *a, const trip_writer_list *b)
{
    return a->axis == b->axis && a->level == b->level && a->kind == b->kind;
}

static int check_list(const trip_writer_params *p, unsigned i, const char *path)
{
    const trip_writer_list *l = &p->lists[i];
    const trip_writer_list full = level_0(p, l->axis);
    trip_affine inverse;
    if (l->axis < 0 || l->axis > 2 || !trip_kind_of(l->kind))
        return fail_list(path, i, "its axis or kind is unknown");
    for (unsigned j = 0; j < i; j++) {
        if (same_list(l, &p->lists[j]))
            return fail_list(path, i, "another list has the same axis, level and kind");
        if (l->level == p->lists[j].level && !same_grid(l, &p->lists[j]))
            return fail_list(path, i, "another list of its level has a different grid");
    }
    for (int a = 0; a < 3; a++)
        if (l->dims[a] < 1 || l->dims[a] > TRIP_AXIS_VOXELS_MAX)
            return fail_list(path, i, "its grid must have 1 to 16777216 voxels along each axis");
    if (!trip_affine_invert(&l->index_to_world, &inverse))
        return fail_list(path, i, "its index-to-world map is singular or not finite");
    if (!(l->sheet_step > 0) ||
        !isfinite(l->sheet_first + l->sheet_step * (double)l->dims[l->axis]))
        return fail_list(path, i, "the coordinates of its sheets do not ascend");
    if (l->level == 0 && trip_kind_of(l->kind)->coarse)
        return fail_list(path, i, "it is of level 0, but its kind is for coarse levels");
    if (l->level == 0 && !same_grid(l, &full))
        return fail_list(path, i, "it is of level 0, but its grid is not the data set's grid");
    return TRIP_OK;
}

static int check_lists(const trip_writer_params *p, const char *path)
{
    int status = TRIP_OK;
    unsigned axes = 0;
    if (p->list_count < 3 || p->list_count > TRIP_LISTS_MAX)
        return trip_fail(TRIP_ERROR, "write", path, "%u lists; use 3 to %d", p->list_count,
                         TRIP_LISTS_MAX);
    for (unsigned i = 0; i < p->list_count && status == TRIP_OK; i++) {
        status = check_list(p, i, path);
        if (status == TRIP_OK && p->lists[i].level == 0 && p->lists[i].kind == TRIP_KIND_VOXELS)
            axes |= 1u << p->lists[i].axis;
    }
    if (status == TRIP_OK && axes != 7)
        return trip_fail(TRIP_ERROR, "write", path, "a list of voxels of level 0 is missing");
    return status;
}

/* Sets X, Y and Z of the voxels, then X, Y and Z of the halo. */
static void set_default_lists(trip_writer *w)
{
    trip_writer_params *p = &w->params;
    if (p->lists)
        return;
    for (int i = 0; i < TRIP_DEFAULT_LISTS; i++) {
        w->default_lists[i] = level_0(p, i % 3);
        w->default_lists[i].kind = i < 3 ? TRIP_KIND_VOXELS : TRIP_KIND_HALO;
    }
    p->lists = w->default_lists;
    p->list_count = p->halo ? TRIP_DEFAULT_LISTS : TRIP_DEFAULT_LISTS / 2;
}

static int check_params(const trip_writer_params *p, const char *path)
{
    trip_affine inverse;
    for (int a = 0; a < 3; a++)
        if (p->dims[a] < 1 || p->dims[a] > TRIP_AXIS_VOXELS_MAX)
            return trip_fail(TRIP_ERROR, "write", path, "%lld voxels along axis %d; use 1 to %d",
                             (long long)p->dims[a], a, TRIP_AXIS_VOXELS_MAX);
    if (!is_power_of_two(p->tile_voxels) || p->tile_voxels < 16 || p->tile_voxels > 128)
        return trip_fail(TRIP_USAGE, "write", path, "tile of %u voxels; use 16, 32, 64 or 128",
                         p->tile_voxels);
    if (p->slab_sheets > 64)
        return trip_fail(TRIP_USAGE, "write", path, "slab of %u sheets; use 1 to 64",
                         p->slab_sheets);
    if (!is_power_of_two(p->page_bytes) || p->page_bytes < 4096 || p->page_bytes > 1 << 24)
        return trip_fail(TRIP_USAGE, "write", path,
                         "page of %u bytes; use a power of two from 4096 to 16777216",
                         p->page_bytes);
    if (p->code_bytes > 2)
        return trip_fail(TRIP_ERROR, "write", path, "codes of %u bytes; use 1 or 2", p->code_bytes);
    if (p->normal_bytes && p->normal_bytes != 3 && p->normal_bytes != 4)
        return trip_fail(TRIP_ERROR, "write", path, "normals of %u bytes; use 3 or 4",
                         p->normal_bytes);
    if (!trip_affine_invert(&p->index_to_world, &inverse))
        return trip_fail(TRIP_ERROR, "write", path,
                         "the index-to-world map is singular or not finite");
    int status = check_codes(&p->codes, path);
    return status == TRIP_OK ? check_lists(p, path) : status;
}

static void set_header_codes(trip_file_header *h, const trip_writer_codes *c)
{
    const trip_codes codes =
        c->table ? trip_codes_from_table(c->table, c->table_entries, c->table_step_log2)
                 : (trip_codes){ .lo = c->code_lo, .hi = c->code_hi };
    h->code_lo = codes.lo;
    h->code_hi = codes.hi;
    h->code_table_entries = codes.entries;
    h->code_table_step_log2 = codes.step_log2;
    memcpy(h->gradient_step, c->gradient_step, sizeof h->gradient_step);
    h->gradient_full = c->gradient_full;
}

/* Fills the parts of the header that are known from the start. */
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
    set_header_codes(h, &p->codes);
    h->tile_log2 = (uint32_t)__builtin_ctz(p->tile_voxels);
    h->slab_sheets = p->slab_sheets;
    h->page_log2 = (uint32_t)__builtin_ctz(p->page_bytes);
    h->planes = 1u << TRIP_PLANE_VOXELS | (p->normal_bytes ? 1u << TRIP_PLANE_NORMALS : 0);
    h->code_bytes = p->code_bytes;
    h->normal_bytes = p->normal_bytes;
    h->list_count = p->list_count;
}

static int open_spool(trip_writer *w, trip_output *o, unsigned level)
{
    return trip_output_create(
        o,
        &(trip_output_params){ .folder = w->folder.partial,
                               .name = TRIP_SPOOL_NAME,
                               .buffer_bytes = level ? COARSE_SPOOL_BYTES : SPOOL_BUFFER_BYTES,
                               .failed = &w->failed,
                               .unnamed = true },
        w->budget);
}

static size_t larger(size_t a, size_t b)
{
    return a > b ? a : b;
}

/* Returns a buffer size with which many lists at once take no more memory than a few. */
static size_t plane_buffer_bytes(const trip_writer *w, unsigned level)
{
    size_t share = level ? SPOOL_BUFFER_BYTES : PLANE_BUFFER_BYTES, lists = 0;
    for (unsigned i = 0; level == 0 && i < w->list_count; i++)
        lists += w->params.lists[i].level == 0;
    while (level == 0 && share > SPOOL_BUFFER_BYTES && share * lists > 3 * PLANE_BUFFER_BYTES)
        share /= 2;
    return larger(w->params.page_bytes, level > 1 ? 0 : share);
}

static int open_plane(trip_writer *w, trip_list_writer *l, int plane)
{
    char name[32];
    size_t page = w->params.page_bytes;
    int status = open_spool(w, &l->checksums[plane], l->is.level);
    if (status < 0)
        return status;
    return trip_output_create(
        &l->planes[plane],
        &(trip_output_params){
            .folder = w->folder.partial,
            .name = trip_plane_file_name(l->is.axis, l->is.level, l->is.kind, plane, name),
            .buffer_bytes = plane_buffer_bytes(w, l->is.level),
            .flusher = w->flusher,
            .failed = &w->failed,
            .page_bytes = page,
            .checksums = &l->checksums[plane] },
        w->budget);
}

static int open_list(trip_writer *w, trip_list_writer *l, const trip_writer_list *is)
{
    l->is = *is;
    l->planes_present = w->header.planes & trip_kind_of(is->kind)->planes;
    l->form = trip_block_form_of(&w->header, is->kind);
    int status = open_spool(w, &l->slabs, is->level);
    trip_slab_init(&l->slab, w->params.slab_sheets, w->budget);
    l->sheet = -1;
    if (status == TRIP_OK)
        status = open_spool(w, &l->bricks, is->level);
    if (status == TRIP_OK)
        status = open_spool(w, &l->runs, is->level);
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        if (status == TRIP_OK && l->planes_present >> plane & 1)
            status = open_plane(w, l, plane);
    return status;
}

static int open_lists(trip_writer *w)
{
    unsigned count = w->params.list_count;
    int status = TRIP_OK;
    w->lists = trip_budget_take(w->budget, count * sizeof *w->lists); /* zeroed */
    if (!w->lists)
        return trip_fail(TRIP_ERROR, "write", w->folder.path,
                         "no memory for %u lists; raise --memory", count);
    w->list_count = count;
    for (unsigned i = 0; i < count && status == TRIP_OK; i++)
        status = open_list(w, &w->lists[i], &w->params.lists[i]);
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
    w->folder.fd = -1;
    set_defaults(&w->params);
    set_default_lists(w);
    int status = check_params(&w->params, path);
    if (status == TRIP_OK)
        fill_header(w);
    if (status == TRIP_OK)
        status = trip_folder_begin(&w->folder, path, params->replace);
    if (status == TRIP_OK && (errno = trip_flusher_create(&w->flusher)))
        status = trip_fail_errno("write", path, "cannot start threads");
    if (status == TRIP_OK)
        status = open_lists(w);
    w->params.lists = NULL; /* the caller's lists are copied by now */
    if (status < 0) {
        trip_writer_abort(w);
        return status;
    }
    *out = w;
    return TRIP_OK;
}

int trip_writer_add_deviations(trip_writer *w)
{
    int status = TRIP_OK;
    w->header.planes |= 1u << TRIP_PLANE_DEVIATIONS;
    for (unsigned i = 0; i < w->list_count && status == TRIP_OK; i++) {
        trip_list_writer *l = &w->lists[i];
        if (l->is.kind != TRIP_KIND_VALUES)
            continue;
        assert(l->records == 0);
        l->planes_present |= 1u << TRIP_PLANE_DEVIATIONS;
        status = open_plane(w, l, TRIP_PLANE_DEVIATIONS);
    }
    return status;
}

int trip_writer_end_slab(trip_writer *w, trip_list_writer *l)
{
    size_t n = l->slab.brick_count;
    if (n == 0)
        return TRIP_OK;
    trip_slab_end_sheet(&l->slab);
    trip_file_slab slab = { .first_brick = l->brick_count,
                            .first_record = l->slab_first_record,
                            .first_block = l->slab_first_block,
                            .brick_count = (uint32_t)n,
                            .slab = (uint32_t)(l->sheet / w->params.slab_sheets) };
    int status = trip_output_append(&l->slabs, &slab, sizeof slab);
    for (size_t i = 0; i < n && status == TRIP_OK; i++)
        status = trip_output_append(&l->bricks, &l->slab.bricks[i].brick, sizeof(trip_file_brick));
    if (status == TRIP_OK)
        status = trip_output_append(&l->runs, l->slab.runs,
                                    n * w->params.slab_sheets * sizeof(trip_file_run));
    l->slab_count++;
    l->brick_count += n;
    l->slab_first_record = l->records;
    l->slab_first_block = l->planes[TRIP_PLANE_VOXELS].bytes;
    trip_slab_clear(&l->slab);
    return status;
}

/* Begins a run. Ends the previous sheet and slab if the run is in another. */
static int enter_sheet(trip_writer *w, trip_list_writer *l, uint32_t sheet, uint64_t tile)
{
    int status = TRIP_OK;
    if (sheet != l->sheet) {
        if (l->sheet >= 0 && sheet / w->params.slab_sheets == l->sheet / w->params.slab_sheets)
            trip_slab_end_sheet(&l->slab);
        else
            status = trip_writer_end_slab(w, l);
    }
    l->sheet = sheet;
    l->last_tile = tile;
    return status;
}

static int check_run(const trip_writer *w, const trip_list_writer *l, uint32_t sheet,
                     uint32_t tile_u, uint32_t tile_v, uint32_t count)
{
    const int64_t *dims = l->is.dims;
    int axis = l->is.axis;
    unsigned log2 = w->header.tile_log2;
    bool inside = sheet < dims[axis] && (int64_t)tile_u << log2 < dims[(axis + 1) % 3] &&
                  (int64_t)tile_v << log2 < dims[(axis + 2) % 3];
    bool after =
        sheet > l->sheet || (sheet == l->sheet && trip_morton(tile_u, tile_v) > l->last_tile);
    if (inside && after && count <= 1u << 2 * log2)
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "write", w->folder.path,
                     "list %c%u.%s: run of %u records in tile (%u, %u) of sheet %u is %s",
                     'x' + axis, l->is.level, trip_kind_of(l->is.kind)->name, count, tile_u, tile_v,
                     sheet, inside ? "out of order" : "outside the grid");
}

/* A tile at the border reaches beyond the grid, but its splats must not. */
static int check_bounds(const trip_writer *w, const trip_list_writer *l, uint32_t sheet,
                        const trip_file_brick *b)
{
    const int64_t *dims = l->is.dims;
    int axis = l->is.axis;
    unsigned log2 = w->header.tile_log2;
    if (((int64_t)b->tile_u << log2) + b->u_max < dims[(axis + 1) % 3] &&
        ((int64_t)b->tile_v << log2) + b->v_max < dims[(axis + 2) % 3])
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "write", w->folder.path,
                     "list %c: records of tile (%u, %u) of sheet %u are outside the grid",
                     'x' + axis, b->tile_u, b->tile_v, sheet);
}

static int append_normals(trip_list_writer *l, const uint32_t *normals, uint32_t count)
{
    unsigned char packed[3 * TRIP_RUN_RECORDS_MAX];
    trip_output *o = &l->planes[TRIP_PLANE_NORMALS];
    if (l->form.normal_bytes == sizeof *normals)
        return trip_output_append(o, normals, count * sizeof *normals);
    trip_normals_pack(l->form.normal_bytes, normals, count, packed);
    return trip_output_append(o, packed, (size_t)count * l->form.normal_bytes);
}

static int append_deviations(trip_list_writer *l, const uint32_t *deviations, uint32_t count)
{
    uint8_t bytes[TRIP_RUN_RECORDS_MAX];
    for (uint32_t i = 0; i < count; i++)
        bytes[i] = (uint8_t)deviations[i];
    return trip_output_append(&l->planes[TRIP_PLANE_DEVIATIONS], bytes, count);
}

static int append_beside(trip_list_writer *l, const uint32_t *beside, uint32_t count)
{
    return l->planes_present >> TRIP_PLANE_NORMALS & 1 ? append_normals(l, beside, count)
                                                       : append_deviations(l, beside, count);
}

/* Appends a run that is in order. */
static int append_run(trip_writer *w, trip_list_writer *l, uint32_t sheet, uint32_t tile_u,
                      uint32_t tile_v, const uint32_t *voxels, const uint32_t *beside,
                      uint32_t count)
{
    const bool deviates = l->planes_present >> TRIP_PLANE_DEVIATIONS & 1;
    uint64_t block[TRIP_BLOCK_WORDS_MAX];
    uint32_t words = trip_kind_of(l->is.kind)->pack(&l->form, voxels, count, block);
    if (words == 0)
        return trip_fail(TRIP_ERROR, "write", w->folder.path,
                         "list %c: records of tile (%u, %u) of sheet %u are out of order, outside "
                         "the tile, or have codes of more than %u bytes",
                         'x' + l->is.axis, tile_u, tile_v, sheet, l->form.code_bytes);
    const trip_file_brick *b =
        trip_slab_add(&l->slab, sheet % w->params.slab_sheets, tile_u, tile_v, voxels,
                      deviates ? beside : NULL, count, words);
    int status = b ? check_bounds(w, l, sheet, b) : TRIP_ERROR;
    if (status == TRIP_OK)
        status = trip_output_append(&l->planes[TRIP_PLANE_VOXELS], block, words * sizeof *block);
    return status;
}

int trip_writer_append(trip_writer *w, unsigned list, uint32_t sheet, uint32_t tile_u,
                       uint32_t tile_v, const uint32_t *voxels, const uint32_t *beside,
                       uint32_t count)
{
    assert(list < w->list_count);
    trip_list_writer *l = &w->lists[list];
    assert(!beside == !(l->planes_present & ~(1u << TRIP_PLANE_VOXELS)));
    if (count == 0)
        return TRIP_OK;
    int status = check_run(w, l, sheet, tile_u, tile_v, count);
    if (status == TRIP_OK)
        status = enter_sheet(w, l, sheet, trip_morton(tile_u, tile_v));
    if (status == TRIP_OK)
        status = append_run(w, l, sheet, tile_u, tile_v, voxels, beside, count);
    if (status == TRIP_OK && beside)
        status = append_beside(l, beside, count);
    l->records += count;
    uint64_t bytes = 0;
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        bytes += l->planes[plane].bytes;
    atomic_store_explicit(&l->bytes, bytes, memory_order_relaxed);
    return status;
}

int trip_writer_set_codes(trip_writer *w, const trip_writer_codes *codes)
{
    const int status = check_codes(codes, w->folder.path);
    if (status < 0)
        return status;
    w->params.codes = *codes;
    set_header_codes(&w->header, codes);
    return TRIP_OK;
}

static double grid_voxels(const trip_writer *w)
{
    const int64_t *dims = w->params.dims;
    return (double)dims[0] * (double)dims[1] * (double)dims[2];
}

/* Returns the records of a list of a kind at a level, or 0 if there is none. */
static uint64_t records_of(const trip_writer *w, unsigned level, trip_kind kind)
{
    for (unsigned i = 0; i < w->list_count; i++)
        if (w->lists[i].is.level == level && w->lists[i].is.kind == kind)
            return w->lists[i].records;
    return 0;
}

static int check_records(const trip_writer *w)
{
    for (unsigned i = 0; i < w->list_count; i++) {
        const trip_list_writer *l = &w->lists[i];
        uint64_t wanted = records_of(w, l->is.level, l->is.kind);
        if (l->records != wanted)
            return trip_fail(
                TRIP_ERROR, "write", w->folder.path,
                "lists of the same %s have %llu and %llu records; the numbers must be equal",
                trip_kind_of(l->is.kind)->name, (unsigned long long)wanted,
                (unsigned long long)l->records);
    }
    return TRIP_OK;
}

static int check_text(const trip_writer *w, const char *text)
{
    const uint64_t bytes = strlen(text);
    if (bytes > TRIP_TEXT_BYTES_MAX)
        return trip_fail(TRIP_ERROR, "write", w->folder.path,
                         "the text about the volume has %llu bytes, more than the maximum of %llu; "
                         "give fewer or simpler transfer functions",
                         (unsigned long long)bytes, (unsigned long long)TRIP_TEXT_BYTES_MAX);
    return TRIP_OK;
}

static bool has_typical_range(const trip_writer_summary *s)
{
    return s->typical_min != 0 || s->typical_max != 0;
}

static int check_summary(const trip_writer *w, const trip_writer_summary *s)
{
    uint64_t kept = records_of(w, 0, TRIP_KIND_VOXELS);
    uint64_t halo = records_of(w, 0, TRIP_KIND_HALO);
    int status = check_records(w);
    if (status < 0)
        return status;
    if (!isfinite(s->value_min) || !isfinite(s->value_max) || s->value_min > s->value_max)
        return trip_fail(TRIP_ERROR, "write", w->folder.path, "invalid value range %g to %g",
                         s->value_min, s->value_max);
    if (has_typical_range(s) &&
        !(s->typical_min >= s->value_min && s->typical_min <= s->typical_max &&
          s->typical_max <= s->value_max))
        return trip_fail(TRIP_ERROR, "write", w->folder.path, "invalid typical range %g to %g",
                         s->typical_min, s->typical_max);
    /* In a sparse volume, neighbours of kept voxels may not exist, but they are in the grid. */
    if (s->voxels < kept || (double)s->voxels > grid_voxels(w) ||
        (double)halo > grid_voxels(w) - (double)kept)
        return trip_fail(TRIP_ERROR, "write", w->folder.path,
                         "%llu kept voxels and %llu halo voxels do not fit %llu voxels read and "
                         "%.0f in the grid",
                         (unsigned long long)kept, (unsigned long long)halo,
                         (unsigned long long)s->voxels, grid_voxels(w));
    return TRIP_OK;
}

static int for_planes(trip_list_writer *l, int (*stage)(trip_output *))
{
    int status = TRIP_OK;
    for (int plane = 0; plane < TRIP_PLANES && status == TRIP_OK; plane++)
        if (l->planes_present >> plane & 1)
            status = stage(&l->planes[plane]);
    return status;
}

/* Starts all syncs at once, since each waits for the disk. */
static int sync_planes(trip_writer *w)
{
    int status = TRIP_OK;
    for (unsigned i = 0; i < w->list_count && status == TRIP_OK; i++) {
        status = trip_writer_end_slab(w, &w->lists[i]);
        if (status == TRIP_OK)
            status = for_planes(&w->lists[i], trip_output_start_sync);
    }
    for (unsigned i = 0; i < w->list_count && status == TRIP_OK; i++)
        status = for_planes(&w->lists[i], trip_output_sync);
    return status;
}

/* Appends a table at the next multiple of 8 bytes, and records its offset. */
static int append_table(trip_output *index, trip_output *table, uint64_t *offset)
{
    int status = trip_output_align(index, 8);
    *offset = index->bytes;
    return status == TRIP_OK ? trip_output_append_output(index, table) : status;
}

static void describe_list(const trip_list_writer *l, trip_file_list *f)
{
    f->axis = (uint32_t)l->is.axis;
    f->level = l->is.level;
    f->kind = (uint32_t)l->is.kind;
    f->planes = l->planes_present;
    for (int a = 0; a < 3; a++)
        f->dims[a] = (uint64_t)l->is.dims[a];
    memcpy(f->index_to_world, l->is.index_to_world.m, sizeof f->index_to_world);
    f->sheet_first = l->is.sheet_first;
    f->sheet_step = l->is.sheet_step;
    f->records = l->records;
    f->slab_count = l->slab_count;
    f->brick_count = l->brick_count;
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        f->plane_bytes[plane] = l->planes[plane].bytes;
}

static int append_list(trip_output *index, trip_list_writer *l, trip_file_list *f)
{
    describe_list(l, f);
    int status = append_table(index, &l->slabs, &f->slabs_offset);
    if (status == TRIP_OK)
        status = append_table(index, &l->bricks, &f->bricks_offset);
    if (status == TRIP_OK)
        status = append_table(index, &l->runs, &f->runs_offset);
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        if (status == TRIP_OK && l->planes_present >> plane & 1)
            status = append_table(index, &l->checksums[plane], &f->page_checksums_offset[plane]);
    return status;
}

/* Appends the descriptors after the tables, since they contain the tables' offsets. */
static int append_lists(trip_writer *w, trip_output *index)
{
    size_t bytes = w->list_count * sizeof(trip_file_list);
    trip_file_list *lists = trip_budget_take(w->budget, bytes); /* zeroed */
    int status = TRIP_OK;
    if (!lists)
        return trip_fail(TRIP_ERROR, "write", w->folder.path,
                         "no memory for %u lists; raise --memory", w->list_count);
    for (unsigned i = 0; i < w->list_count && status == TRIP_OK; i++)
        status = append_list(index, &w->lists[i], &lists[i]);
    if (status == TRIP_OK)
        status = trip_output_align(index, 8);
    w->header.lists_offset = index->bytes;
    if (status == TRIP_OK)
        status = trip_output_append(index, lists, bytes);
    trip_budget_release(w->budget, lists, bytes);
    return status;
}

static int append_coordinates(trip_writer *w, trip_output *index)
{
    const trip_coordinates *c = w->params.coordinates;
    if (!c || !trip_coordinates_uneven(c))
        return TRIP_OK;
    int status = trip_output_align(index, 8);
    w->header.coordinates_offset = index->bytes;
    for (int a = 0; a < 3 && status == TRIP_OK; a++)
        status = trip_output_append(index, c->along[a], (size_t)c->voxels[a] * sizeof(double));
    return status;
}

static int append_codes(trip_writer *w, trip_output *index)
{
    const trip_writer_codes *c = &w->params.codes;
    if (!c->table)
        return TRIP_OK;
    int status = trip_output_align(index, 8);
    w->header.code_table_offset = index->bytes;
    return status == TRIP_OK
               ? trip_output_append(index, c->table, c->table_entries * sizeof *c->table)
               : status;
}

static int append_tables(trip_writer *w, trip_output *index, const char *text)
{
    int status = append_lists(w, index);
    if (status == TRIP_OK)
        status = append_coordinates(w, index);
    if (status == TRIP_OK)
        status = append_codes(w, index);
    w->header.text_offset = index->bytes;
    w->header.text_bytes = strlen(text);
    if (status == TRIP_OK)
        status = trip_output_append(index, text, strlen(text));
    return status == TRIP_OK ? trip_output_align(index, 8) : status;
}

static int hash_range(trip_output *o, uint64_t first, uint64_t end, uint64_t *hash)
{
    unsigned char part[16384];
    XXH64_state_t *state = XXH64_createState();
    int status = TRIP_OK;
    if (!state)
        return trip_fail(TRIP_ERROR, "write", o->path, "out of memory");
    XXH64_reset(state, 0);
    while (first < end && status == TRIP_OK) {
        size_t n = end - first < sizeof part ? (size_t)(end - first) : sizeof part;
        status = trip_output_read(o, first, part, n);
        XXH64_update(state, part, n);
        first += n;
    }
    *hash = XXH64_digest(state);
    XXH64_freeState(state);
    return status;
}

/* Appends the page checksums of the index, and writes the header. */
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
    int status = open_spool(w, &checksums, 0);
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
    const char *text = summary->text ? summary->text : "{}";
    int status = check_summary(w, summary);
    if (status == TRIP_OK)
        status = check_text(w, text);
    w->header.value_min = summary->value_min;
    w->header.value_max = summary->value_max;
    const bool typical = has_typical_range(summary);
    w->header.typical_min = typical ? summary->typical_min : summary->value_min;
    w->header.typical_max = typical ? summary->typical_max : summary->value_max;
    w->header.voxels = summary->voxels;
    w->header.kept = records_of(w, 0, TRIP_KIND_VOXELS);
    w->header.halo = records_of(w, 0, TRIP_KIND_HALO);
    if (status == TRIP_OK)
        status = sync_planes(w);
    if (status == TRIP_OK)
        status = write_index(w, text);
    if (status == TRIP_OK)
        status = trip_folder_commit(&w->folder);
    if (status == TRIP_OK)
        trip_writer_abort(w);
    return status;
}

static void close_list(trip_list_writer *l)
{
    for (int plane = 0; plane < TRIP_PLANES; plane++) {
        trip_output_close(&l->planes[plane]);
        trip_output_close(&l->checksums[plane]);
    }
    trip_output_close(&l->slabs);
    trip_output_close(&l->bricks);
    trip_output_close(&l->runs);
    trip_slab_free(&l->slab);
}

/* After a commit there is no partial folder, so this only frees memory. */
void trip_writer_abort(trip_writer *w)
{
    if (!w)
        return;
    for (unsigned i = 0; i < w->list_count; i++)
        close_list(&w->lists[i]);
    trip_budget_release(w->budget, w->lists, w->list_count * sizeof *w->lists);
    trip_flusher_destroy(w->flusher);
    trip_folder_close(&w->folder);
    free(w);
}

int trip_writer_folder(const trip_writer *w)
{
    return w->folder.fd;
}

uint64_t trip_writer_bytes(const trip_writer *w)
{
    uint64_t bytes = 0;
    for (unsigned i = 0; i < w->list_count; i++)
        bytes += atomic_load_explicit(&w->lists[i].bytes, memory_order_relaxed);
    return bytes;
}

uint64_t trip_writer_records(const trip_writer *w, unsigned list)
{
    return w->lists[list].records;
}

uint64_t trip_writer_plane_bytes(const trip_writer *w, unsigned list, int plane)
{
    return w->lists[list].planes[plane].bytes;
}
