/* The kernels for plain C, for any processor. */
#define TRIP_SIMD TRIP_SIMD_PLAIN
#include "cpu/kernels/table_tmpl.h"

const trip_cpu_kernels trip_cpu_plain = TRIP_CPU_TABLE("plain");
