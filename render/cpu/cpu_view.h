/* Computes the constants of the kernels (trip_cpu_view) from a frame. Pure functions. */
#ifndef TRIP_CPU_VIEW_H
#define TRIP_CPU_VIEW_H

#include "cpu/kernels/kernels.h"

/* Makes the view of a list that the frame's plan draws. The caller sets `way`, `shading` and
 * `flattens`. */
void trip_cpu_view_make(trip_cpu_view *view, const trip_frame *frame, const trip_list *list,
                        bool front_to_back);

/* Sets the transfer function of the view. `table` has 65536 entries and must outlive the view.
 * `shown` is the range of codes with extinction if it is known to have no gaps (code_set.h).
 * Otherwise it is empty. */
void trip_cpu_view_set_table(trip_cpu_view *view, const trip_tf_entry *table,
                             trip_code_range shown);

/* Makes the view of an axis' layer. */
void trip_cpu_layer_view_make(trip_cpu_view *view, const trip_frame *frame, int axis,
                              bool front_to_back);

#endif
