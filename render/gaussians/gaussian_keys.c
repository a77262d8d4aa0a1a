#include "gaussian_keys.h"

#include <math.h>

#include "gaussian_picture.h"

static void put(double to[3], trip_vec3 v)
{
    to[0] = v.x;
    to[1] = v.y;
    to[2] = v.z;
}

static trip_gaussian_view view_of(const trip_camera *c)
{
    const trip_camera_params *p = &c->params;
    const trip_vec3 forward = trip_normalize(trip_sub(p->look, p->eye));
    const trip_vec3 right = trip_normalize(trip_cross(forward, p->up));
    const double half = c->ortho ? p->ortho_height / 2 : tan(p->fov_degrees * (M_PI / 360));
    trip_gaussian_view v = {
        .parallel = c->ortho,
        .half_width = half * c->width / c->height,
        .half_height = half,
        .width_px = (unsigned)c->width,
        .height_px = (unsigned)c->height,
    };
    put(v.eye, p->eye);
    put(v.right, right);
    put(v.down, trip_cross(forward, right));
    put(v.forward, forward);
    return v;
}

unsigned trip_gaussian_planes_of(const trip_camera *c, trip_gaussian_plane planes[])
{
    const trip_gaussian_view v = view_of(c);
    trip_gaussian_view_planes(&v, planes);
    trip_gaussian_plane *near = &planes[TRIP_GAUSSIAN_SIDES];
    *near = (trip_gaussian_plane){ .offset = c->ortho ? 0 : -0.99 * TRIP_GAUSSIAN_NEAR };
    for (int a = 0; a < 3; a++) {
        near->normal[a] = v.forward[a];
        near->offset -= v.forward[a] * v.eye[a];
    }
    return TRIP_GAUSSIAN_SIDES + 1;
}

trip_gaussian_key trip_gaussian_key_of_list(const trip_camera *c, int axis, int way)
{
    trip_gaussian_key key = { .offset = -way * trip_component(c->eye, axis) };
    key.direction[axis] = way;
    return key;
}

trip_gaussian_key trip_gaussian_key_of_depth(const trip_camera *c)
{
    trip_gaussian_key key = { .offset = -trip_dot(c->forward, c->eye) };
    put(key.direction, c->forward);
    return key;
}

trip_gaussian_lod trip_gaussian_lod_of(const trip_camera *c, double voxel_px)
{
    const trip_gaussian_view v = view_of(c);
    trip_gaussian_lod lod = { .voxel_px = voxel_px,
                              .eye = { v.eye[0], v.eye[1], v.eye[2] },
                              .parallel = c->ortho,
                              .px = c->height / (2 * v.half_height) };
    if (!c->ortho)
        lod.px *= sqrt(1 + v.half_width * v.half_width + v.half_height * v.half_height);
    return lod;
}
