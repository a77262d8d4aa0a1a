#include "render_view.h"

#include <stdio.h>
#include <stdlib.h>

#include "report.h"
#include "text.h"
#include "visible.h"

#define DEGREE (3.14159265358979323846 / 180)

/* Whether something of the view is left to find. */
static bool is_fitted(const render_options *o)
{
    return !(o->eye_given && o->look_given);
}

static trip_camera_framing framing_of(const render_options *o, const session *s)
{
    trip_camera_framing f = {
        .width = o->width,
        .height = o->height,
        .view = o->view,
        .azimuth_degrees = o->azimuth_degrees,
        .elevation_degrees = o->elevation_degrees,
        .roll_degrees = o->roll_degrees,
        .fov_degrees = o->fov_degrees,
        .parallel = o->ortho_height > 0 || o->ortho_fit,
        .ortho_height = o->ortho_height,
        .turntable = o->orbit > 0,
    };
    trip_dataset_text_frame(s->text, s->data, &f);
    if (o->up_given)
        trip_framing_set_up(&f, o->up);
    return f;
}

/* Another up where the one that was not asked for lies along the view. */
static void avoid_up_along_view(trip_camera_params *view)
{
    trip_vec3 gaze = trip_normalize(trip_sub(view->look, view->eye));
    if (trip_length(trip_cross(gaze, view->up)) < 1e-6)
        view->up = fabs(view->up.z) > 0.5 ? trip_v3(0, 1, 0) : trip_v3(0, 0, 1);
}

/* The view from a given eye at a given point or the middle. */
static void view_from_eye(const render_options *o, const trip_camera_framing *f, const session *s,
                          trip_camera_params *view)
{
    *view = (trip_camera_params){ .eye = o->eye,
                                  .look = o->look,
                                  .up = trip_length(f->up) > 0 ? f->up : trip_v3(0, 0, 1),
                                  .fov_degrees = o->fov_degrees > 0 ? o->fov_degrees : 30,
                                  .ortho_height = o->ortho_height,
                                  .width = o->width,
                                  .height = o->height };
    if (!o->look_given)
        view->look = trip_framing_middle(f, &s->data->index_to_world);
    if (o->up_given)
        view->up = o->up;
    else
        avoid_up_along_view(view);
    trip_vec3 gaze = trip_sub(view->look, view->eye);
    if (o->roll_degrees != 0)
        view->up = trip_camera_turn(view, gaze, -o->roll_degrees).up;
}

static int view_framed(const render_options *o, const trip_camera_framing *f, const session *s,
                       trip_camera_params *view)
{
    int status = trip_camera_frame(f, &s->data->index_to_world, view);
    if (!status && o->look_given) {
        view->eye = trip_add(o->look, trip_sub(view->eye, view->look));
        view->look = o->look;
    }
    return status;
}

/* As through another lens: the eye stays where it is. */
static int zoom(trip_camera_params *view, double factor)
{
    if (factor == 0)
        return 0;
    view->ortho_height /= factor;
    view->fov_degrees = atan(tan(view->fov_degrees / 2 * DEGREE) / factor) * 2 / DEGREE;
    if (view->ortho_height > 0 || (view->fov_degrees >= RENDER_FOV_MIN_DEGREES &&
                                   view->fov_degrees <= RENDER_FOV_MAX_DEGREES))
        return 0;
    return trip_fail(TRIP_USAGE, "usage", "--zoom",
                     "%g makes an angle of view of %g degrees, which is not between %g and %g",
                     factor, view->fov_degrees, RENDER_FOV_MIN_DEGREES, RENDER_FOV_MAX_DEGREES);
}

static int make_view(render_views *v, const render_options *o, const session *s,
                     const trip_camera_framing *f)
{
    int status = 0;
    if (o->eye_given)
        view_from_eye(o, f, s, &v->first);
    else
        status = view_framed(o, f, s, &v->first);
    v->axis = trip_length(f->up) > 0 ? f->up : trip_v3(0, 0, 1);
    return status ? status : zoom(&v->first, o->zoom);
}

/* Half of a splat's reach counts: beyond it is faint, and the margin holds the rest. Of small
 * things the margin is too narrow for that, and more counts. */
static double kernel_that_counts(const trip_camera_framing *f, double radius)
{
    const double margin = (1 - TRIP_FRAMING_FILL) / 2;
    double voxels = INFINITY;
    for (int a = 0; a < 3; a++)
        voxels = fmin(voxels, f->hi[a] - f->lo[a]);
    return fmax(radius / 2, radius - margin * voxels);
}

/* With a reader that is gone before the one of the frames is made. */
static int make_fitted(render_views *v, const render_options *o, const session *s,
                       trip_camera_framing *f)
{
    trip_visible visible = { .data = s->data, .budget = s->budget };
    const session_reader wanted = {
        .engine = o->engine == TRIP_ENGINE_NULL ? TRIP_ENGINE_AUTO : o->engine,
        .threads = o->threads,
    };
    trip_dataset_kept_bounds(s->data, visible.lo, visible.hi);
    int status = session_make_reader(s, &visible.reader, &wanted);
    if (status)
        return status;
    trip_visible_start(&visible, s->table);
    status = trip_visible_bounds(&visible, f->lo, f->hi);
    visible.kernel_radius = kernel_that_counts(f, o->settings.kernel_radius);
    f->reach = trip_visible_reach;
    f->reach_user = &visible;
    if (!status)
        status = make_view(v, o, s, f);
    v->splats = visible.splats;
    trip_reader_destroy(visible.reader);
    return status;
}

int render_views_make(render_views *v, const render_options *o, const session *s)
{
    trip_camera_framing f = framing_of(o, s);
    *v = (render_views){ .count = o->orbit > 0 ? o->orbit : 1 };
    return is_fitted(o) ? make_fitted(v, o, s, &f) : make_view(v, o, s, &f);
}

trip_camera_params render_views_get(const render_views *v, int index)
{
    return index ? trip_camera_turn(&v->first, v->axis, 360.0 * index / v->count) : v->first;
}

static const char *point(trip_vec3 p, char text[128])
{
    char x[32], y[32], z[32];
    snprintf(text, 128, "%s,%s,%s", trip_text_from_double(p.x, x), trip_text_from_double(p.y, y),
             trip_text_from_double(p.z, z));
    return text;
}

char *render_view_options(const trip_camera_params *view)
{
    char *options, eye[128], look[128], up[128], angle[32];
    bool ortho = view->ortho_height > 0;
    trip_text_from_double(ortho ? view->ortho_height : view->fov_degrees, angle);
    if (asprintf(&options, "--eye %s --look %s --up %s --%s %s --size %dx%d", point(view->eye, eye),
                 point(view->look, look), point(view->up, up), ortho ? "ortho" : "fov", angle,
                 view->width, view->height) < 0)
        return NULL;
    return options;
}
