/* Voxels to splats: which voxels of a box are kept, their code and the gradient there, which are
 * their halo, and the pieces that they make in the lists along X, Y and Z. A splatter is made once;
 * every thread has its own place in it. */
#ifndef TRIP_SPLATS_H
#define TRIP_SPLATS_H

#include "envelope.h"
#include "normal.h"
#include "piece.h"
#include "scan.h"
#include "walk.h"

typedef struct trip_splat_params {
    const trip_volume_info *info;
    const trip_envelope *envelope;
    trip_piece_format format;
    trip_quantiser quantiser; /* where the format is quantised */
    /* Normals in 3 bytes, of quantised formats; NULL: in 4. */
    const trip_compact_normals *compact;
    bool tally; /* of the values of all voxels, kept or not */
    unsigned threads;
    /* Memory for a piece of a list, aligned to 8 bytes, or NULL when the run is to end. */
    void *(*reserve)(void *user, unsigned thread, unsigned list, size_t bytes);
    void *user;
} trip_splat_params;

typedef struct trip_splatter trip_splatter;

/* Edge and height of the boxes to walk with. */
enum { TRIP_SPLAT_HEIGHT = 16 };
int64_t trip_splat_edge(const trip_piece_format *f);

/* Memory that one thread takes. */
size_t trip_splat_thread_bytes(const trip_piece_format *f, bool sparse);

int trip_splatter_create(trip_splatter **out, const trip_splat_params *params, trip_budget *budget);
void trip_splatter_destroy(trip_splatter *s);

/* Makes the pieces of a box. */
int trip_splatter_box(trip_splatter *s, unsigned thread, const trip_box *box);

/* Sums over all threads, while none is at work. */
void trip_splatter_tally(const trip_splatter *s, trip_tally *out);
uint64_t trip_splatter_kept(const trip_splatter *s);
/* At least as many as the halo has: of sparse volumes, what is around several boxes is counted
 * several times. */
uint64_t trip_splatter_halo(const trip_splatter *s);

/* A power of two about a voxel's length: gradients that wait for their range, in floats, do so as
 * values per this, which no unit of the world takes out of a float's range. */
double trip_gradient_unit(const trip_affine *index_to_world);

/* A bound of the magnitude of world-space gradients, by central differences, of values that are in
 * [lo, hi], background included: known before anything is read. */
double trip_gradient_bound(const trip_volume_info *info, double lo, double hi);

#endif
