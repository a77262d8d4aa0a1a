/* The view of `triptych render`, and the options that give a view again. */
#ifndef TRIP_RENDER_VIEW_H
#define TRIP_RENDER_VIEW_H

#include "render_options.h"

/* What the options say of the view; points into them. */
triptych_view render_view(const render_options *o);

/* The options that give this view again, to the last bit; for free(). NULL without memory. */
char *render_view_options(const triptych_camera *view);

#endif
