#include "occupancy.h"

#include <math.h>
#include <string.h>

#include "format.h"
#include "report.h"

enum {
    MAX_VOXELS = 128, /* along each axis of the level to read */
    ALONG_Z = 2,
    WHOLE_VOXEL = 1023, /* weight of a voxel with the maximum value */
};

typedef struct summing {
    const trip_occupancy_params *params;
    unsigned level;
    trip_mean_scale scale; /* of the codes of means */
    int shift[3];          /* a voxel of the level lies in bin index >> shift */
    int dims[3];           /* bins along each axis */
    uint64_t weights[TRIP_OCCUPANCY_EDGE * TRIP_OCCUPANCY_EDGE * TRIP_OCCUPANCY_EDGE];
} summing;

static void choose_level(summing *s)
{
    const trip_occupancy_params *p = s->params;
    for (int a = 0; a < 3; a++)
        while (s->level < p->levels && (p->dims[a] - 1) >> s->level >= MAX_VOXELS)
            s->level++;
    for (int a = 0; a < 3; a++) {
        int64_t last = (p->dims[a] - 1) >> s->level;
        while (last >> s->shift[a] >= TRIP_OCCUPANCY_EDGE)
            s->shift[a]++;
        s->dims[a] = (int)(last >> s->shift[a]) + 1;
    }
}

/* Returns whether the codes of the list are means (mean.h). */
static bool has_means(const summing *s)
{
    return s->level > 0 && !s->params->kinds.values;
}

static unsigned list_of(const summing *s)
{
    const trip_occupancy_params *p = s->params;
    const bool both = s->level > 0 && p->kinds.means && p->kinds.values;
    return trip_levels_first_list(p->halo, p->kinds, s->level) + (both ? TRIP_HALO_LISTS : 0) +
           ALONG_Z;
}

/* Returns the distance of a value from the minimum, scaled to WHOLE_VOXEL. Ids count by their rank,
 * and even codes by the code. */
static double distance_of(const summing *s, double code)
{
    const trip_codes *codes = &s->params->codes;
    double lo = s->scale.lo, width = s->scale.width;
    if (codes->table && !trip_codes_ids(codes)) {
        lo = s->params->typical_min;
        width = s->params->typical_max - lo;
        code = trip_codes_value(codes, code);
    }
    return fmin(1, fmax(0, width > 0 ? (code - lo) / width : 1)) * WHOLE_VOXEL;
}

/* Returns the weight of a code. Multiplies the distance of a mean by the kept share of the voxel.
 */
static uint64_t weight_of(const summing *s, unsigned code)
{
    if (!has_means(s))
        return (uint64_t)(distance_of(s, code) + 0.5);
    unsigned shares = code % TRIP_MEAN_SHARES;
    double kept = trip_mean_cover(shares) * trip_mean_depth(shares);
    unsigned mean = s->scale.width > 0 ? code >> TRIP_MEAN_AXIS_BITS : WHOLE_VOXEL;
    if (s->params->codes.table)
        return (uint64_t)(distance_of(s, trip_mean_value(&s->scale, code)) * kept + 0.5);
    return (uint64_t)(mean * kept + 0.5);
}

static void add_square(summing *s, const trip_list_position *position, const trip_square *square)
{
    const int *dims = s->dims;
    const unsigned tile_log2 = s->params->tile_log2;
    const uint64_t plane = (uint64_t)(position->sheet >> s->shift[2]) * (uint64_t)dims[1];
    uint32_t voxels[64];
    trip_square_voxels(square, voxels);
    for (uint32_t n = 0; n < square->count; n++) {
        uint64_t i = (((uint64_t)position->brick.tile_u << tile_log2) + trip_voxel_u(voxels[n])) >>
                     s->shift[0];
        uint64_t j = (((uint64_t)position->brick.tile_v << tile_log2) + trip_voxel_v(voxels[n])) >>
                     s->shift[1];
        s->weights[(plane + j) * (uint64_t)dims[0] + i] += weight_of(s, trip_voxel_code(voxels[n]));
    }
}

static void add_run(summing *s, const trip_list_position *position, const trip_block *run)
{
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    const uint32_t count = trip_block_squares(run, squares);
    for (uint32_t i = 0; i < count; i++)
        add_square(s, position, &squares[i]);
}

static int add_sheets(summing *s, trip_writer *w, bool odd, trip_list_buffer *buffer,
                      trip_budget *budget)
{
    trip_list_cursor *cursor;
    trip_list_position position;
    trip_block run;
    int status = trip_list_cursor_open(&cursor, w, list_of(s), odd, false, budget);
    if (status < 0)
        return status;
    while ((status = trip_list_cursor_next(cursor, &position)) > 0) {
        status = trip_list_cursor_read(cursor, &position, 0, buffer, &run);
        if (status == 0 && trip_interrupted())
            status = trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted");
        if (status < 0)
            break;
        add_run(s, &position, &run);
    }
    trip_list_cursor_close(cursor);
    return status;
}

/* Scales the weights so that the greatest is UINT16_MAX. */
static void scale_weights(const summing *s, trip_occupancy *o)
{
    const size_t count = (size_t)s->dims[0] * (size_t)s->dims[1] * (size_t)s->dims[2];
    uint64_t max = 1;
    memcpy(o->dims, s->dims, sizeof o->dims);
    for (size_t i = 0; i < count; i++)
        max = s->weights[i] > max ? s->weights[i] : max;
    for (size_t i = 0; i < count; i++)
        o->weights[i] = (uint16_t)((double)s->weights[i] / (double)max * UINT16_MAX + 0.5);
}

int trip_occupancy_read(trip_occupancy *o, trip_writer *w, const trip_occupancy_params *params,
                        trip_budget *budget)
{
    summing *s = trip_budget_take(budget, sizeof *s);
    if (!s)
        return trip_fail(TRIP_ERROR, "brick", "orientation",
                         "guessing it takes 3 MiB of memory: raise --memory");
    *s = (summing){ .params = params };
    s->scale = trip_mean_scale_make(params->typical_min, params->typical_max, &params->codes);
    choose_level(s);
    trip_list_buffer *buffer;
    int status = trip_list_buffer_create(&buffer, w, budget);
    if (status == 0)
        status = add_sheets(s, w, false, buffer, budget);
    if (status == 0)
        status = add_sheets(s, w, true, buffer, budget);
    if (status == 0)
        scale_weights(s, o);
    trip_list_buffer_destroy(buffer, budget);
    trip_budget_release(budget, s, sizeof *s);
    return status;
}

trip_occupancy_row trip_occupancy_along(const trip_occupancy *o, int axis, int a, int b)
{
    const size_t steps[3] = { 1, (size_t)o->dims[0], (size_t)o->dims[0] * (size_t)o->dims[1] };
    const size_t at = (size_t)a * steps[(axis + 1) % 3] + (size_t)b * steps[(axis + 2) % 3];
    return (trip_occupancy_row){ o->weights + at, steps[axis], o->dims[axis] };
}
