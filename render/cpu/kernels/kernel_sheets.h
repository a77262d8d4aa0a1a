/* Data of the kernels for `post` (sheet.h): rasters of sheets, sample planes between sheets, the
 * transfer function's integrals, and the constants of a pass. */
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

/* Returns trip_settings_early_termination(), but at least 2^-60. A positive threshold makes pixels
 * without weight terminated and keeps numbers normal. Light behind a transmittance below 2^-60
 * changes no float of a picture. */
static inline float trip_cpu_early_termination(const trip_settings *s)
{
    const double min = 0x1p-60;
    return (float)fmax(trip_settings_early_termination(s), min);
}

/* Rasters store code - TRIP_CPU_CODE_BIAS, but at least TRIP_CPU_CODE_MIN, so that code 0 counts
 * as 1. */
#define TRIP_CPU_CODE_BIAS 32768
#define TRIP_CPU_CODE_MISSING INT16_MIN
#define TRIP_CPU_CODE_MIN (INT16_MIN + 1)

/* Half of the change of the code per index along u, v and the sheets, rounded down. The halves fit
 * 16 bits, because codes of neighbouring voxels can differ by up to 2^16 - 1. */
typedef struct trip_cpu_gradient {
    int16_t along[3];
} trip_cpu_gradient;

/* A raster holds an aligned square of 64 x 64 voxels of a sheet or sample plane. It repeats the
 * first column and row of the rasters to the right and below, so that it holds all corners of its
 * cells. Kernels read and write vectors up to TRIP_CPU_RASTER_ROOM voxels past the last. */
#define TRIP_CPU_RASTER 64
#define TRIP_CPU_RASTER_LOG2 6
#define TRIP_CPU_RASTER_STRIDE (TRIP_CPU_RASTER + 2)
#define TRIP_CPU_RASTER_ROOM 14
#define TRIP_CPU_RASTER_VOXELS                                                                     \
    ((TRIP_CPU_RASTER + 1) * TRIP_CPU_RASTER_STRIDE + TRIP_CPU_RASTER_ROOM)

typedef struct trip_cpu_voxels {
    int16_t codes[TRIP_CPU_RASTER_VOXELS];
    trip_cpu_gradient gradients[TRIP_CPU_RASTER_VOXELS]; /* undefined for missing voxels */
} trip_cpu_voxels;

/* The deviation codes of a raster (deviation.h), times TRIP_CPU_DEVIATION_PARTS. They exist only in
 * frames that blur the function, and are undefined for missing voxels. */
typedef int16_t trip_cpu_deviations[TRIP_CPU_RASTER_VOXELS];
#define TRIP_CPU_DEVIATION_PARTS 128

/* Offset of a square's voxel in a raster from the square's first voxel, by Morton number n. */
#define TRIP_CPU_PLACE(n)                                                                          \
    ((((n) >> 1 & 1) | ((n) >> 2 & 2) | ((n) >> 3 & 4)) * TRIP_CPU_RASTER_STRIDE +                 \
     (((n)&1) | ((n) >> 1 & 2) | ((n) >> 2 & 4)))
#define TRIP_CPU_PLACES4(n)                                                                        \
    TRIP_CPU_PLACE(n), TRIP_CPU_PLACE((n) + 1), TRIP_CPU_PLACE((n) + 2), TRIP_CPU_PLACE((n) + 3)
#define TRIP_CPU_PLACES16(n)                                                                       \
    TRIP_CPU_PLACES4(n), TRIP_CPU_PLACES4((n) + 4), TRIP_CPU_PLACES4((n) + 8),                     \
        TRIP_CPU_PLACES4((n) + 12)
static const uint16_t trip_cpu_places[64] = { TRIP_CPU_PLACES16(0), TRIP_CPU_PLACES16(16),
                                              TRIP_CPU_PLACES16(32), TRIP_CPU_PLACES16(48) };
#undef TRIP_CPU_PLACES16
#undef TRIP_CPU_PLACES4
#undef TRIP_CPU_PLACE

/* An index of a code in a pool of rasters must fit 32 bits. */
#define TRIP_CPU_RASTERS_MAX (INT32_MAX / (int32_t)(sizeof(trip_cpu_voxels) / sizeof(int16_t)))

/* A raster has 8 x 8 squares, a bit each in a word, row by row. Squares at its right and lower
 * edges include the repeated column and row. */
#define TRIP_CPU_SQUARES_ACROSS (TRIP_CPU_RASTER / 8)
#define TRIP_CPU_COLUMN_0 UINT64_C(0x0101010101010101)
#define TRIP_CPU_COLUMN_7 UINT64_C(0x8080808080808080)

/* The range of biased codes at the corners of a square's cells in one sheet. min > max means no
 * cells. */
typedef struct trip_cpu_square_ranges {
    int16_t min[64], max[64];
} trip_cpu_square_ranges;

/* The cells of a raster that may be visible between a sheet and the next, a bit each. */
typedef struct trip_cpu_cells {
    uint64_t rows[TRIP_CPU_RASTER];
    uint64_t fours[TRIP_CPU_RASTER]; /* bitwise or of a row and the three below it */
} trip_cpu_cells;

/* A sheet or sample plane as a grid of `across` x `down` rasters (trip_cpu_group). `rasters` holds
 * their numbers in the pool. Number 0 is the raster in which every voxel is missing. The outermost
 * rasters of the grid always have number 0. */
typedef struct trip_cpu_sample {
    const int32_t *rasters;
    double coordinate; /* along the list's axis, in voxels; with uneven spacing, a position
                          (coordinates.h) */
    const struct trip_cpu_making *making; /* NULL if the whole sample plane is made */
} trip_cpu_sample;

/* Squares that threads make on demand: bit masks, one word per raster of the grid. A thread makes
 * the squares that it was the first to add to `begun`. */
typedef struct trip_cpu_on_demand {
    _Atomic uint64_t *begun, *made;
} trip_cpu_on_demand;

/* State for making a sheet or sample plane on demand. The codes of a sample plane between two
 * sheets, and gradients, are made square by square. The first thread that draws a ray through a
 * square makes it: codes if the segment may be visible, gradients if it is. Hidden and transparent
 * squares are thus never made, and new data is in the cache of its reader. */
typedef struct trip_cpu_making {
    const int32_t *rasters;
    trip_cpu_on_demand codes, gradients; /* a sheet has its codes from the start */
    /* For a sheet: the sheets before and behind it in index order, or NULL. */
    const int32_t *before, *behind;
    /* For a sample plane: the sheets on both sides, and weights as in sheet_between(). NULL for a
     * sheet.
     */
    const struct trip_cpu_making *from, *to;
    int32_t weights;
} trip_cpu_making;

/* The four sheets that kernels of 64 voxels read for a segment, by ascending index: from one before
 * the segment to one behind it. NULL stands for an absent sheet, with all voxels missing. The first
 * and last sheets of the grid repeat beyond it. */
typedef struct trip_cpu_about {
    const int32_t *rasters[TRIP_KERNEL_TAPS];
    int64_t number; /* sheet index of rasters[1] */
} trip_cpu_about;

/* The two sheets of a segment with the nearest value: the nearer one, and the rasters of the other.
 */
typedef struct trip_cpu_pair {
    const trip_cpu_making *near;
    const int32_t *other;
} trip_cpu_pair;

/* Integrals of the transfer function from code 0 to each entry: of extinction, and of extinction
 * times each colour component. They are scaled so that the largest is 2^30. Differences are exact
 * except for the rounding of each integral. Entries are 1, 2 or 4 codes apart, if the function is
 * linear between them. Fewer entries stay in a processor's cache. */
#define TRIP_CPU_ENTRIES_MAX 65537

/* The transfer function in closed form (closed_form.h): x = scale c + offset, where c is a biased
 * code times TRIP_CPU_CODE_PARTS. Extinction is per voxel_world. */
#define TRIP_CPU_CODE_PARTS 16384
typedef struct trip_cpu_closed_form {
    float scale, offset, k[4], q0[3], q1[3];
    bool ramp, coloured;
    float min; /* for a ramp: a segment with both x at most `min` is transparent */
} trip_cpu_closed_form;

typedef struct trip_cpu_integrals {
    int32_t (*sums)[4];  /* TRIP_CPU_ENTRIES_MAX rows: extinction, red, green, blue */
    int32_t (*at)[4];    /* growth of `sums` per entry if the function were constant at this entry's
                            values */
    int entry_log2;      /* log2 of the codes from one entry to the next */
    float extinction;    /* extinction per voxel_world for one unit of sums[0] */
    int32_t first, last; /* range of the entries with extinction; empty if first > last */
    bool is_closed;      /* `closed` replaces all fields above */
    int32_t end;         /* biased code at which the transfer function ends; constant behind it */
    trip_cpu_closed_form closed;
} trip_cpu_integrals;

/* The integrals of a blurred function (blurred_function.h), row after row. Row 0 is the function
 * itself. The layout of a row lets kernels read it like four integrals. */
typedef struct trip_cpu_blurred_row {
    int32_t first;    /* the entry of code 0 */
    int32_t log2;     /* log2 of the codes from one entry to the next */
    int32_t half;     /* half of an entry's codes, times TRIP_CPU_CODE_PARTS */
    float extinction; /* extinction per voxel_world for one unit of sums[0] */
} trip_cpu_blurred_row;

typedef struct trip_cpu_blurred {
    trip_cpu_blurred_row *rows;   /* NULL if nothing is blurred */
    int32_t (*sums)[4], (*at)[4]; /* as in trip_cpu_integrals; each row has a unit of its own */
} trip_cpu_blurred;

#define TRIP_CPU_BLURRED_ROWS 33
#define TRIP_CPU_BLURRED_BEFORE 4

/* Maximum number of segments in a group. A group has one sample plane more than segments. */
#define TRIP_CPU_SEGMENTS 64

typedef struct trip_cpu_group {
    trip_cpu_voxels *pool;
    trip_cpu_deviations *deviations; /* of the pool's rasters; NULL if nothing is blurred */
    int64_t first_u, first_v;        /* voxel at the corner of the grid of rasters */
    int32_t across, down;
    unsigned segments;
    trip_cpu_sample samples[TRIP_CPU_SEGMENTS + 1]; /* in draw order */
    /* For each segment and raster of the grid: squares with a cell that may be visible, and these
     * cells. Cells are undefined for rasters without such squares. */
    const uint64_t *visible[TRIP_CPU_SEGMENTS];
    const trip_cpu_cells *cells[TRIP_CPU_SEGMENTS];
    const uint64_t *needed[TRIP_CPU_SEGMENTS]; /* squares with voxels that rays may read */
    bool leaps;                  /* at a sheet, rays may read gradients outside `needed` */
    const trip_cpu_about *about; /* for each segment; NULL selects the linear kernel */
    trip_cpu_pair nearest[TRIP_CPU_SEGMENTS]; /* set for the nearest value only */
    const uint64_t *some;                     /* squares visible in any segment */
    /* If set, only rays with a cell in [lo, hi) at the first sample plane are drawn. Units: voxels
     * of the grid of rasters. */
    bool windowed;
    int32_t lo[2], hi[2];
} trip_cpu_group;

/* Constants of a pass over the sheets of a list. Vectors use the list's axes: u, v, sheet. */
typedef struct trip_cpu_sheet_view {
    const struct trip_frame *of;
    const trip_cpu_integrals *integrals;
    const trip_cpu_blurred *blurred;
    const trip_coordinates *coordinates; /* NULL with even spacing */
    int axis;
    trip_kernel kernel;
    /* For the nearest value: the table of the transfer function, and the map from stretched codes
     * to its entries, code = (stretched >> code_shift) + code_first. */
    const struct trip_tf_entry *table;
    int code_shift, code_first;
    float voxel_world;
    int64_t voxels[2]; /* size of the grid along u and v */
    bool ortho, shading, headlight, point_light;
    float early_termination; /* trip_cpu_early_termination() */
    double direction;        /* 1 draws sheets in ascending order, -1 in descending order */
    double eye[3], r0[3], rx[3], ry[3];
    double middle;      /* of the grid along the sheets; clipping distances start there */
    double steepest;    /* maximum movement of rays along u or v from one sheet to the next */
    double world[3][3]; /* [row][column]: index_to_world for u, v, sheet, divided by voxel_world */
    float gradient[3][3]; /* from the sum of two gradients to their mean in world space, divided by
                             gradient_full */
    float light[3];  /* without headlight: direction to the light in world space, or the position of
                        a point light */
    float to_eye[3]; /* only in parallel views */
    int clips; /* number of half-spaces that clip the rays; [u, v, sheet, offset] as in trip_clip */
    double clip[TRIP_CLIP_MAX][4];
    bool has_debug_colour; /* `debug_colour` replaces all colours before lighting */
    float debug_colour[3];
    trip_cpu_effects effects;
} trip_cpu_sheet_view;

#endif
