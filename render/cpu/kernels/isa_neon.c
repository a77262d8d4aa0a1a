/* The kernels for NEON. */
#if defined(__aarch64__)

#define TRIP_SIMD TRIP_SIMD_NEON
#include "cpu/kernels/table_tmpl.h"

const trip_cpu_kernels trip_cpu_neon = TRIP_CPU_TABLE("neon");

#endif
