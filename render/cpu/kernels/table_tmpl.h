/* Every kernel for one instruction set: each cpu_isa_*.c includes it once TRIP_SIMD is defined. */
#ifndef TRIP_CPU_TABLE_H
#define TRIP_CPU_TABLE_H

#if TRIP_CPU_CLOSED
#pragma GCC diagnostic ignored "-Wunused-function"
#endif

#include "cpu/kernels/blend_tmpl.h"
#include "cpu/kernels/count_tmpl.h"
#include "cpu/kernels/isa.h"
#include "cpu/kernels/merge_tmpl.h"
#include "cpu/kernels/project_tmpl.h"
#include "cpu/kernels/sheet_tmpl.h"
#include "cpu/kernels/simd_tmpl.h"
#include "cpu/kernels/slice_tmpl.h"
#include "cpu/kernels/squares_tmpl.h"
#include "cpu/kernels/sum_tmpl.h"

/* Defines the table `name` of the instruction set called `isa`, or with depth the one that `name`
 * names for layers with depth; with TRIP_CPU_CLOSED what either has for segments in closed form. */
#if TRIP_CPU_CLOSED && TRIP_CPU_DEPTH
#define TRIP_CPU_TABLE(name, isa_name) CLOSED(name##_depth_closed)
#elif TRIP_CPU_CLOSED
#define TRIP_CPU_TABLE(name, isa_name) CLOSED(name##_closed)
#elif TRIP_CPU_DEPTH
#define TRIP_CPU_TABLE(name, isa_name)                                                             \
    extern trip_cpu_sheet_kernel name##_depth_closed;                                              \
    const trip_cpu_kernels name##_depth = KERNELS(isa_name, NULL, name##_depth_closed)
#else
#define TRIP_CPU_TABLE(name, isa_name)                                                             \
    extern trip_cpu_sheet_kernel name##_closed;                                                    \
    extern const trip_cpu_kernels name##_depth;                                                    \
    const trip_cpu_kernels name = KERNELS(isa_name, &name##_depth, name##_closed)
#endif

/* Of the kernels it alone is compiled then. */
#define CLOSED(name)                                                                               \
    extern trip_cpu_sheet_kernel name;                                                             \
    uint64_t name(const trip_cpu_sheet_view *view, const trip_cpu_group *g, int x, int y,          \
                  float *pixels)                                                                   \
    {                                                                                              \
        return sheet_pane(view, g, x, y, pixels);                                                  \
    }                                                                                              \
    static_assert(TRIP_CPU_CLOSED, "for the semicolon")

#define KERNELS(isa_name, depth_table, closed)                                                     \
    {                                                                                              \
        .isa = isa_name, .lanes = V, .channels = CHANNELS, .with_depth = depth_table,              \
        .squares = squares, .stage = stage, .project = project, .pane_clear = pane_clear,          \
        .pane_begin = pane_begin, .pane_blend = pane_blend, .pane_end = pane_end,                  \
        .pane_merge = pane_merge, .pane_finish = pane_finish, .drawn = drawn,                      \
        .reaching = reaching, .sheet_clear = sheet_clear, .sheet_composite = sheet_composite,      \
        .sheet_ranges = sheet_ranges, .sheet_cells = sheet_cells,                                  \
        .sheet_gradients = sheet_gradients, .sheet_between = sheet_between,                        \
        .sheet_pane = sheet_pane, .sheet_pane_closed = (closed),                                   \
    }

#endif
