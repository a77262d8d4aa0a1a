/* Every kernel for one instruction set: each cpu_isa_*.c includes it once TRIP_SIMD is defined. */
#ifndef TRIP_CPU_TABLE_H
#define TRIP_CPU_TABLE_H

#include "cpu/kernels/blend_tmpl.h"
#include "cpu/kernels/drawn_tmpl.h"
#include "cpu/kernels/isa.h"
#include "cpu/kernels/merge_tmpl.h"
#include "cpu/kernels/project_tmpl.h"
#include "cpu/kernels/simd_tmpl.h"
#include "cpu/kernels/squares_tmpl.h"

#define TRIP_CPU_TABLE(name)                                                                       \
    {                                                                                              \
        .isa = name, .lanes = V, .squares = squares, .stage = stage, .project = project,           \
        .tile_clear = tile_clear, .tile_begin = tile_begin, .tile_blend = tile_blend,              \
        .tile_end = tile_end, .tile_merge = tile_merge, .tile_finish = tile_finish,                \
        .drawn = drawn,                                                                            \
    }

#endif
