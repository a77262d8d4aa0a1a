/* The view of `triptych render`. Main thread only. */
#ifndef TRIP_RENDER_VIEW_H
#define TRIP_RENDER_VIEW_H

#include "render_options.h"

/* Converts the options to a view, which points into *o. */
triptych_view render_view(const render_options *o);

#endif
