/* The constants that the kernels work with (trip_cpu_view), from a frame. Pure functions. */
#ifndef TRIP_CPU_VIEW_H
#define TRIP_CPU_VIEW_H

#include "cpu/kernels/kernels.h"

/* The constants of a list of the frame's plan, which draws it; `shading` is the caller's to set. */
void trip_cpu_view_make(trip_cpu_view *view, const trip_frame *frame, const trip_list *list,
                        bool front_to_back);

/* Has the view's voxels show as `table` says, which outlives it, of 65536 entries; `shown`: its
 * codes with extinction where these are known to follow one another (code_set.h). */
void trip_cpu_view_set_table(trip_cpu_view *view, const trip_tf_entry *table,
                             trip_code_range shown);

/* The constants of the layer of an axis. */
void trip_cpu_layer_view_make(trip_cpu_view *view, const trip_frame *frame, int axis,
                              bool front_to_back);

#endif
