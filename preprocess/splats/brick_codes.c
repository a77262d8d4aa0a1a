#include "brick_codes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "gradient.h"
#include "report.h"

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

/* ---- codes that follow the values ---- */

/* A window that holds this part of the kept values needs so many codes. */
static const double window = 0.01;
enum { WINDOW_CODES = 128, WINDOW_VALUES = 8 };

/* Returns the width of the narrowest window that holds enough of the sorted values, without windows
 * of a single value. Returns INFINITY if there is none. */
static double narrowest_window(const float *values, size_t count)
{
    double narrowest = INFINITY;
    size_t held = (size_t)(window * (double)count);
    held = held < WINDOW_VALUES ? WINDOW_VALUES : held;
    for (size_t i = 0; i + held < count; i++) {
        const double width = (double)values[i + held] - (double)values[i];
        if (width > 0 && width < narrowest)
            narrowest = width;
    }
    return narrowest;
}

static bool has_enough(const trip_quantiser *q, const float *kept, size_t count)
{
    return narrowest_window(kept, count) >= WINDOW_CODES * (q->hi - q->lo) / 65535;
}

/* Makes knots over the range of the values and, beyond a typical range, as much room as make_room()
 * makes. */
static void make_knots(trip_brick_codes *c, const trip_brick_input *in, trip_knots_params *p)
{
    const trip_tally *t = in->tally;
    trip_quantiser *q = &c->quantiser;
    const double lo = t->typical_min, hi = t->typical_max, room = (hi > lo ? hi - lo : 1) / 4;
    const double background = in->info->background;
    p->likely_lo = lo - room;
    p->likely_hi = hi + room;
    p->lo = fmin(t->value_min, p->likely_lo);
    p->hi = fmax(t->value_max, p->likely_hi);
    if (in->info->sparse && background >= q->lo && background <= q->hi) {
        p->lo = fmin(p->lo, background);
        p->hi = fmax(p->hi, background);
    }
    trip_knots_make(&c->knots, p);
    q->knots = &c->knots;
}

static int follow_values(trip_brick_codes *c, const trip_brick_input *in)
{
    trip_knots_params p = { 0 };
    size_t kept_count = 0;
    float *all = trip_value_sample_sorted(&in->tally->sample, &p.all_count);
    float *kept = malloc((p.all_count + 1) * sizeof *kept);
    if (!all || !kept) {
        free(all);
        free(kept);
        return trip_fail(TRIP_ERROR, "brick", in->params->input, "out of memory");
    }
    for (size_t i = 0; i < p.all_count; i++)
        if (trip_envelope_keeps(&in->envelope, all[i]))
            kept[kept_count++] = all[i];
    p.all = all;
    p.kept = kept;
    p.kept_count = kept_count;
    if (!has_enough(&c->quantiser, kept, kept_count))
        make_knots(c, in, &p);
    free(all);
    free(kept);
    return 0;
}

/* ---- choices ---- */

static void set_even(trip_brick_codes *c, const trip_brick_input *in, double lo, double hi)
{
    hi = hi > lo ? hi : lo + 1;
    c->quantiser = (trip_quantiser){ .lo = lo,
                                     .hi = hi,
                                     .gradient_full = trip_brick_gradient_full(in, lo, hi),
                                     .gradient_unit = trip_gradient_unit(&in->info->index_to_world),
                                     .bytes = trip_brick_code_bytes(in) == 1 };
    include_background(&c->quantiser, in);
    make_room(&c->quantiser, in);
}

int trip_brick_codes_set_range(trip_brick_codes *c, const trip_brick_input *in)
{
    const trip_tally *t = in->tally;
    if (trip_brick_rounds_codes(in)) {
        set_even(c, in, t->typical_min, t->typical_max);
        return 0;
    }
    set_even(c, in, t->value_min, t->value_max);
    c->quantiser.ids = in->ids.numbered;
    return in->ids.numbered ? 0 : follow_values(c, in);
}

/* Decoding gives ranks, which are the codes. */
static void set_ids(trip_brick_codes *c, const trip_brick_input *in)
{
    set_even(c, in, 0, 65535);
    c->quantiser.lo = 0;
    c->quantiser.hi = 65535;
    c->quantiser.ids = true;
    c->ids = in->ids.values;
    c->id_count = in->ids.count;
}

static int choose_range(trip_brick_codes *c, const trip_brick_input *in)
{
    double lo = 0, hi = 1;
    if (in->ids.count && !in->ids.numbered) {
        set_ids(c, in);
        return 0;
    }
    if (in->scanned && (!trip_brick_has_narrow_type(in) || trip_brick_rounds_codes(in)))
        return trip_brick_codes_set_range(c, in);
    if (trip_brick_has_narrow_type(in) && !trip_brick_rounds_codes(in))
        trip_brick_type_range(in->info, &lo, &hi);
    set_even(c, in, lo, hi);
    return 0;
}

static void choose_compact_normals(trip_brick_codes *c, const trip_brick_input *in)
{
    double step[3], full = c->quantiser.gradient_full;
    trip_brick_choose_compact(in, full, step);
    c->compact = trip_compact_normals_make(&in->info->index_to_world, full, step);
}

int trip_brick_codes_choose(trip_brick_codes *c, const trip_brick_input *in)
{
    const int status = choose_range(c, in);
    c->code_bytes = trip_brick_code_bytes(in);
    c->normal_bytes = trip_brick_normal_bytes(in);
    if (c->normal_bytes == 3)
        choose_compact_normals(c, in);
    return status;
}

trip_codes trip_brick_codes_get(const trip_brick_codes *c)
{
    const trip_quantiser *q = &c->quantiser;
    if (c->ids)
        return trip_codes_from_table(c->ids, c->id_count, 0);
    if (q->knots)
        return trip_codes_from_table(q->knots->values, TRIP_KNOTS, TRIP_KNOT_STEP_LOG2);
    return (trip_codes){ .lo = q->lo, .hi = q->hi };
}

trip_writer_codes trip_brick_codes_header(const trip_brick_codes *c)
{
    const trip_codes of = trip_brick_codes_get(c);
    trip_writer_codes codes = { .code_lo = of.lo,
                                .code_hi = of.hi,
                                .table = of.table,
                                .table_entries = of.entries,
                                .table_step_log2 = of.step_log2 };
    if (c->normal_bytes)
        codes.gradient_full = c->quantiser.gradient_full;
    if (c->normal_bytes == 3)
        memcpy(codes.gradient_step, c->compact.step, sizeof codes.gradient_step);
    return codes;
}
