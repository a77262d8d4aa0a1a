#include "cpu/kernels/kernels.h"

/* A voxel's place in its square by the low three bits of its Morton number. */
#define PLACE(n) ((uint64_t)(((n)&1) | ((n)&2) << 2 | ((n)&4) >> 1))
#define BIT(x, n) ((uint64_t)((x) >> (n)&1))
#define BELOW1(x) BIT(x, 0)
#define BELOW2(x) (BELOW1(x) + BIT(x, 1))
#define BELOW3(x) (BELOW2(x) + BIT(x, 2))
#define BELOW4(x) (BELOW3(x) + BIT(x, 3))
#define BELOW5(x) (BELOW4(x) + BIT(x, 4))
#define BELOW6(x) (BELOW5(x) + BIT(x, 5))
#define BELOW7(x) (BELOW6(x) + BIT(x, 6))
#define AT(x, n, below) (BIT(x, n) * PLACE(n) << 8 * (below))
#define PLACES(x)                                                                                  \
    (AT(x, 0, 0) | AT(x, 1, BELOW1(x)) | AT(x, 2, BELOW2(x)) | AT(x, 3, BELOW3(x)) |               \
     AT(x, 4, BELOW4(x)) | AT(x, 5, BELOW5(x)) | AT(x, 6, BELOW6(x)) | AT(x, 7, BELOW7(x)))
#define PLACES4(x) PLACES(x), PLACES((x) + 1), PLACES((x) + 2), PLACES((x) + 3)
#define PLACES16(x) PLACES4(x), PLACES4((x) + 4), PLACES4((x) + 8), PLACES4((x) + 12)
#define PLACES64(x) PLACES16(x), PLACES16((x) + 16), PLACES16((x) + 32), PLACES16((x) + 48)

const uint64_t trip_cpu_places[256] = { PLACES64(0), PLACES64(64), PLACES64(128), PLACES64(192) };
