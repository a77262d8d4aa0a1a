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

/* One splat, ready to blend; 64 bytes, a cache line. With q a pixel's offset from its centre, the
 * exponent of the optical depth at the pixel is
 *     peak - G(p) ((l11 qx + l21 qy)^2 + (l22 qy)^2)
 * G as in trip_cpu_rays, and nothing is drawn where that is below `least`. With p the pixel from
 * the tile's corner and c the centre, l11 qx + l21 qy = l11 px + l21 py + u and l22 qy = l22 py +
 * w, where u = -(l11 cx + l21 cy),  w = -l22 cy A splat that lies in up to two by two tiles is made
 * once for each, with its centre from the tile's corner, where floats are finest, and its blocks
 * there. One that lies in more, a wide one, is made once, with its centre from the corner of the
 * first, top left. */
typedef struct trip_cpu_splat {
    float u, w;
    float l11, l21, l22;
    float peak, least;
    uint32_t thick; /* not 0: the long form of 1 - exp(-x) is needed */
    float r, g, b;
    uint32_t blocks;         /* that it may touch, see below */
    uint16_t x0, y0, x1, y1; /* pixels that contain the support, inclusive, inside the image */
    uint32_t sequence;       /* its place among the voxels of the chunk */
    uint32_t spare;
} trip_cpu_splat;

static_assert(sizeof(trip_cpu_splat) == 64, "one cache line");

/* trip_cpu_splat.blocks: in bits 0 to 7 the columns of blocks, from bit 8 on the first row, from
 * bit 16 on how many rows follow. */
#define TRIP_CPU_BLOCKS_TOP_SHIFT 8
#define TRIP_CPU_BLOCKS_MORE_SHIFT 16

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
    double stretch;          /* where it is constant, else 1 */
    float cutoff;            /* how far below its peak a support ends, in TRIP_CPU_EXP_UNIT */
    float thick_log2;        /* log2 of the largest optical depth, stretch aside, of thin splats */
    int tiles_across, tiles; /* of the screen; `tiles` stands for all of a wide splat */
    double along_x[4], along_y[4], along_z[4]; /* X, Y, z of a voxel: [u, v, sheet, constant] */
    trip_vec3 to_eye[3]; /* world space, from a splat to the eye: [0] + x [1] + y [2], about the
                            image's middle and not normalised */
    trip_splat parallel; /* the footprint of all, in parallel views */
} trip_cpu_view;

/* Voxels waiting to be projected: one entry a lane, from any runs. */
#define TRIP_CPU_STAGED 256
typedef struct trip_cpu_staged {
    int32_t u[TRIP_CPU_STAGED + 16], v[TRIP_CPU_STAGED + 16], sheet[TRIP_CPU_STAGED + 16];
    int32_t code[TRIP_CPU_STAGED + 16], normal[TRIP_CPU_STAGED + 16];
} trip_cpu_staged;

/* The same voxels on their way to splats: what one loop of the projection leaves to the next. */
typedef struct trip_cpu_lanes {
    float x[TRIP_CPU_STAGED], y[TRIP_CPU_STAGED]; /* as in trip_cpu_splat */
    float whole_x[TRIP_CPU_STAGED], whole_y[TRIP_CPU_STAGED];
    float z[TRIP_CPU_STAGED], inverse_z[TRIP_CPU_STAGED];
    float l11[TRIP_CPU_STAGED], l21[TRIP_CPU_STAGED], l22[TRIP_CPU_STAGED];
    float peak[TRIP_CPU_STAGED];
    float r[TRIP_CPU_STAGED], g[TRIP_CPU_STAGED], b[TRIP_CPU_STAGED];
    uint32_t first[TRIP_CPU_STAGED], last[TRIP_CPU_STAGED]; /* pixels: two uint16 each */
    /* Bits of a vector's lanes: with pixels in the image; near the plane of the eye; beyond the
     * first tile to the right, below, and beyond two by two. */
    uint32_t kept[TRIP_CPU_STAGED / 4], near[TRIP_CPU_STAGED / 4];
    uint32_t right[TRIP_CPU_STAGED / 4], below[TRIP_CPU_STAGED / 4], wide[TRIP_CPU_STAGED / 4];
} trip_cpu_lanes;

/* Wide splats are copied for the tile at hand, so many at a time. */
#define TRIP_CPU_LOCAL 128
#define TRIP_CPU_PAIRS 2048

/* What one thread needs while it projects or blends. */
typedef struct trip_cpu_scratch {
    /* Of each block, at the same place as its pixels: pixel centres x[V], y[V] from the tile's
     * corner, G[V], log2 stretch[V] in TRIP_CPU_EXP_UNIT. */
    _Alignas(64) float geometry[4 * TRIP_CPU_TILE_PIXELS];
    /* Splats and blocks that they may touch: place in `splats` << 8 | block. */
    uint32_t pairs[TRIP_CPU_PAIRS + 16];
    uint8_t open[32 + 8]; /* rows of blocks, a bit for each block that may still take light */
    uint32_t pair_count;
    trip_cpu_splat *splats;      /* of the flush; those from `local` on are this thread's */
    uint32_t local, local_count; /* copies made for the tile at hand */
    unsigned quarters;
    bool any_open, placed; /* placed: the pixel centres are there */
    int x, y;              /* of the tile's first pixel */
    float *pixels;
    void (*blend)(struct trip_cpu_scratch *s); /* all pairs, in order */
    const trip_cpu_view *view;
    trip_cpu_staged staged;
    trip_cpu_lanes lanes;
} trip_cpu_scratch;

/* What a projecting thread fills, chunk by chunk, and then sorts by tile. */
typedef struct trip_cpu_basket {
    trip_cpu_splat *splats; /* TRIP_CPU_CHUNK_SPLATS and 16 */
    uint32_t *tiles;        /* as many: the splats' tiles; view->tiles for wide ones */
    uint16_t *ranks;        /* as many: how many splats of that tile came before */
    uint32_t *counts;       /* by tile, and one for wide ones */
    uint32_t count;
} trip_cpu_basket;

/* Most voxels of a chunk, and splats that they may become: one for each of two by two tiles. */
#define TRIP_CPU_CHUNK 2048
#define TRIP_CPU_CHUNK_SPLATS (4 * TRIP_CPU_CHUNK)

typedef struct trip_cpu_kernels {
    const char *isa;
    unsigned lanes;

    /* Adds voxels of one run to `staged` in draw order, leaving out transparent ones; at most
     * TRIP_CPU_STAGED - `filled` voxels. Returns the new fill. */
    uint32_t (*stage)(const trip_cpu_view *view, const trip_run *run, const uint32_t *voxels,
                      const uint32_t *normals, uint32_t count, bool reversed,
                      trip_cpu_staged *staged, uint32_t filled);
    /* Projects the first `count` staged voxels, the first of which is number `sequence` of the
     * chunk; those with pixels in the image become splats of the basket, in order. */
    void (*project)(const trip_cpu_view *view, const trip_cpu_staged *staged, uint32_t count,
                    uint32_t sequence, trip_cpu_lanes *lanes, trip_cpu_basket *basket);

    /* Empties a tile's pixels: transparent where the list has weight, closed elsewhere. */
    void (*tile_clear)(const trip_cpu_view *view, int x, int y, float *pixels);
    /* Takes up a tile for blending; `quarters` says which of its 16 x 16 quarters to draw. The
     * scratch's splats and local are set. */
    void (*tile_begin)(const trip_cpu_view *view, trip_cpu_scratch *s, int x, int y,
                       unsigned quarters, float *pixels);
    /* Blends splats[first] to splats[first + count - 1], which are this tile's. */
    void (*tile_blend)(trip_cpu_scratch *s, uint32_t first, uint32_t count);
    /* Blends one wide splat. */
    void (*tile_blend_wide)(trip_cpu_scratch *s, uint32_t splat);
    /* Ends with every splat in the pixels; true when some pixel may still take light. */
    bool (*tile_end)(trip_cpu_scratch *s);
    /* sum += w^2 layer, or sum = w^2 layer when it is the first. */
    void (*tile_merge)(const trip_cpu_view *view, int x, int y, const float *pixels, bool first,
                       float *sum);
    /* The finished picture of a tile into an image; sum NULL: nothing was drawn there. */
    void (*tile_finish)(const trip_cpu_view *view, int x, int y, const float *sum, float *rgba);
} trip_cpu_kernels;

#endif
