/* The kernels for AVX-512 with VBMI2: Ice Lake, Zen 4 and later. */
#if defined(__x86_64__)

#define TRIP_SIMD TRIP_SIMD_AVX512
#include "cpu/kernels/table_tmpl.h"

TRIP_CPU_TABLE(trip_cpu_avx512_vbmi2, "avx512-vbmi2");

#endif
