/* Compositing of footprints into a tile of the picture, by kernels in several instruction sets or
 * by a graphics device. The kernels are pure functions of their arguments and give the same bits in
 * every instruction set, since they fuse no operations. Any thread may call them with its own tile.
 */
#ifndef TRIP_GAUSSIAN_TILES_H
#define TRIP_GAUSSIAN_TILES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "budget.h"

/* A tile is a square of the picture. It consists of blocks of 4 x 4 pixels, row by row, and a block
 * of 16 pixels, row by row. A tile has one plane of floats for
 * each number of the enumeration. */
enum {
    TRIP_TILE_PX = 16,
    TRIP_TILE_PIXELS = TRIP_TILE_PX * TRIP_TILE_PX,
    TRIP_TILE_BLOCKS = TRIP_TILE_PIXELS / 16,
    TRIP_TILE_T = 0, /* transmittance; negative once the pixel is closed: takes no more */
    TRIP_TILE_RED,
    TRIP_TILE_GREEN,
    TRIP_TILE_BLUE,
    TRIP_TILE_DEPTH, /* sum of T alpha z; only if depth is wanted */
    TRIP_TILE_PLANES_MAX,
};

/* A projected Gaussian (gaussian_footprint.h). */
typedef struct trip_projected {
    double x, y;                      /* pixels */
    float across, across_shear, down; /* across_shear is across times shear */
    float limit;                      /* a little above the q at which alpha is 1/255 */
    float opacity, rgb[3], z;
    float reach_x, reach_y;
    uint32_t curved; /* 1 or 0 */
} trip_projected;

_Static_assert(sizeof(trip_projected) == 64, "a projected Gaussian fills a cache line");

/* The rest of a curved footprint. Bounds count from its centre. */
typedef struct trip_curve {
    float bend_x, bend_y, tilt, skew, turn;
    float left, right, top, bottom;
} trip_curve;

/* A projected Gaussian with its density along rays (gaussian_profile.h), for drawing by sheets.
 * Coordinates count along the axis of the sheets, in the direction of the rays. */
typedef struct trip_sheet_splat {
    trip_projected footprint;
    trip_curve curve; /* if the footprint is curved */
    float across, across_shear, down, slope_x, slope_y, variance, unit;
    double coordinate;   /* of the centre */
    int64_t first, last; /* sheets that it reaches */
} trip_sheet_splat;

enum { TRIP_SHEET_RUN = 16 }; /* sheets that are drawn at once */

/* A run of sheets, perpendicular to an axis. */
typedef struct trip_sheet_run {
    int64_t first; /* number of the first sheet; sheet n begins at n * thickness */
    double thickness;
    double r0, rx, ry; /* the component along the axis of the ray of p is r0 + rx p.x + ry p.y */
    double ox, oy;     /* so much the coordinate grows from pixel to pixel at a depth of 1 unit */
    bool parallel;
} trip_sheet_run;

typedef struct trip_tile_kernels {
    const char *isa;
    /* Draws splats[list[0]] to splats[list[count - 1]] into the tile with its corner at pixel (x,
     * y). `curves` has an element for each splat, or is NULL if none is curved. `open` has a bit
     * for each block with an open pixel. Without `depth`, its plane may be missing. */
    void (*draw)(float *planes, uint16_t *open, const trip_projected *splats,
                 const trip_curve *curves, const uint32_t *list, size_t count, int x, int y,
                 float termination, bool depth);
    /* Draws the splats that reach into a run, then composites its sheets front to back. Splats that
     * are thicker than a sheet share out their optical depth. */
    void (*draw_sheets)(float *planes, uint16_t *open, const trip_sheet_run *run,
                        const trip_sheet_splat *splats, const uint32_t *list, size_t count, int x,
                        int y, float termination, bool depth);
} trip_tile_kernels;

/* The lists of a piece. Tile t draws splats[pairs[first[t]]] and the count[t] - 1 next ones. */
typedef struct trip_tile_piece {
    const trip_projected *splats;
    const trip_curve *curves;      /* NULL if no footprint is curved */
    size_t splat_from, splat_to;   /* all indices in `pairs` lie in this range */
    const uint32_t *first, *count; /* for each tile */
    const uint32_t *pairs;
    size_t pair_count;
} trip_tile_piece;

typedef struct trip_tiles_params {
    int width, height;            /* of the picture, in pixels */
    size_t splats_max, pairs_max; /* of a piece */
    bool curved, depth;
    float termination;
    trip_budget *budget;
} trip_tiles_params;

/* The tiles of one picture on a device. */
typedef struct trip_tiles trip_tiles;

/* Composites in place of the kernels, with planes of its own. All calls come from one thread. */
typedef struct trip_tile_device {
    void *user;
    size_t batch_max; /* Gaussians that it should get at once */
    /* Begins a picture. Returns 0, a failure (reported), or 1 if the budget or the device has too
     * little memory (not reported). */
    int (*begin)(void *user, trip_tiles **out, const trip_tiles_params *params);
    /* Draws a piece. The lists may change afterwards. Sets open[t] to 0 for tiles that are known to
     * be closed, and skips tiles with 0. */
    int (*draw)(trip_tiles *t, const trip_tile_piece *piece, uint16_t *open);
    /* Writes the planes of `count` tiles, as the kernels would leave them. */
    int (*read)(trip_tiles *t, size_t first, size_t count, float *planes);
    void (*end)(trip_tiles *t);
} trip_tile_device;

/* Returns the kernels for the instruction set that the CPU renderer uses (cpu/kernels/isa.h), or
 * the one with this name. NULL or "" selects the widest. Reports TRIP_USAGE and returns NULL if it
 * cannot run here. */
const trip_tile_kernels *trip_tile_kernels_choose(const char *isa);

/* Returns the position of pixel (x, y) of a tile in its planes. */
static inline int trip_tile_place(int x, int y)
{
    return ((y >> 2) * (TRIP_TILE_PX / 4) + (x >> 2)) * 16 + (y & 3) * 4 + (x & 3);
}

#endif
