#include "classes.h"

#include <math.h>

enum { COMPONENTS = 4 };

#define LINE_TOLERANCE 1e-3

static void get_components(const trip_tf_entry *e, double out[COMPONENTS])
{
    out[0] = e->r;
    out[1] = e->g;
    out[2] = e->b;
    out[3] = e->extinction;
}

/* Lines from a point that stay close to all points so far: slopes between these bounds. */
typedef struct cone {
    double from[COMPONENTS], least[COMPONENTS], most[COMPONENTS];
} cone;

static cone begin_cone(const trip_tf_entry *e)
{
    cone c;
    get_components(e, c.from);
    for (int i = 0; i < COMPONENTS; i++) {
        c.least[i] = -INFINITY;
        c.most[i] = INFINITY;
    }
    return c;
}

static bool cone_holds(const cone *c, const trip_tf_entry *e, double steps)
{
    double to[COMPONENTS];
    get_components(e, to);
    for (int i = 0; i < COMPONENTS; i++) {
        double slope = (to[i] - c->from[i]) / steps;
        if (slope < c->least[i] || slope > c->most[i])
            return false;
    }
    return true;
}

static void narrow_cone(cone *c, const trip_tf_entry *e, double steps,
                        const double tolerance[COMPONENTS])
{
    double to[COMPONENTS];
    get_components(e, to);
    for (int i = 0; i < COMPONENTS; i++) {
        c->least[i] = fmax(c->least[i], (to[i] - tolerance[i] - c->from[i]) / steps);
        c->most[i] = fmin(c->most[i], (to[i] + tolerance[i] - c->from[i]) / steps);
    }
}

static void find_knots(trip_classes *c, const double tolerance[COMPONENTS])
{
    unsigned from = 0;
    cone lines = begin_cone(&c->table[0]);
    c->knot_count = 0;
    for (unsigned code = 1; code < TRIP_CLASS_CODES; code++) {
        if (!cone_holds(&lines, &c->table[code], code - from)) {
            from = code - 1;
            c->knots[c->knot_count++] = from;
            lines = begin_cone(&c->table[from]);
        }
        narrow_cone(&lines, &c->table[code], code - from, tolerance);
    }
}

void trip_classes_make(trip_classes *c, const trip_tf_entry *table)
{
    double tolerance[COMPONENTS] = { 0 };
    uint32_t next = TRIP_CLASS_CODES;
    c->table = table;
    for (unsigned code = TRIP_CLASS_CODES; code-- > 0;) {
        double e[COMPONENTS];
        get_components(&table[code], e);
        for (int i = 0; i < COMPONENTS; i++)
            tolerance[i] = fmax(tolerance[i], LINE_TOLERANCE * e[i]);
        next = table[code].extinction > 0 ? code : next;
        c->next_visible[code] = next;
    }
    find_knots(c, tolerance);
}

static double clamp(double code)
{
    return fmin(TRIP_CLASS_CODES - 1, fmax(0, code));
}

bool trip_classes_visible(const trip_classes *c, double least, double most)
{
    return c->next_visible[(unsigned)clamp(least)] <= (unsigned)ceil(clamp(most));
}

size_t trip_classes_knot_above(const trip_classes *c, double code)
{
    size_t low = 0, high = c->knot_count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (c->knots[middle] > code)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

double trip_classes_at(const trip_classes *c, double code, double rgb[3])
{
    double at = clamp(code), here[COMPONENTS], next[COMPONENTS];
    unsigned i = (unsigned)at < TRIP_CLASS_CODES - 2 ? (unsigned)at : TRIP_CLASS_CODES - 2;
    double t = at - i;
    get_components(&c->table[i], here);
    get_components(&c->table[i + 1], next);
    for (int k = 0; k < COMPONENTS; k++)
        here[k] += t * (next[k] - here[k]);
    rgb[0] = here[0];
    rgb[1] = here[1];
    rgb[2] = here[2];
    return here[3];
}
