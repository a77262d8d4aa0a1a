#include "brick_codes.h"

#include <math.h>
#include <string.h>

#include "gradient.h"

/* Maximum factor by which the background may widen the range of codes. The values then keep at
 * least 4096 of 65536 codes. */
#define BACKGROUND_SHARE 16

/* Widens the range to the background of a sparse volume, because its halo contains the background.
 */
static void include_background(trip_quantiser *q, const trip_brick_input *in)
{
    const double background = in->info->background;
    const double lo = fmin(q->lo, background), hi = fmax(q->hi, background);
    if (in->info->sparse && hi - lo <= BACKGROUND_SHARE * (q->hi - q->lo)) {
        q->lo = lo;
        q->hi = hi;
    }
}

/* Widens the range, because sharpened values of coarse levels (sharpen.h) can leave it. Integers of
 * 8 or 16 bits in 16-bit codes keep the range of their type, at least one code per value. */
static void make_room(trip_quantiser *q, const trip_brick_input *in)
{
    const double room = (q->hi - q->lo) / 4;
    if (q->bytes) {
        trip_quantiser_set_bytes(q, q->lo, q->hi);
    } else if (!trip_brick_has_narrow_type(in)) {
        q->lo -= room;
        q->hi += room;
    }
}

void trip_brick_codes_set_range(trip_brick_codes *c, const trip_brick_input *in, double lo,
                                double hi)
{
    hi = hi > lo ? hi : lo + 1;
    c->quantiser = (trip_quantiser){ lo, hi, trip_brick_gradient_full(in, lo, hi),
                                     trip_gradient_unit(&in->info->index_to_world),
                                     trip_brick_code_bytes(in) == 1 };
    include_background(&c->quantiser, in);
    make_room(&c->quantiser, in);
}

static void choose_range(trip_brick_codes *c, const trip_brick_input *in)
{
    double lo = 0, hi = 1;
    if (trip_brick_has_narrow_type(in) && !trip_brick_rounds_codes(in)) {
        trip_brick_type_range(in->info, &lo, &hi);
    } else if (in->scanned) {
        lo = in->tally->value_min;
        hi = in->tally->value_max;
    }
    trip_brick_codes_set_range(c, in, lo, hi);
}

static void choose_compact_normals(trip_brick_codes *c, const trip_brick_input *in)
{
    double step[3], full = c->quantiser.gradient_full;
    trip_brick_choose_compact(in, full, step);
    c->compact = trip_compact_normals_make(&in->info->index_to_world, full, step);
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
    if (c->normal_bytes)
        codes.gradient_full = c->quantiser.gradient_full;
    if (c->normal_bytes == 3)
        memcpy(codes.gradient_step, c->compact.step, sizeof codes.gradient_step);
    return codes;
}
