/* Makes a data set from a volume: everything that `triptych brick` does after parsing its command
 * line. Any thread may call it. The run starts and ends its own threads, which work in the caller's
 * scope. */
#ifndef TRIP_BRICK_H
#define TRIP_BRICK_H

#include "brick_params.h"

/* The stages of a run, in order. */
typedef enum trip_brick_stage {
    TRIP_BRICK_SCAN,   /* reads all values, if the envelope or the normals depend on them */
    TRIP_BRICK_READ,   /* makes splats, writes the ordered list, spills pieces that do not fit in
                          memory */
    TRIP_BRICK_MERGE,  /* merges the splats on disk and in memory into the other lists */
    TRIP_BRICK_LEVELS, /* makes the coarse levels from the written lists */
    TRIP_BRICK_FINISH, /* writes the index and syncs all files */
    TRIP_BRICK_STAGES
} trip_brick_stage;

/* The cost of a stage, without the bytes of the index. */
typedef struct trip_brick_cost {
    double seconds;
    uint64_t bytes_read, bytes_written;
} trip_brick_cost;

typedef struct trip_brick_summary {
    int64_t dims[3];
    double spacing[3];
    uint64_t voxels, kept, not_finite;
    uint64_t halo;                     /* halo voxels */
    unsigned code_bytes, normal_bytes; /* bytes per splat in one list */
    double value_min, value_max;
    trip_tf_kind kind;        /* recognised kind of the volume */
    uint64_t input_bytes;     /* bytes of values, decompressed */
    uint64_t bytes;           /* bytes of all files */
    uint64_t halo_bytes;      /* bytes of the halo's lists */
    unsigned levels;          /* coarse levels */
    uint64_t level_bytes;     /* bytes of the coarse levels' lists */
    uint64_t temporary_bytes; /* bytes spilled */
    bool resumed;             /* an interrupted run was resumed */
    char note[1536];          /* choices that the file left open, or "" */
    trip_brick_cost stages[TRIP_BRICK_STAGES];
    uint64_t memory_bytes, peak_memory_bytes; /* limit and peak of the budget */
} trip_brick_summary;

/* Makes the data set. *summary is complete only on success. */
int trip_brick(const trip_brick_params *params, trip_brick_summary *summary);

#endif
