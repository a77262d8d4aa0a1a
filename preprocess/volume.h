/* A volume being read, whatever its file format: an affine grid of scalar values that arrives once,
 * front to back, in blocks small enough for memory. trip_volume_next() is called by one thread;
 * blocks it returned may be decoded and released by any thread and live until released. Opening
 * reads headers only. One file per format implements trip_volume_reader; volume.c picks it by
 * content, then name.
 *
 * Voxel (i, j, k) has its centre at index coordinates (i, j, k), i fastest in memory, the first
 * voxel at (0, 0, 0) whatever the file calls it. index_to_world takes those to world space: the
 * file's own, but right-handed (a file whose space is left-handed has its x negated). */
#ifndef TRIP_VOLUME_H
#define TRIP_VOLUME_H

#include <stdbool.h>
#include <stdint.h>

#include "budget.h"
#include "geometry.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum trip_scalar {
    TRIP_U8,
    TRIP_I8,
    TRIP_U16,
    TRIP_I16,
    TRIP_U32,
    TRIP_I32,
    TRIP_U64,
    TRIP_I64,
    TRIP_F16,
    TRIP_F32,
    TRIP_F64,
    TRIP_SCALARS
} trip_scalar;

unsigned trip_scalar_bytes(trip_scalar type);
/* "uint8", "int16", "float", "double", "half", ... and their common aliases; -1 when unknown. */
int trip_scalar_from_name(const char *name);
const char *trip_scalar_name(trip_scalar type);

typedef struct trip_volume_info {
    int64_t dims[3]; /* voxels along i, j, k; each >= 1 */
    trip_affine index_to_world;
    trip_scalar type;    /* as stored in the file */
    double slope, inter; /* value = slope * stored + inter */
    bool sparse;         /* only active voxels exist; the others hold `background` */
    double background;
    const char *format; /* "nrrd", "openvdb", ... */
    char space[8];      /* how world space lies in the patient, as in anatomy.h; "" : not said */
    bool oriented;      /* the file says how its axes lie in world space: nothing to be guessed */
    char modality[17];  /* of DICOM: "CT", "MR", ...; "": not known */
    char name[128];     /* grid name where the format has one */
    char note[512];     /* for people: what was chosen where the file leaves a choice, or "" */
} trip_volume_info;

typedef enum trip_level_set_mode {
    TRIP_LEVEL_SET_UNSET = 0, /* filled, if the grid is a level set */
    TRIP_LEVEL_SET_FILLED, /* density 1 inside, 0 outside, a ramp one voxel wide at the surface */
    TRIP_LEVEL_SET_BAND,   /* density max(0, 1 - |distance| / half band width) */
} trip_level_set_mode;

/* Zero means the default everywhere. */
typedef struct trip_volume_params {
    const char *grid; /* OpenVDB grid name; default: "density", else the first fog volume,
                       * else the first scalar grid */
    trip_level_set_mode level_set;
    int64_t raw_dims[3];       /* headerless raw only: --size */
    const char *raw_type;      /* --type; default: from the file's name, else uint8 */
    double spacing[3];         /* --spacing: raw and image stacks; elsewhere overrides the file's */
    int raw_endian;            /* 0 native, 1 little, 2 big */
    uint64_t raw_offset_bytes; /* --offset */
    bool allow_gaps;           /* go on where slices of a stack are missing */
} trip_volume_params;

typedef struct trip_volume trip_volume;

/* A box of voxels ready to decode. origin and size are in voxels; for dense volumes a block is a
 * slab of whole slices, for sparse ones a box around active voxels. Blocks do not overlap and
 * together hold every existing voxel once. */
typedef struct trip_volume_block {
    int64_t origin[3];
    int64_t size[3];
    void *data; /* the reader's */
} trip_volume_block;

/* `path` may be a file, a folder or a printf-like or glob pattern of slices. */
int trip_volume_open(trip_volume **out, const char *path, const trip_volume_params *params,
                     trip_budget *budget);
const trip_volume_info *trip_volume_get_info(const trip_volume *v);
void trip_volume_close(trip_volume *v);

/* Start again from the first block; all blocks must have been released. */
int trip_volume_rewind(trip_volume *v);
/* 1: *block is filled; 0: no more; negative: reported failure. A dense block holds about
 * `slices_hint` slices (at least 1; 0 lets the reader choose) plus what neighbours need. */
int trip_volume_next(trip_volume *v, int64_t slices_hint, trip_volume_block *block);
/* Passes over slices before the next block, without reading them where the file allows that.
 * Returns how many it passed over: `slices`, fewer at the end, or 0 where slices have to be read or
 * there are none. */
int64_t trip_volume_skip(trip_volume *v, int64_t slices);
/* Values of the box [lo, lo + size) as float32, i fastest, into values; `active`, when not NULL,
 * gets 1 where the voxel exists. The box may exceed the block by one voxel on every side: values
 * outside the volume repeat the edge voxel (dense) or are the background (sparse), active 0. */
int trip_block_decode(const trip_volume *v, const trip_volume_block *block, const int64_t lo[3],
                      const int64_t size[3], float *values, uint8_t *active);
/* The memory of one released slab stays with the volume, for the next block, until it is rewound or
 * closed. */
void trip_block_release(trip_volume *v, trip_volume_block *block);

#ifdef __cplusplus
}
#endif

#endif
