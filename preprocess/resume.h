/* The part of the ordered list that an interrupted run left. Its plane files are moved out of the
 * partial data set before a new writer removes the data set. Their runs are then appended again, up
 * to a checkpoint. One thread. */
#ifndef TRIP_RESUME_H
#define TRIP_RESUME_H

#include "block.h"
#include "list_builder.h"

typedef struct trip_leftover {
    int fd[TRIP_PLANES_OF_VOXELS];         /* -1 if absent */
    uint64_t bytes[TRIP_PLANES_OF_VOXELS]; /* length; UINT64_MAX if the format has no such plane */
} trip_leftover;

static inline trip_leftover trip_leftover_none(void)
{
    return (trip_leftover){ .fd = { -1, -1 } };
}

/* Moves the ordered list's plane files from the partial data set into the spill's folder and opens
 * them. A longer file in the spill's folder stays. The caller holds the spill's lock. Fails on
 * links and on files of other users. */
int trip_leftover_take(trip_leftover *out, const trip_spill *spill, const char *partial_path,
                       const trip_piece_format *format);
void trip_leftover_close(trip_leftover *l);

/* Appends the runs up to the journal's checkpoint from the plane files. Fails if records lie
 * outside their tile or are out of order, or if the number or length of runs differs from the
 * checkpoint. */
int trip_leftover_replay(const trip_leftover *l, trip_journal *j, trip_list_builder *builder,
                         const trip_block_form *form, trip_budget *budget);

#endif
