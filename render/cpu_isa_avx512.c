/* The kernels for AVX-512 (F, DQ, BW, VL), with FMA and BMI. */
#if defined(__x86_64__)

#define TRIP_SIMD TRIP_SIMD_AVX512
#include "cpu_simd.h"

#include "cpu_blend.h"
#include "cpu_merge.h"
#include "cpu_project.h"

#include "cpu_isa.h"

const trip_cpu_kernels trip_cpu_avx512 = {
    .isa = "avx512",
    .lanes = V,
    .stage = stage,
    .project = project,
    .tile_clear = tile_clear,
    .tile_begin = tile_begin,
    .tile_blend = tile_blend,
    .tile_end = tile_end,
    .tile_merge = tile_merge,
    .tile_finish = tile_finish,
};

#endif
