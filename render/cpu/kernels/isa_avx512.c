/* The kernels for AVX-512 (F, DQ, BW, VL), with FMA and BMI. */
#if defined(__x86_64__)

#define TRIP_SIMD TRIP_SIMD_AVX512
#include "cpu/kernels/table_tmpl.h"

TRIP_CPU_TABLE(trip_cpu_avx512, "avx512");

#endif
