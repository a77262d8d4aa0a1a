/* The tile kernel in plain C. */
#define TRIP_SIMD TRIP_SIMD_PLAIN
#include "tiles_tmpl.h"

TRIP_TILE_TABLE(trip_tiles_plain, "plain");
