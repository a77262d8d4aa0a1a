/* The views of triptych.h. render/camera/framing.h lists the steps from the settings to the camera.
 */
#include "library_context.h"
#include "report.h"
#include "framing.h"

enum { DEFAULT_SIZE = 1024 };

static bool are_finite(const double *v)
{
    return !v || isfinite(v[0] + v[1] + v[2]);
}

static int check(const trip_view_settings *s)
{
    const double sum = s->azimuth_degrees + s->elevation_degrees + s->roll_degrees + s->zoom +
                       s->fov_degrees + s->ortho_height;
    const char *why = NULL;
    if (!isfinite(sum) || !are_finite(s->eye) || !are_finite(s->look) || !are_finite(s->up))
        why = "a number is not finite";
    else if (s->width < 1 || s->height < 1 || s->width > TRIP_PICTURE_MAX_PX ||
             s->height > TRIP_PICTURE_MAX_PX)
        why = "the width and height of a picture must be 1 to 65536 pixels";
    else if (s->up && !(trip_length(trip_v3(s->up[0], s->up[1], s->up[2])) > 0))
        why = "the up direction is zero";
    else if (s->zoom < 0 || s->ortho_height < 0)
        why = "the zoom and the height of a parallel view must not be below 0";
    else if (s->fov_degrees != 0 && !(s->fov_degrees >= TRIP_VIEW_FOV_MIN_DEGREES &&
                                      s->fov_degrees <= TRIP_VIEW_FOV_MAX_DEGREES))
        why = "the angle of view must be 1e-6 to 179.999 degrees";
    else if (s->side < TRIP_SIDE_DEFAULT || s->side > TRIP_SIDE_ISO)
        why = "unknown side";
    else if (s->eye && s->ortho_fit)
        why = "a parallel view with an eye needs a height";
    return why ? trip_fail(TRIP_USAGE, "render", "view", "%s", why) : 0;
}

static trip_view_settings settings_of(const triptych_view *o)
{
    return (trip_view_settings){
        .width = o->width ? o->width : DEFAULT_SIZE,
        .height = o->height ? o->height : DEFAULT_SIZE,
        .eye = o->eye,
        .look = o->look,
        .up = o->up,
        .side = (trip_side)o->side,
        .azimuth_degrees = o->azimuth_degrees,
        .elevation_degrees = o->elevation_degrees,
        .roll_degrees = o->roll_degrees,
        .zoom = o->zoom,
        .fov_degrees = o->fov_degrees,
        .ortho_height = o->ortho_height,
        .ortho_fit = o->ortho_fit,
        .turntable = o->turntable,
    };
}

/* Makes a reader for the visible voxels, which ends before the reader of the frames is made. */
static int make_reader(const triptych *t, trip_visible *v)
{
    const triptych_resources *r = &t->resources;
    const trip_engine engine = (trip_engine)r->engine;
    const session_reader wanted = {
        .engine = engine == TRIP_ENGINE_NULL ? TRIP_ENGINE_AUTO : engine,
        .threads = (int)trip_context_threads(r->threads),
        .skip = trip_visible_skip,
        .skip_user = v,
    };
    return session_make_reader(&t->session, &v->reader, &wanted);
}

int trip_context_find_view(triptych *t, const triptych_view *given)
{
    const trip_view_settings settings = settings_of(given);
    const session *s = &t->session;
    trip_found_view found;
    int status = t->has_function || trip_context_draws_scene(t)
                     ? 0
                     : trip_context_use_transfer_function(t, &(triptych_transfer_function){ 0 });
    if (!status)
        status = check(&settings);
    if (status)
        return status;
    trip_view_object object = trip_context_draws_scene(t) ? trip_context_scene_object(t)
                                                          : trip_view_object_of(s->data, s->text);
    trip_visible visible = { .data = s->data, .budget = s->budget, .table = s->table };
    if (!trip_context_draws_scene(t) && !(settings.eye && settings.look) &&
        !trip_coordinates_uneven(&s->data->coordinates)) {
        status = make_reader(t, &visible);
        object.visible = &visible;
        object.kernel_radius = t->settings.kernel_radius;
    }
    if (!status)
        status = trip_view_find(&found, &settings, &object);
    trip_reader_destroy(visible.reader);
    if (status)
        return status;
    t->view = t->turned = found.params;
    t->axis = found.axis;
    t->fit_splats = visible.splats;
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
