#include "library_view.h"

#include <math.h>

#include "camera.h"
#include "library_context.h"
#include "outline.h"
#include "report.h"
#include "visible.h"

enum { DEFAULT_SIZE = 1024 };

#define DEGREE (3.14159265358979323846 / 180)

static trip_vec3 vector(const double v[3])
{
    return trip_v3(v[0], v[1], v[2]);
}

/* Whether part of the view must be fitted to the visible voxels. */
static bool is_fitted(const triptych_view *o)
{
    return !(o->eye && o->look);
}

/* Returns the axis along which the grid has a single slice, or -1. */
static int slice_axis(const trip_dataset *d)
{
    int axis = -1, singles = 0;
    for (int a = 0; a < 3; a++)
        if (d->header.dims[a] == 1) {
            axis = a;
            singles++;
        }
    return singles == 1 ? axis : -1;
}

/* A single slice faces the viewer like a picture. Rows run from left to right. The other axis
 * points up or down, whichever is closer to the object's up direction, or else to its front. */
static void face_slice(trip_camera_framing *f, const trip_dataset *d, int axis)
{
    const trip_affine *m = &d->index_to_world;
    const trip_vec3 right = trip_affine_vector(m, axis == 0 ? trip_v3(0, 1, 0) : trip_v3(1, 0, 0));
    trip_vec3 up = trip_affine_vector(m, axis == 2 ? trip_v3(0, 1, 0) : trip_v3(0, 0, 1));
    const trip_vec3 above = trip_length(f->up) > 0 ? f->up : trip_v3(0, 0, 1);
    const trip_vec3 front = trip_length(f->front) > 0 ? f->front : trip_v3(0, -1, 0);
    const double rises = trip_dot(trip_normalize(up), trip_normalize(above));
    if ((fabs(rises) > 0.5 ? rises : trip_dot(up, front)) < 0)
        up = trip_scale(up, -1);
    f->up = trip_normalize(up);
    f->front = trip_normalize(trip_cross(right, up));
    f->view = TRIP_VIEW_FRONT;
}

static trip_camera_framing framing_of(const triptych_view *o, const session *s)
{
    trip_camera_framing f = {
        .width = o->width,
        .height = o->height,
        .view = (trip_view)o->side,
        .azimuth_degrees = o->azimuth_degrees,
        .elevation_degrees = o->elevation_degrees,
        .roll_degrees = o->roll_degrees,
        .fov_degrees = o->fov_degrees,
        .parallel = o->ortho_height > 0 || o->ortho_fit,
        .ortho_height = o->ortho_height,
        .turntable = o->turntable,
    };
    trip_dataset_metadata_frame(s->text, s->data, &f);
    const int slice = slice_axis(s->data);
    if (slice >= 0 && !o->up && o->side == TRIPTYCH_SIDE_DEFAULT)
        face_slice(&f, s->data, slice);
    if (o->up)
        trip_framing_set_up(&f, vector(o->up));
    return f;
}

/* Replaces a default up direction that is parallel to the view direction. */
static void avoid_up_along_view(trip_camera_params *view)
{
    trip_vec3 view_direction = trip_normalize(trip_sub(view->look, view->eye));
    if (trip_length(trip_cross(view_direction, view->up)) < 1e-6)
        view->up = fabs(view->up.z) > 0.5 ? trip_v3(0, 1, 0) : trip_v3(0, 0, 1);
}

/* Makes the view from a given eye, towards a given point or the middle. */
static void view_from_eye(const triptych_view *o, const trip_camera_framing *f, const session *s,
                          trip_camera_params *view)
{
    *view = (trip_camera_params){ .eye = vector(o->eye),
                                  .up = trip_length(f->up) > 0 ? f->up : trip_v3(0, 0, 1),
                                  .fov_degrees = o->fov_degrees > 0 ? o->fov_degrees : 30,
                                  .ortho_height = o->ortho_height,
                                  .width = o->width,
                                  .height = o->height };
    view->look = o->look ? vector(o->look) : trip_framing_middle(f, &s->data->index_to_world);
    if (o->up)
        view->up = vector(o->up);
    else
        avoid_up_along_view(view);
    trip_vec3 view_direction = trip_sub(view->look, view->eye);
    if (o->roll_degrees != 0)
        view->up = trip_camera_turn(view, view_direction, -o->roll_degrees).up;
}

static int view_framed(const triptych_view *o, const trip_camera_framing *f, const session *s,
                       trip_camera_params *view)
{
    int status = trip_camera_frame(f, &s->data->index_to_world, view);
    if (!status && o->look) {
        view->eye = trip_add(vector(o->look), trip_sub(view->eye, view->look));
        view->look = vector(o->look);
    }
    return status;
}

/* Zooms as with another lens: the eye stays in its position. */
static int zoom(trip_camera_params *view, double factor)
{
    if (factor == 0)
        return 0;
    view->ortho_height /= factor;
    view->fov_degrees = atan(tan(view->fov_degrees / 2 * DEGREE) / factor) * 2 / DEGREE;
    if (view->ortho_height > 0 || (view->fov_degrees >= TRIPTYCH_FOV_MIN_DEGREES &&
                                   view->fov_degrees <= TRIPTYCH_FOV_MAX_DEGREES))
        return 0;
    return trip_fail(TRIP_USAGE, "usage", "--zoom",
                     "%g gives an angle of view of %g degrees; it must be %g to %g", factor,
                     view->fov_degrees, TRIPTYCH_FOV_MIN_DEGREES, TRIPTYCH_FOV_MAX_DEGREES);
}

static int make_view(trip_found_view *v, const triptych_view *o, const session *s,
                     const trip_camera_framing *f)
{
    int status = 0;
    if (o->eye)
        view_from_eye(o, f, s, &v->params);
    else
        status = view_framed(o, f, s, &v->params);
    v->axis = trip_length(f->up) > 0 ? f->up : trip_v3(0, 0, 1);
    return status ? status : zoom(&v->params, o->zoom);
}

/* Returns the radius of a splat that must be inside the picture. It is half of the kernel radius,
 * since the splat is faint beyond, and the margin holds the rest. For small objects the margin is
 * too narrow, so the radius is larger. */
static double kernel_that_counts(const trip_camera_framing *f, double radius)
{
    const double margin = (1 - TRIP_FRAMING_FILL) / 2;
    double voxels = INFINITY;
    for (int a = 0; a < 3; a++)
        voxels = fmin(voxels, f->hi[a] - f->lo[a]);
    return fmax(radius / 2, radius - margin * voxels);
}

/* The view must contain `visible`, voxels visible on their own, and `outline`, the visible voxels
 * that are faint on their own. */
typedef struct fitted {
    trip_visible *visible;
    trip_outline *outline;
} fitted;

static int reach_of_fitted(void *user, const trip_reach_origin *origin, const trip_reach *wanted,
                           int count, double *values)
{
    const fitted *f = user;
    trip_outline_reach(f->outline, origin, wanted, count, values);
    return trip_visible_raise(f->visible, origin, wanted, count, values);
}

/* Makes the outline for the view that contains the whole box. */
static int make_outline(trip_outline **out, const session *s, trip_reader *reader,
                        const trip_camera_framing *f)
{
    trip_camera_params view;
    trip_camera_framing of_box = *f;
    of_box.ortho_height = 0;
    int status = trip_camera_frame(&of_box, &s->data->index_to_world, &view);
    return status ? status
                  : trip_outline_make(out, &(trip_outline_params){
                                               .data = s->data,
                                               .reader = reader,
                                               .budget = s->budget,
                                               .table = s->table,
                                               .lo = { f->lo[0], f->lo[1], f->lo[2] },
                                               .hi = { f->hi[0], f->hi[1], f->hi[2] },
                                               .view = &view,
                                           });
}

static int make_outlined(trip_found_view *v, const triptych_view *o, const session *s,
                         trip_visible *visible, trip_outline *outline, trip_camera_framing *f)
{
    fitted stage = { visible, outline };
    if (outline) {
        v->splats += visible->splats + trip_outline_splats(outline);
        trip_visible_start(visible, s->table, true);
        f->reach = reach_of_fitted;
        f->reach_user = &stage;
    }
    return make_view(v, o, s, f);
}

/* Uses a temporary reader, which is destroyed before the reader of the frames is made. A turntable
 * has no outline, since turning shows other sides. */
static int make_fitted(trip_found_view *v, const triptych_view *o, const session *s,
                       double kernel_radius, const session_reader *wanted, trip_camera_framing *f)
{
    trip_visible visible = { .data = s->data, .budget = s->budget };
    trip_outline *outline = NULL;
    session_reader with = *wanted;
    with.skip = trip_visible_skip;
    with.skip_user = &visible;
    trip_dataset_kept_bounds(s->data, visible.lo, visible.hi);
    int status = session_make_reader(s, &visible.reader, &with);
    if (status)
        return status;
    trip_visible_start(&visible, s->table, false);
    status = trip_visible_bounds(&visible, f->lo, f->hi);
    visible.kernel_radius = kernel_that_counts(f, kernel_radius);
    if (!status && !o->eye && !f->turntable)
        status = make_outline(&outline, s, visible.reader, f);
    f->reach = trip_visible_reach;
    f->reach_user = &visible;
    if (!status)
        status = make_outlined(v, o, s, &visible, outline, f);
    v->splats += visible.splats;
    trip_outline_destroy(outline);
    trip_reader_destroy(visible.reader);
    return status;
}

static bool are_finite(const double *v)
{
    return !v || isfinite(v[0] + v[1] + v[2]);
}

static int check(const triptych_view *o)
{
    double sum = o->azimuth_degrees + o->elevation_degrees + o->roll_degrees + o->zoom +
                 o->fov_degrees + o->ortho_height;
    const char *why = NULL;
    if (!isfinite(sum) || !are_finite(o->eye) || !are_finite(o->look) || !are_finite(o->up))
        why = "a number is not finite";
    else if (o->width < 1 || o->height < 1 || o->width > TRIP_PICTURE_MAX_PX ||
             o->height > TRIP_PICTURE_MAX_PX)
        why = "the width and height of a picture must be 1 to 65536 pixels";
    else if (o->up && !(trip_length(vector(o->up)) > 0))
        why = "the up direction is zero";
    else if (o->zoom < 0 || o->ortho_height < 0)
        why = "the zoom and the height of a parallel view must not be below 0";
    else if (o->fov_degrees != 0 && !(o->fov_degrees >= TRIPTYCH_FOV_MIN_DEGREES &&
                                      o->fov_degrees <= TRIPTYCH_FOV_MAX_DEGREES))
        why = "the angle of view must be 1e-6 to 179.999 degrees";
    else if (o->side < TRIPTYCH_SIDE_DEFAULT || o->side > TRIPTYCH_ISO)
        why = "unknown side";
    else if (o->eye && o->ortho_fit)
        why = "a parallel view with an eye needs a height";
    return why ? trip_fail(TRIP_USAGE, "render", "view", "%s", why) : 0;
}

int trip_view_find(trip_found_view *found, const triptych_view *view, const session *s,
                   double kernel_radius, const session_reader *wanted)
{
    *found = (trip_found_view){ .splats = 0 };
    int status = check(view);
    if (status)
        return status;
    trip_camera_framing f = framing_of(view, s);
    const bool fits = is_fitted(view) && !trip_coordinates_uneven(&s->data->coordinates);
    return fits ? make_fitted(found, view, s, kernel_radius, wanted, &f)
                : make_view(found, view, s, &f);
}

int trip_context_find_view(triptych *t, const triptych_view *given)
{
    const triptych_resources *r = &t->resources;
    trip_engine engine = (trip_engine)r->engine;
    const session_reader wanted = {
        .engine = engine == TRIP_ENGINE_NULL ? TRIP_ENGINE_AUTO : engine,
        .threads = (int)trip_context_threads(r->threads),
    };
    triptych_view view = *given;
    trip_found_view found;
    view.width = view.width ? view.width : DEFAULT_SIZE;
    view.height = view.height ? view.height : DEFAULT_SIZE;
    int status = t->has_function
                     ? 0
                     : trip_context_use_transfer_function(t, &(triptych_transfer_function){ 0 });
    if (!status)
        status = trip_view_find(&found, &view, &t->session, t->settings.kernel_radius, &wanted);
    if (status)
        return status;
    t->view = t->turned = found.params;
    t->axis = found.axis;
    t->fit_splats = found.splats;
    t->has_view = true;
    return 0;
}

int triptych_set_view(triptych *t, const triptych_view *view)
{
    trip_scope *before = trip_context_enter_anew(t);
    int status = trip_context_check_idle(t, true);
    return trip_context_leave(before, status ? status : trip_context_find_view(t, view));
}

int triptych_turn(triptych *t, double degrees)
{
    trip_scope *before = trip_context_enter_anew(t);
    int status = trip_context_check_idle(t, true);
    if (!status && !isfinite(degrees))
        status = trip_fail(TRIP_USAGE, "render", "view", "the angle is not finite");
    if (!status && !t->has_view)
        status = trip_context_find_view(t, &(triptych_view){ 0 });
    if (!status)
        t->turned = degrees != 0 ? trip_camera_turn(&t->view, t->axis, degrees) : t->view;
    return trip_context_leave(before, status);
}

static void put(double out[3], trip_vec3 v)
{
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

int triptych_get_camera(triptych *t, triptych_camera *out)
{
    trip_scope *before = trip_context_enter(t);
    int status = trip_context_check_open(t);
    if (!status && !t->has_view)
        status = trip_context_check_idle(t, true);
    if (!status && !t->has_view)
        status = trip_context_find_view(t, &(triptych_view){ 0 });
    if (status)
        return trip_context_leave(before, status);
    *out = (triptych_camera){ .fov_degrees = t->turned.fov_degrees,
                              .ortho_height = t->turned.ortho_height,
                              .width = t->turned.width,
                              .height = t->turned.height,
                              .splats = t->fit_splats };
    put(out->eye, t->turned.eye);
    put(out->look, t->turned.look);
    put(out->up, t->turned.up);
    return trip_context_leave(before, 0);
}
