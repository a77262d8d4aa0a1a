/* Turns the voxels of a box into splats: finds which voxels are kept, their codes and normals, and
 * which other voxels are their halo, and makes pieces of them for the lists along X, Y and Z. One
 * splatter serves several threads, each of which has its own workspace in it. */
#ifndef TRIP_SPLATS_H
#define TRIP_SPLATS_H

#include "envelope.h"
#include "normal.h"
#include "piece.h"
#include "region.h"
#include "scan.h"
#include "walk.h"

typedef struct trip_splat_params {
    const trip_volume_info *info;
    const trip_envelope *envelope;
    const trip_region *region; /* of what the envelope keeps; its ends are not open; NULL: all */
    trip_piece_format format;
    trip_quantiser quantiser; /* where the format is quantised */
    /* How normals of 3 bytes are encoded, for quantised formats only; NULL: they have 4 bytes. */
    const trip_compact_normals *compact;
    bool tally; /* count the values of all voxels, kept or not */
    unsigned threads;
    /* As in trip_piece_sink. */
    int (*reserve)(void *user, unsigned thread, unsigned list, size_t bytes, void **memory);
    void *user;
} trip_splat_params;

typedef struct trip_splatter trip_splatter;

/* Edge and height in voxels of the boxes that trip_splatter_box() takes: see trip_walk_params. */
enum { TRIP_SPLAT_HEIGHT = 16 };
int64_t trip_splat_edge(const trip_piece_format *f);

/* Bytes of one thread's workspace. */
size_t trip_splat_thread_bytes(const trip_piece_format *f, bool sparse);

int trip_splatter_create(trip_splatter **out, const trip_splat_params *params, trip_budget *budget);
void trip_splatter_destroy(trip_splatter *s);

/* Makes the pieces of a box. May run on several threads at once, with different `thread`. */
int trip_splatter_box(trip_splatter *s, unsigned thread, const trip_box *box);

/* Sums over all threads, for when none is inside trip_splatter_box(). */
void trip_splatter_tally(const trip_splatter *s, trip_tally *out);
uint64_t trip_splatter_kept(const trip_splatter *s);
/* At least as many as the halo has: in sparse volumes a voxel that lies next to several portions is
 * counted once for each. */
uint64_t trip_splatter_halo(const trip_splatter *s);

#endif
