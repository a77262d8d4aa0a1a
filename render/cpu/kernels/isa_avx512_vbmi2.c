/* The kernels for AVX-512 with VBMI2: Ice Lake, Zen 4 and later. */
#if defined(__x86_64__)

#define TRIP_SIMD TRIP_SIMD_AVX512
#include "cpu/kernels/table_tmpl.h"

const trip_cpu_kernels trip_cpu_avx512_vbmi2 = TRIP_CPU_TABLE("avx512-vbmi2");

#endif
