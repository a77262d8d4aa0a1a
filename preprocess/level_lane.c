#include "level_lane.h"

#include "format.h"

static void *carve(unsigned char *base, size_t *used, size_t bytes)
{
    size_t at = *used;
    *used = at + ((bytes + 63) & ~(size_t)63);
    return base ? base + at : NULL;
}

size_t trip_level_lane_make(trip_level_lane *l, const trip_level_work *w, unsigned producer,
                            unsigned char *memory)
{
    const size_t edge = (size_t)1 << w->edge_log2, plane = edge * edge;
    const unsigned below_log2 = w->lists ? w->format.tile_log2 : w->edge_log2;
    const size_t squares = (size_t)TRIP_LEVEL_SOURCES << 2 * (w->edge_log2 + 1 - below_log2);
    size_t used = 0;
    *l = (trip_level_lane){ .producer = producer, .box.tables = &w->tables };
    l->squares = carve(memory, &used, squares * sizeof *l->squares);
    l->sums = carve(memory, &used, plane * sizeof *l->sums);
    l->voxels = carve(memory, &used, plane * sizeof *l->voxels);
    l->touched = carve(memory, &used, plane / 8);
    l->box.values = carve(memory, &used, plane * sizeof(uint32_t));
    l->box.normals = carve(memory, &used, plane * sizeof(uint32_t));
    for (int axis = 0; axis < 3; axis++)
        l->box.bits[axis] = carve(memory, &used, (axis == 2 ? 1 : edge) * plane / 8);
    if (w->lists)
        l->run = carve(memory, &used, trip_list_buffer_bytes());
    else
        l->below = carve(memory, &used, plane * sizeof *l->below);
    if (w->format.halo)
        used += trip_sharpen_lane_make(&l->sharpen, w->edge_log2, memory ? memory + used : NULL);
    return used;
}

/* ---- what is added up ---- */

static void gradient_of(const trip_level_work *w, uint32_t normal, double gradient[3])
{
    if (w->params->compact)
        trip_compact_normal_unpack(w->params->compact, normal, gradient);
    else
        trip_normal_unpack(normal, w->params->quantiser.gradient_full, gradient);
}

/* Of a gradient in world space. */
static uint32_t normal_of(const trip_level_work *w, const double gradient[3])
{
    const double(*j)[4] = w->params->index_to_world.m;
    double index[3];
    if (!w->params->compact)
        return trip_normal_pack(gradient, w->params->quantiser.gradient_full);
    for (int a = 0; a < 3; a++)
        index[a] = j[0][a] * gradient[0] + j[1][a] * gradient[1] + j[2][a] * gradient[2];
    return trip_compact_normal_pack(w->params->compact, index);
}

static trip_coarse_sum *sum_at(trip_level_lane *l, size_t at)
{
    uint64_t bit = UINT64_C(1) << at % 64;
    if (!(l->touched[at / 64] & bit))
        trip_coarse_sum_clear(&l->sums[at]);
    l->touched[at / 64] |= bit;
    return &l->sums[at];
}

static int add_run(trip_level_lane *l, const trip_level_work *w, const trip_level_source *square)
{
    trip_list_run run;
    double gradient[3];
    int status = trip_list_cursor_read(square->cursor, &square->run, l->run, &run);
    const bool normals = run.normals && square->kept;
    trip_coarse_sum *sum = NULL;
    size_t last = SIZE_MAX; /* in list order those of a voxel come together */
    for (uint32_t i = 0; i < run.count && status == 0; i++) {
        const uint32_t voxel = run.voxels[i];
        const size_t u = (size_t)square->u + trip_voxel_u(voxel),
                     v = (size_t)square->v + trip_voxel_v(voxel);
        const unsigned odd = (u & 1) | (v & 1) << 1 | square->odd << 2;
        const size_t at = (v >> 1 << w->edge_log2) + (u >> 1);
        if (at != last)
            sum = sum_at(l, last = at);
        if (normals)
            gradient_of(w, run.normals[i], gradient);
        trip_coarse_sum_add_whole(sum, (uint16_t)trip_voxel_code(voxel), square->kept, odd,
                                  normals ? gradient : NULL);
    }
    return status;
}

static int add_voxels(trip_level_lane *l, const trip_level_work *w, const trip_level_source *square)
{
    const bool normals = w->format.normals;
    const uint32_t count = square->voxels.count;
    double gradient[3];
    int status =
        trip_output_read(square->file, square->voxels.at, l->below, count * sizeof *l->below);
    for (uint32_t i = 0; i < count && status == 0; i++) {
        const trip_coarse_voxel *voxel = &l->below[i];
        size_t u = (size_t)square->u + voxel->u, v = (size_t)square->v + voxel->v;
        unsigned odd = (u & 1) | (v & 1) << 1 | square->odd << 2;
        if (normals && voxel->kept)
            gradient_of(w, voxel->normal, gradient);
        trip_coarse_sum_add(sum_at(l, (v >> 1 << w->edge_log2) + (u >> 1)), voxel, odd,
                            normals && voxel->kept ? gradient : NULL);
    }
    return status;
}

int trip_level_lane_add(trip_level_lane *l, const trip_level_work *w,
                        const trip_level_source *square)
{
    return w->lists ? add_run(l, w, square) : add_voxels(l, w, square);
}

uint32_t trip_level_lane_take(trip_level_lane *l, const trip_level_work *w)
{
    const size_t words = (size_t)1 << (2 * w->edge_log2 - 6), edge = (size_t)1 << w->edge_log2;
    uint32_t n = 0;
    for (size_t word = 0; word < words; word++) {
        for (uint64_t bits = l->touched[word]; bits; bits &= bits - 1) {
            size_t at = word * 64 + (size_t)__builtin_ctzll(bits);
            trip_coarse_voxel *voxel = &l->voxels[n];
            double gradient[3];
            if (!trip_coarse_sum_get(&l->sums[at], voxel))
                continue;
            trip_coarse_sum_gradient(&l->sums[at], gradient);
            voxel->u = (uint8_t)(at & (edge - 1));
            voxel->v = (uint8_t)(at >> w->edge_log2);
            if (voxel->kept && w->format.normals)
                voxel->normal = normal_of(w, gradient);
            n++;
        }
        l->touched[word] = 0;
    }
    return n;
}

/* ---- pieces ---- */

static void *reserve(void *user, unsigned thread, unsigned list, size_t bytes)
{
    return trip_list_builder_reserve(user, thread, list, bytes);
}

/* Marks the voxels of a square in the box: all, or of lists of means those that were kept. False
 * where there are none. */
static bool mark(trip_level_lane *l, const trip_coarse_voxel *voxels, uint32_t count, bool kept)
{
    bool some = false;
    for (uint32_t i = 0; i < count; i++) {
        if (kept && !voxels[i].kept)
            continue;
        trip_splat_box_mark(&l->box, voxels[i].v, 0, &voxels[i].u, 1);
        some = true;
    }
    return some;
}

static uint32_t value_code(const trip_level_work *w, const trip_coarse_voxel *voxel)
{
    return w->params->code_bytes == 1 ? (voxel->value + 128u) / 257 * 257 : voxel->value;
}

static uint32_t shares_of(const trip_coarse_voxel *voxel, int axis)
{
    if (voxel->kept == TRIP_COARSE_ALL)
        return TRIP_MEAN_SHARES - 1;
    return trip_mean_pack_shares(voxel->cover[axis] / (double)TRIP_COARSE_ALL,
                                 voxel->kept / (double)voxel->cover[axis]);
}

static void put_values(trip_level_lane *l, const trip_level_work *w,
                       const trip_coarse_voxel *voxels, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        l->box.values[trip_splat_box_row(&l->box, voxels[i].v, 0) + voxels[i].u] =
            value_code(w, &voxels[i]);
}

/* The values of a list of means, and with the first of them what the others have too. */
static void put_means(trip_level_lane *l, const trip_level_work *w, const trip_coarse_voxel *voxels,
                      uint32_t count, unsigned list)
{
    for (uint32_t i = 0; i < count; i++) {
        const trip_coarse_voxel *voxel = &voxels[i];
        const size_t at = trip_splat_box_row(&l->box, voxel->v, 0) + voxel->u;
        if (!voxel->kept)
            continue;
        if (list == 0) {
            l->box.normals[at] = voxel->normal;
            l->box.values[at] = trip_mean_pack_value(&w->scale, voxel->mean);
        }
        l->box.values[at] = (l->box.values[at] & ~(uint32_t)(TRIP_MEAN_SHARES - 1)) |
                            shares_of(voxel, trip_list_axis(list));
    }
}

/* The pieces of a list. */
static int emit(trip_level_lane *l, const trip_level_work *w, const trip_coarse_voxel *voxels,
                uint32_t count, unsigned list)
{
    const trip_piece_format f = trip_piece_format_of(&w->format, list);
    const trip_piece_sink sink = { reserve, w->builder, l->producer };
    if (list < TRIP_HALO_LISTS)
        put_means(l, w, voxels, count, list);
    else if (list == TRIP_HALO_LISTS) /* the same along all axes */
        put_values(l, w, voxels, count);
    return trip_splat_box_emit(&l->box, &f, list, &sink);
}

int trip_level_lane_emit(trip_level_lane *l, const trip_level_work *w, uint64_t key,
                         const trip_coarse_voxel *voxels, uint32_t count, unsigned first)
{
    const uint64_t morton = key & ((UINT64_C(1) << TRIP_TILE_MORTON_BITS) - 1);
    const int64_t edge = (int64_t)1 << w->edge_log2;
    const int64_t size[3] = { edge, edge, 1 };
    int64_t lo[3] = { 0, 0, (int64_t)(key >> TRIP_TILE_MORTON_BITS) };
    int status = 0;
    for (int bit = 0; bit < TRIP_TILE_MORTON_BITS; bit++)
        lo[bit % 2] |= (int64_t)(morton >> bit & 1) << bit / 2;
    lo[0] <<= w->edge_log2;
    lo[1] <<= w->edge_log2;
    trip_splat_box_begin(&l->box, lo, size);
    if (!mark(l, voxels, count, first == 0))
        return 0;
    for (unsigned list = first; list < first + 3 && status == 0; list++)
        status = emit(l, w, voxels, count, list);
    return status;
}
