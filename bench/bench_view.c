#include "bench_view.h"

#include "framing.h"

static const double fov_degrees = 30, fill = 0.95, degree = 3.14159265358979323846 / 180;

/* The bounding box of all splats with their kernels in world space, and the axes of a view. */
typedef struct framing {
    trip_vec3 corners[8], middle;
    trip_vec3 right, up, view_direction; /* unit length */
} framing;

static void frame_box(framing *f, const session *s)
{
    const trip_view_object box = trip_view_object_of(s->data, s->text);
    for (int i = 0; i < 8; i++) {
        double corner[3];
        for (int a = 0; a < 3; a++)
            corner[a] = i >> a & 1 ? box.hi[a] + box.kernel_radius : box.lo[a] - box.kernel_radius;
        f->corners[i] =
            trip_affine_point(&s->data->index_to_world, trip_v3(corner[0], corner[1], corner[2]));
    }
    f->middle = trip_scale(trip_add(f->corners[0], f->corners[7]), 0.5);
}

/* Makes a view from directions in index space. */
static framing make_framing(const session *s, trip_vec3 view_direction, trip_vec3 up)
{
    framing f;
    frame_box(&f, s);
    f.view_direction = trip_normalize(trip_affine_vector(&s->data->index_to_world, view_direction));
    f.right = trip_normalize(
        trip_cross(f.view_direction, trip_affine_vector(&s->data->index_to_world, up)));
    f.up = trip_cross(f.right, f.view_direction);
    return f;
}

static trip_camera_params params(const framing *f, const int size[2], double distance)
{
    return (trip_camera_params){
        .eye = trip_sub(f->middle, trip_scale(f->view_direction, distance)),
        .look = f->middle,
        .up = f->up,
        .width = size[0],
        .height = size[1],
    };
}

/* Returns the distance from the middle at which a perspective view shows the whole box. */
static double distance_needed(const framing *f, const int size[2])
{
    double slope_y = fill * tan(fov_degrees * degree / 2), distance = 0;
    double slope_x = slope_y * size[0] / size[1];
    for (int i = 0; i < 8; i++) {
        trip_vec3 corner = trip_sub(f->corners[i], f->middle);
        double needed = fmax(fabs(trip_dot(corner, f->right)) / slope_x,
                             fabs(trip_dot(corner, f->up)) / slope_y);
        distance = fmax(distance, needed - trip_dot(corner, f->view_direction));
    }
    return distance;
}

trip_camera_params bench_view_oblique(const session *s, const int size[2])
{
    framing f = make_framing(s, trip_v3(-1, -1, -1), trip_v3(0, 0, 1));
    trip_camera_params view = params(&f, size, distance_needed(&f, size));
    view.fov_degrees = fov_degrees;
    return view;
}

static framing make_between(const session *s, double degrees)
{
    double angle = degrees * degree;
    return make_framing(s, trip_v3(-cos(angle), -sin(angle), -0.3), trip_v3(0, 0, 1));
}

trip_camera_params bench_view_between(const session *s, const int size[2], double degrees)
{
    framing f = make_between(s, degrees), middle = make_between(s, 45);
    trip_camera_params view = params(&f, size, distance_needed(&middle, size));
    view.fov_degrees = fov_degrees;
    return view;
}

trip_camera_params bench_view_lateral(const session *s, const int size[2])
{
    framing f = make_framing(s, trip_v3(0, 0, -1), trip_v3(0, 1, 0));
    double height = 0, distance = 0;
    for (int i = 0; i < 8; i++) {
        trip_vec3 corner = trip_sub(f.corners[i], f.middle);
        double needed =
            fmax(fabs(trip_dot(corner, f.right)) * size[1] / size[0], fabs(trip_dot(corner, f.up)));
        height = fmax(height, 2 * needed / fill);
        distance = fmax(distance, 2 * trip_length(corner));
    }
    trip_camera_params view = params(&f, size, distance);
    view.ortho_height = height;
    return view;
}

/* Makes the default view of `render`, turned around the up direction. */
static framing make_turned(const session *s, double azimuth_degrees)
{
    framing f;
    trip_found_view view;
    const trip_view_object box = trip_view_object_of(s->data, s->text);
    trip_view_find(
        &view, &(trip_view_settings){ .width = 1, .height = 1, .azimuth_degrees = azimuth_degrees },
        &box);
    frame_box(&f, s);
    f.view_direction = trip_normalize(trip_sub(view.params.look, view.params.eye));
    f.right = trip_normalize(trip_cross(f.view_direction, view.params.up));
    f.up = trip_cross(f.right, f.view_direction);
    return f;
}

trip_camera_params bench_view_round(const session *s, const int size[2], int index, int count)
{
    framing f;
    double distance = 0;
    for (int i = 0; i < count; i++) {
        f = make_turned(s, 360.0 * i / count);
        distance = fmax(distance, distance_needed(&f, size));
    }
    f = make_turned(s, 360.0 * index / count);
    trip_camera_params view = params(&f, size, distance);
    view.fov_degrees = fov_degrees;
    return view;
}
