#include "render_view.h"

/* The framed view; of a turntable, as far off as its widest side needs. */
static trip_camera_params framed(const render_options *o, const trip_dataset *d,
                                 const trip_dataset_text *text)
{
    trip_camera_framing f = { .width = o->width,
                              .height = o->height,
                              .fov_degrees = o->fov_degrees,
                              .turntable = o->orbit > 0 };
    trip_dataset_text_frame(text, d, &f);
    trip_camera_params view = trip_camera_frame(&f, &d->index_to_world);
    trip_vec3 arm = trip_sub(view.eye, view.look);
    double distance = trip_length(arm);
    for (int i = 1; i < o->orbit; i++) {
        f.azimuth_degrees = 360.0 * i / o->orbit;
        trip_camera_params other = trip_camera_frame(&f, &d->index_to_world);
        distance = fmax(distance, trip_length(trip_sub(other.eye, other.look)));
    }
    view.eye = trip_add(view.look, trip_scale(trip_normalize(arm), distance));
    return view;
}

/* Another up where the one that was not asked for lies along the view. */
static void avoid_up_along_view(trip_camera_params *view)
{
    trip_vec3 gaze = trip_normalize(trip_sub(view->look, view->eye));
    if (trip_length(trip_cross(gaze, view->up)) < 1e-6)
        view->up = fabs(view->up.z) > 0.5 ? trip_v3(0, 1, 0) : trip_v3(0, 0, 1);
}

trip_camera_params render_view(const render_options *o, const trip_dataset *d,
                               const trip_dataset_text *text, int index)
{
    trip_camera_params view = framed(o, d, text);
    trip_vec3 arm = trip_sub(view.eye, view.look);
    if (o->look_given)
        view.look = o->look;
    view.eye = o->eye_given ? o->eye : trip_add(view.look, arm);
    if (o->up_given)
        view.up = o->up;
    else
        avoid_up_along_view(&view);
    view.ortho_height = o->ortho_height;
    return index ? trip_camera_turn(&view, 360.0 * index / o->orbit) : view;
}
