/* Makes a data set of a volume: all that `triptych brick` does after it parsed its command line.
 * Any thread may call; the run starts and ends threads of its own, which work in the caller's
 * scope. */
#ifndef TRIP_BRICK_H
#define TRIP_BRICK_H

#include "region.h"
#include "transfer_function.h"
#include "volume.h"

typedef struct trip_value_range {
    double lo, hi; /* inclusive */
} trip_value_range;

typedef enum trip_brick_code_bits {
    TRIP_CODE_BITS_AUTO, /* 8 where these keep all values of the type exactly, else 16 */
    TRIP_CODE_BITS_8,
    TRIP_CODE_BITS_16,
} trip_brick_code_bits;

typedef enum trip_brick_normals {
    TRIP_NORMALS_AUTO,    /* compact where they keep gradients below full shading exactly */
    TRIP_NORMALS_COMPACT, /* in 3 bytes, see normal.h */
    TRIP_NORMALS_FULL,    /* in 4 bytes */
    TRIP_NORMALS_NONE,
} trip_brick_normals;

/* What coarse levels are drawn by: interpolated values (post), splats (pre). */
typedef enum trip_brick_levels_for {
    TRIP_LEVELS_FOR_AUTO, /* post, or pre where there is no halo */
    TRIP_LEVELS_FOR_POST, /* not without a halo */
    TRIP_LEVELS_FOR_PRE,
    TRIP_LEVELS_FOR_BOTH, /* not without a halo */
} trip_brick_levels_for;

/* Zero means the default everywhere. */
typedef struct trip_brick_params {
    const char *input, *output;
    trip_volume_params volume;

    /* The opacity envelope is the union of these; if none is given, that of the automatic function
     * of the volume's kind. */
    const char *const *functions; /* as trip_tf_load() takes them */
    size_t function_count;
    const trip_value_range *ranges;
    size_t range_count;
    bool keep_all;      /* every finite voxel */
    trip_region region; /* of what these keep, that alone; the halo reaches beyond it */
    bool automatic;     /* adds the automatic function's, which is also what is drawn by default */

    trip_brick_code_bits code_bits;
    trip_brick_normals normals;
    /* Coarse levels: 0 as many as it takes until one is a single brick; below 0: none; else so
     * many, or fewer where fewer come to one voxel. */
    int levels;
    trip_brick_levels_for levels_for;
    bool no_halo; /* leave out the transparent neighbours of kept voxels */
    bool replace; /* replace an existing data set; otherwise that is a reported failure */
    /* Resume an interrupted run with the same input and parameters, if there is one. */
    bool resume;
    unsigned tile_voxels, slab_sheets;
    uint64_t memory_bytes; /* default: a quarter of what the process may use */
    unsigned threads;      /* default: one a processor */
    uint64_t max_bytes;    /* refuse a larger data set: size of the cache it is for; 0: no limit */
    int64_t slices;        /* read at a time; default: by memory */

    /* Called on the calling thread with the progress of a stage ("sample", "scan", "read" in
     * voxels, "merge" in records, "levels" in sheets). */
    void (*progress)(void *user, const char *stage, uint64_t done, uint64_t total);
    void *progress_user;
} trip_brick_params;

/* The stages of a run, one after the other. */
typedef enum trip_brick_stage {
    TRIP_BRICK_SCAN,   /* reads all values, where the envelope or the normals depend on them */
    TRIP_BRICK_READ,   /* makes splats; writes the ordered list, spills what does not fit */
    TRIP_BRICK_MERGE,  /* merges the splats on disk and in memory into the other lists */
    TRIP_BRICK_LEVELS, /* makes the coarse levels of the lists that were written */
    TRIP_BRICK_FINISH, /* writes the index and syncs all files */
    TRIP_BRICK_STAGES
} trip_brick_stage;

/* What a stage cost; the bytes of the index are not counted. */
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
    uint64_t bytes;           /* of all lists */
    uint64_t halo_bytes;      /* of these, of the lists of the halo */
    unsigned levels;          /* coarse ones */
    uint64_t level_bytes;     /* of these, of their lists */
    uint64_t temporary_bytes; /* spilled */
    bool resumed;             /* an interrupted run was resumed */
    char note[1024];          /* what was chosen where the file leaves a choice, or "" */
    trip_brick_cost stages[TRIP_BRICK_STAGES];
    uint64_t memory_bytes, peak_memory_bytes; /* limit and peak of the budget */
} trip_brick_summary;

/* Makes the data set; *summary is complete after success only. */
int trip_brick(const trip_brick_params *params, trip_brick_summary *summary);

/* The expected size and duration of a run. */
typedef struct trip_brick_estimate {
    uint64_t voxels, kept, halo;
    uint64_t bytes, temporary_bytes; /* needed on the disk of the output */
    uint64_t free_bytes;             /* on that disk */
    double seconds;
} trip_brick_estimate;

/* Estimates a run with these parameters from a sample of the volume. Writes no data set. */
int trip_brick_estimate_make(const trip_brick_params *params, trip_brick_estimate *estimate);

#endif
