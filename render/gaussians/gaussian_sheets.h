/* One pass of the order by sheets: composites slabs of space, perpendicular to an axis, into the
 * pixels with rays in one direction along the axis. Sheet n holds the coordinates from n to n + 1
 * times the thickness. Coordinates count in the direction of the rays.
 *
 * A Gaussian shares out its optical depth over the sheets that its ellipsoid reaches, widened by
 * the low-pass filter. The integral of its density along each pixel's ray decides
 * (gaussian_profile.h). The first and the last one also get the density before and behind. In
 * perspective, the first sheet is the eye's. A sheet sums its optical depths tau and colours c, so
 * no order inside it matters:
 *
 *     colour = sum(tau c) / sum(tau) (1 - exp(-sum(tau))),   T *= exp(-sum(tau))
 *
 * Pixels without weight in the list of the axis stay empty. A pixel stops once T is below
 * `early_termination`. The picture has the same bits for any number of threads, size of batches and
 * instruction set. One thread calls these functions; the runner lends others. */
#ifndef TRIP_GAUSSIAN_SHEETS_H
#define TRIP_GAUSSIAN_SHEETS_H

#include "budget.h"
#include "gaussian_picture.h"
#include "gaussian_tiles.h"
#include "settings.h"
#include "task_runner.h"

typedef struct trip_gaussian_sheets trip_gaussian_sheets;

typedef struct trip_gaussian_sheets_params {
    const trip_camera *camera;       /* outlives the pass */
    trip_gaussian_settings settings; /* the background is not drawn */
    const trip_settings *weights;    /* method and h; outlives the pass */
    int axis_of_view, axis, way;     /* way: 1 or -1, the direction of the rays */
    double thickness;                /* in units of the scene */
    size_t room;                     /* greatest number of Gaussians held at once */
    bool reference;                  /* draws in double precision, without threads */
    trip_budget *budget;
    trip_task_runner runner;
    const char *isa; /* NULL selects the widest instruction set */
} trip_gaussian_sheets_params;

/* Returns the greatest coordinate that a step draws, less its least. */
static inline double trip_gaussian_sheets_step(double thickness)
{
    return TRIP_SHEET_RUN * thickness;
}

/* Returns how far the low-pass filter widens Gaussians along an axis, in parallel views or at a
 * depth of 1. */
double trip_gaussian_sheets_spread(const trip_camera *c, int axis);

/* Returns the bytes that a pass takes from its budget. */
size_t trip_gaussian_sheets_bytes(const trip_gaussian_sheets_params *p);
/* Fails (reported) if the budget is too small. */
int trip_gaussian_sheets_begin(trip_gaussian_sheets **out, const trip_gaussian_sheets_params *p);
/* Adds Gaussians, in any order. A Gaussian that ends in a drawn sheet counts in the next
 * one. `count` may be at most the room that is left. */
int trip_gaussian_sheets_add(trip_gaussian_sheets *g, const trip_gaussian *gaussians, size_t count);
size_t trip_gaussian_sheets_room_left(const trip_gaussian_sheets *g);
/* Draws the next run of sheets that hold Gaussians, if it ends before a coordinate. All Gaussians
 * that reach into it must be added. Sets *drawn to whether there was one. */
int trip_gaussian_sheets_draw(trip_gaussian_sheets *g, double coordinate, bool *drawn);
/* Returns whether a pixel takes more. */
bool trip_gaussian_sheets_is_open(const trip_gaussian_sheets *g);
/* Adds w^2 times the pass, divided by the sum of the w^2 of all lists, to a picture of four floats
 * per pixel. With settings.depth it adds the depths, weighted by opacity too, to `depth`. */
void trip_gaussian_sheets_merge(const trip_gaussian_sheets *g, float *rgba, float *depth);
void trip_gaussian_sheets_end(trip_gaussian_sheets *g); /* NULL is allowed */

#endif
