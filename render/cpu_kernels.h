/* What the CPU renderer's inner loops share: a projected splat, the constants of a list, the pixels
 * of a screen tile, and the table of loops that each instruction set provides. The kernels are pure
 * functions of their arguments; threads give each its own scratch. cpu_isa.h chooses a table. */
#ifndef TRIP_CPU_KERNELS_H
#define TRIP_CPU_KERNELS_H

#include <assert.h>
#include <stdint.h>

#include "renderer.h"
#include "splat.h"

/* Edge of a screen tile in pixels. Its pixels are kept as V-lane vectors of four columns times V /
 * 4 rows (a block), so that a small footprint meets few vectors and all of them aligned: block
 * after block, row by row of blocks, each as R[V] G[V] B[V] T[V]; T is 1 - alpha. */
#define TRIP_CPU_TILE 32
#define TRIP_CPU_TILE_PIXELS (TRIP_CPU_TILE * TRIP_CPU_TILE)

/* Exponents are kept ready for the conversion to a float's bits: y stands for
 * 2^(y / TRIP_CPU_EXP_UNIT - 127). */
#define TRIP_CPU_EXP_UNIT 8388608.0

/* Splats whose largest optical depth is below this use the short form of 1 - exp(-x). */
#define TRIP_CPU_THIN 0.4f

/* One splat, ready to blend; 64 bytes, a cache line. Its centre is (x + whole_x, y + whole_y). With
 * q the pixel's offset from it, the exponent of the optical depth at a pixel is
 *     peak - G(p) ((l11 qx + l21 qy)^2 + (l22 qy)^2)
 * G as in trip_cpu_rays, and nothing is drawn where that is below `least`. */
typedef struct trip_cpu_splat {
    float x, y, whole_x, whole_y;
    float l11, l21, l22, peak;
    float r, g, b, least;
    uint16_t x0, y0, x1, y1; /* pixels that contain the support, inclusive, inside the image */
    float thick;             /* 1 unless thin */
    float spare;
} trip_cpu_splat;

static_assert(sizeof(trip_cpu_splat) == 64, "one cache line");

/* Where the rays of a view are alike, their tables are not needed. */
typedef enum trip_cpu_rays {
    TRIP_CPU_PARALLEL,    /* G = 1, stretch constant */
    TRIP_CPU_PERSPECTIVE, /* G(p) = 1 / |r(p)|^2, stretch constant: cubic voxels */
    TRIP_CPU_STRETCHED,   /* G(p) and stretch(p) */
} trip_cpu_rays;

/* Constants of one list of one frame. */
typedef struct trip_cpu_view {
    const trip_frame *of;
    trip_splat_frame splat;
    trip_cpu_rays rays;
    bool front_to_back, shading;
    bool stretch_varies;
    int axis, u_axis, v_axis;
    double gradient_full;
    double stretch;                            /* where it is constant, else 1 */
    double along_x[4], along_y[4], along_z[4]; /* X, Y, z of a voxel: [u, v, sheet, constant] */
    double eye[3];                             /* [u, v, sheet] */
    double world[3][3];                        /* index_to_world's columns for u, v, sheet */
    trip_splat parallel;                       /* the footprint of all, in parallel views */
} trip_cpu_view;

/* Voxels waiting to be projected: one entry a lane, from any runs. */
#define TRIP_CPU_STAGED 512
typedef struct trip_cpu_staged {
    int32_t u[TRIP_CPU_STAGED + 16], v[TRIP_CPU_STAGED + 16], sheet[TRIP_CPU_STAGED + 16];
    int32_t code[TRIP_CPU_STAGED + 16], normal[TRIP_CPU_STAGED + 16];
} trip_cpu_staged;

/* Pairs of a splat and a block that it may touch: splat << 8 | block. */
#define TRIP_CPU_LOCAL 128
#define TRIP_CPU_PAIRS 2048

/* What one thread needs while it blends a tile. */
typedef struct trip_cpu_scratch {
    _Alignas(64) float rays[TRIP_CPU_TILE_PIXELS];     /* G of each pixel, in block order */
    _Alignas(64) float stretch[TRIP_CPU_TILE_PIXELS];  /* log2 stretch in TRIP_CPU_EXP_UNIT */
    _Alignas(64) float columns[8 * 16], rows[32 * 16]; /* pixel centres of block columns and rows */
    _Alignas(64) trip_cpu_splat local[TRIP_CPU_LOCAL]; /* centres relative to the tile */
    uint32_t pairs[TRIP_CPU_PAIRS];
    uint8_t open[256 + 64]; /* 1: block may still take light */
    uint32_t splats, pair_count;
    unsigned quarters;
    bool any_open;
    int x, y; /* of the tile's first pixel */
    float *pixels;
    void (*blend)(struct trip_cpu_scratch *s); /* all pairs, in order */
    const trip_cpu_view *view;
    trip_cpu_staged staged;
} trip_cpu_scratch;

typedef struct trip_cpu_kernels {
    const char *isa;
    unsigned lanes;

    /* Adds voxels of one run to `staged` in draw order, leaving out transparent ones; at most
     * TRIP_CPU_STAGED - `filled` voxels. Returns the new fill. */
    uint32_t (*stage)(const trip_cpu_view *view, const trip_run *run, const uint32_t *voxels,
                      const uint32_t *normals, uint32_t count, bool reversed,
                      trip_cpu_staged *staged, uint32_t filled);
    /* Projects the first `count` staged voxels; those with pixels in the image become splats, in
     * order. `out` has room for count + 16. Returns how many. */
    uint32_t (*project)(const trip_cpu_view *view, const trip_cpu_staged *staged, uint32_t count,
                        trip_cpu_splat *out);

    /* Empties a tile's pixels: transparent where the list has weight, closed elsewhere. */
    void (*tile_clear)(const trip_cpu_view *view, int x, int y, float *pixels);
    /* Takes up a tile for blending; `quarters` says which of its 16 x 16 quarters to draw. */
    void (*tile_begin)(const trip_cpu_view *view, trip_cpu_scratch *s, int x, int y,
                       unsigned quarters, float *pixels);
    /* Blends splats[order[i]] in order, or splats[i] where order is NULL. */
    void (*tile_blend)(trip_cpu_scratch *s, const trip_cpu_splat *splats, const uint16_t *order,
                       uint32_t count);
    /* Ends with every splat in the pixels; true when some pixel may still take light. */
    bool (*tile_end)(trip_cpu_scratch *s);
    /* sum += w^2 layer, or sum = w^2 layer when it is the first. */
    void (*tile_merge)(const trip_cpu_view *view, int x, int y, const float *pixels, bool first,
                       float *sum);
    /* The finished picture of a tile into an image; sum NULL: nothing was drawn there. */
    void (*tile_finish)(const trip_cpu_view *view, int x, int y, const float *sum, float *rgba);
} trip_cpu_kernels;

#endif
