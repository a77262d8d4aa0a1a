/* The views of `triptych render`: one, or those of a turntable. */
#ifndef TRIP_RENDER_VIEW_H
#define TRIP_RENDER_VIEW_H

#include "dataset_text.h"
#include "render_options.h"

/* The view of image `index` (0 but for an orbit). */
trip_camera_params render_view(const render_options *o, const trip_dataset *d,
                               const trip_dataset_text *text, int index);

#endif
