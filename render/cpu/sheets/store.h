/* The sheets and slices at hand: rasters of voxels from a pool of fixed size, decoded from runs,
 * completed with what lies beside them. Owned by the renderer's thread, which no job runs beside;
 * those that the functions here start end before they return. */
#ifndef TRIP_CPU_SHEETS_STORE_H
#define TRIP_CPU_SHEETS_STORE_H

#include "block.h"
#include "cpu/kernels/kernels.h"
#include "cpu/pool.h"
#include "cpu/sheets/integrals.h"
#include "reader.h"

/* Squares of a raster in which cells may show: all, and those with such cells so near to an edge
 * that both ends of a segment that meets these depend on voxels of the square beyond it. */
enum {
    TRIP_CPU_ALL,
    TRIP_CPU_LEFT,
    TRIP_CPU_RIGHT,
    TRIP_CPU_ABOVE,
    TRIP_CPU_BELOW,
    TRIP_CPU_EDGES
};
typedef uint64_t trip_cpu_edges[TRIP_CPU_EDGES];

/* A sheet, or a slice between two. */
typedef struct trip_cpu_sheet {
    int64_t number;                 /* of the sheet */
    int32_t *rasters;               /* the number of each in the pool; 0: absent */
    trip_cpu_square_ranges *ranges; /* of sheets; of rasters that are there */
    _Atomic uint64_t *filled;       /* squares with voxels; of rasters that are there */
    uint64_t *visible;              /* squares in which cells may show from here to the next */
    trip_cpu_cells *cells;          /* those cells, of rasters with visible squares */
    trip_cpu_edges *edges;          /* these squares by edges */
    uint64_t *needed;               /* squares of which segments that may show take voxels */
    trip_cpu_making making;         /* but for frames whose sheets and slices are made at once */
    bool prepared, shaded;          /* ranges are there; all gradients are */
} trip_cpu_sheet;

enum {
    TRIP_CPU_SHEETS_MAX = 20,                /* at hand at once */
    TRIP_CPU_SLICES_MAX = TRIP_CPU_SEGMENTS, /* between sheets */
};

/* A rectangle of rasters along u and v, inclusive. */
typedef struct trip_cpu_rasters {
    int64_t first[2], last[2];
} trip_cpu_rasters;

typedef struct trip_cpu_store {
    trip_budget *budget;
    const trip_cpu_kernels *kernels;
    trip_cpu_pool *pool;
    trip_cpu_codes codes; /* of the frame's data set */
    const trip_coordinates *coordinates;
    int axis; /* of the layer's lists */

    trip_cpu_voxels *voxels; /* rasters */
    size_t voxels_bytes;
    int32_t *free; /* numbers of free rasters */
    uint32_t rasters, free_count;

    /* The grid of rasters, the outermost of which are absent; in rasters. */
    int64_t first_u, first_v;
    int32_t across, down;
    char *grids; /* of the sheets and slices below */
    size_t grids_bytes;
    unsigned sheet_room; /* sheets that there is room for */
    trip_cpu_sheet sheets[TRIP_CPU_SHEETS_MAX], samples_per_sheet[TRIP_CPU_SLICES_MAX];
    uint64_t *some; /* squares visible in any of the segments drawn at a time */
    uint64_t *open; /* squares of a sheet that voxels are decoded of; at first all */
} trip_cpu_store;

/* What so many sheets of a rectangle take, with a pool of so many rasters. */
uint64_t trip_cpu_store_bytes(const trip_cpu_rasters *all, unsigned sheets, uint64_t rasters);
/* What is taken of the budget. */
uint64_t trip_cpu_store_held_bytes(const trip_cpu_store *s);
/* Room for so many sheets of a rectangle, and for `least` to `most` rasters in at most `room`
 * bytes; every sheet is absent then. False where that is too little. */
bool trip_cpu_store_fit(trip_cpu_store *s, const trip_cpu_rasters *all, unsigned sheets,
                        uint64_t min, uint64_t max, uint64_t room);
/* Moves to a rectangle that is no larger than the one there is room for; every sheet is absent. */
void trip_cpu_store_move(trip_cpu_store *s, const trip_cpu_rasters *to);
void trip_cpu_store_release(trip_cpu_store *s);

static inline bool trip_cpu_rasters_have(const trip_cpu_rasters *b, int64_t u, int64_t v)
{
    return u >= b->first[0] && u <= b->last[0] && v >= b->first[1] && v <= b->last[1];
}

/* Where raster (u, v), in rasters, is in the grid's tables. */
static inline size_t trip_cpu_store_at(const trip_cpu_store *s, int64_t u, int64_t v)
{
    return (size_t)((v - s->first_v) * s->across + (u - s->first_u));
}

static inline size_t trip_cpu_store_grid(const trip_cpu_store *s)
{
    return (size_t)s->across * (size_t)s->down;
}

/* A raster, which is to be cleared; false when none is free. */
bool trip_cpu_store_take(trip_cpu_store *s, trip_cpu_sheet *sheet, size_t at);
/* All of a raster is missing. Any thread may clear one. */
void trip_cpu_store_clear(const trip_cpu_store *s, int32_t raster);
/* Every raster of a sheet or slice is free again. */
void trip_cpu_store_drop(trip_cpu_store *s, trip_cpu_sheet *sheet);

/* A run's voxels into open squares of rasters of a sheet that are there. May run beside those of
 * other runs. */
void trip_cpu_store_decode(const trip_cpu_store *s, const trip_cpu_sheet *sheet,
                           const trip_block *block, const trip_run *run);

/* What is done with a sheet or slice: several of them at a time, raster by raster. */
typedef struct trip_cpu_sheet_work {
    trip_cpu_sheet *sheet;
    /* Cells and slices: the sheets on both sides. Gradients: those before and after in index order,
     * NULL where there is none. */
    const trip_cpu_sheet *other, *third;
    /* Cells, with kernels of 64 voxels: the sheets beyond, in draw order; NULL where there is none.
     */
    const trip_cpu_sheet *before, *behind;
    trip_kernel kernel;
    bool everywhere; /* cells: all squares about those that may show are needed */
} trip_cpu_sheet_work;

/* Complete sheets' rasters get the first voxels of those beside them, and ranges. */
void trip_cpu_store_prepare(trip_cpu_store *s, const trip_cpu_sheet_work *work, unsigned count);
/* Which squares and cells may show from prepared sheets to the next, `other`, and which squares are
 * needed then. With kernels of 64 voxels all cells may that have four corners at a sheet, of
 * squares about which the function shows something. */
void trip_cpu_store_find_visible(trip_cpu_store *s, const trip_cpu_sheet_work *work, unsigned count,
                                 const trip_cpu_tf *f);
/* All gradients of prepared sheets' voxels. */
void trip_cpu_store_find_gradients(trip_cpu_store *s, const trip_cpu_sheet_work *work,
                                   unsigned count);
/* Rasters for a slice between two sheets, where they are needed. False when the pool is full; then
 * it is empty. */
bool trip_cpu_store_take_slice(trip_cpu_store *s, const trip_cpu_sheet_work *work);
/* All voxels of slices are missing; or are made. */
void trip_cpu_store_clear_samples_per_sheet(trip_cpu_store *s, const trip_cpu_sheet_work *work,
                                            unsigned count);
void trip_cpu_store_cut(trip_cpu_store *s, const trip_cpu_sheet_work *work, unsigned count);

#endif
