/* Runs that a reader hands out. Plain values; the reader owns the bytes. */
#ifndef TRIP_BATCH_H
#define TRIP_BATCH_H

#include "block.h"
#include "selection.h"

/* Runs ready to draw, in draw order. The block of run i, already checked, is at
 * planes[TRIP_PLANE_VOXELS] + runs[i].at[TRIP_PLANE_VOXELS]. Its normals and deviations are found
 * in the same way. */
typedef struct trip_batch {
    const trip_pass *pass;
    /* NULL for planes that are not read, and if only runs are wanted. */
    const unsigned char *planes[TRIP_PLANES];
    size_t plane_bytes[TRIP_PLANES]; /* including gaps */
    uint64_t splats;                 /* records of all runs */
    const trip_run *runs;
    size_t run_count;
    void *slot;
} trip_batch;

/* Returns the list of a run in a batch. */
static inline const trip_list *trip_batch_list(const trip_batch *b, const trip_run *run)
{
    return b->pass->selections[run->selection].list;
}

/* Returns the block of a run. The batch must have its planes. */
static inline trip_block trip_block_of(const trip_batch *b, const trip_run *run)
{
    const trip_selection *s = &b->pass->selections[run->selection];
    const trip_block_form form = trip_block_form_of(&s->data->header, s->list->kind);
    const unsigned char *at[TRIP_PLANES];
    for (int plane = 0; plane < TRIP_PLANES; plane++)
        at[plane] = b->planes[plane] && s->list->planes >> plane & 1
                        ? b->planes[plane] + run->at[plane]
                        : NULL;
    trip_block block = trip_block_make(&form, run->count, run->words, at[TRIP_PLANE_VOXELS],
                                       at[TRIP_PLANE_NORMALS]);
    block.deviations = at[TRIP_PLANE_DEVIATIONS];
    return block;
}

#endif
