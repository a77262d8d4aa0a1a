/* The view of `triptych render`. */
#ifndef TRIP_RENDER_VIEW_H
#define TRIP_RENDER_VIEW_H

#include "render_options.h"

/* What the options say of the view; points into them. */
triptych_view render_view(const render_options *o);

#endif
