#include "camera.h"

#include "report.h"

#define PI 3.14159265358979323846

/* Orthonormal, right-handed with forward towards the scene: right x up = -forward. */
typedef struct basis {
    trip_vec3 right, up, forward;
} basis;

static bool finite3(trip_vec3 v)
{
    return isfinite(v.x) && isfinite(v.y) && isfinite(v.z);
}

static int check_params(const trip_camera_params *p)
{
    if (p->width < 1 || p->height < 1 || p->width > TRIP_PICTURE_MAX_PX ||
        p->height > TRIP_PICTURE_MAX_PX)
        return trip_fail(TRIP_USAGE, "camera", "size",
                         "%d x %d px is out of range; use 1 to %d px along each side", p->width,
                         p->height, TRIP_PICTURE_MAX_PX);
    if (!finite3(p->eye) || !finite3(p->look) || !finite3(p->up))
        return trip_fail(TRIP_USAGE, "camera", "eye, look, up",
                         "a coordinate is not a finite number");
    if (p->ortho_height != 0 && !(isfinite(p->ortho_height) && p->ortho_height > 0))
        return trip_fail(TRIP_USAGE, "camera", "ortho height",
                         "%g is not a positive length; use a number above 0", p->ortho_height);
    if (p->ortho_height == 0 && !(p->fov_degrees > 0 && p->fov_degrees < 180))
        return trip_fail(TRIP_USAGE, "camera", "fov", "%g is not between 0 and 180 degrees",
                         p->fov_degrees);
    return 0;
}

static int make_basis(const trip_camera_params *p, basis *b)
{
    trip_vec3 view_direction = trip_sub(p->look, p->eye);
    if (!(trip_length(view_direction) > 0 && isfinite(trip_length(view_direction))))
        return trip_fail(TRIP_USAGE, "camera", "look",
                         "the point looked at must differ from the eye");
    b->forward = trip_normalize(view_direction);
    trip_vec3 right = trip_cross(b->forward, trip_normalize(p->up));
    if (!(trip_length(right) > 1e-9))
        return trip_fail(TRIP_USAGE, "camera", "up",
                         "is zero or parallel to the view direction; use another up vector");
    b->right = trip_normalize(right);
    b->up = trip_cross(b->right, b->forward);
    return 0;
}

/* Returns the world units per pixel at depth 1 in perspective, and everywhere in parallel views. */
static double pixel_size(const trip_camera_params *p)
{
    if (p->ortho_height > 0)
        return p->ortho_height / p->height;
    return 2 * tan(p->fov_degrees * (PI / 360)) / p->height;
}

/* Snaps a direction to a grid axis if only rounding separates them. Otherwise an invisible list of
 * weight 1e-9 would be read. */
static double without_rounding(double component, trip_vec3 v)
{
    double max = fmax(fabs(v.x), fmax(fabs(v.y), fabs(v.z)));
    return fabs(component) > 1e-9 * max ? component : 0;
}

/* Returns the power of two that scales a length into [sqrt(1/2), sqrt(2)); 1 for a length of 1 with
 * rounding error. */
static double power_of_two_for(double length)
{
    int exponent;
    frexp(length * sqrt(2), &exponent);
    return ldexp(1, 1 - exponent);
}

/* Computes differences from the first voxel first: far from the world's origin they are exact, but
 * products are not. Returns the scale of the directions. In parallel views rx and ry are lengths
 * and are not scaled. */
static double set_rays(trip_camera *c, const basis *b, const trip_affine *world_to_index, double k)
{
    const double(*m)[4] = c->index_to_world.m;
    trip_vec3 first_voxel = trip_v3(m[0][3], m[1][3], m[2][3]);
    trip_vec3 corner =
        trip_add(trip_scale(b->right, -0.5 * c->width * k), trip_scale(b->up, 0.5 * c->height * k));
    trip_vec3 eye = trip_sub(c->params.eye, first_voxel), r0 = b->forward;
    if (c->ortho)
        eye = trip_add(eye, corner);
    else
        r0 = trip_add(r0, corner);
    double scale = power_of_two_for(trip_length(trip_affine_vector(world_to_index, b->forward)));
    double across = c->ortho ? 1 : scale;
    c->eye = trip_affine_vector(world_to_index, eye);
    c->r0 = trip_scale(trip_affine_vector(world_to_index, r0), scale);
    if (c->ortho)
        c->r0 = trip_v3(without_rounding(c->r0.x, c->r0), without_rounding(c->r0.y, c->r0),
                        without_rounding(c->r0.z, c->r0));
    c->rx = trip_scale(trip_affine_vector(world_to_index, trip_scale(b->right, k)), across);
    c->ry = trip_scale(trip_affine_vector(world_to_index, trip_scale(b->up, -k)), across);
    return scale;
}

/* The inverse of set_rays(), computed from the same world-space basis, not by inversion. A depth is
 * a world distance divided by `scale`, and so is to_x . c in perspective. */
static void set_projection(trip_camera *c, const basis *b, double k, double scale)
{
    trip_vec3 x = trip_scale(b->right, 1 / k), y = trip_scale(b->up, -1 / k);
    if (!c->ortho) {
        x = trip_add(x, trip_scale(b->forward, 0.5 * c->width));
        y = trip_add(y, trip_scale(b->forward, 0.5 * c->height));
    }
    double across = c->ortho ? 1 : 1 / scale;
    c->forward =
        trip_scale(trip_affine_transpose_vector(&c->index_to_world, b->forward), 1 / scale);
    c->to_x = trip_scale(trip_affine_transpose_vector(&c->index_to_world, x), across);
    c->to_y = trip_scale(trip_affine_transpose_vector(&c->index_to_world, y), across);
}

static int check_voxel(const trip_affine *m)
{
    for (int a = 0; a < 3; a++) {
        double length = trip_length(trip_v3(m->m[0][a], m->m[1][a], m->m[2][a]));
        if (!(length >= TRIP_VOXEL_WORLD_MIN && length <= TRIP_VOXEL_WORLD_MAX))
            return trip_fail(
                TRIP_USAGE, "camera", "index to world",
                "voxels are %.3g world units long; scale the volume to lengths of %g to %g", length,
                TRIP_VOXEL_WORLD_MIN, TRIP_VOXEL_WORLD_MAX);
    }
    return 0;
}

/* Fails if a number is outside the range that the renderers can compute with. NaN fails too. */
static int check_range(const trip_camera *c)
{
    double far = trip_length(c->eye), x = trip_length(c->rx), y = trip_length(c->ry);
    const double max = TRIP_CAMERA_PIXEL_VOXELS;
    if (!(x >= 1 / max && y >= 1 / max && x <= max && y <= max))
        return trip_fail(TRIP_USAGE, "camera", c->ortho ? "ortho height" : "fov",
                         "a pixel is %.3g x %.3g voxels; change the view to make it %.3g to %.3g",
                         x, y, 1 / max, max);
    if (!(far <= TRIP_CAMERA_FARTHEST_VOXELS))
        return trip_fail(TRIP_USAGE, "camera", "eye",
                         "lies %.3g voxels from the first voxel; move it within %.3g voxels", far,
                         TRIP_CAMERA_FARTHEST_VOXELS);
    return 0;
}

int trip_camera_make(trip_camera *c, const trip_camera_params *params,
                     const trip_affine *index_to_world)
{
    trip_affine world_to_index;
    basis b = { 0 };
    int status = check_params(params);
    if (!status)
        status = make_basis(params, &b);
    if (!status)
        status = check_voxel(index_to_world);
    if (status)
        return status;
    if (!trip_affine_invert(index_to_world, &world_to_index))
        return trip_fail(TRIP_ERROR, "camera", "index to world",
                         "the map from index space to world space is singular");

    double k = pixel_size(params);
    *c = (trip_camera){
        .params = *params,
        .width = params->width,
        .height = params->height,
        .ortho = params->ortho_height > 0,
        .index_to_world = *index_to_world,
        .voxel_world = cbrt(fabs(trip_affine_determinant(index_to_world))),
        .world_forward = b.forward,
    };
    set_projection(c, &b, k, set_rays(c, &b, &world_to_index, k));
    return check_range(c);
}

trip_camera_params trip_camera_turn(const trip_camera_params *view, trip_vec3 axis, double degrees)
{
    trip_camera_params p = *view;
    double angle = degrees * (PI / 180);
    axis = trip_normalize(axis);
    p.eye = trip_add(view->look, trip_turned(trip_sub(view->eye, view->look), axis, angle));
    p.up = trip_turned(view->up, axis, angle);
    return p;
}

trip_vec3 trip_camera_direction(const trip_camera *c, double left, double up, double front)
{
    basis b;
    if (make_basis(&c->params, &b) < 0) /* not for the view of a camera */
        return trip_v3(0, 0, 0);
    return trip_add(trip_scale(b.right, -left),
                    trip_add(trip_scale(b.up, up), trip_scale(b.forward, -front)));
}
