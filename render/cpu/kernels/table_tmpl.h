/* Compiles every kernel for one instruction set. Each isa_*.c defines TRIP_SIMD, then includes this
 * file. */
#ifndef TRIP_CPU_TABLE_H
#define TRIP_CPU_TABLE_H

#if TRIP_CPU_CLOSED || TRIP_CPU_EFFECTS || TRIP_CPU_NEAREST || TRIP_CPU_BLURRED
#pragma GCC diagnostic ignored "-Wunused-function"
#endif

#include "cpu/kernels/blend_tmpl.h"
#include "cpu/kernels/count_tmpl.h"
#include "cpu/kernels/isa.h"
#include "cpu/kernels/merge_tmpl.h"
#include "cpu/kernels/project_tmpl.h"
#include "cpu/kernels/sheet_tmpl.h"
#include "cpu/kernels/simd_tmpl.h"
#include "cpu/kernels/sample_tmpl.h"
#include "cpu/kernels/squares_tmpl.h"
#include "cpu/kernels/sum_tmpl.h"

/* TRIP_CPU_TABLE defines the kernel table `name` for the instruction set `isa_name`.
 * - With TRIP_CPU_DEPTH it defines name##_depth, the table for layers with depth.
 * - With TRIP_CPU_CLOSED it defines only the kernel for segments in closed form.
 * - With TRIP_CPU_EFFECTS it defines only the kernels for frames with effects.
 * - With TRIP_CPU_NEAREST it defines only the kernel for the nearest value.
 * - With TRIP_CPU_BLURRED it defines only the kernel for blurred functions. */
#if TRIP_CPU_DEPTH
#define TRIP_CPU_TABLE(name, isa_name) DEFINE(name##_depth, isa_name, NULL)
#else
#define TRIP_CPU_TABLE(name, isa_name)                                                             \
    extern const trip_cpu_kernels name##_depth;                                                    \
    DEFINE(name, isa_name, &name##_depth)
#endif

#define SHEET_KERNEL(name)                                                                         \
    extern trip_cpu_sheet_kernel name;                                                             \
    uint64_t name(const trip_cpu_sheet_view *view, const trip_cpu_group *g, int x, int y,          \
                  float *pixels)                                                                   \
    {                                                                                              \
        return sheet_pane(view, g, x, y, pixels);                                                  \
    }

#define PROJECT_KERNEL(name)                                                                       \
    extern trip_cpu_project_kernel name;                                                           \
    uint32_t name(const trip_cpu_view *view, const _Atomic uint64_t *open,                         \
                  const trip_cpu_staged *staged, uint32_t count, trip_cpu_lanes *lanes,            \
                  trip_cpu_splat *out, float *depths)                                              \
    {                                                                                              \
        return project(view, open, staged, count, lanes, out, depths);                             \
    }

/* Each DEFINE ends in a declaration, so that a semicolon can follow. */
#if TRIP_CPU_CLOSED
#define DEFINE(name, isa_name, depth_table)                                                        \
    SHEET_KERNEL(name##_sheet_closed)                                                              \
    static_assert(TRIP_CPU_CLOSED, "it alone is compiled then")
#elif TRIP_CPU_NEAREST
#define DEFINE(name, isa_name, depth_table)                                                        \
    SHEET_KERNEL(name##_sheet_nearest)                                                             \
    static_assert(TRIP_CPU_NEAREST, "it alone is compiled then")
#elif TRIP_CPU_BLURRED
#define DEFINE(name, isa_name, depth_table)                                                        \
    SHEET_KERNEL(name##_sheet_blurred)                                                             \
    static_assert(TRIP_CPU_BLURRED, "it alone is compiled then")
#elif TRIP_CPU_EFFECTS
#define DEFINE(name, isa_name, depth_table)                                                        \
    SHEET_KERNEL(name##_sheet_effects)                                                             \
    PROJECT_KERNEL(name##_project_effects)                                                         \
    static_assert(TRIP_CPU_EFFECTS, "they alone are compiled then")
#else
#define DEFINE(name, isa_name, depth_table)                                                        \
    extern trip_cpu_sheet_kernel name##_sheet_closed, name##_sheet_effects, name##_sheet_nearest,  \
        name##_sheet_blurred;                                                                      \
    extern trip_cpu_project_kernel name##_project_effects;                                         \
    const trip_cpu_kernels name =                                                                  \
        KERNELS(isa_name, depth_table, name##_sheet_closed, name##_sheet_effects,                  \
                name##_sheet_nearest, name##_sheet_blurred, name##_project_effects)
#endif

#define KERNELS(isa_name, depth_table, closed, with_effects, nearest, blurred,                     \
                project_with_effects)                                                              \
    {                                                                                              \
        .isa = isa_name, .lanes = V, .channels = CHANNELS, .with_depth = depth_table,              \
        .squares = squares, .stage = stage, .project = project, .pane_clear = pane_clear,          \
        .pane_begin = pane_begin, .pane_blend = pane_blend, .pane_end = pane_end,                  \
        .pane_merge = pane_merge, .pane_finish = pane_finish, .drawn = drawn,                      \
        .reaching = reaching, .sheet_clear = sheet_clear, .sheet_composite = sheet_composite,      \
        .sheet_decode = sheet_decode, .sheet_ranges = sheet_ranges, .sheet_cells = sheet_cells,    \
        .sheet_gradients = sheet_gradients, .sheet_outlines = sheet_outlines,                      \
        .sheet_between = sheet_between, .sheet_deviations_between = sheet_deviations_between,      \
        .sheet_rows = sheet_rows, .sheet_pane = sheet_pane, .sheet_pane_closed = (closed),         \
        .sheet_pane_effects = (with_effects), .sheet_pane_nearest = (nearest),                     \
        .sheet_pane_blurred = (blurred), .project_effects = (project_with_effects),                \
    }

#endif
