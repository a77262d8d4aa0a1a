/* Computes the constants of a pass over sheets, in the form of kernel_sheets.h. Pure functions. */
#ifndef TRIP_CPU_SHEETS_PASS_VIEW_H
#define TRIP_CPU_SHEETS_PASS_VIEW_H

#include "cpu/kernels/kernel_sheets.h"
#include "cpu/sheets/integrals.h"
#include "renderer.h"

/* Returns how far drawn rays move at most along u or v between two sheets, in index lengths. */
double trip_cpu_pass_steepest(const trip_frame *frame);

void trip_cpu_pass_view_make(trip_cpu_sheet_view *view, const trip_frame *frame, int axis,
                             bool descending, const trip_cpu_tf *function);

#endif
