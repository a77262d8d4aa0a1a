/* Draws frames in `post` (sheet.h). The runs of a pass become sheets. As soon as some consecutive
 * sheets are complete, they are cut into sample planes, drawn into the panes and dropped. A pixel
 * depends only on the sample planes, never on how many are drawn at a time. The renderer owns the
 * object; its thread calls all functions. */
#ifndef TRIP_CPU_SHEETS_SHEETS_H
#define TRIP_CPU_SHEETS_SHEETS_H

#include "cpu/cpu_state.h"

int trip_cpu_sheets_create(trip_cpu_sheets **out, const trip_cpu *r);
void trip_cpu_sheets_destroy(trip_cpu_sheets *s);

int trip_cpu_sheets_begin_frame(trip_cpu_sheets *s, trip_cpu *r);
int trip_cpu_sheets_begin_layer(trip_cpu_sheets *s, int axis);
int trip_cpu_sheets_draw(trip_cpu_sheets *s, const trip_batch *batch);
/* Draws the last sheets of the layer. Call it after the layer's last batch. */
int trip_cpu_sheets_end_layer(trip_cpu_sheets *s);

#endif
