/* What the kernels of `post` (sheet.h) share: the values of sheets in rasters, the slices cut from
 * them, the transfer function's integrals, and the constants of a pass. */
#ifndef TRIP_CPU_SHEETS_H
#define TRIP_CPU_SHEETS_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "camera.h"
#include "coordinates.h"
#include "cpu/kernels/kernel_effects.h"
#include "kernel.h"
#include "settings.h"

struct trip_frame;

/* trip_settings_early_termination(), but above 0, so that pixels without weight, which let nothing
 * through, are saturated, and numbers stay normal. What is behind so little changes no float of a
 * picture. */
static inline float trip_cpu_early_termination(const trip_settings *s)
{
    const double min = 0x1p-60;
    return (float)fmax(trip_settings_early_termination(s), min);
}

/* A voxel's code less 32768: at least TRIP_CPU_CODE_MIN, so that code 0 is taken for 1. */
#define TRIP_CPU_CODE_BIAS 32768
#define TRIP_CPU_CODE_MISSING INT16_MIN
#define TRIP_CPU_CODE_MIN (INT16_MIN + 1)

/* Half of the differences of codes an index along u, v and the sheets, rounded down: of two voxels
 * that lie beside one another codes may differ by 16 bits. */
typedef struct trip_cpu_gradient {
    int16_t along[3];
} trip_cpu_gradient;

/* A raster is an aligned square of 64 x 64 voxels of a sheet or slice, and the first column and row
 * of those to the right and below, so that it holds all corners of the cells that start in it.
 * Vectors of voxels are read and written up to TRIP_CPU_RASTER_ROOM voxels beyond the last. */
#define TRIP_CPU_RASTER 64
#define TRIP_CPU_RASTER_LOG2 6
#define TRIP_CPU_RASTER_STRIDE (TRIP_CPU_RASTER + 2)
#define TRIP_CPU_RASTER_ROOM 14
#define TRIP_CPU_RASTER_VOXELS                                                                     \
    ((TRIP_CPU_RASTER + 1) * TRIP_CPU_RASTER_STRIDE + TRIP_CPU_RASTER_ROOM)

typedef struct trip_cpu_voxels {
    int16_t codes[TRIP_CPU_RASTER_VOXELS];
    trip_cpu_gradient gradients[TRIP_CPU_RASTER_VOXELS]; /* of voxels that are there */
} trip_cpu_voxels;

/* Codes of a pool of rasters are counted in 32 bits. */
#define TRIP_CPU_RASTERS_MAX (INT32_MAX / (int32_t)(sizeof(trip_cpu_voxels) / sizeof(int16_t)))

/* A raster is divided into 8 x 8 squares, a bit each, row by row. Those at its right and its lower
 * edge have the first column and row beyond it, too. */
#define TRIP_CPU_SQUARES_ACROSS (TRIP_CPU_RASTER / 8)
#define TRIP_CPU_COLUMN_0 UINT64_C(0x0101010101010101)
#define TRIP_CPU_COLUMN_7 UINT64_C(0x8080808080808080)

/* What the cells that start in a square lie between at one sheet, as biased codes; least > most
 * where there are none. */
typedef struct trip_cpu_square_ranges {
    int16_t min[64], max[64];
} trip_cpu_square_ranges;

/* The cells of a raster that may show between a sheet and the next: a bit each, a word a row. */
typedef struct trip_cpu_cells {
    uint64_t rows[TRIP_CPU_RASTER];
    uint64_t fours[TRIP_CPU_RASTER]; /* those of a row and the three below it together */
} trip_cpu_cells;

/* The rasters of a sheet or slice in a grid of `across` x `down`, the outermost of which are
 * absent: the number of each in the pool; 0 is the raster in which every voxel is missing. */
typedef struct trip_cpu_slice {
    const int32_t *rasters;
    double coordinate; /* along the list's axis: a place, where spacing is uneven */
    const struct trip_cpu_making *making; /* NULL: all of it is there */
} trip_cpu_slice;

/* Gradients of a sheet, and all voxels of a slice between two, are made square by square, when a
 * ray first meets one, by the thread that draws it: what is hidden or transparent is not made, and
 * what is made is in that processor's cache. */
typedef struct trip_cpu_making {
    const int32_t *rasters;
    _Atomic uint64_t *begun, *made; /* squares, of rasters that are there */
    /* Of a sheet: those before and behind it in index order; NULL where there is none. */
    const int32_t *before, *behind;
    /* Of a slice: the sheets on both sides, and weights as of sheet_between(). */
    const struct trip_cpu_making *from, *to;
    int32_t weights;
} trip_cpu_making;

/* Of a segment, with kernels of 64 voxels: the sheets from one before it to one behind, by
 * ascending index. NULL: it is not there, and its voxels count as missing ones do; beyond the grid
 * its last sheet repeats. */
typedef struct trip_cpu_about {
    const int32_t *rasters[TRIP_KERNEL_TAPS];
    int64_t number; /* of the second */
} trip_cpu_about;

/* Integrals of the transfer function from code 0 to each entry, times a factor that makes the
 * greatest 2^30: of extinction, and of extinction times each colour component. Differences of them
 * are exact but for the rounding of each. Entries are 1, 2 or 4 codes apart, as far as the function
 * is linear between them: fewer stay in a processor's cache. */
#define TRIP_CPU_ENTRIES_MAX 65537

/* Where segments have a closed form (closed_form.h): x is scale c + offset of a biased code times
 * TRIP_CPU_CODE_PARTS, extinction is per voxel_world. */
#define TRIP_CPU_CODE_PARTS 16384
typedef struct trip_cpu_closed_form {
    float scale, offset, k[4], q0[3], q1[3];
    bool ramp, coloured;
    float min; /* of a ramp: a segment whose x do not exceed it shows nothing */
} trip_cpu_closed_form;

typedef struct trip_cpu_integrals {
    int32_t (*sums)[4];  /* TRIP_CPU_ENTRIES_MAX: extinction, red, green, blue */
    int32_t (*at)[4];    /* what they would grow by to the next entry if all was as at this one */
    int entry_log2;      /* codes from one entry to the next */
    float extinction;    /* 1 of sums[0], per voxel_world */
    int32_t first, last; /* entries with extinction are among these; first > last: none */
    bool is_closed;      /* none of what stands above is used, but: */
    trip_cpu_closed_form closed;
} trip_cpu_integrals;

/* Segments of a group: at most so many, and one slice more. */
#define TRIP_CPU_SEGMENTS 64

typedef struct trip_cpu_group {
    trip_cpu_voxels *pool;
    int64_t first_u, first_v; /* voxels: of the grid of rasters */
    int32_t across, down;
    unsigned segments;
    trip_cpu_slice samples_per_sheet[TRIP_CPU_SEGMENTS + 1]; /* in draw order */
    /* For each segment and raster of the grid: the squares in which some cell may show, and those
     * cells, of rasters that have some. */
    const uint64_t *visible[TRIP_CPU_SEGMENTS];
    const trip_cpu_cells *cells[TRIP_CPU_SEGMENTS];
    const uint64_t *needed[TRIP_CPU_SEGMENTS]; /* squares with voxels that rays may take there */
    bool leaps;                  /* rays may light themselves at a sheet from beyond these */
    const trip_cpu_about *about; /* for each segment; NULL: the kernel is linear */
    const uint64_t *some;        /* squares visible in any segment */
    /* Only rays whose cell at the first slice is in [lo, hi) are drawn; voxels, as positions are.
     */
    bool windowed;
    int32_t lo[2], hi[2];
} trip_cpu_group;

/* Constants of a pass over the sheets of a list. Vectors are by the list's own axes: u, v, sheet.
 */
typedef struct trip_cpu_sheet_view {
    const struct trip_frame *of;
    const trip_cpu_integrals *integrals;
    const trip_coordinates *coordinates; /* of uneven spacing; else NULL */
    int axis;
    trip_kernel kernel;
    int64_t voxels[2]; /* of the grid along u and v */
    bool ortho, shading, headlight, point_light;
    float early_termination; /* trip_cpu_saturation() */
    double direction;        /* 1: ascending; -1 */
    double eye[3], r0[3], rx[3], ry[3];
    double middle;        /* of the grid along the sheets: what is cut away is counted from there */
    double steepest;      /* rays move at most so far along u or v from one sheet to the next */
    double world[3][3];   /* row, column: index_to_world of u, v, sheet, over voxel_world */
    float gradient[3][3]; /* from differences of codes to half of world space, over gradient_full */
    float light[3];       /* without headlight: the way to it in the world; or its place */
    float to_eye[3];      /* in parallel views */
    int clips; /* half-spaces that rays are cut to, [u, v, sheet, offset] as in trip_clip */
    double clip[TRIP_CLIP_MAX][4];
    bool tinted; /* all has one colour before it is lit: */
    float tint[3];
    trip_cpu_effects effects;
} trip_cpu_sheet_view;

#endif
