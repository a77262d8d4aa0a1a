/* What a layer holds at a pixel, the same for all renderers. Each channel is composited as a colour
 * is, premultiplied by opacity: sum of alpha_i T_i v_i over the splats i of the layer, T_i being
 * what those in front of i let through. Layers are merged channel by channel with w^2 (equation 3
 * of Hofsetz, Max & Bastos 2008).
 *
 * Depth: the plane of a splat's depth z (camera.h) meets the ray of pixel p at the distance
 *     d(p) = max(0, z) |J r(p)|
 * from the eye, in parallel views from the eye's plane, in world units. z is one number a splat,
 * and |J r(p)| one a pixel, so that layers hold z as the camera of level 0 has it. The picture's
 * depth is |J r(p)| sum of alpha_i T_i z_i / sum of alpha_i T_i of the merged sums: the mean
 * distance of what is seen at p, weighted by how much is seen of it; the background is not among
 * it. Where nothing is seen it is +infinity. */
#ifndef TRIP_LAYER_H
#define TRIP_LAYER_H

#include "camera.h"
#include "settings.h"

typedef enum trip_channel {
    TRIP_CHANNEL_RED,
    TRIP_CHANNEL_GREEN,
    TRIP_CHANNEL_BLUE,
    TRIP_CHANNEL_ALPHA, /* v_i = 1 */
    TRIP_CHANNEL_DEPTH, /* v_i = z_i; in layers whose picture's depth is wanted */
    TRIP_CHANNELS_MAX,
} trip_channel;

/* How many a frame's layers have, the first ones. */
static inline unsigned trip_layer_channels(const trip_settings *s)
{
    return s->depth ? TRIP_CHANNELS_MAX : TRIP_CHANNEL_DEPTH;
}

/* Depths by the camera of a list times this are those by the camera of level 0. */
static inline double trip_layer_depth_unit(const trip_camera *list, const trip_camera *level0)
{
    double x = 0.5 * level0->width, y = 0.5 * level0->height;
    return trip_camera_ray_length(list, x, y) / trip_camera_ray_length(level0, x, y);
}

#endif
