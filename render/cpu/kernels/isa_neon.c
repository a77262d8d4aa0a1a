/* The kernels for NEON. */
#if defined(__aarch64__)

#define TRIP_SIMD TRIP_SIMD_NEON
#include "cpu/kernels/table_tmpl.h"

TRIP_CPU_TABLE(trip_cpu_neon, "neon");

#endif
