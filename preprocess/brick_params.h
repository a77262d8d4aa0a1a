/* The parameters of a run of brick.h. Plain values. */
#ifndef TRIP_BRICK_PARAMS_H
#define TRIP_BRICK_PARAMS_H

#include "transfer_function.h"
#include "volume_info.h"

typedef struct trip_value_range {
    double lo, hi; /* inclusive */
} trip_value_range;

typedef enum trip_brick_code_bits {
    TRIP_CODE_BITS_AUTO, /* 8 if 8 bits keep all values of the type exactly, else 16 */
    TRIP_CODE_BITS_8,
    TRIP_CODE_BITS_16,
} trip_brick_code_bits;

typedef enum trip_brick_normals {
    /* None, as drawing computes normals from values. Stored where it cannot: voxels are dropped
     * without a halo, or coarse levels hold means without values. */
    TRIP_NORMALS_AUTO,
    TRIP_NORMALS_COMPACT, /* 3 bytes, see normal.h */
    TRIP_NORMALS_FULL,    /* 4 bytes */
    TRIP_NORMALS_NONE,
    TRIP_NORMALS_STORED, /* compact if that keeps gradients below full shading exactly, else full */
} trip_brick_normals;

/* The classification that coarse levels serve: post interpolates values, pre draws splats. */
typedef enum trip_brick_levels_for {
    TRIP_LEVELS_FOR_AUTO, /* post, or pre without a halo */
    TRIP_LEVELS_FOR_POST, /* requires a halo */
    TRIP_LEVELS_FOR_PRE,
    TRIP_LEVELS_FOR_BOTH, /* requires a halo */
} trip_brick_levels_for;

/* Zero means the default. */
typedef struct trip_brick_params {
    const char *input, *output;
    trip_volume_params volume;

    /* The opacity envelope is the union of the functions, the ranges and `keep_all`. Without any,
     * the automatic transfer function defines it. */
    const char *const *functions; /* as trip_tf_load() takes them */
    size_t function_count;
    const trip_value_range *ranges;
    size_t range_count;
    bool keep_all;      /* keeps every finite voxel */
    trip_region region; /* keeps only voxels in this region; the halo reaches beyond it */
    bool automatic;     /* adds the envelope of the automatic transfer function, which becomes the
                           default for drawing */

    trip_brick_code_bits code_bits;
    trip_brick_normals normals;
    /* Number of coarse levels. 0 adds levels until one is a single brick. A negative number
     * disables them. A positive number is a maximum: levels end at a single voxel. */
    int levels;
    trip_brick_levels_for levels_for;
    bool no_halo; /* leaves out the transparent neighbours of kept voxels */
    bool replace; /* replaces an existing data set, which is otherwise a reported failure */
    /* Resumes an interrupted run with the same input and parameters, if there is one. */
    bool resume;
    unsigned tile_voxels, slab_sheets;
    uint64_t memory_bytes; /* default: a quarter of the process's limit */
    unsigned threads;      /* default: one per processor */
    uint64_t max_bytes;    /* size of the cache; larger data sets are refused; 0 means no limit */
    int64_t slices;        /* slices read at once; default: by memory */

    /* Called on the calling thread with the progress of a stage: "sample", "scan" and "read" count
     * voxels, "merge" records, "levels" sheets. */
    void (*progress)(void *user, const char *stage, uint64_t done, uint64_t total);
    void *progress_user;
} trip_brick_params;

#endif
