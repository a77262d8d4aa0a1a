/* The tile kernel for NEON. */
#if defined(__aarch64__)

#define TRIP_SIMD TRIP_SIMD_NEON
#include "tiles_tmpl.h"

TRIP_TILE_TABLE(trip_tiles_neon, "neon");

#endif
