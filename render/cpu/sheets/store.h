/* The sheets and slices at hand: blocks of voxels from a pool of fixed size, decoded from runs,
 * completed with what lies beside them. Owned by the renderer's thread, which no job runs beside;
 * those that the functions here start end before they return. */
#ifndef TRIP_CPU_SHEETS_STORE_H
#define TRIP_CPU_SHEETS_STORE_H

#include "block.h"
#include "cpu/kernels/kernels.h"
#include "cpu/pool.h"
#include "cpu/sheets/integrals.h"
#include "reader.h"

/* A sheet, or a slice between two. */
typedef struct trip_cpu_sheet {
    int64_t number;                 /* of the sheet */
    int32_t *blocks;                /* where each starts in the pool; 0: absent */
    trip_cpu_square_ranges *ranges; /* of sheets; of blocks that are there */
    uint64_t *visible;              /* squares in which cells may show from here to the next */
    trip_cpu_cells *cells;          /* those of squares that are visible */
    bool prepared, shaded;          /* ranges are there; gradients are */
} trip_cpu_sheet;

enum {
    TRIP_CPU_SHEETS_MAX = 20,                /* at hand at once */
    TRIP_CPU_SLICES_MAX = TRIP_CPU_SEGMENTS, /* between sheets */
};

typedef struct trip_cpu_store {
    trip_budget *budget;
    const trip_cpu_kernels *kernels;
    trip_cpu_pool *pool;

    trip_cpu_voxel *voxels; /* blocks of TRIP_CPU_BLOCK_VOXELS */
    size_t voxels_bytes;
    int32_t *free; /* where free blocks start */
    uint32_t blocks, free_count;

    /* The grid of blocks, the outermost of which are absent; in blocks. */
    int64_t first_u, first_v;
    int32_t across, down;
    char *grids; /* of the sheets and slices below */
    size_t grids_bytes;
    trip_cpu_sheet sheets[TRIP_CPU_SHEETS_MAX], slices[TRIP_CPU_SLICES_MAX];
    uint64_t *some; /* squares visible in any of the segments drawn at a time */
} trip_cpu_store;

/* Room for lists whose voxels lie in [first, last] along u and v (blocks, inclusive); every sheet
 * is absent then. */
int trip_cpu_store_fit(trip_cpu_store *s, const int64_t first[2], const int64_t last[2]);
void trip_cpu_store_release(trip_cpu_store *s);

/* Where block (u, v), in blocks, is in the grid's tables. */
static inline size_t trip_cpu_store_at(const trip_cpu_store *s, int64_t u, int64_t v)
{
    return (size_t)((v - s->first_v) * s->across + (u - s->first_u));
}

static inline size_t trip_cpu_store_grid(const trip_cpu_store *s)
{
    return (size_t)s->across * (size_t)s->down;
}

/* A block in which all is missing; false when none is free. */
bool trip_cpu_store_take(trip_cpu_store *s, trip_cpu_sheet *sheet, size_t at);
/* Every block of a sheet or slice is free again. */
void trip_cpu_store_drop(trip_cpu_store *s, trip_cpu_sheet *sheet);

/* A run's voxels into blocks of a sheet that are there. May run beside those of other runs. */
void trip_cpu_store_decode(const trip_cpu_store *s, const trip_cpu_sheet *sheet,
                           const trip_block *block, const trip_run *run, unsigned tile_log2);

/* A complete sheet's blocks get the first voxels of those beside them, and ranges. */
void trip_cpu_store_prepare(trip_cpu_store *s, trip_cpu_sheet *sheet);
/* Which squares may show from a prepared sheet to the next. */
void trip_cpu_store_find_visible(trip_cpu_store *s, trip_cpu_sheet *from, const trip_cpu_sheet *to,
                                 const trip_cpu_function *f);
/* Gradients of the voxels of cells that may show on either side of a prepared sheet; `below` and
 * `above` are the sheets before and after it in index order, NULL where there is none. `visible`
 * are those of the intervals on both sides. */
void trip_cpu_store_shade(trip_cpu_store *s, trip_cpu_sheet *sheet, const trip_cpu_sheet *below,
                          const trip_cpu_sheet *above, const uint64_t *visible_before);
/* A slice at weight `part` of `to`, where cells may show between both. False when the pool is full;
 * then it is empty. */
bool trip_cpu_store_cut(trip_cpu_store *s, trip_cpu_sheet *slice, const trip_cpu_sheet *from,
                        const trip_cpu_sheet *to, const uint64_t *visible, double part);

#endif
