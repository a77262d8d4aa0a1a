#include "classes.h"

#include <math.h>

enum { COMPONENTS = 4 };

#define KNOT_TOLERANCE 0.25

static void get_components(const trip_tf_entry *e, double out[COMPONENTS])
{
    out[0] = e->r;
    out[1] = e->g;
    out[2] = e->b;
    out[3] = e->extinction;
}

/* The lines from a point that stay close to all later points: bounds of their slopes. */
typedef struct cone {
    double from[COMPONENTS], min[COMPONENTS], max[COMPONENTS];
} cone;

static cone begin_cone(const trip_tf_entry *e)
{
    cone c;
    get_components(e, c.from);
    for (int i = 0; i < COMPONENTS; i++) {
        c.min[i] = -INFINITY;
        c.max[i] = INFINITY;
    }
    return c;
}

static bool cone_holds(const cone *c, const trip_tf_entry *e, double steps)
{
    double to[COMPONENTS];
    get_components(e, to);
    for (int i = 0; i < COMPONENTS; i++) {
        double slope = (to[i] - c->from[i]) / steps;
        if (slope < c->min[i] || slope > c->max[i])
            return false;
    }
    return true;
}

/* Maximum errors of the components. */
typedef struct slack {
    double colour, extinction;
} slack;

static slack slack_at(const trip_tf_entry *e, double voxel_world, double tolerance)
{
    double depth = e->extinction * voxel_world, min = KNOT_TOLERANCE * tolerance;
    return (slack){ .colour = depth < 1 ? min / depth : min,
                    .extinction = min * fmax(1, depth) / voxel_world };
}

static void narrow_cone(cone *c, const trip_tf_entry *e, double steps, slack s)
{
    double to[COMPONENTS];
    get_components(e, to);
    for (int i = 0; i < COMPONENTS; i++) {
        double off = i == 3 ? s.extinction : s.colour;
        c->min[i] = fmax(c->min[i], (to[i] - off - c->from[i]) / steps);
        c->max[i] = fmin(c->max[i], (to[i] + off - c->from[i]) / steps);
    }
}

static void find_knots(trip_classes *c, double voxel_world, double tolerance)
{
    unsigned from = 0;
    cone lines = begin_cone(&c->table[0]);
    c->knot_count = 0;
    for (unsigned code = 1; code < TRIP_CLASS_CODES; code++) {
        const trip_tf_entry *e = &c->table[code];
        if (!cone_holds(&lines, e, code - from)) {
            from = code - 1;
            c->knots[c->knot_count++] = (uint16_t)from;
            lines = begin_cone(&c->table[from]);
        }
        narrow_cone(&lines, e, code - from, slack_at(e, voxel_world, tolerance));
    }
}

static void count_knots(trip_classes *c)
{
    size_t count = 0;
    for (unsigned code = 0; code < TRIP_CLASS_CODES; code++) {
        while (count < c->knot_count && c->knots[count] <= code)
            count++;
        c->knots_up_to[code] = (uint16_t)count;
    }
}

void trip_classes_make(trip_classes *c, const trip_tf_entry *table, double voxel_world,
                       double tolerance)
{
    uint32_t next = TRIP_CLASS_CODES;
    c->table = table;
    for (unsigned code = TRIP_CLASS_CODES; code-- > 0;) {
        next = table[code].extinction > 0 ? code : next;
        c->next_visible[code] = next;
    }
    find_knots(c, voxel_world, tolerance);
    count_knots(c);
}

static double clamp(double code)
{
    const double last = TRIP_CLASS_CODES - 1;
    return code < 0 ? 0 : code > last ? last : code;
}

bool trip_classes_visible(const trip_classes *c, double min, double max)
{
    return c->next_visible[(unsigned)clamp(min)] < clamp(max) + 1;
}

size_t trip_classes_knot_above(const trip_classes *c, double code)
{
    return code < 0 ? 0 : c->knots_up_to[(unsigned)clamp(code)];
}

size_t trip_classes_knot_from(const trip_classes *c, double code)
{
    size_t above = trip_classes_knot_above(c, code);
    return above > 0 && c->knots[above - 1] == code ? above - 1 : above;
}

double trip_classes_at(const trip_classes *c, double code, double rgb[3])
{
    double at = clamp(code), here[COMPONENTS], next[COMPONENTS];
    unsigned i = (unsigned)at < TRIP_CLASS_CODES - 2 ? (unsigned)at : TRIP_CLASS_CODES - 2;
    double t = at - i;
    get_components(&c->table[i], here);
    get_components(&c->table[i + 1], next);
    for (int k = 0; k < 3; k++)
        rgb[k] = here[k] + t * (next[k] - here[k]);
    return here[3] + t * (next[3] - here[3]);
}
