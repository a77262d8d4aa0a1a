/* The kernels for plain C, for any processor. */
#define TRIP_SIMD TRIP_SIMD_PLAIN
#include "cpu/kernels/table_tmpl.h"

TRIP_CPU_TABLE(trip_cpu_plain, "plain");
