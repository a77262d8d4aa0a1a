/* A volume file to a data set: the whole of `triptych brick` but for its command line. Any thread;
 * it starts and ends its own threads, which work in the caller's scope. */
#ifndef TRIP_BRICK_H
#define TRIP_BRICK_H

#include "transfer_function.h"
#include "volume.h"

typedef struct trip_value_range {
    double lo, hi; /* inclusive */
} trip_value_range;

typedef enum trip_brick_normals {
    TRIP_NORMALS_AUTO,    /* compact, unless that takes a pass over the input of its own */
    TRIP_NORMALS_COMPACT, /* in 3 bytes, see normal.h */
    TRIP_NORMALS_FULL,    /* in 4 bytes */
    TRIP_NORMALS_NONE,
} trip_brick_normals;

/* Zero means the default everywhere. */
typedef struct trip_brick_params {
    const char *input, *output;
    trip_volume_params volume;

    /* The opacity envelope: the union of these. With none of them, the function that
     * trip_tf_from_histogram() makes of the volume. */
    const char *const *functions; /* as trip_tf_load() takes them */
    size_t function_count;
    const trip_value_range *ranges;
    size_t range_count;
    bool keep_all; /* every finite voxel */
    /* Besides the others also what trip_tf_from_histogram() shows, which is drawn by default. */
    bool automatic;

    trip_brick_normals normals;
    bool no_halo; /* the transparent neighbours of what is kept are left out */
    bool replace; /* an existing data set */
    /* Go on from where a run with the same input and parameters was killed, if there was one. */
    bool resume;
    unsigned tile_voxels, slab_sheets;
    uint64_t memory_bytes; /* default: a quarter of what the process may use */
    unsigned threads;      /* default: one a processor */
    uint64_t most_bytes;   /* of the cache that the output is for; 0: none. More is refused */
    int64_t slices;        /* read at a time; default: by memory */

    /* Hears how far a stage ("sample", "scan", "read", "merge") is, on the calling thread. */
    void (*progress)(void *user, const char *stage, uint64_t done, uint64_t total);
    void *progress_user;
} trip_brick_params;

/* One stage of a run; those overlap with nothing. */
typedef enum trip_brick_stage {
    TRIP_BRICK_SCAN,   /* a pass over the input, where the envelope depends on all values */
    TRIP_BRICK_READ,   /* the pass that makes splats; writes what is in order, spills what is not */
    TRIP_BRICK_MERGE,  /* spilled and remembered splats to the lists */
    TRIP_BRICK_FINISH, /* the index, and everything onto the disk */
    TRIP_BRICK_STAGES
} trip_brick_stage;

/* What a stage took, and the bytes it moved; the index is not counted. */
typedef struct trip_brick_cost {
    double seconds;
    uint64_t bytes_read, bytes_written;
} trip_brick_cost;

typedef struct trip_brick_summary {
    int64_t dims[3];
    double spacing[3];
    uint64_t voxels, kept, not_finite;
    uint64_t halo;                     /* neighbours of kept voxels that are not kept themselves */
    unsigned code_bytes, normal_bytes; /* of a splat in one list */
    double value_min, value_max;
    trip_tf_kind kind;        /* what the volume was recognised as */
    uint64_t input_bytes;     /* as stored, decompressed */
    uint64_t bytes;           /* of the data set's lists, those of the halo included */
    uint64_t halo_bytes;      /* of the latter */
    uint64_t temporary_bytes; /* spilled */
    bool resumed;
    char note[512]; /* as trip_volume_info has it */
    trip_brick_cost stages[TRIP_BRICK_STAGES];
    uint64_t memory_bytes, peak_memory_bytes; /* promised and taken from the budget */
} trip_brick_summary;

int trip_brick(const trip_brick_params *params, trip_brick_summary *summary);

/* What such a run will come to, from a look at parts of the input. */
typedef struct trip_brick_estimate {
    uint64_t voxels, kept, halo;
    uint64_t bytes, temporary_bytes; /* on the disk of the output */
    uint64_t free_bytes;             /* there */
    double seconds;
} trip_brick_estimate;

int trip_brick_estimate_make(const trip_brick_params *params, trip_brick_estimate *estimate);

#endif
