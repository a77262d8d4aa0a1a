#include "framing.h"

#include "report.h"
#include "settings.h"

#define DEGREE (3.14159265358979323846 / 180)
#define DEFAULT_FOV_DEGREES 30.0
#define ISO_ELEVATION_DEGREES 35.264389682754654 /* of a cube's diagonal: atan(1 / sqrt(2)) */

typedef struct angles {
    double azimuth, elevation; /* degrees; 0, 0 is the front */
} angles;

static const angles side_angles[] = {
    [TRIP_SIDE_DEFAULT] = { 30, 20 }, [TRIP_SIDE_FRONT] = { 0, 0 },
    [TRIP_SIDE_BACK] = { 180, 0 },    [TRIP_SIDE_LEFT] = { 90, 0 },
    [TRIP_SIDE_RIGHT] = { -90, 0 },   [TRIP_SIDE_TOP] = { 0, 90 },
    [TRIP_SIDE_BOTTOM] = { 0, -90 },  [TRIP_SIDE_ISO] = { 45, ISO_ELEVATION_DEGREES },
};

/* The state of the steps. Each step sets its part from the parts above. */
typedef struct finding {
    const trip_view_settings *s;
    const trip_affine *map; /* from index space to world space */

    trip_vec3 axis, front; /* up and front of the object; a zero front selects the default */
    trip_side side;

    trip_vec3 right, up, forward; /* of the picture, orthonormal: right x up = -forward */
    double sin_elevation, cos_elevation, sin_roll, cos_roll;

    double lo[3], hi[3];      /* index-space box around the part to fit */
    trip_reach_origin origin; /* the centre of the box, and up of the object */
    trip_visible *visible;    /* NULL: the box is the part to fit */

    bool parallel;
    double half[2]; /* half size of the area to fill, along right and up: tangents, or lengths in
                       parallel views */
} finding;

static trip_vec3 vector(const double v[3])
{
    return trip_v3(v[0], v[1], v[2]);
}

/* ---- object ---- */

/* A single slice has rows and columns. Other grids have neither. */
static void set_slice(trip_view_object *o, const trip_dataset *d)
{
    int axis = -1, singles = 0;
    for (int a = 0; a < 3; a++)
        if (d->header.dims[a] == 1) {
            axis = a;
            singles++;
        }
    if (singles != 1)
        return;
    o->row =
        trip_affine_vector(&o->index_to_world, axis == 0 ? trip_v3(0, 1, 0) : trip_v3(1, 0, 0));
    o->column =
        trip_affine_vector(&o->index_to_world, axis == 2 ? trip_v3(0, 1, 0) : trip_v3(0, 0, 1));
}

trip_view_object trip_view_object_of(const trip_dataset *d, const trip_dataset_metadata *text)
{
    trip_view_object o = { .index_to_world = d->index_to_world,
                           .kernel_radius = TRIP_KERNEL_RADIUS_VOXELS };
    trip_dataset_kept_bounds(d, o.lo, o.hi);
    for (int a = 0; a < 3; a++) {
        o.lo[a] = trip_coordinates_position(&d->coordinates, a, o.lo[a]);
        o.hi[a] = trip_coordinates_position(&d->coordinates, a, o.hi[a]);
    }
    trip_dataset_metadata_orient(text, d, &o.up, &o.front);
    set_slice(&o, d);
    return o;
}

/* ---- orientation ---- */

/* Returns the given front, made perpendicular to up. The default is -y for up +z, and +z for up +y;
 * in both cases +x points to the viewer's right. */
static trip_vec3 level_front(trip_vec3 front, trip_vec3 up)
{
    trip_vec3 right = trip_cross(up, trip_normalize(front));
    if (!(trip_length(right) > 1e-6))
        right = fabs(up.x) < 0.9 ? trip_v3(1, 0, 0) : trip_v3(0, 1, 0);
    return trip_normalize(trip_cross(right, up));
}

/* Tips the object so that another of its directions is up, while its front keeps facing the viewer.
 * If the front becomes parallel to up, the object's former bottom or top faces the viewer. */
static void tip(finding *f, trip_vec3 up)
{
    trip_vec3 old = f->axis, front = level_front(f->front, old);
    up = trip_normalize(up);
    if (!(trip_length(trip_cross(up, front)) > 1e-6))
        front = trip_scale(old, trip_dot(up, front) > 0 ? -1 : 1);
    f->axis = up;
    f->front = front;
}

/* A single slice faces the viewer like a picture. Rows run from left to right. The other axis
 * points up or down, whichever is closer to the object's up direction, or else to its front. */
static void face_slice(finding *f, const trip_view_object *o)
{
    const trip_vec3 front = trip_length(o->front) > 0 ? o->front : trip_v3(0, -1, 0);
    const double rises = trip_dot(trip_normalize(o->column), f->axis);
    const bool down = (fabs(rises) > 0.5 ? rises : trip_dot(o->column, front)) < 0;
    const trip_vec3 up = down ? trip_scale(o->column, -1) : o->column;
    f->axis = trip_normalize(up);
    f->front = trip_normalize(trip_cross(o->row, up));
    f->side = TRIP_SIDE_FRONT;
}

static void orient(finding *f, const trip_view_object *o)
{
    f->axis = trip_length(o->up) > 0 ? trip_normalize(o->up) : trip_v3(0, 0, 1);
    f->front = o->front;
    f->side = f->s->side;
    if (f->s->up)
        tip(f, vector(f->s->up));
    else if (trip_length(o->row) > 0 && f->side == TRIP_SIDE_DEFAULT)
        face_slice(f, o);
    f->origin.axis = trip_normalize(f->axis);
}

/* ---- directions ---- */

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

/* Computes the picture's axes for the view's side. A picture turned clockwise has its new up to the
 * left of the old one. */
static void set_directions(finding *f)
{
    const trip_view_settings *s = f->s;
    const angles side = side_angles[f->side];
    const trip_vec3 axis = f->origin.axis, front = level_front(f->front, axis);
    double sine, cosine;
    sine_cosine(side.azimuth + s->azimuth_degrees, &sine, &cosine);
    const trip_vec3 level =
        trip_add(trip_scale(front, cosine), trip_scale(trip_cross(axis, front), sine));
    sine_cosine(side.elevation + s->elevation_degrees, &sine, &cosine);
    sine_cosine(s->roll_degrees, &f->sin_roll, &f->cos_roll);
    const trip_vec3 right = trip_cross(axis, level);
    const trip_vec3 up = trip_sub(trip_scale(axis, cosine), trip_scale(level, sine));
    f->sin_elevation = sine;
    f->cos_elevation = cosine;
    f->forward = trip_sub(trip_scale(level, -cosine), trip_scale(axis, sine));
    f->right = trip_add(trip_scale(right, f->cos_roll), trip_scale(up, f->sin_roll));
    f->up = trip_sub(trip_scale(up, f->cos_roll), trip_scale(right, f->sin_roll));
}

/* ---- extent ---- */

/* Returns the radius of a splat that must be inside the picture. It is half of the kernel radius,
 * since the splat is faint beyond, and the margin holds the rest. For small objects the margin is
 * too narrow, so the radius is larger. */
static double kernel_that_counts(const finding *f, double radius)
{
    const double margin = (1 - TRIP_FRAMING_FILL) / 2;
    double voxels = INFINITY;
    for (int a = 0; a < 3; a++)
        voxels = fmin(voxels, f->hi[a] - f->lo[a]);
    return fmax(radius / 2, radius - margin * voxels);
}

/* Sets the box around the part to fit: of the visible voxels, or of all splats. */
static int find_box(finding *f, const trip_view_object *o)
{
    int status = 0;
    const double kernel = o->visible ? 0 : o->kernel_radius;
    for (int a = 0; a < 3; a++) {
        f->lo[a] = o->lo[a] - kernel;
        f->hi[a] = o->hi[a] + kernel;
    }
    if (o->visible) {
        trip_visible_start(o->visible, o->lo, o->hi);
        status = trip_visible_bounds(o->visible, f->lo, f->hi);
        o->visible->kernel_radius = kernel_that_counts(f, o->kernel_radius);
    }
    const double *lo = f->lo, *hi = f->hi;
    f->origin.index =
        trip_v3(0.5 * lo[0] + 0.5 * hi[0], 0.5 * lo[1] + 0.5 * hi[1], 0.5 * lo[2] + 0.5 * hi[2]);
    return status;
}

/* Computes the maximum values over the corners of the box. */
static int reach_of_box(const finding *f, const trip_reach *wanted, int count, double *values)
{
    for (int i = 0; i < count; i++)
        values[i] = -INFINITY;
    for (int corner = 0; corner < 8; corner++) {
        const double *lo = f->lo, *hi = f->hi;
        trip_vec3 index = trip_v3(corner & 1 ? hi[0] : lo[0], corner & 2 ? hi[1] : lo[1],
                                  corner & 4 ? hi[2] : lo[2]);
        trip_vec3 p = trip_affine_vector(f->map, trip_sub(index, f->origin.index));
        double from_axis = trip_length(trip_cross(f->origin.axis, p));
        for (int i = 0; i < count; i++)
            values[i] =
                fmax(values[i], trip_dot(wanted[i].along, p) + wanted[i].around * from_axis);
    }
    return 0;
}

static int reach_of(const finding *f, const trip_reach *wanted, int count, double *values)
{
    if (!f->visible)
        return reach_of_box(f, wanted, count, values);
    return trip_visible_reach(f->visible, &f->origin, wanted, count, values);
}

/* ---- framing ---- */

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

static void want_fit(const finding *f, trip_vec3 axis, double half, trip_reach wanted[2])
{
    trip_vec3 nearer = trip_scale(f->forward, -half);
    wanted[0] = (trip_reach){ .along = trip_add(axis, nearer) };
    wanted[1] = (trip_reach){ .along = trip_sub(nearer, axis) };
}

/* Moves the visible centre to the one for a larger `distance` than this axis needs. It is the
 * centre for the narrower half angle that would need this distance. While the same two points are
 * outermost, the distance is linear in 1 / half. */
static int fit_from(const finding *f, trip_vec3 axis, double distance, fit *own)
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
        want_fit(f, axis, 1 / inverse, wanted);
        int status = reach_of(f, wanted, 2, values);
        if (status)
            return status;
        const fit last = *own;
        *own = fit_of(1 / inverse, values[0], values[1]);
        slope = (own->distance - last.distance) / (inverse - 1 / last.half);
    }
    return 0;
}

/* Sets the point looked at, relative to the origin, and the eye's distance from it. */
static int fit_perspective(const finding *f, trip_vec3 *look, double *distance)
{
    const trip_vec3 axes[2] = { f->right, f->up };
    trip_reach wanted[4];
    double v[4];
    want_fit(f, f->right, f->half[0], wanted);
    want_fit(f, f->up, f->half[1], wanted + 2);
    int status = reach_of(f, wanted, 4, v);
    if (status)
        return status;
    fit fits[2] = { fit_of(f->half[0], v[0], v[1]), fit_of(f->half[1], v[2], v[3]) };
    int tight = fits[1].distance > fits[0].distance;
    *distance = fits[tight].distance;
    status = fit_from(f, axes[!tight], *distance, &fits[!tight]);
    *look = trip_add(trip_scale(f->right, fits[0].middle), trip_scale(f->up, fits[1].middle));
    return status;
}

/* Places the eye of a parallel view in front of everything. */
static int fit_parallel(const finding *f, trip_vec3 *look, double *distance, double *height)
{
    trip_reach wanted[6];
    double v[6];
    want_fit(f, f->right, 0, wanted);
    want_fit(f, f->up, 0, wanted + 2);
    wanted[4] = (trip_reach){ .along = f->forward };
    wanted[5] = (trip_reach){ .along = trip_scale(f->forward, -1) };
    int status = reach_of(f, wanted, 6, v);
    if (status)
        return status;
    fit x = fit_of(0, v[0], v[1]), y = fit_of(0, v[2], v[3]);
    *look = trip_add(trip_scale(f->right, x.middle), trip_scale(f->up, y.middle));
    *height = 2 * fmax(x.distance / f->half[0], y.distance / f->half[1]);
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
static trip_reach turning(const finding *f, trip_vec3 axis, double qx, double qy, double half)
{
    double e = f->sin_elevation, c = f->cos_elevation, depth = f->parallel ? 0 : 1;
    return (trip_reach){
        .along = trip_scale(axis, depth * e + qy * c / half),
        .around = hypot(qx / half, depth * c - qy * e / half),
    };
}

/* Moves the point looked at along the axis so that the margins above and below are equal. */
static int fit_turntable(const finding *f, trip_vec3 *look, double *distance, double *height)
{
    const trip_vec3 axis = f->origin.axis;
    const double q[2][2] = { { f->cos_roll, f->sin_roll }, { -f->sin_roll, f->cos_roll } };
    trip_reach wanted[6];
    double v[6], needed = 0;
    for (int i = 0; i < 4; i++) {
        double sign = i % 2 ? -1 : 1;
        wanted[i] = turning(f, axis, sign * q[i / 2][0], sign * q[i / 2][1], f->half[i / 2]);
    }
    wanted[4] = (trip_reach){ .along = axis, .around = 1 };
    wanted[5] = (trip_reach){ .along = trip_scale(axis, -1), .around = 1 };
    int status = reach_of(f, wanted, 6, v);
    if (status)
        return status;
    int pair = fabs(q[1][1]) >= fabs(q[0][1]) ? 2 : 0;
    double per_shift = trip_dot(axis, trip_sub(wanted[pair].along, wanted[pair + 1].along));
    double shift = fabs(per_shift) > 1e-9 ? (v[pair] - v[pair + 1]) / per_shift : 0;
    for (int i = 0; i < 4; i++)
        needed = fmax(needed, v[i] - shift * trip_dot(axis, wanted[i].along));
    *look = trip_scale(axis, shift);
    *height = 2 * needed;
    *distance = f->parallel ? 2 * (v[4] + v[5]) : needed;
    return 0;
}

/* Frames the part to fit, in the directions of the picture. */
static int frame(const finding *f, trip_camera_params *out)
{
    trip_vec3 look;
    double distance, height = 0;
    int status = f->s->turntable ? fit_turntable(f, &look, &distance, &height)
                 : f->parallel   ? fit_parallel(f, &look, &distance, &height)
                                 : fit_perspective(f, &look, &distance);
    if (status)
        return status;
    look = trip_add(trip_affine_point(f->map, f->origin.index), look);
    bool upright = f->sin_roll == 0 && f->cos_roll > 0 && f->cos_elevation > 1e-3;
    out->eye = trip_sub(look, trip_scale(f->forward, distance));
    out->look = look;
    out->up = upright ? f->origin.axis : f->up;
    out->ortho_height = f->parallel ? height : 0;
    return 0;
}

/* Frames the visible part. A turntable has no outline, since one framing serves all its pictures.
 */
static int frame_visible(finding *f, trip_visible *visible, trip_camera_params *out)
{
    int status = visible && !f->s->turntable ? trip_visible_outline(visible) : 0;
    f->visible = visible;
    return status ? status : frame(f, out);
}

/* Moves the framed view to a given point looked at, and sets a given height. */
static int find_framed(finding *f, trip_visible *visible, trip_camera_params *out)
{
    const trip_view_settings *s = f->s;
    f->half[1] = TRIP_FRAMING_FILL * (f->parallel ? 1 : tan(out->fov_degrees / 2 * DEGREE));
    f->half[0] = f->half[1] * s->width / s->height;
    int status = frame_visible(f, visible, out);
    if (!status && s->look) {
        out->eye = trip_add(vector(s->look), trip_sub(out->eye, out->look));
        out->look = vector(s->look);
    }
    if (s->ortho_height > 0)
        out->ortho_height = s->ortho_height;
    return status;
}

/* Looks from a given eye, towards a given point or the middle. */
static void look_from_eye(const finding *f, trip_camera_params *out)
{
    const trip_view_settings *s = f->s;
    out->eye = vector(s->eye);
    out->look = s->look ? vector(s->look) : trip_affine_point(f->map, f->origin.index);
    out->up = s->up ? vector(s->up) : f->axis;
    out->ortho_height = s->ortho_height;
    const trip_vec3 view_direction = trip_sub(out->look, out->eye);
    /* replaces a default up direction that is parallel to the view direction */
    if (!s->up && trip_length(trip_cross(trip_normalize(view_direction), out->up)) < 1e-6)
        out->up = fabs(out->up.z) > 0.5 ? trip_v3(0, 1, 0) : trip_v3(0, 0, 1);
    if (s->roll_degrees != 0)
        out->up = trip_camera_turn(out, view_direction, -s->roll_degrees).up;
}

/* ---- lens ---- */

/* Zooms as with another lens: the eye stays in its position. */
static int zoom(trip_camera_params *view, double factor)
{
    if (factor == 0)
        return 0;
    view->ortho_height /= factor;
    view->fov_degrees = atan(tan(view->fov_degrees / 2 * DEGREE) / factor) * 2 / DEGREE;
    if (view->ortho_height > 0 || (view->fov_degrees >= TRIP_VIEW_FOV_MIN_DEGREES &&
                                   view->fov_degrees <= TRIP_VIEW_FOV_MAX_DEGREES))
        return 0;
    return trip_fail(TRIP_USAGE, "usage", "--zoom",
                     "%g gives an angle of view of %g degrees; it must be %g to %g", factor,
                     view->fov_degrees, TRIP_VIEW_FOV_MIN_DEGREES, TRIP_VIEW_FOV_MAX_DEGREES);
}

int trip_view_find(trip_found_view *out, const trip_view_settings *s, const trip_view_object *o)
{
    finding f = { .s = s,
                  .map = &o->index_to_world,
                  .parallel = s->ortho_height > 0 || s->ortho_fit };
    trip_camera_params view = { .fov_degrees =
                                    s->fov_degrees > 0 ? s->fov_degrees : DEFAULT_FOV_DEGREES,
                                .width = s->width,
                                .height = s->height };
    orient(&f, o);
    set_directions(&f);
    int status = find_box(&f, o);
    if (!status && s->eye)
        look_from_eye(&f, &view);
    else if (!status)
        status = find_framed(&f, o->visible, &view);
    if (!status)
        status = zoom(&view, s->zoom);
    if (o->visible)
        trip_visible_end(o->visible);
    *out = (trip_found_view){ view, f.axis };
    return status;
}
