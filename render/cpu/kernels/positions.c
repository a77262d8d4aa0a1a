#include "cpu/kernels/kernels.h"

/* Position of a voxel in its square, from the low three bits of its Morton number. */
#define PLACE(n) ((uint64_t)(((n)&1) | ((n)&2) << 2 | ((n)&4) >> 1))
#define BIT(x, n) ((uint64_t)((x) >> (n)&1))
#define BELOW1(x) BIT(x, 0)
#define BELOW2(x) (BELOW1(x) + BIT(x, 1))
#define BELOW3(x) (BELOW2(x) + BIT(x, 2))
#define BELOW4(x) (BELOW3(x) + BIT(x, 3))
#define BELOW5(x) (BELOW4(x) + BIT(x, 4))
#define BELOW6(x) (BELOW5(x) + BIT(x, 5))
#define BELOW7(x) (BELOW6(x) + BIT(x, 6))
#define NUMBER(n) ((uint64_t)(n))
#define AT(of, x, n, below) (BIT(x, n) * of(n) << 8 * (below))
/* Packs of(n) for each set bit n of x into consecutive bytes, lowest bit first. */
#define EACH(of, x)                                                                                \
    (AT(of, x, 0, 0) | AT(of, x, 1, BELOW1(x)) | AT(of, x, 2, BELOW2(x)) |                         \
     AT(of, x, 3, BELOW3(x)) | AT(of, x, 4, BELOW4(x)) | AT(of, x, 5, BELOW5(x)) |                 \
     AT(of, x, 6, BELOW6(x)) | AT(of, x, 7, BELOW7(x)))
#define EACH4(of, x) EACH(of, x), EACH(of, (x) + 1), EACH(of, (x) + 2), EACH(of, (x) + 3)
#define EACH16(of, x) EACH4(of, x), EACH4(of, (x) + 4), EACH4(of, (x) + 8), EACH4(of, (x) + 12)
#define EACH64(of, x)                                                                              \
    EACH16(of, x), EACH16(of, (x) + 16), EACH16(of, (x) + 32), EACH16(of, (x) + 48)
#define EACH256(of) EACH64(of, 0), EACH64(of, 64), EACH64(of, 128), EACH64(of, 192)

const uint64_t trip_cpu_positions[256] = { EACH256(PLACE) };
const uint64_t trip_cpu_bits_set[256] = { EACH256(NUMBER) };
