#include <string.h>

#include "cpu/kernels/isa.h"
#include "gaussian_tiles.h"

extern const trip_tile_kernels trip_tiles_plain;
#if defined(__x86_64__)
extern const trip_tile_kernels trip_tiles_avx2, trip_tiles_avx512;
#elif defined(__aarch64__)
extern const trip_tile_kernels trip_tiles_neon;
#endif

const trip_tile_kernels *trip_tile_kernels_choose(const char *isa)
{
    const trip_cpu_kernels *chosen = trip_cpu_isa_choose(isa);
    if (!chosen)
        return NULL;
#if defined(__x86_64__)
    if (strncmp(chosen->isa, "avx512", 6) == 0)
        return &trip_tiles_avx512;
    if (strcmp(chosen->isa, "avx2") == 0)
        return &trip_tiles_avx2;
#elif defined(__aarch64__)
    if (strcmp(chosen->isa, "neon") == 0)
        return &trip_tiles_neon;
#endif
    return &trip_tiles_plain;
}
