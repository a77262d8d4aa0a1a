#include "render_view.h"

#include <stdio.h>

#include "text.h"

triptych_view render_view(const render_options *o)
{
    return (triptych_view){
        .width = o->width,
        .height = o->height,
        .eye = o->eye_given ? o->eye : NULL,
        .look = o->look_given ? o->look : NULL,
        .up = o->up_given ? o->up : NULL,
        .side = o->side,
        .azimuth_degrees = o->azimuth_degrees,
        .elevation_degrees = o->elevation_degrees,
        .roll_degrees = o->roll_degrees,
        .zoom = o->zoom,
        .fov_degrees = o->fov_degrees,
        .ortho_height = o->ortho_height,
        .ortho_fit = o->ortho_fit,
        .turntable = o->orbit > 0,
    };
}

static const char *point(const double p[3], char text[128])
{
    char x[32], y[32], z[32];
    snprintf(text, 128, "%s,%s,%s", trip_text_from_double(p[0], x), trip_text_from_double(p[1], y),
             trip_text_from_double(p[2], z));
    return text;
}

char *render_view_options(const triptych_camera *view)
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
