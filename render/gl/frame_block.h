/* Computes the constants of a list or a layer in the layout of the shaders (shared.h), and the
 * effects that a frame needs in its shaders. Pure functions. */
#ifndef TRIP_GL_FRAME_BLOCK_H
#define TRIP_GL_FRAME_BLOCK_H

#include <stdbool.h>

#include "gl/shared.h"
#include "renderer.h"

/* Features compiled into a shader only if the scene or the view needs them. The shaders see each as
 * a macro. */
enum trip_gl_effect {
    TRIP_GL_PARALLEL = 1,
    TRIP_GL_ANISOTROPIC = 2, /* voxels are not cubes */
    TRIP_GL_SHADED = 4,
    TRIP_GL_HEADLIGHT = 8,
    TRIP_GL_INDEXED = 16,
    TRIP_GL_QUADS = 32,       /* two triangles for each splat instead of a point sprite */
    TRIP_GL_UNCULLED = 64,    /* the list has weight at every pixel */
    TRIP_GL_COMPACT = 128,    /* 3-byte normals; set only if the shader reads normals */
    TRIP_GL_DEPTH = 256,      /* layers store depths (layer.h) */
    TRIP_GL_NEAR = 512,       /* some splats may be near (render/splat.h) */
    TRIP_GL_SUMMED = 1024,    /* splats of a sheet are summed before compositing */
    TRIP_GL_AFFINE = 2048,    /* footprints use the affine map at the centre (render/splat.h) */
    TRIP_GL_FLATTENED = 4096, /* kernels are flattened along gradients */
    TRIP_GL_WIDE = 8192,      /* values are interpolated from 64 voxels (render/kernel.h) */
    TRIP_GL_FIXED = 16384, /* footprints have one size; in perspective set together with AFFINE */
    TRIP_GL_UNEVEN = 65536,
    /* Effects of render/light/effects.h. The shader computes the position that it shades. */
    TRIP_GL_CUED = 32768,
    TRIP_GL_SHADOWS = 131072,
    TRIP_GL_OCCLUSION = 262144,
    TRIP_GL_EMISSION = 524288,
    TRIP_GL_PLACED = TRIP_GL_CUED | TRIP_GL_SHADOWS | TRIP_GL_OCCLUSION | TRIP_GL_EMISSION,
    TRIP_GL_CLOSED = 1048576,
    TRIP_GL_EXACT = 2097152,    /* post: sheets hold exact draw codes (draw_codes.h) */
    TRIP_GL_NEAREST = 4194304,  /* values and outlines of the nearest voxels (render/sheet.h) */
    TRIP_GL_RESIDENT = 8388608, /* with INDEXED: an array of vertices for each list, no indices */
    TRIP_GL_TWO_POINTS = 16777216, /* culls by trip_weight_of_two_points() */
    TRIP_GL_BLURRED = 33554432,    /* deviations blur the function (blurred_function.h) */
    TRIP_GL_CURVED = 67108864,     /* footprints of Gaussians may be curved (gaussian_tiles.h) */
    TRIP_GL_EFFECT_SETS = 134217728,
};

/* Returns x minus x rounded to float. The variable is volatile because GCC 12 replaces
 * (double)(float)x with x when it vectorises. */
static inline float trip_gl_frame_rest(double x)
{
    const volatile float rounded = (float)x;
    return (float)(x - (double)rounded);
}

/* Fills the constants of a list that the plan draws. */
void trip_gl_frame_make(trip_gl_frame_double *out, const trip_frame *frame, const trip_list *list);
/* Fills the constants of the layer of an axis. */
void trip_gl_frame_make_layer(trip_gl_frame_double *out, const trip_frame *frame, int axis);
void trip_gl_frame_round(trip_gl_frame_float *out, const trip_gl_frame_double *in);

/* Returns the bits of TRIP_GL_PLACED that the settings enable. */
unsigned trip_gl_frame_placed(const trip_settings *settings);

/* Returns the effects of a list viewed by `camera`, without TRIP_GL_QUADS and TRIP_GL_NEAR. */
unsigned trip_gl_frame_effects(const trip_frame *frame, const trip_camera *camera, int axis);

/* Returns the maximum ratio between two kernel widths; 1 for even spacing. */
double trip_gl_frame_ratio(const trip_coordinates *coordinates);

/* Returns the minimum depth, in world units, at which a point sprite of `point_size_px` pixels
 * covers the visible part of any support. Returns 0 if it always does, infinity if it may never.
 * `settings` holds the radius of the widest kernel; kernels differ in width by up to `ratio` along
 * each axis. */
double trip_gl_frame_sprite_depth(const trip_settings *settings, const trip_camera *camera,
                                  double ratio, double point_size_px);

/* Returns the depth (z of the camera) from which on no visible splat is near; infinity if there is
 * no such depth. `settings` and `ratio` are as for trip_gl_frame_sprite_depth(). */
double trip_gl_frame_near_depth(const trip_settings *settings, const trip_camera *camera,
                                double ratio);

#endif
