/* The tile kernel for AVX2. */
#if defined(__x86_64__)

#define TRIP_SIMD TRIP_SIMD_AVX2
#include "tiles_tmpl.h"

TRIP_TILE_TABLE(trip_tiles_avx2, "avx2");

#endif
