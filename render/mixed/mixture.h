/* The picture of volumes and Gaussian scenes together.
 *
 * Definition
 * ----------
 * World space is common to all objects. The space of an object is placed in it by a similarity. At
 * each pixel, light is composited along the ray, front to back:
 *
 * - A volume contributes its optical depth and its colour by its transfer function, at each point.
 *   Where volumes overlap, their optical depths add up, and so does the light that they emit.
 * - A Gaussian attenuates and emits at the view depth of its centre (gaussian_picture.h).
 *
 * Planes of equal view depth cut the picture into slabs. Renderers draw each volume once per slab.
 * Inside a slab, matter counts as evenly spread along each ray: its colour is one, and its optical
 * depth grows linearly with depth. The Gaussians of a slab are composited together, at the mean of
 * their depths at the pixel, weighted by how much each is seen. So:
 *
 * - The optical depth of a slab is exact, and so is a part of the ray with one volume alone.
 * - Evenly spread matter with Gaussians at one depth per slab is exact.
 * - Otherwise, matter moves by less than the depth of a slab.
 *
 * Only depths where two objects overlap are cut finely: into TRIP_MIXTURE_SLABS slabs in total.
 * Pure functions; the caller has the memory. */
#ifndef TRIP_MIXTURE_H
#define TRIP_MIXTURE_H

#include <stdbool.h>
#include <stddef.h>

#include "camera.h"

enum {
    TRIP_MIXTURE_SLABS = 48,
    TRIP_MIXTURE_VOLUMES_MAX = 16,
    TRIP_MIXTURE_CUTS_MAX = TRIP_MIXTURE_SLABS + 4 * (TRIP_MIXTURE_VOLUMES_MAX + 2)
};

/* View depths (camera.h) from lo to hi; empty unless lo < hi. */
typedef struct trip_depth_range {
    double lo, hi;
} trip_depth_range;

/* Returns the depths of a box in the camera's index space, in front of the eye. */
trip_depth_range trip_mixture_depths(const trip_camera *camera, const double lo[3],
                                     const double hi[3]);
/* Returns whether two ranges have more than a point in common. */
bool trip_mixture_meet(trip_depth_range a, trip_depth_range b);
/* Cuts the depths of volumes, in ascending order. Returns the number of cuts: one more than slabs,
 * or 0 if no volume is in front of the eye. `centres` are the depths of the Gaussians' centres. */
unsigned trip_mixture_cut(const trip_depth_range *volumes, unsigned count, trip_depth_range centres,
                          double cuts[TRIP_MIXTURE_CUTS_MAX]);

/* A pixel while slabs are composited. */
typedef struct trip_mixture_pixel {
    float rgb[3], transmittance; /* colour so far; transmittance of volumes alone */
    float light[3], tau;         /* of the slab: colour times optical depth, and optical depth */
    float before[4], depth;      /* the Gaussians so far, and the sum of their alpha times depth */
} trip_mixture_pixel;

/* Begins a picture. */
void trip_mixture_begin(trip_mixture_pixel *pixels, size_t count);
/* Adds the picture of one volume in the slab: premultiplied, without background. */
void trip_mixture_add(trip_mixture_pixel *pixels, const float *rgba, size_t count);
/* Composites the slab. `gaussians` is the picture of all Gaussians up to its end, without
 * background, and `distances` has their distances (layer.h); NULL if there are none. */
void trip_mixture_end_slab(trip_mixture_pixel *pixels, const trip_camera *camera,
                           trip_depth_range slab, const float *gaussians, const float *distances);
/* Writes the picture so far: premultiplied, without background. */
void trip_mixture_picture(const trip_mixture_pixel *pixels, size_t count, float *rgba);

#endif
