#include "brick_codes.h"

#include <math.h>
#include <string.h>

#include "gradient.h"

/* The bound of gradients follows from the range of the values, or of the codes if that is unknown.
 */
void trip_brick_codes_set_range(trip_brick_codes *c, const trip_brick_input *in, double lo,
                                double hi)
{
    double least = in->scanned ? in->tally->value_min : lo;
    double most = in->scanned ? in->tally->value_max : hi;
    c->quantiser =
        (trip_quantiser){ lo, hi > lo ? hi : lo + 1,
                          trip_gradient_bound(in->info, least, most > least ? most : least + 1),
                          trip_gradient_unit(&in->info->index_to_world) };
}

static void choose_range(trip_brick_codes *c, const trip_brick_input *in)
{
    double lo = 0, hi = 1;
    if (trip_brick_has_narrow_type(in)) {
        trip_brick_type_range(in->info, &lo, &hi);
    } else if (in->scanned) {
        lo = in->tally->value_min;
        hi = in->tally->value_max;
    }
    trip_brick_codes_set_range(c, in, lo, hi);
}

/* The magnitude from which on shading is full, for the range of the values or, where that is
 * unknown, of the codes. */
static double full_gradient(const trip_brick_codes *c, const trip_brick_input *in)
{
    double range = in->scanned ? in->tally->value_max - in->tally->value_min : 0;
    double voxel = cbrt(fabs(trip_affine_determinant(&in->info->index_to_world)));
    return TRIP_GRADIENT_FULL * (range > 0 ? range : c->quantiser.hi - c->quantiser.lo) / voxel;
}

static void choose_compact_normals(trip_brick_codes *c, const trip_brick_input *in)
{
    const trip_volume_info *info = in->info;
    double step[3], full = full_gradient(c, in);
    double unit = info->type < TRIP_F16 ? fabs(info->slope) / 2 : 0;
    trip_compact_normals_choose(&info->index_to_world, full, unit, step);
    c->compact = trip_compact_normals_make(&info->index_to_world, full, step);
}

void trip_brick_codes_choose(trip_brick_codes *c, const trip_brick_input *in)
{
    choose_range(c, in);
    c->code_bytes = trip_brick_code_bytes(in);
    c->normal_bytes = trip_brick_normal_bytes(in);
    if (c->normal_bytes == 3)
        choose_compact_normals(c, in);
}

trip_writer_codes trip_brick_codes_header(const trip_brick_codes *c)
{
    trip_writer_codes codes = { .code_lo = c->quantiser.lo, .code_hi = c->quantiser.hi };
    if (c->normal_bytes == 4)
        codes.gradient_scale = c->quantiser.gradient_scale;
    if (c->normal_bytes == 3) {
        codes.gradient_full = c->compact.full;
        memcpy(codes.gradient_step, c->compact.step, sizeof codes.gradient_step);
    }
    return codes;
}
