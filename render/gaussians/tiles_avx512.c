/* The tile kernel for AVX-512 (F, DQ, BW, VL). */
#if defined(__x86_64__)

#define TRIP_SIMD TRIP_SIMD_AVX512
#include "tiles_tmpl.h"

TRIP_TILE_TABLE(trip_tiles_avx512, "avx512");

#endif
