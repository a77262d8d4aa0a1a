#include "draw_codes.h"

#include <math.h>

#include "deviation.h"

enum { LAST = TRIP_CODES - 1 };

/* Limit of exact codes. Single precision and its products hold them. */
#define FARTHEST 1e15

/* ---- the part in which a function changes ---- */

static bool same_colour(const trip_rgba *a, const trip_rgba *b)
{
    return a->r == b->r && a->g == b->g && a->b == b->b && a->opacity == b->opacity;
}

/* Whether the function looks the same at two points: nothing is visible, or the colours are equal.
 */
static bool look_alike(const trip_tf_point *a, const trip_tf_point *b)
{
    return (a->colour.opacity == 0 && b->colour.opacity == 0) ||
           same_colour(&a->colour, &b->colour);
}

typedef struct span {
    double lo, hi;
} span;

static double within(span s, double value)
{
    return fmin(s.hi, fmax(s.lo, value));
}

/* The smallest interval outside of which the function is constant, and the distance between the
 * nearest two of its points there that do not coincide. */
typedef struct part {
    span of;
    double nearest;
} part;

static part changing_part(const trip_tf *tf)
{
    size_t count;
    const trip_tf_point *points = trip_tf_points(tf, &count);
    size_t first = 0, last = count - 1;
    while (first < last && look_alike(&points[first], &points[first + 1]))
        first++;
    while (last > first && look_alike(&points[last], &points[last - 1]))
        last--;
    part p = { { points[first].value, points[last].value }, 0 };
    for (size_t i = first + 1; i <= last; i++) {
        const double apart = points[i].value - points[i - 1].value;
        if (apart > 0 && (p.nearest == 0 || apart < p.nearest))
            p.nearest = apart;
    }
    return p;
}

double trip_draw_codes_changing(const trip_tf *tf)
{
    const part p = changing_part(tf);
    return p.of.hi - p.of.lo;
}

/* ---- the range of draw codes ---- */

/* Returns the distance between the codes of the data set about a value. */
static double apart_at(const trip_codes *c, double value)
{
    const double code = floor(trip_codes_code(c, value));
    double apart = 0;
    for (double reach = 1; !(apart > 0) && reach < TRIP_CODES; reach *= 2)
        apart = (trip_codes_value(c, code + reach) - trip_codes_value(c, code - reach)) /
                (fmin(LAST, code + reach) - fmax(0, code - reach));
    return apart;
}

/* Returns the distance between the codes of the data set in a part of its values. */
static double apart_in(const trip_codes *c, span of)
{
    const double codes = trip_codes_code(c, of.hi) - trip_codes_code(c, of.lo);
    const double apart = fmin(apart_at(c, of.lo), apart_at(c, of.hi));
    return codes > 0 ? fmin(apart, (of.hi - of.lo) / codes) : apart;
}

static double width_of(span s)
{
    return s.hi - s.lo;
}

/* Widens a range by `room` on both sides together, and by as much as possible within `limits`. */
static span widened(span s, double room, span limits)
{
    const double below = s.lo - limits.lo, above = limits.hi - s.hi;
    if (!(below + above > room))
        return limits;
    if (below < room / 2)
        return (span){ limits.lo, s.hi + (room - below) };
    if (above < room / 2)
        return (span){ s.lo - (room - above), limits.hi };
    return (span){ s.lo - room / 2, s.hi + room / 2 };
}

static span hull(span a, span b)
{
    return (span){ fmin(a.lo, b.lo), fmax(a.hi, b.hi) };
}

/* Returns the range of values that the draw codes cover. `typical` lies within `data`. */
static span choose_range(span data, span typical, span changing, double nearest, double apart)
{
    const double width = width_of(changing);
    const bool two_ends = changing.lo - typical.lo > width && typical.hi - changing.hi > width;
    const double finest = width / TRIP_DRAW_PART_MAX, coarsest = width / TRIP_DRAW_PART_MIN;
    const double code = fmax(fmin(coarsest, fmax(finest, nearest / TRIP_DRAW_PART_MIN)), apart);
    const span most = hull(typical, changing);
    const double room = LAST * code - width_of(most);
    if (width_of(data) <= LAST * code)
        return data;
    if (room >= 0)
        return widened(most, fmin(room, 2 * width_of(most)), data);
    const double widest =
        two_ends ? LAST * code * TRIP_DRAW_COARSER : LAST * width / TRIP_DRAW_PART_FINE;
    return widened(changing, widest - width, most);
}

/* ---- the map ---- */

/* Codes beyond `from` grow like a square root: at a distance x by 2 scale (sqrt(1 + x / scale) -
 * 1). The growth begins as x. */
typedef struct tail {
    double from, scale;
} tail;

/* Returns a tail that takes the exact code `farthest` to `end`. It begins halfway between the part
 * in which the function changes and `end`. */
static tail tail_to(double changing, double end, double farthest)
{
    const double from = changing + (end - changing) / 2;
    const double room = fabs(end - from), reach = fabs(farthest - from);
    return (tail){ from, room * room / (4 * (reach - room)) };
}

static double squeezed(const tail *t, double code)
{
    const double grown = sqrt(1 + fabs(code - t->from) / t->scale) - 1;
    return t->from + copysign(2 * t->scale * grown, code - t->from);
}

/* Fills the map. If values lie beyond the range, the outer half of the codes on that side are a
 * tail. Gradients of far values then keep their direction. */
static void fill_map(const trip_draw_codes *d, span changing, uint16_t map[TRIP_CODES])
{
    const double first = trip_draw_code_exact(d, 0), last = trip_draw_code_exact(d, LAST);
    const double per_code = trip_draw_value_per_code(d);
    const tail below = tail_to((changing.lo - d->lo) / per_code, 0, first);
    const tail above = tail_to((changing.hi - d->lo) / per_code, LAST, last);
    for (unsigned stored = 0; stored < TRIP_CODES; stored++) {
        double code = trip_draw_code_exact(d, stored);
        if (first < 0 && code < below.from)
            code = squeezed(&below, code);
        else if (last > LAST && code > above.from)
            code = squeezed(&above, code);
        map[stored] = (uint16_t)(fmin(LAST, fmax(0, code)) + 0.5);
    }
}

trip_draw_codes trip_draw_codes_as_stored(const trip_codes *stored)
{
    return (trip_draw_codes){ .lo = stored->lo, .hi = stored->hi, .stored = *stored };
}

trip_draw_codes trip_draw_codes_for(const trip_tf *tf, const trip_codes *stored,
                                    const double typical[2], uint16_t map[TRIP_CODES])
{
    trip_draw_codes d = trip_draw_codes_as_stored(stored);
    const span data = { stored->lo, stored->hi };
    if (trip_codes_even(stored))
        return d;
    part p = changing_part(tf);
    const bool inside = p.of.hi >= data.lo && p.of.lo <= data.hi;
    p.of = (span){ within(data, p.of.lo), within(data, p.of.hi) };
    if (inside && data.lo < data.hi) {
        const double apart = apart_in(stored, p.of);
        const bool known = typical[1] > typical[0];
        const span most = { within(data, typical[0]), within(data, typical[1]) };
        const span range = choose_range(data, known ? most : data, p.of, p.nearest, apart);
        d.lo = range.lo;
        d.hi = range.hi;
    }
    d.of_stored = map;
    fill_map(&d, p.of, map);
    return d;
}

double trip_draw_code_exact(const trip_draw_codes *d, unsigned stored)
{
    if (!d->of_stored)
        return stored;
    if (!(d->hi > d->lo))
        return 0;
    const double code = LAST * ((trip_codes_value(&d->stored, stored) - d->lo) / (d->hi - d->lo));
    return fmin(FARTHEST, fmax(-FARTHEST, code));
}

double trip_draw_deviation(const trip_draw_codes *d, unsigned stored, unsigned deviation)
{
    if (!d->of_stored || deviation == 0)
        return deviation;
    const unsigned before = stored > 0 ? stored - 1 : 0, behind = stored < LAST ? stored + 1 : LAST;
    const double growth = (trip_draw_code_exact(d, behind) - trip_draw_code_exact(d, before)) /
                          (double)(behind - before);
    return fmin(TRIP_DEVIATION_MAX, deviation * sqrt(fmax(0, growth)));
}

/* ---- tables ---- */

void trip_draw_codes_stored_table(const trip_draw_codes *d, const trip_tf *tf, double voxel_world,
                                  trip_tf_entry table[TRIP_CODES])
{
    if (trip_codes_even(&d->stored)) {
        trip_tf_fill_table(tf, d->stored.lo, d->stored.hi, voxel_world, table);
        return;
    }
    for (unsigned code = 0; code < TRIP_CODES; code++)
        table[code] = trip_tf_entry_at(tf, trip_codes_value(&d->stored, code), voxel_world);
}

void trip_draw_codes_table(const trip_draw_codes *d, const trip_tf *tf, double voxel_world,
                           trip_tf_entry table[TRIP_CODES])
{
    if (d->of_stored)
        trip_tf_fill_table(tf, d->lo, d->hi, voxel_world, table);
    else
        trip_draw_codes_stored_table(d, tf, voxel_world, table);
}

/* ---- losses ---- */

/* Changes below 1/8 in opacity or in visible colour are not reported. */
static bool differ_much(const trip_rgba *a, const trip_rgba *b)
{
    const double much = 0.125, opacity = fmax(a->opacity, b->opacity);
    return fabs(a->opacity - b->opacity) > much * opacity ||
           (opacity > 0 &&
            fmax(fabs(a->r - b->r), fmax(fabs(a->g - b->g), fabs(a->b - b->b))) > much);
}

bool trip_draw_codes_loss(const trip_draw_codes *d, const trip_tf *tf, trip_draw_loss *out)
{
    enum { FEW = 16, TIMES = 4 };
    size_t count;
    const trip_tf_point *points = trip_tf_points(tf, &count);
    const span data = { d->stored.lo, d->stored.hi };
    const part p = changing_part(tf);
    for (size_t i = 1; i < count && d->of_stored; i++) {
        const span s = { within(data, points[i - 1].value), within(data, points[i].value) };
        const double drawn = (s.hi - s.lo) / trip_draw_value_per_code(d);
        const double stored = trip_codes_code(&d->stored, s.hi) - trip_codes_code(&d->stored, s.lo);
        if (drawn < FEW && stored >= TIMES * FEW && stored >= TIMES * drawn &&
            differ_much(&points[i - 1].colour, &points[i].colour)) {
            *out = (trip_draw_loss){ s.lo, s.hi, drawn, p.of.lo, p.of.hi };
            return true;
        }
    }
    return false;
}
