#include "closed_form.h"

#include <math.h>

/* Number of codes to try first, before all codes. */
enum { TRIED = 64 };

/* With fewer codes, only constant entries are accepted. */
enum { FEWEST = 16 };

/* Limit of the optical depth along the longest ray. A larger one uses tables, because single
 * precision does not suffice. */
#define MAX 1e15

/* The visible codes among the codes of the data set. */
typedef struct span {
    int first, last;
    bool ramp;         /* there are invisible codes at one end */
    int up;            /* 1 or -1: the direction in which extinction grows from that end */
    bool from_nothing; /* extinction is 0 at x = 0 */
} span;

static bool shows(const trip_tf_entry *table, int code)
{
    return table[code].extinction > 0;
}

/* Bisects between a visible and an invisible code. Returns the visible one of the two neighbours at
 * the border. */
static int edge(const trip_tf_entry *table, int shown, int hidden)
{
    while (shown - hidden > 1 || hidden - shown > 1) {
        const int middle = (shown + hidden) / 2;
        if (shows(table, middle))
            shown = middle;
        else
            hidden = middle;
    }
    return shown;
}

static bool find_span(const trip_tf_entry *table, int min, int max, span *s)
{
    *s = (span){ .first = min, .last = max };
    if (!shows(table, min) && !shows(table, max))
        return false;
    s->up = table[max].extinction > table[min].extinction ? 1 : -1;
    s->ramp = !shows(table, min) || !shows(table, max);
    if (s->ramp && s->up > 0)
        s->first = edge(table, max, min);
    else if (s->ramp)
        s->last = edge(table, min, max);
    return true;
}

/* Extrapolates the beginning of extinction with the parabola through three codes at its lower end,
 * so that errors are relative. A ramp begins at most one code before them; otherwise it is a step.
 */
static bool set_positions(trip_closed_form *form, const trip_tf_entry *table, span *s)
{
    const int codes = s->last - s->first, low = s->up > 0 ? s->first : s->last;
    const int high = s->up > 0 ? s->last : s->first, step = s->ramp ? 1 : 1 + codes / 64;
    const double k[3] = { table[low].extinction, table[low + s->up * step].extinction,
                          table[low + 2 * s->up * step].extinction };
    const double bend = 0.5 * (k[2] - 2 * k[1] + k[0]), slope = k[1] - k[0] - bend;
    double before = k[0] / slope;
    for (int i = 0; i < 3; i++)
        before = k[0] / (slope - bend * before);
    before *= step; /* codes */
    form->ramp = s->ramp;
    s->from_nothing = s->ramp || (before >= 0 && 4 * before < codes);
    if (s->ramp && !(before >= 0 && before <= 1 + 1e-3))
        return false;
    const double start = s->from_nothing ? low - s->up * before : s->first;
    form->scale = 1 / ((s->from_nothing ? high : s->last) - start);
    form->offset = -start * form->scale;
    return true;
}

/* Returns the polynomial through values at distinct positions, by divided differences. */
static void interpolate(const double *x, double *y, int count, double *c)
{
    for (int order = 1; order < count; order++)
        for (int i = count - 1; i >= order; i--)
            y[i] = (y[i] - y[i - 1]) / (x[i] - x[i - order]);
    for (int i = 0; i < count; i++)
        c[i] = 0;
    for (int i = count - 1; i >= 0; i--) { /* c = c (x - x[i]) + y[i] */
        for (int k = count - 1; k > 0; k--)
            c[k] = c[k - 1] - x[i] * c[k];
        c[0] = y[i] - x[i] * c[0];
    }
}

/* Interpolates at the codes with the smallest error. A ramp is x times a polynomial. */
static void set_extinction(trip_closed_form *form, const trip_tf_entry *table, const span *s)
{
    const int nodes = s->from_nothing ? 3 : 4, codes = s->last - s->first;
    double x[4], y[4];
    for (int i = 0; i < nodes; i++) {
        const double at = 0.5 - 0.5 * cos((i + 0.5) / nodes * 3.14159265358979323846);
        const int code = s->first + (int)lround(at * codes);
        x[i] = form->scale * code + form->offset;
        y[i] = table[code].extinction / (s->from_nothing ? x[i] : 1);
    }
    form->k[0] = 0;
    interpolate(x, y, nodes, form->k + (s->from_nothing ? 1 : 0));
}

static double component(const trip_tf_entry *e, int i)
{
    return i == 0 ? e->r : i == 1 ? e->g : e->b;
}

static void set_colours(trip_closed_form *form, const trip_tf_entry *table, const span *s)
{
    const double x0 = form->scale * s->first + form->offset;
    const double x1 = form->scale * s->last + form->offset;
    form->coloured = false;
    for (int i = 0; i < 3; i++) {
        const double a = component(&table[s->first], i), b = component(&table[s->last], i);
        form->q1[i] = b == a ? 0 : (b - a) / (x1 - x0);
        form->q0[i] = a - form->q1[i] * x0;
        form->coloured = form->coloured || form->q1[i] != 0;
    }
}

/* Sets a constant extinction and colour, for transfer functions with few visible codes. */
static void set_constant(trip_closed_form *form, const trip_tf_entry *table, const span *s)
{
    *form = (trip_closed_form){ .k = { table[s->first].extinction } };
    for (int i = 0; i < 3; i++)
        form->q0[i] = component(&table[s->first], i);
}

static double distance(double a, double b)
{
    return a > b ? a - b : b - a;
}

static bool has_colour(const trip_closed_form *form, const trip_tf_entry *e, double x)
{
    const double off[3] = { distance(form->q0[0] + x * form->q1[0], e->r),
                            distance(form->q0[1] + x * form->q1[1], e->g),
                            distance(form->q0[2] + x * form->q1[2], e->b) };
    return off[0] <= TRIP_CLOSED_FORM_ERROR && off[1] <= TRIP_CLOSED_FORM_ERROR &&
           off[2] <= TRIP_CLOSED_FORM_ERROR;
}

/* Returns whether the form fits every `step`th code of a range. `min` is 1 / D. */
static trip_closed_form_fault check(const trip_closed_form *form, const trip_tf_entry *table,
                                    int from, int to, int step, double min)
{
    const double *c = form->k;
    for (int code = from; code <= to; code += step) {
        const double position = form->scale * code + form->offset, x = position > 0 ? position : 0;
        const double k = table[code].extinction, is = c[0] + x * (c[1] + x * (c[2] + x * c[3]));
        if (!(distance(is, k) <= TRIP_CLOSED_FORM_ERROR * (k + min) && k <= MAX * min))
            return TRIP_CLOSED_FORM_EXTINCTION;
        if (k > 0 && !has_colour(form, &table[code], x))
            return TRIP_CLOSED_FORM_COLOUR;
    }
    return TRIP_CLOSED_FORM_FOUND;
}

trip_closed_form_fault trip_closed_form_find(trip_closed_form *form, const trip_tf_entry *table,
                                             unsigned min, unsigned max, double longest)
{
    const int from = (int)min, to = (int)max;
    span s;
    *form = (trip_closed_form){ .ramp = false };
    if (from > to || !find_span(table, from, to, &s))
        return TRIP_CLOSED_FORM_ENDS;
    if (s.last - s.first < FEWEST) {
        set_constant(form, table, &s);
    } else {
        if (!set_positions(form, table, &s))
            return TRIP_CLOSED_FORM_EXTINCTION;
        set_extinction(form, table, &s);
        set_colours(form, table, &s);
    }
    const int step = (to - from) / TRIED + 1;
    const trip_closed_form_fault fault = check(form, table, from, to, step, 1 / longest);
    return fault || step == 1 ? fault : check(form, table, from, to, 1, 1 / longest);
}
