/* The views of `triptych render`: one, or those of a turntable. */
#ifndef TRIP_RENDER_VIEW_H
#define TRIP_RENDER_VIEW_H

#include "render_options.h"
#include "session.h"

typedef struct render_views {
    trip_camera_params first;
    trip_vec3 axis;  /* that an orbit goes about */
    int count;       /* of an orbit, or 1 */
    uint64_t splats; /* looked at to find out how far what is visible reaches */
} render_views;

/* Works out the views; reads some of the data where a view is to be fitted to it. */
int render_views_make(render_views *v, const render_options *o, const session *s);
trip_camera_params render_views_get(const render_views *v, int index);

/* The options that give this view again, to the last bit; for free(). NULL without memory. */
char *render_view_options(const trip_camera_params *view);

#endif
