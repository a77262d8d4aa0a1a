/* The kernels for AVX2, FMA and BMI. */
#if defined(__x86_64__)

#define TRIP_SIMD TRIP_SIMD_AVX2
#include "cpu/kernels/table_tmpl.h"

TRIP_CPU_TABLE(trip_cpu_avx2, "avx2");

#endif
