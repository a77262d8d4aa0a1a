#include "levels.h"

#include <string.h>

#include "folder.h"
#include "format.h"
#include "level_source.h"
#include "mean.h"
#include "report.h"
#include "sharpen.h"
#include "splat_box.h"

enum { SOURCES = 4, FILE_BUFFER_BYTES = 1 << 16 };

/* What a list builder takes besides its pieces. */
#define BUILDER_BYTES ((uint64_t)3 << 20)
/* Of a voxel of the level below, in the pieces of what is made of it. */
#define PIECE_BYTES 64

/* One level being made. */
typedef struct making {
    const trip_levels_params *params;
    trip_budget *budget;
    unsigned level, first_list;
    int64_t dims[3];
    trip_level_source sources[SOURCES];
    unsigned source_count;
    trip_list_builder *builder;
    trip_output *file; /* of its voxels, for its values and the next level; NULL: there is none */
    trip_mean_scale scale;
    trip_sharpen sharpen;
    uint64_t sheets_before, sheets; /* of all levels: progress */

    trip_splat_box_tables tables;
    trip_splat_box box;
    unsigned edge_log2;
    trip_coarse_sum *sums; /* of a square, by row */
    uint64_t *touched;     /* bits of those */
    trip_coarse_voxel *voxels;
    size_t memory_bytes;
    unsigned char *memory; /* of the tables and arrays above */
} making;

unsigned trip_levels_count(const int64_t dims[3], int wanted, unsigned tile_voxels)
{
    const int64_t last = wanted > 0 ? 1 : (int64_t)tile_voxels;
    const unsigned most =
        wanted > 0 && wanted < TRIP_LEVELS_MOST ? (unsigned)wanted : TRIP_LEVELS_MOST;
    unsigned levels = 0;
    for (int a = 0; a < 3 && wanted >= 0; a++)
        while (levels < most && (dims[a] - 1) >> levels >= last)
            levels++;
    return levels;
}

static void level_dims(const int64_t dims[3], unsigned level, int64_t out[3])
{
    for (int a = 0; a < 3; a++)
        out[a] = ((dims[a] - 1) >> level) + 1;
}

/* Voxel i of a level has its centre amid those of level 0 that it covers. */
static trip_writer_list list_of(const int64_t dims[3], const trip_affine *index_to_world,
                                unsigned level)
{
    double step = ldexp(1, (int)level);
    trip_affine map = trip_affine_identity();
    trip_writer_list list = { .level = level, .sheet_first = 0.5 * (step - 1), .sheet_step = step };
    for (int a = 0; a < 3; a++) {
        map.m[a][a] = step;
        map.m[a][3] = list.sheet_first;
    }
    level_dims(dims, level, list.dims);
    list.index_to_world = level ? trip_affine_multiply(index_to_world, &map) : *index_to_world;
    return list;
}

unsigned trip_levels_lists(const int64_t dims[3], const trip_affine *index_to_world, bool halo,
                           unsigned levels, trip_writer_list *lists)
{
    const trip_kind kinds[2][2] = { { TRIP_KIND_VOXELS, TRIP_KIND_HALO },
                                    { TRIP_KIND_MEANS, TRIP_KIND_VALUES } };
    unsigned n = 0;
    for (unsigned level = 0; level <= levels; level++)
        for (int kind = 0; kind < (halo ? 2 : 1); kind++)
            for (int axis = 0; axis < 3; axis++) {
                lists[n] = list_of(dims, index_to_world, level);
                lists[n].kind = kinds[level > 0][kind];
                lists[n++].axis = axis;
            }
    return n;
}

/* ---- memory ---- */

static void *carve(unsigned char *base, size_t *used, size_t bytes)
{
    size_t at = *used;
    *used = at + ((bytes + 63) & ~(size_t)63);
    return base ? base + at : NULL;
}

/* Returns the bytes; NULL as base computes these only. */
static size_t lay_out(making *m, unsigned char *base)
{
    size_t edge = (size_t)1 << m->edge_log2, plane = edge * edge, used = 0;
    m->sums = carve(base, &used, plane * sizeof *m->sums);
    m->voxels = carve(base, &used, plane * sizeof *m->voxels);
    m->touched = carve(base, &used, plane / 8);
    m->box.values = carve(base, &used, plane * sizeof(uint32_t));
    m->box.normals = carve(base, &used, plane * sizeof(uint32_t));
    for (int axis = 0; axis < 3; axis++)
        m->box.bits[axis] = carve(base, &used, (axis == 2 ? 1 : edge) * plane / 8);
    return used;
}

static int fail_memory(void)
{
    return trip_fail(
        TRIP_ERROR, "brick", "levels",
        "need more memory: give more with --memory, or leave them out with --levels 0");
}

static int take_memory(making *m)
{
    m->edge_log2 =
        (unsigned)__builtin_ctzll((unsigned long long)trip_splat_box_edge(&m->params->format));
    m->memory_bytes = lay_out(m, NULL);
    m->memory = trip_budget_take(m->budget, m->memory_bytes);
    if (!m->memory)
        return fail_memory();
    lay_out(m, m->memory);
    trip_splat_box_tables_fill(&m->tables, &m->params->format);
    m->box.tables = &m->tables;
    return 0;
}

/* The pieces are of codes, whatever those of level 0 were. */
static trip_piece_format format_of(const making *m)
{
    trip_piece_format f = m->params->format;
    f.quantised = true;
    return f;
}

static int open_builder(making *m)
{
    const trip_levels_params *p = m->params;
    const trip_piece_format format = format_of(m);
    uint64_t least = trip_list_builder_min_bytes(&format, 1);
    uint64_t left = trip_budget_left_bytes(m->budget), records = 0;
    for (unsigned list = 0; list < m->first_list; list++)
        records += trip_writer_records(p->writer, list);
    uint64_t wanted = least + records * PIECE_BYTES;
    uint64_t beside = BUILDER_BYTES;
    if (p->format.halo)
        beside += trip_sharpen_later_bytes(m->dims, m->edge_log2, records);
    left = left > beside + least ? left - beside : least;
    for (size_t i = 0; i < trip_spill_count(p->spill); i++)
        trip_spill_retire(p->spill, i);
    trip_list_builder_params b = { .format = format,
                                   .quantiser = p->quantiser,
                                   .producers = 1,
                                   .first_list = m->first_list,
                                   .memory_bytes = wanted < left ? wanted : left,
                                   .writer = p->writer,
                                   .spill = p->spill };
    memcpy(b.dims, m->dims, sizeof b.dims);
    return trip_list_builder_create(&m->builder, &b, m->budget);
}

/* ---- a square ---- */

static void gradient_of(const making *m, uint32_t normal, double gradient[3])
{
    if (m->params->compact)
        trip_compact_normal_unpack(m->params->compact, normal, gradient);
    else
        trip_normal_unpack(normal, m->params->quantiser.gradient_full, gradient);
}

/* Of a gradient in world space. */
static uint32_t normal_of(const making *m, const double gradient[3])
{
    const double(*j)[4] = m->params->index_to_world.m;
    double index[3];
    if (!m->params->compact)
        return trip_normal_pack(gradient, m->params->quantiser.gradient_full);
    for (int a = 0; a < 3; a++)
        index[a] = j[0][a] * gradient[0] + j[1][a] * gradient[1] + j[2][a] * gradient[2];
    return trip_compact_normal_pack(m->params->compact, index);
}

static trip_coarse_sum *sum_at(making *m, size_t at)
{
    uint64_t bit = UINT64_C(1) << at % 64;
    if (!(m->touched[at / 64] & bit))
        trip_coarse_sum_clear(&m->sums[at]);
    m->touched[at / 64] |= bit;
    return &m->sums[at];
}

static void add_voxels(making *m, const trip_level_source *s)
{
    const bool normals = m->params->format.normals;
    double gradient[3];
    for (uint32_t i = 0; i < s->count; i++) {
        const trip_coarse_voxel *voxel = &s->voxels[i];
        size_t u = (size_t)s->u + voxel->u, v = (size_t)s->v + voxel->v;
        unsigned odd = (u & 1) | (v & 1) << 1 | s->odd << 2;
        if (normals && voxel->kept)
            gradient_of(m, voxel->normal, gradient);
        trip_coarse_sum_add(sum_at(m, (v >> 1 << m->edge_log2) + (u >> 1)), voxel, odd,
                            normals && voxel->kept ? gradient : NULL);
    }
}

/* Turns the sums into voxels; returns their number. */
static uint32_t take_voxels(making *m)
{
    const size_t words = (size_t)1 << (2 * m->edge_log2 - 6), edge = (size_t)1 << m->edge_log2;
    uint32_t n = 0;
    for (size_t w = 0; w < words; w++) {
        for (uint64_t bits = m->touched[w]; bits; bits &= bits - 1) {
            size_t at = w * 64 + (size_t)__builtin_ctzll(bits);
            trip_coarse_voxel *voxel = &m->voxels[n];
            double gradient[3];
            if (!trip_coarse_sum_get(&m->sums[at], voxel))
                continue;
            trip_coarse_sum_gradient(&m->sums[at], gradient);
            voxel->u = (uint8_t)(at & (edge - 1));
            voxel->v = (uint8_t)(at >> m->edge_log2);
            if (voxel->kept && m->params->format.normals)
                voxel->normal = normal_of(m, gradient);
            n++;
        }
        m->touched[w] = 0;
    }
    return n;
}

static void *reserve(void *user, unsigned thread, unsigned list, size_t bytes)
{
    return trip_list_builder_reserve(user, thread, list, bytes);
}

/* Marks the voxels of a square in the box: all, or of lists of means those that were kept. False
 * where there are none. */
static bool mark(making *m, const trip_coarse_voxel *voxels, uint32_t count, bool kept)
{
    bool some = false;
    for (uint32_t i = 0; i < count; i++) {
        if (kept && !voxels[i].kept)
            continue;
        trip_splat_box_mark(&m->box, voxels[i].v, 0, &voxels[i].u, 1);
        some = true;
    }
    return some;
}

static uint32_t value_code(const making *m, const trip_coarse_voxel *voxel)
{
    return m->params->code_bytes == 1 ? (voxel->value + 128u) / 257 * 257 : voxel->value;
}

static uint32_t mean_code(const making *m, const trip_coarse_voxel *voxel, int axis)
{
    return trip_mean_pack(&m->scale, voxel->mean, voxel->cover[axis] / (double)TRIP_COARSE_ALL,
                          voxel->kept / (double)voxel->cover[axis]);
}

/* The pieces of a list. */
static int emit(making *m, const trip_coarse_voxel *voxels, uint32_t count, unsigned list)
{
    const trip_piece_format whole = format_of(m), f = trip_piece_format_of(&whole, list);
    const trip_piece_sink sink = { reserve, m->builder, 0 };
    for (uint32_t i = 0; i < count; i++) {
        const trip_coarse_voxel *voxel = &voxels[i];
        size_t at = trip_splat_box_row(&m->box, voxel->v, 0) + voxel->u;
        if (list >= TRIP_HALO_LISTS)
            m->box.values[at] = value_code(m, voxel);
        else if (voxel->kept)
            m->box.values[at] = mean_code(m, voxel, trip_list_axis(list));
        m->box.normals[at] = voxel->normal;
    }
    return trip_splat_box_emit(&m->box, &f, list, &sink);
}

/* Of a square, in the three lists from `first` on: those of means, or of values. */
static int make_pieces(making *m, uint64_t key, const trip_coarse_voxel *voxels, uint32_t count,
                       unsigned first)
{
    const uint64_t morton = key & ((UINT64_C(1) << TRIP_TILE_MORTON_BITS) - 1);
    const int64_t edge = (int64_t)1 << m->edge_log2;
    const int64_t size[3] = { edge, edge, 1 };
    int64_t lo[3] = { 0, 0, (int64_t)(key >> TRIP_TILE_MORTON_BITS) };
    int status = 0;
    for (int bit = 0; bit < TRIP_TILE_MORTON_BITS; bit++)
        lo[bit % 2] |= (int64_t)(morton >> bit & 1) << bit / 2;
    lo[0] <<= m->edge_log2;
    lo[1] <<= m->edge_log2;
    trip_splat_box_begin(&m->box, lo, size);
    if (!mark(m, voxels, count, first == 0))
        return 0;
    for (unsigned list = first; list < first + 3 && status == 0; list++)
        status = emit(m, voxels, count, list);
    return status;
}

/* ---- a level ---- */

static uint64_t first_key(const making *m)
{
    uint64_t first = UINT64_MAX;
    for (unsigned i = 0; i < m->source_count; i++)
        if (m->sources[i].has && m->sources[i].key < first)
            first = m->sources[i].key;
    return first;
}

static int poll(void)
{
    return trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted") : 0;
}

static int make_square(making *m, uint64_t key)
{
    int status = 0;
    for (unsigned i = 0; i < m->source_count; i++) {
        trip_level_source *s = &m->sources[i];
        while (s->has && s->key == key && status == 0) {
            add_voxels(m, s);
            status = trip_level_source_next(s);
        }
    }
    uint32_t count = status == 0 ? take_voxels(m) : 0;
    if (count > 0)
        status = make_pieces(m, key, m->voxels, count, 0);
    if (count > 0 && status == 0 && m->file)
        status = trip_level_file_append(m->file, key, m->voxels, count);
    return status == 0 ? poll() : status;
}

static void show(const making *m, uint64_t sheet)
{
    if (m->params->progress)
        m->params->progress(m->params->progress_user, m->sheets_before + sheet, m->sheets);
}

/* The lists of values, once the file is complete. */
static int make_values(making *m)
{
    trip_coarse_voxel *voxels;
    uint64_t key;
    uint32_t count;
    int status = 0;
    while (status == 0 && (status = trip_sharpen_next(&m->sharpen, &key, &voxels, &count)) == 1) {
        status = make_pieces(m, key, voxels, count, TRIP_HALO_LISTS);
        status = status == 0 ? poll() : status;
    }
    return status;
}

static int make_level(making *m)
{
    uint64_t key, sheet = UINT64_MAX;
    int status = 0;
    while (status == 0 && (key = first_key(m)) != UINT64_MAX) {
        if (key >> TRIP_TILE_MORTON_BITS != sheet)
            show(m, sheet = key >> TRIP_TILE_MORTON_BITS);
        status = make_square(m, key);
    }
    if (status == 0 && m->file)
        status = trip_output_flush(m->file);
    if (status == 0 && m->params->format.halo)
        status = make_values(m);
    if (status == 0)
        status = trip_list_builder_finish(m->builder, &m->params->quantiser, m->params->workers,
                                          NULL, NULL);
    return status;
}

static int open_lists(making *m)
{
    const trip_levels_params *p = m->params;
    int status = 0;
    for (unsigned i = 0; i < 4 && status == 0; i++) {
        bool halo = i / 2;
        if (halo && !p->format.halo)
            continue;
        status = trip_level_source_list(&m->sources[m->source_count++], p->writer,
                                        (halo ? TRIP_HALO_LISTS : 0) + 2, !halo, i % 2,
                                        p->format.tile_log2, m->edge_log2, m->budget);
    }
    return status;
}

static int open_file(making *m, const trip_output *below)
{
    int status = 0;
    for (unsigned odd = 0; odd < 2 && status == 0; odd++)
        status = trip_level_source_file(&m->sources[m->source_count++], below, odd, m->edge_log2,
                                        m->budget);
    return status;
}

/* A file without a name. */
static int create_file(making *m, trip_output *file)
{
    m->file = file;
    return trip_output_create(file,
                              &(trip_output_params){ .folder = m->params->folder,
                                                     .name = TRIP_SPOOL_NAME,
                                                     .buffer_bytes = FILE_BUFFER_BYTES,
                                                     .unnamed = true },
                              m->budget);
}

static int open_sharpen(making *m)
{
    const double least = m->scale.lo, most = m->scale.lo + m->scale.width;
    return trip_sharpen_open(&m->sharpen, m->file, m->edge_log2, (uint16_t)ceil(least),
                             (uint16_t)floor(most), m->budget);
}

static void close_making(making *m)
{
    trip_list_builder_destroy(m->builder);
    trip_sharpen_close(&m->sharpen);
    for (unsigned i = 0; i < m->source_count; i++)
        trip_level_source_close(&m->sources[i]);
    if (m->memory)
        trip_budget_release(m->budget, m->memory, m->memory_bytes);
}

static int make(making *m, const trip_output *below, trip_output *file)
{
    int status = take_memory(m);
    if (status == 0)
        status = m->level == 1 ? open_lists(m) : open_file(m, below);
    if (status == 0 && (m->level < m->params->levels || m->params->format.halo))
        status = create_file(m, file);
    if (status == 0 && m->params->format.halo)
        status = open_sharpen(m);
    if (status == 0)
        status = open_builder(m);
    return status == 0 ? make_level(m) : status;
}

int trip_levels_make(const trip_levels_params *params, trip_budget *budget)
{
    trip_output files[2] = { { .fd = -1 }, { .fd = -1 } };
    const unsigned lists = trip_piece_list_count(&params->format);
    making *m = trip_budget_take(budget, sizeof *m);
    uint64_t sheets = 0, before = 0;
    int status = m ? 0 : fail_memory();
    for (unsigned level = 1; level <= params->levels; level++)
        sheets += (uint64_t)((params->dims[2] - 1) >> level) + 1;
    for (unsigned level = 1; level <= params->levels && status == 0; level++) {
        *m = (making){ .params = params,
                       .budget = budget,
                       .level = level,
                       .first_list = level * lists,
                       .scale = trip_mean_scale_make(params->value_min, params->value_max,
                                                     params->quantiser.lo, params->quantiser.hi),
                       .sheets_before = before,
                       .sheets = sheets };
        level_dims(params->dims, level, m->dims);
        status = make(m, &files[(level - 1) % 2], &files[level % 2]);
        close_making(m);
        trip_output_close(&files[(level - 1) % 2]);
        before += (uint64_t)m->dims[2];
    }
    trip_output_close(&files[0]);
    trip_output_close(&files[1]);
    if (m)
        trip_budget_release(budget, m, sizeof *m);
    return status;
}
