/* Turns the voxels of a box into splats. Finds the kept voxels, their codes and normals, and the
 * voxels of their halo. Makes pieces of them for the lists along X, Y and Z. One splatter serves
 * several threads, and holds a workspace for each. */
#ifndef TRIP_SPLATS_H
#define TRIP_SPLATS_H

#include "envelope.h"
#include "normal.h"
#include "piece.h"
#include "volume_info.h"
#include "scan.h"
#include "walk.h"

typedef struct trip_splat_params {
    const trip_volume_info *info;
    const trip_envelope *envelope;
    const trip_region *region; /* keeps only voxels in this region, which must have explicit ends;
                                  NULL for no limit */
    trip_piece_format format;
    trip_quantiser quantiser; /* only for a quantised format */
    /* Encoding of 3-byte normals, for quantised formats only. NULL selects 4-byte normals. */
    const trip_compact_normals *compact;
    bool tally; /* count the values of all voxels, kept or not */
    unsigned threads;
    /* As in trip_piece_sink. */
    int (*reserve)(void *user, unsigned thread, unsigned list, size_t bytes, void **memory);
    void *user;
} trip_splat_params;

typedef struct trip_splatter trip_splatter;

/* Edge and height in voxels of the boxes for trip_splatter_box(), as in trip_walk_params. */
enum { TRIP_SPLAT_HEIGHT = 16 };
int64_t trip_splat_edge(const trip_piece_format *f);

/* Returns the size of one thread's workspace in bytes. */
size_t trip_splat_thread_bytes(const trip_piece_format *f, bool sparse);

int trip_splatter_create(trip_splatter **out, const trip_splat_params *params, trip_budget *budget);
void trip_splatter_destroy(trip_splatter *s);

/* Makes the pieces of a box. Several threads may call it at once with different `thread`. */
int trip_splatter_box(trip_splatter *s, unsigned thread, const trip_box *box);

/* Sums over all threads. No thread may be inside trip_splatter_box() during the call. */
void trip_splatter_tally(const trip_splatter *s, trip_tally *out);
uint64_t trip_splatter_kept(const trip_splatter *s);
/* Returns an upper bound of the number of halo voxels. In sparse volumes a voxel beside several
 * portions counts once for each. */
uint64_t trip_splatter_halo(const trip_splatter *s);

#endif
