/* The store holds sheets and sample planes as rasters of voxels from a pool of fixed size. Rasters
 * are decoded from runs, and repeat the first voxels of their neighbours. The renderer's thread
 * owns the store. A function that starts a job returns after the job has ended. */
#ifndef TRIP_CPU_SHEETS_STORE_H
#define TRIP_CPU_SHEETS_STORE_H

#include "block.h"
#include "cpu/kernels/kernels.h"
#include "cpu/pool.h"
#include "cpu/sheets/integrals.h"
#include "draw_codes.h"
#include "reader.h"

/* Sets of squares of a raster. ALL holds the squares with cells that may be visible. LEFT, RIGHT,
 * ABOVE and BELOW hold the squares with such cells near that edge: segments that meet them may read
 * voxels beyond the edge. */
enum {
    TRIP_CPU_ALL,
    TRIP_CPU_LEFT,
    TRIP_CPU_RIGHT,
    TRIP_CPU_ABOVE,
    TRIP_CPU_BELOW,
    TRIP_CPU_EDGES
};
typedef uint64_t trip_cpu_edges[TRIP_CPU_EDGES];

/* A sheet, or a sample plane between two sheets. A sample plane has only `rasters` and `making`.
 * Arrays have one entry for each raster of the grid. */
typedef struct trip_cpu_sheet {
    int64_t number;                 /* index of the sheet in its list */
    int32_t *rasters;               /* numbers in the pool; 0 stands for absent */
    trip_cpu_square_ranges *ranges; /* defined for present rasters */
    _Atomic uint64_t *filled;       /* squares with voxels; defined for present rasters */
    uint64_t *visible;     /* squares with cells that may be visible up to the next sheet */
    trip_cpu_cells *cells; /* these cells; defined for rasters with visible squares */
    trip_cpu_edges *edges; /* `visible`, split by edges */
    /* Blurred functions only: the row that suffices for each square (sheet_rows()), defined for
     * present rasters, and the largest of them. */
    uint8_t (*rows)[64];
    _Atomic unsigned largest_row;
    uint64_t *needed;       /* squares from which visible segments read voxels */
    trip_cpu_making making; /* unused if trip_cpu_sheets_at_once() */
    bool prepared, shaded;  /* all ranges are found; all gradients are found */
} trip_cpu_sheet;

enum {
    TRIP_CPU_SHEETS_MAX = 20,                 /* sheets in memory at a time */
    TRIP_CPU_SAMPLES_MAX = TRIP_CPU_SEGMENTS, /* sample planes in memory at a time */
};

/* A rectangle of rasters along u and v, inclusive. */
typedef struct trip_cpu_rasters {
    int64_t first[2], last[2];
} trip_cpu_rasters;

typedef struct trip_cpu_store {
    trip_budget *budget;
    const trip_cpu_kernels *kernels;
    trip_cpu_pool *pool;
    const trip_draw_codes *draw; /* the codes that are interpolated */
    bool blurs;                  /* rasters have deviations */
    trip_cpu_codes codes;        /* stretch of the frame's draw codes */
    const trip_coordinates *coordinates;
    int axis; /* axis of the layer's lists */

    trip_cpu_voxels *voxels; /* the pool of rasters; raster 0 has only missing voxels */
    size_t voxels_bytes;
    trip_cpu_deviations *deviations; /* of the pool's rasters; NULL unless a frame has blurred */
    size_t deviations_bytes;
    int32_t *free; /* numbers of free rasters */
    uint32_t rasters, free_count;

    /* The grid of rasters, in rasters. The outermost rasters of the grid are absent. */
    int64_t first_u, first_v;
    int32_t across, down;
    char *grids; /* memory of the arrays below */
    size_t grids_bytes;
    unsigned sheet_room, sample_room; /* number of sheets and of sample planes with memory */
    trip_cpu_sheet sheets[TRIP_CPU_SHEETS_MAX], samples[TRIP_CPU_SAMPLES_MAX];
    uint64_t *some; /* squares visible in any segment of the group */
    uint64_t *open; /* squares to decode in the current sheet; at first all */
} trip_cpu_store;

/* Returns the bytes of sheets and sample planes of a rectangle, with a pool of `rasters` rasters.
 * Rasters have deviations if `blurs`. */
uint64_t trip_cpu_store_bytes(const trip_cpu_rasters *all, unsigned sheets, unsigned samples,
                              uint64_t rasters, bool blurs);
/* Returns the bytes that the store holds from the budget. */
uint64_t trip_cpu_store_held_bytes(const trip_cpu_store *s);
/* Makes room for sheets and sample planes of a rectangle and for `min` to `max` rasters, in at most
 * `room` bytes. All sheets are empty afterwards. Returns false if `room` is too small. */
bool trip_cpu_store_fit(trip_cpu_store *s, const trip_cpu_rasters *all, unsigned sheets,
                        unsigned samples, uint64_t min, uint64_t max, uint64_t room);
/* Moves the grid to a rectangle that is no larger than the one of trip_cpu_store_fit(). Empties all
 * sheets. */
void trip_cpu_store_move(trip_cpu_store *s, const trip_cpu_rasters *to);
void trip_cpu_store_release(trip_cpu_store *s);

static inline bool trip_cpu_rasters_have(const trip_cpu_rasters *b, int64_t u, int64_t v)
{
    return u >= b->first[0] && u <= b->last[0] && v >= b->first[1] && v <= b->last[1];
}

/* Returns the index of raster (u, v) in the arrays of the grid. */
static inline size_t trip_cpu_store_at(const trip_cpu_store *s, int64_t u, int64_t v)
{
    return (size_t)((v - s->first_v) * s->across + (u - s->first_u));
}

static inline size_t trip_cpu_store_grid(const trip_cpu_store *s)
{
    return (size_t)s->across * (size_t)s->down;
}

/* Takes a raster for position `at`; the caller must clear it. Returns false if none is free. */
bool trip_cpu_store_take(trip_cpu_store *s, trip_cpu_sheet *sheet, size_t at);
/* Marks all voxels of a raster as missing. Any thread may call it. */
void trip_cpu_store_clear(const trip_cpu_store *s, int32_t raster);
/* Returns all rasters of a sheet or sample plane to the pool. */
void trip_cpu_store_drop(trip_cpu_store *s, trip_cpu_sheet *sheet);

/* Decodes a run's voxels into the open squares of a sheet's present rasters. Several threads may
 * decode runs at a time if the runs share no voxel. */
void trip_cpu_store_decode(const trip_cpu_store *s, const trip_cpu_sheet *sheet,
                           const trip_block *block, const trip_run *run);

/* One sheet or sample plane of a job, with its neighbours. A job handles several, raster by raster.
 */
typedef struct trip_cpu_sheet_work {
    trip_cpu_sheet *sheet;
    /* For cells, `other` is the next sheet. For sample planes, these are the sheets on both sides.
     * For gradients, these are the sheets before and after in index order; NULL stands for none. */
    const trip_cpu_sheet *other, *third;
    /* For cells and kernels of 64 voxels: the sheets before `sheet` and behind `other`, in draw
     * order; NULL stands for none. */
    const trip_cpu_sheet *before, *behind;
    trip_kernel kernel;
    bool everywhere; /* for cells: all squares about visible ones are needed */
} trip_cpu_sheet_work;

/* Prepares complete sheets: copies the first voxels of neighbouring rasters and finds the ranges.
 */
void trip_cpu_store_prepare(trip_cpu_store *s, const trip_cpu_sheet_work *work, unsigned count);
/* Finds the squares and cells that may be visible between prepared sheets and the next sheet,
 * `other`. Also finds the squares needed for drawing them. With kernels of 64 voxels, a cell may be
 * visible if it has four corners on a sheet and a value about its square is visible. */
void trip_cpu_store_find_visible(trip_cpu_store *s, const trip_cpu_sheet_work *work, unsigned count,
                                 const trip_cpu_tf *f);
/* Finds all gradients of prepared sheets. */
void trip_cpu_store_find_gradients(trip_cpu_store *s, const trip_cpu_sheet_work *work,
                                   unsigned count);
/* Takes the needed rasters for a sample plane between two sheets. Returns false and takes none if
 * the pool is full. */
bool trip_cpu_store_take_sample(trip_cpu_store *s, const trip_cpu_sheet_work *work);
/* The first function marks all voxels of sample planes as missing, the second one interpolates
 * them. */
void trip_cpu_store_clear_samples(trip_cpu_store *s, const trip_cpu_sheet_work *work,
                                  unsigned count);
void trip_cpu_store_cut(trip_cpu_store *s, const trip_cpu_sheet_work *work, unsigned count);

#endif
