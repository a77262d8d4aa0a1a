#include "point_colour.h"

#include <math.h>
#include <string.h>

#include "report.h"

static const struct {
    const char *name;
    unsigned attribute;
} colourings[] = {
    [TRIP_POINT_BY_RGB] = { "colours", TRIP_POINT_COLOUR },
    [TRIP_POINT_BY_INTENSITY] = { "intensities", TRIP_POINT_INTENSITY },
    [TRIP_POINT_BY_HEIGHT] = { "heights", 0 },
    [TRIP_POINT_BY_CLASSIFICATION] = { "classes", TRIP_POINT_CLASSIFICATION },
    [TRIP_POINT_BY_RETURN] = { "returns", TRIP_POINT_RETURNS },
    [TRIP_POINT_BY_TIME] = { "GPS times", TRIP_POINT_TIME },
    [TRIP_POINT_BY_DENSITY] = { "density", 0 },
};

/* The classes of LAS 1.4, table 17. Bytes: red, green, blue. Further classes have the last colour.
 */
static const unsigned char classes[][3] = {
    { 170, 170, 170 }, /* never classified */
    { 200, 200, 200 }, /* unclassified */
    { 166, 124, 82 },  /* ground */
    { 180, 220, 120 }, /* low vegetation */
    { 100, 180, 70 },  /* medium vegetation */
    { 30, 120, 40 },   /* high vegetation */
    { 220, 90, 60 },   /* building */
    { 255, 0, 255 },   /* low noise */
    { 120, 90, 160 },  /* model key */
    { 60, 120, 220 },  /* water */
    { 90, 70, 60 },    /* rail */
    { 80, 80, 90 },    /* road */
    { 235, 235, 150 }, /* overlap */
    { 250, 200, 60 },  /* wire guard */
    { 255, 160, 0 },   /* wire conductor */
    { 160, 60, 20 },   /* tower */
    { 200, 140, 90 },  /* connector */
    { 130, 130, 200 }, /* bridge */
    { 255, 0, 255 },   /* high noise */
    { 150, 200, 210 }, /* others */
};

int trip_point_choose_colouring(const trip_point_info *info, const char *path,
                                trip_point_colouring wanted, trip_point_colouring *out)
{
    *out = wanted;
    if (wanted == TRIP_POINT_BY_AUTO) {
        *out = info->attributes & TRIP_POINT_COLOUR      ? TRIP_POINT_BY_RGB
               : info->attributes & TRIP_POINT_INTENSITY ? TRIP_POINT_BY_INTENSITY
                                                         : TRIP_POINT_BY_HEIGHT;
        return 0;
    }
    const unsigned needed = colourings[wanted].attribute;
    return (info->attributes & needed) == needed
               ? 0
               : trip_fail(TRIP_USAGE, "brick", path,
                           "has no %s to color it by; `triptych info FILE` lists its attributes",
                           colourings[wanted].name);
}

void trip_point_note_colouring(const char *path, trip_point_colouring chosen)
{
    trip_note(path, "has no colours, and is drawn by its %s; --color selects others",
              colourings[chosen].name);
}

double trip_point_value(trip_point_colouring by, const trip_point *p, const double up[3])
{
    double height = 0;
    switch (by) {
    case TRIP_POINT_BY_INTENSITY:
        return (double)p->intensity;
    case TRIP_POINT_BY_HEIGHT:
        for (int a = 0; a < 3; a++)
            height += up[a] * p->position[a];
        return height;
    case TRIP_POINT_BY_CLASSIFICATION:
        return p->classification;
    case TRIP_POINT_BY_RETURN:
        return p->return_number;
    case TRIP_POINT_BY_TIME:
        return p->gps_time;
    default:
        return 0;
    }
}

int trip_point_palette_make(trip_point_palette *p, trip_point_colouring by, double lo, double hi)
{
    *p = (trip_point_palette){ .by = by, .lo = lo, .hi = hi };
    if (by != TRIP_POINT_BY_HEIGHT && by != TRIP_POINT_BY_RETURN && by != TRIP_POINT_BY_TIME &&
        by != TRIP_POINT_BY_DENSITY)
        return 0;
    const int status = trip_tf_load(&p->tf, "preset:viridis");
    if (status == 0)
        trip_tf_denormalise(p->tf, 0, 1);
    return status;
}

void trip_point_palette_colour(const trip_point_palette *p, double value, float rgb[3])
{
    enum { LAST = sizeof classes / sizeof *classes - 1 };
    const double span = p->hi - p->lo;
    const double part = span > 0 ? fmin(1, fmax(0, (value - p->lo) / span)) : 0.5;
    if (p->by == TRIP_POINT_BY_CLASSIFICATION) {
        const int class = value >= 0 && value < LAST ? (int)value : LAST;
        for (int c = 0; c < 3; c++)
            rgb[c] = (float)(classes[class][c] / 255.0);
    } else if (p->tf) {
        const trip_rgba found = trip_tf_evaluate(p->tf, part);
        rgb[0] = (float)found.r;
        rgb[1] = (float)found.g;
        rgb[2] = (float)found.b;
    } else {
        rgb[0] = rgb[1] = rgb[2] = (float)part;
    }
}

void trip_point_palette_free(trip_point_palette *p)
{
    trip_tf_destroy(p->tf);
    p->tf = NULL;
}
