/* Frames that classify after interpolation (sheet.h): the runs of a pass become sheets, and as soon
 * as some sheets in a row are complete they are cut into slices and drawn into the panes, and let
 * go of. What a pixel gets depends on the slices alone, never on how many were drawn at a time.
 * Called by the renderer's thread. */
#ifndef TRIP_CPU_SHEETS_SHEETS_H
#define TRIP_CPU_SHEETS_SHEETS_H

#include "cpu/cpu_state.h"

int trip_cpu_sheets_create(trip_cpu_sheets **out, const trip_cpu *r);
void trip_cpu_sheets_destroy(trip_cpu_sheets *s);

int trip_cpu_sheets_begin_frame(trip_cpu_sheets *s, trip_cpu *r);
int trip_cpu_sheets_begin_layer(trip_cpu_sheets *s, int axis);
int trip_cpu_sheets_draw(trip_cpu_sheets *s, const trip_batch *batch);
/* Every batch of the layer was drawn: so are its last sheets. */
int trip_cpu_sheets_end_layer(trip_cpu_sheets *s);

#endif
