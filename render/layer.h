/* The contents of a layer at a pixel, the same for all renderers. Each channel is composited like a
 * premultiplied colour: the sum of alpha_i T_i v_i over the splats i of the layer. T_i is the
 * transmittance of the splats in front of i. Layers are merged channel by channel with w^2
 * (equation 3 of Hofsetz, Max & Bastos 2008).
 *
 * Depth: the plane of a splat's depth z (camera.h) meets the ray of pixel p at the distance
 *     d(p) = max(0, z) |J r(p)|
 * from the eye, or from the eye's plane in parallel views, in world units. z is one number per
 * splat, and |J r(p)| one per pixel. So layers hold z, by the camera of level 0. The picture's
 * depth is |J r(p)| (sum of alpha_i T_i z_i) / (sum of alpha_i T_i) of the merged sums. This is the
 * mean distance of the visible parts at p, weighted by their visibility, without the background. It
 * is +infinity if nothing is visible. */
#ifndef TRIP_LAYER_H
#define TRIP_LAYER_H

#include "camera.h"
#include "settings.h"

typedef enum trip_channel {
    TRIP_CHANNEL_RED,
    TRIP_CHANNEL_GREEN,
    TRIP_CHANNEL_BLUE,
    TRIP_CHANNEL_ALPHA, /* v_i = 1 */
    TRIP_CHANNEL_DEPTH, /* v_i = z_i; only if depth is wanted */
    TRIP_CHANNELS_MAX,
} trip_channel;

/* Returns the number of channels of a frame's layers. */
static inline unsigned trip_layer_channels(const trip_settings *s)
{
    return s->depth ? TRIP_CHANNELS_MAX : TRIP_CHANNEL_DEPTH;
}

/* Returns the factor from depths of a list's camera to depths of level 0's camera. */
static inline double trip_layer_depth_unit(const trip_camera *list, const trip_camera *level0)
{
    double x = 0.5 * level0->width, y = 0.5 * level0->height;
    return trip_camera_ray_length(list, x, y) / trip_camera_ray_length(level0, x, y);
}

#endif
