#include "render_view.h"

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
