/* The kernels for AVX2, FMA and BMI. */
#if defined(__x86_64__)

#define TRIP_SIMD TRIP_SIMD_AVX2
#include "cpu/kernels/table_tmpl.h"

const trip_cpu_kernels trip_cpu_avx2 = TRIP_CPU_TABLE("avx2");

#endif
