#include "framing.h"

#define DEGREE (3.14159265358979323846 / 180)
#define DEFAULT_FOV_DEGREES 30.0
#define ISO_ELEVATION_DEGREES 35.264389682754654 /* of a cube's diagonal: atan(1 / sqrt(2)) */

typedef struct angles {
    double azimuth, elevation; /* degrees; 0, 0 is the front */
} angles;

static const angles view_angles[] = {
    [TRIP_VIEW_DEFAULT] = { 30, 20 }, [TRIP_VIEW_FRONT] = { 0, 0 },
    [TRIP_VIEW_BACK] = { 180, 0 },    [TRIP_VIEW_LEFT] = { 90, 0 },
    [TRIP_VIEW_RIGHT] = { -90, 0 },   [TRIP_VIEW_TOP] = { 0, 90 },
    [TRIP_VIEW_BOTTOM] = { 0, -90 },  [TRIP_VIEW_ISO] = { 45, ISO_ELEVATION_DEGREES },
};

/* The state of the fit, in world space relative to the origin. */
typedef struct fitting {
    const trip_camera_framing *f;
    const trip_affine *index_to_world;
    trip_reach_origin origin;
    trip_vec3 right, up, forward; /* of the picture, orthonormal: right x up = -forward */
    double sin_elevation, cos_elevation, sin_roll, cos_roll;
    double half[2]; /* half size of the area to fill, along right and up: tangents, or lengths in
                       parallel views */
} fitting;

/* Computes sine and cosine of an angle in degrees, exact at multiples of 90. */
static void sine_cosine(double degrees, double *sine, double *cosine)
{
    double quarters = round(degrees / 90), rest = (degrees - 90 * quarters) * DEGREE;
    int quarter = (int)fmod(fmod(quarters, 4) + 4, 4);
    const double s = sin(rest), c = cos(rest);
    const double sines[4] = { s, c, -s, -c };
    *sine = sines[quarter];
    *cosine = sines[(quarter + 1) % 4];
}

static trip_vec3 default_up(const trip_camera_framing *f)
{
    return trip_length(f->up) > 0 ? trip_normalize(f->up) : trip_v3(0, 0, 1);
}

/* Returns the given front, made perpendicular to up. The default is -y for up +z, and +z for up +y;
 * in both cases +x points to the viewer's right. */
static trip_vec3 level_front(const trip_camera_framing *f, trip_vec3 up)
{
    trip_vec3 right = trip_cross(up, trip_normalize(f->front));
    if (!(trip_length(right) > 1e-6))
        right = fabs(up.x) < 0.9 ? trip_v3(1, 0, 0) : trip_v3(0, 1, 0);
    return trip_normalize(trip_cross(right, up));
}

void trip_framing_set_up(trip_camera_framing *f, trip_vec3 up)
{
    trip_vec3 old = default_up(f), front = level_front(f, old);
    up = trip_normalize(up);
    if (!(trip_length(trip_cross(up, front)) > 1e-6))
        front = trip_scale(old, trip_dot(up, front) > 0 ? -1 : 1);
    f->up = up;
    f->front = front;
}

/* Computes the maximum values over the corners of the box. */
static int reach_of_box(const fitting *t, const trip_reach *wanted, int count, double *values)
{
    for (int i = 0; i < count; i++)
        values[i] = -INFINITY;
    for (int corner = 0; corner < 8; corner++) {
        const double *lo = t->f->lo, *hi = t->f->hi;
        trip_vec3 index = trip_v3(corner & 1 ? hi[0] : lo[0], corner & 2 ? hi[1] : lo[1],
                                  corner & 4 ? hi[2] : lo[2]);
        trip_vec3 p = trip_affine_vector(t->index_to_world, trip_sub(index, t->origin.index));
        double from_axis = trip_length(trip_cross(t->origin.axis, p));
        for (int i = 0; i < count; i++)
            values[i] =
                fmax(values[i], trip_dot(wanted[i].along, p) + wanted[i].around * from_axis);
    }
    return 0;
}

static int reach_of(const fitting *t, const trip_reach *wanted, int count, double *values)
{
    if (!t->f->reach)
        return reach_of_box(t, wanted, count, values);
    return t->f->reach(t->f->reach_user, &t->origin, wanted, count, values);
}

static trip_vec3 box_middle(const trip_camera_framing *f)
{
    return trip_v3(0.5 * f->lo[0] + 0.5 * f->hi[0], 0.5 * f->lo[1] + 0.5 * f->hi[1],
                   0.5 * f->lo[2] + 0.5 * f->hi[2]);
}

trip_vec3 trip_framing_middle(const trip_camera_framing *f, const trip_affine *index_to_world)
{
    return trip_affine_point(index_to_world, box_middle(f));
}

/* Computes the picture's axes for the view's side. */
static void set_axes(fitting *t, trip_vec3 up)
{
    const trip_camera_framing *f = t->f;
    double sine, cosine;
    trip_vec3 front = level_front(f, up), left = trip_cross(up, front);
    sine_cosine(view_angles[f->view].azimuth + f->azimuth_degrees, &sine, &cosine);
    trip_vec3 level = trip_add(trip_scale(front, cosine), trip_scale(left, sine));
    t->right = trip_cross(up, level);
    sine_cosine(view_angles[f->view].elevation + f->elevation_degrees, &sine, &cosine);
    t->sin_elevation = sine;
    t->cos_elevation = cosine;
    t->forward = trip_sub(trip_scale(level, -cosine), trip_scale(up, sine));
    t->up = trip_sub(trip_scale(up, cosine), trip_scale(level, sine));
}

/* A picture turned clockwise has its new up to the left of the old one. */
static void roll(fitting *t)
{
    sine_cosine(t->f->roll_degrees, &t->sin_roll, &t->cos_roll);
    trip_vec3 right = t->right, up = t->up;
    t->right = trip_add(trip_scale(right, t->cos_roll), trip_scale(up, t->sin_roll));
    t->up = trip_sub(trip_scale(up, t->cos_roll), trip_scale(right, t->sin_roll));
}

/* The fit along one axis of the picture: the visible centre of the object, and a minimum distance.
 * From this distance the object stays within the half angle with tangent `half`. A point at t along
 * the axis and d deeper than the origin satisfies |t - middle| <= half (distance + d). In a
 * parallel view half is 0, and the distance is the needed half height or width. */
typedef struct fit {
    double half, middle, distance;
} fit;

static fit fit_of(double half, double high, double low)
{
    return (fit){ half, 0.5 * (high - low), 0.5 * (high + low) / (half > 0 ? half : 1) };
}

static void want_fit(const fitting *t, trip_vec3 axis, double half, trip_reach wanted[2])
{
    trip_vec3 nearer = trip_scale(t->forward, -half);
    wanted[0] = (trip_reach){ .along = trip_add(axis, nearer) };
    wanted[1] = (trip_reach){ .along = trip_sub(nearer, axis) };
}

/* Moves the visible centre to the one for a larger `distance` than this axis needs. It is the
 * centre for the narrower half angle that would need this distance. While the same two points are
 * outermost, the distance is linear in 1 / half. */
static int fit_from(const fitting *t, trip_vec3 axis, double distance, fit *own)
{
    enum { STEPS = 8 };
    double slope = own->distance * own->half;
    for (int i = 0; i < STEPS && own->distance > 0; i++) {
        if (fabs(own->distance - distance) <= 1e-6 * distance)
            break;
        trip_reach wanted[2];
        double values[2], inverse = 1 / own->half + (distance - own->distance) / slope;
        if (!(inverse > 0 && isfinite(inverse))) /* as if one side were a pixel wide */
            break;
        want_fit(t, axis, 1 / inverse, wanted);
        int status = reach_of(t, wanted, 2, values);
        if (status)
            return status;
        const fit last = *own;
        *own = fit_of(1 / inverse, values[0], values[1]);
        slope = (own->distance - last.distance) / (inverse - 1 / last.half);
    }
    return 0;
}

/* Sets the point looked at, relative to the origin, and the eye's distance from it. */
static int fit_perspective(const fitting *t, trip_vec3 *look, double *distance)
{
    const trip_vec3 axes[2] = { t->right, t->up };
    trip_reach wanted[4];
    double v[4];
    want_fit(t, t->right, t->half[0], wanted);
    want_fit(t, t->up, t->half[1], wanted + 2);
    int status = reach_of(t, wanted, 4, v);
    if (status)
        return status;
    fit fits[2] = { fit_of(t->half[0], v[0], v[1]), fit_of(t->half[1], v[2], v[3]) };
    int tight = fits[1].distance > fits[0].distance;
    *distance = fits[tight].distance;
    status = fit_from(t, axes[!tight], *distance, &fits[!tight]);
    *look = trip_add(trip_scale(t->right, fits[0].middle), trip_scale(t->up, fits[1].middle));
    return status;
}

/* Places the eye of a parallel view in front of everything. */
static int fit_parallel(const fitting *t, trip_vec3 *look, double *distance, double *height)
{
    trip_reach wanted[6];
    double v[6];
    want_fit(t, t->right, 0, wanted);
    want_fit(t, t->up, 0, wanted + 2);
    wanted[4] = (trip_reach){ .along = t->forward };
    wanted[5] = (trip_reach){ .along = trip_scale(t->forward, -1) };
    int status = reach_of(t, wanted, 6, v);
    if (status)
        return status;
    fit x = fit_of(0, v[0], v[1]), y = fit_of(0, v[2], v[3]);
    *look = trip_add(trip_scale(t->right, x.middle), trip_scale(t->up, y.middle));
    *height = 2 * fmax(x.distance / t->half[0], y.distance / t->half[1]);
    *distance = v[5] + fmax(v[4] + v[5], x.distance + y.distance);
    return 0;
}

/* Returns the worst case of a point on a turning object. Let h be its height above the middle, r
 * its distance from the axis, and a its angle from the eye's side. Let e be the elevation. In
 * direction (qx, qy) of the upright picture the point appears at
 *     qx r sin a + qy (h cos e - r cos a sin e),
 * and r cos a cos e + h sin e nearer than the middle. It stays within half times its depth for all
 * a if
 *     distance >= h (sin e + qy cos e / half) + r sqrt((qx / half)^2 + (cos e - qy sin e / half)^2)
 * A parallel view has `half` 1 and no terms from the depth. */
static trip_reach turning(const fitting *t, trip_vec3 axis, double qx, double qy, double half)
{
    double e = t->sin_elevation, c = t->cos_elevation, depth = t->f->parallel ? 0 : 1;
    return (trip_reach){
        .along = trip_scale(axis, depth * e + qy * c / half),
        .around = hypot(qx / half, depth * c - qy * e / half),
    };
}

/* Moves the point looked at along the axis so that the margins above and below are equal. */
static int fit_turntable(const fitting *t, trip_vec3 *look, double *distance, double *height)
{
    const trip_vec3 axis = t->origin.axis;
    const double q[2][2] = { { t->cos_roll, t->sin_roll }, { -t->sin_roll, t->cos_roll } };
    trip_reach wanted[6];
    double v[6], needed = 0;
    for (int i = 0; i < 4; i++) {
        double sign = i % 2 ? -1 : 1;
        wanted[i] = turning(t, axis, sign * q[i / 2][0], sign * q[i / 2][1], t->half[i / 2]);
    }
    wanted[4] = (trip_reach){ .along = axis, .around = 1 };
    wanted[5] = (trip_reach){ .along = trip_scale(axis, -1), .around = 1 };
    int status = reach_of(t, wanted, 6, v);
    if (status)
        return status;
    int pair = fabs(q[1][1]) >= fabs(q[0][1]) ? 2 : 0;
    double per_shift = trip_dot(axis, trip_sub(wanted[pair].along, wanted[pair + 1].along));
    double shift = fabs(per_shift) > 1e-9 ? (v[pair] - v[pair + 1]) / per_shift : 0;
    for (int i = 0; i < 4; i++)
        needed = fmax(needed, v[i] - shift * trip_dot(axis, wanted[i].along));
    *look = trip_scale(axis, shift);
    *height = 2 * needed;
    *distance = t->f->parallel ? 2 * (v[4] + v[5]) : needed;
    return 0;
}

int trip_camera_frame(const trip_camera_framing *f, const trip_affine *index_to_world,
                      trip_camera_params *out)
{
    trip_vec3 up = default_up(f), look;
    double distance, height = 0, fov = f->fov_degrees > 0 ? f->fov_degrees : DEFAULT_FOV_DEGREES;
    fitting t = { .f = f, .index_to_world = index_to_world, .origin = { box_middle(f), up } };
    set_axes(&t, up);
    roll(&t);
    t.half[1] = TRIP_FRAMING_FILL * (f->parallel ? 1 : tan(fov / 2 * DEGREE));
    t.half[0] = t.half[1] * f->width / f->height;
    int status = f->turntable  ? fit_turntable(&t, &look, &distance, &height)
                 : f->parallel ? fit_parallel(&t, &look, &distance, &height)
                               : fit_perspective(&t, &look, &distance);
    if (status)
        return status;
    look = trip_add(trip_framing_middle(f, index_to_world), look);
    bool upright = t.sin_roll == 0 && t.cos_roll > 0 && t.cos_elevation > 1e-3;
    *out = (trip_camera_params){
        .eye = trip_sub(look, trip_scale(t.forward, distance)),
        .look = look,
        .up = upright ? up : t.up,
        .fov_degrees = fov,
        .ortho_height = !f->parallel          ? 0
                        : f->ortho_height > 0 ? f->ortho_height
                                              : height,
        .width = f->width,
        .height = f->height,
    };
    return 0;
}
