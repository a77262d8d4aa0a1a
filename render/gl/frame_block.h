/* The constants of one list of a frame in the shaders' form (shared.h), and which of the shaders'
 * effects the frame needs. Pure functions. */
#ifndef TRIP_GL_FRAME_BLOCK_H
#define TRIP_GL_FRAME_BLOCK_H

#include <stdbool.h>

#include "gl/shared.h"
#include "renderer.h"

/* Effects compiled into a shader only when the scene or view needs them. */
enum trip_gl_effect {
    TRIP_GL_PARALLEL = 1,    /* parallel view */
    TRIP_GL_ANISOTROPIC = 2, /* not cubes: a voxel is not as long every way */
    TRIP_GL_SHADED = 4,
    TRIP_GL_HEADLIGHT = 8,
    TRIP_GL_INDEXED = 16,
    TRIP_GL_QUADS = 32,       /* two triangles a splat instead of a sprite */
    TRIP_GL_UNCULLED = 64,    /* every pixel has weight in the list */
    TRIP_GL_COMPACT = 128,    /* normals of 3 bytes; only where they are read */
    TRIP_GL_DEPTH = 256,      /* layers have depths (layer.h) */
    TRIP_GL_NEAR = 512,       /* some splats may be near (render/splat.h) */
    TRIP_GL_SUMMED = 1024,    /* splats are summed sheet by sheet */
    TRIP_GL_AFFINE = 2048,    /* footprints by the affine map at the centre (render/splat.h) */
    TRIP_GL_FLATTENED = 4096, /* kernels, along their gradients */
    TRIP_GL_WIDE = 8192,      /* values are interpolated from 64 voxels (render/kernel.h) */
    TRIP_GL_FIXED = 16384,    /* footprints of one size; AFFINE, too, in perspective */
    TRIP_GL_UNEVEN = 65536,   /* spacing is uneven */
    /* Of render/effects.h, for which shaders have the place of what they draw: */
    TRIP_GL_CUED = 32768,
    TRIP_GL_SHADOWS = 131072,
    TRIP_GL_OCCLUSION = 262144,
    TRIP_GL_EMISSION = 524288,
    TRIP_GL_PLACED = TRIP_GL_CUED | TRIP_GL_SHADOWS | TRIP_GL_OCCLUSION | TRIP_GL_EMISSION,
    TRIP_GL_CLOSED = 1048576, /* segments have a closed form (render/closed_form.h) */
    TRIP_GL_EFFECT_SETS = 2097152,
};

/* What a float leaves of a number. Volatile, as GCC 12 takes (double)(float)x for x where it works
 * on two at a time. */
static inline float trip_gl_frame_rest(double x)
{
    const volatile float rounded = (float)x;
    return (float)(x - (double)rounded);
}

/* Of a list that the plan draws. */
void trip_gl_frame_make(trip_gl_frame_double *out, const trip_frame *frame, const trip_list *list);
/* Of the layer of an axis. */
void trip_gl_frame_make_layer(trip_gl_frame_double *out, const trip_frame *frame, int axis);
void trip_gl_frame_round(trip_gl_frame_float *out, const trip_gl_frame_double *in);

/* Those of TRIP_GL_PLACED that the frame has. */
unsigned trip_gl_frame_placed(const trip_settings *settings);

/* The effects of a list viewed by `camera`, TRIP_GL_QUADS and TRIP_GL_NEAR aside. */
unsigned trip_gl_frame_effects(const trip_frame *frame, const trip_camera *camera, int axis);

/* By how many times voxels of uneven spacing are longer than others at most; 1 where it is even. */
double trip_gl_frame_ratio(const trip_coordinates *coordinates);

/* The depth (world units) from which on the part of a support that lies in the image fits a sprite
 * of the given size; 0 where every support does, infinity where none need. Here
 * and below `settings` have the widest kernel's radius, and kernels are up to `ratio` times as wide
 * as others, each along each axis. */
double trip_gl_frame_sprite_depth(const trip_settings *settings, const trip_camera *camera,
                                  double ratio, double point_size_px);

/* The depth (as z of the camera) from which on no splat that may show is near; infinity where any
 * may be. */
double trip_gl_frame_near_depth(const trip_settings *settings, const trip_camera *camera,
                                double ratio);

#endif
