#include "mirror.h"

#include <math.h>

#include "format.h"
#include "report.h"

/* Heads of several scanners and a teapot score 0.93 to 0.97 across their own axis and up to 0.88
 * across the others. What has none, as an engine, a chest, clouds and vessels, stays below 0.88, or
 * scores alike across two, as simulations of atoms do. */
static const double strong = 0.9, most_of_others = 0.9, times_weaker = 2;

enum {
    MOST_VOXELS = 128, /* along each axis of the level that is read */
    KEPT_ALONG_Z = 2,
    WHOLE_VOXEL = 1023, /* weight of a voxel of the greatest value */
};

/* ---- the score ---- */

/* A row of cells along an axis. */
typedef struct row {
    const uint64_t *first;
    size_t step;
    int cells;
} row;

/* Adds, for each place of the mirror, the products of cells and their images. The mirror at place c
 * takes cell i to cell c - i. */
static void add_row(const row *r, uint64_t *sums)
{
    uint64_t w[TRIP_MIRROR_EDGE];
    for (int i = 0; i < r->cells; i++)
        w[i] = r->first[(size_t)i * r->step];
    for (int i = 0; i < r->cells; i++) {
        if (w[i] == 0)
            continue;
        for (int j = 0; j < r->cells; j++)
            sums[i + j] += w[i] * w[j];
    }
}

/* At most 2^18 products of 32 bits are summed. */
double trip_mirror_score(const trip_mirror_cells *cells, int axis)
{
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const size_t steps[3] = { 1, (size_t)cells->dims[0],
                              (size_t)cells->dims[0] * (size_t)cells->dims[1] };
    uint64_t sums[2 * TRIP_MIRROR_EDGE] = { 0 }, most = 0, squares = 0;
    for (int b = 0; b < cells->dims[v]; b++)
        for (int a = 0; a < cells->dims[u]; a++) {
            const uint64_t *first = cells->weights + (size_t)a * steps[u] + (size_t)b * steps[v];
            add_row(&(row){ first, steps[axis], cells->dims[axis] }, sums);
        }
    for (int c = 0; c < 2 * TRIP_MIRROR_EDGE; c++)
        most = sums[c] > most ? sums[c] : most;
    for (size_t i = 0; i < steps[2] * (size_t)cells->dims[2]; i++)
        squares += cells->weights[i] * cells->weights[i];
    return squares > 0 ? (double)most / (double)squares : 0;
}

int trip_mirror_axis(const double scores[3])
{
    int best = 0;
    double other = 0;
    for (int a = 1; a < 3; a++)
        best = scores[a] > scores[best] ? a : best;
    for (int a = 0; a < 3; a++)
        other = a != best ? fmax(other, scores[a]) : other;
    bool found = scores[best] >= strong && other <= most_of_others &&
                 1 - other >= times_weaker * (1 - scores[best]);
    return found ? best : -1;
}

/* ---- the cells of a list ---- */

typedef struct summing {
    const trip_mirror_params *params;
    unsigned level;
    int shift[3]; /* from a voxel of the level to its cell, as powers of 2 */
    trip_mirror_cells cells;
    uint64_t weights[TRIP_MIRROR_EDGE * TRIP_MIRROR_EDGE * TRIP_MIRROR_EDGE];
} summing;

static void choose_level(summing *s)
{
    const trip_mirror_params *p = s->params;
    for (int a = 0; a < 3; a++)
        while (s->level < p->levels && (p->dims[a] - 1) >> s->level >= MOST_VOXELS)
            s->level++;
    for (int a = 0; a < 3; a++) {
        int64_t last = (p->dims[a] - 1) >> s->level;
        while (last >> s->shift[a] >= TRIP_MIRROR_EDGE)
            s->shift[a]++;
        s->cells.dims[a] = (int)(last >> s->shift[a]) + 1;
    }
}

/* How far its value is from the volume's least, times the part of it that was kept. */
static uint64_t weight_of(const summing *s, unsigned code)
{
    const trip_mean_scale *scale = &s->params->scale;
    if (s->level == 0) {
        double part = scale->width > 0 ? ((double)code - scale->lo) / scale->width : 1;
        return (uint64_t)(fmin(1, fmax(0, part)) * WHOLE_VOXEL + 0.5);
    }
    unsigned shares = code % TRIP_MEAN_SHARES;
    double kept = trip_mean_cover(shares) * trip_mean_depth(shares);
    unsigned mean = scale->width > 0 ? code >> TRIP_MEAN_AXIS_BITS : WHOLE_VOXEL;
    return (uint64_t)(mean * kept + 0.5);
}

static void add_run(summing *s, const trip_list_run *run, unsigned tile_log2)
{
    const int *dims = s->cells.dims;
    const uint64_t plane = (uint64_t)(run->sheet >> s->shift[2]) * (uint64_t)dims[1];
    for (uint32_t n = 0; n < run->count; n++) {
        uint32_t voxel = run->voxels[n];
        uint64_t i = (((uint64_t)run->tile_u << tile_log2) + trip_voxel_u(voxel)) >> s->shift[0];
        uint64_t j = (((uint64_t)run->tile_v << tile_log2) + trip_voxel_v(voxel)) >> s->shift[1];
        s->weights[(plane + j) * (uint64_t)dims[0] + i] += weight_of(s, trip_voxel_code(voxel));
    }
}

static int add_sheets(summing *s, trip_writer *w, bool odd, trip_budget *budget)
{
    unsigned list = s->level * s->params->level_lists + KEPT_ALONG_Z;
    trip_list_cursor *cursor;
    trip_list_run run;
    int status = trip_list_cursor_open(&cursor, w, list, odd, budget);
    if (status < 0)
        return status;
    while ((status = trip_list_cursor_next(cursor, &run)) > 0) {
        add_run(s, &run, s->params->tile_log2);
        if (trip_interrupted()) {
            status = trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted");
            break;
        }
    }
    trip_list_cursor_close(cursor);
    return status;
}

/* As parts of the greatest. */
static void scale_weights(summing *s)
{
    const size_t count =
        (size_t)s->cells.dims[0] * (size_t)s->cells.dims[1] * (size_t)s->cells.dims[2];
    uint64_t most = 1;
    for (size_t i = 0; i < count; i++)
        most = s->weights[i] > most ? s->weights[i] : most;
    for (size_t i = 0; i < count; i++)
        s->weights[i] = (uint64_t)((double)s->weights[i] / (double)most * UINT16_MAX + 0.5);
}

int trip_mirror_find(int *axis, trip_writer *w, const trip_mirror_params *params,
                     trip_budget *budget)
{
    *axis = -1;
    summing *s = trip_budget_take(budget, sizeof *s);
    if (!s)
        return trip_fail(TRIP_ERROR, "brick", "symmetry",
                         "finding it takes 2 MiB: give more with --memory");
    *s = (summing){ .params = params };
    s->cells.weights = s->weights;
    choose_level(s);
    int status = add_sheets(s, w, false, budget);
    if (status == 0)
        status = add_sheets(s, w, true, budget);
    if (status == 0) {
        double scores[3];
        scale_weights(s);
        for (int a = 0; a < 3; a++)
            scores[a] = trip_mirror_score(&s->cells, a);
        *axis = trip_mirror_axis(scores);
    }
    trip_budget_release(budget, s, sizeof *s);
    return status;
}
