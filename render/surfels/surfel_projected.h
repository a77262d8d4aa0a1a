/* A surfel in the picture, in single precision: surfel_footprint.h for renderers that keep many.
 * The formulas are the same. Pure functions. */
#ifndef TRIP_SURFEL_PROJECTED_H
#define TRIP_SURFEL_PROJECTED_H

#include "pixels.h"
#include "surfel_footprint.h"

typedef struct trip_surfel_oval {
    float across, shear, down;
} trip_surfel_oval;

typedef struct trip_surfel_projected {
    float x, y;
    trip_surfel_oval blend, disc;
    float base, slope_x, slope_y, near, far;
    float tolerance, front;
    float mass;
    float rgb[3];
} trip_surfel_projected;

static inline trip_surfel_oval trip_surfel_oval_of(const trip_surfel_ellipse *e)
{
    return (trip_surfel_oval){ (float)e->across, (float)e->shear, (float)e->down };
}

/* The colour is left to the caller. */
static inline trip_surfel_projected trip_surfel_project(const trip_surfel_footprint *f)
{
    return (trip_surfel_projected){
        .x = (float)f->x,
        .y = (float)f->y,
        .blend = trip_surfel_oval_of(&f->blend),
        .disc = trip_surfel_oval_of(&f->disc),
        .base = (float)f->base,
        .slope_x = (float)f->slope_x,
        .slope_y = (float)f->slope_y,
        .near = (float)f->near,
        .far = (float)f->far,
        .tolerance = (float)f->tolerance,
        .front = (float)f->front,
        .mass = (float)f->mass,
    };
}

static inline float trip_surfel_oval_radius2(const trip_surfel_oval *e, float dx, float dy)
{
    const float u = e->across * (dx - e->shear * dy), v = e->down * dy;
    return u * u + v * v;
}

static inline float trip_surfel_projected_depth(const trip_surfel_projected *p, bool ortho,
                                                float dx, float dy)
{
    const float v = p->base + p->slope_x * dx + p->slope_y * dy;
    const float z = ortho ? v : v > 0 ? 1 / v : INFINITY;
    return z < p->near ? p->near : z > p->far ? p->far : z;
}

static inline float trip_surfel_oval_coverage(const trip_surfel_oval *e, float dx, float dy)
{
    const float rim = (float)TRIP_SURFEL_RIM;
    const float u = e->across * (dx - e->shear * dy), v = e->down * dy;
    const float gx = e->across * u, gy = e->down * v - e->across * e->shear * u;
    const float q = u * u + v * v, slope = sqrtf(gx * gx + gy * gy);
    const float inside = slope > 0 ? (sqrtf(q * rim) - q) / slope : sqrtf(rim) / e->across;
    return inside > 0 ? inside < 1 ? inside : 1 : 0;
}

static inline float trip_surfel_projected_weight(const trip_surfel_projected *p, float q)
{
    const float rest = 1 - q * (float)(1 / TRIP_SURFEL_REACH), square = rest * rest;
    return p->mass * square * square;
}

/* Returns the rows with squared radii up to `limit` about (x, y), and perhaps one more a side. */
static inline trip_pixels trip_surfel_rows(const trip_surfel_oval *e, float y, float limit,
                                           int height)
{
    const float half = sqrtf(limit) / e->down + 0.01f;
    return trip_pixels_within((double)(y - half), (double)(y + half), height);
}

/* Returns the columns of the row at dy with squared radii up to `limit`, and perhaps more. */
static inline trip_pixels trip_surfel_columns(const trip_surfel_oval *e, float x, float limit,
                                              float dy, int width)
{
    const float v = e->down * dy, rest = limit - v * v;
    const float half = sqrtf(rest > 0 ? rest : 0) / e->across + 0.01f;
    const float middle = x + e->shear * dy;
    return trip_pixels_within((double)(middle - half), (double)(middle + half), width);
}

#endif
