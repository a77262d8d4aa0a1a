/* Reads volumes of all formats: grids of scalar values with an affine map to world space. The
 * values arrive once, front to back, in portions small enough for memory. One thread calls
 * trip_volume_next(); any thread may decode and release the portions that it returned, which live
 * until they are released. Opening reads headers only. One file per format implements
 * trip_volume_reader; volume.c picks it by content, then name.
 *
 * Voxel (i, j, k) has its centre at index coordinates (i, j, k), i fastest in memory, the first
 * voxel at (0, 0, 0) whatever number the file gives it. index_to_world maps these coordinates to
 * the world space of the file, made right-handed: x is negated where the file's is left-handed. */
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
/* The type whose values have the same bits and no sign; of floats and unsigned types their own. */
trip_scalar trip_scalar_unsigned(trip_scalar type);
/* What the bits of a whole number stand for in an unsigned type: of a negative one more than it is
 * by 2 to the power of the type's bits. */
double trip_scalar_without_sign(trip_scalar type, double value);
/* "uint8", "int16", "float", "double", "half", ... and their common aliases; -1 when unknown. */
int trip_scalar_from_name(const char *name);
const char *trip_scalar_name(trip_scalar type);

/* Voxels along an axis of a volume that is bricked, and of one with tables. */
#define TRIP_VOLUME_AXIS_MAX (INT64_C(1) << 24)

typedef struct trip_volume_info {
    int64_t dims[3]; /* voxels along i, j, k; each >= 1 */
    trip_affine index_to_world;
    /* Tables of trip_coordinates; all NULL where spacing is even. The volume's. */
    double *coordinates[3];
    trip_scalar type;    /* as stored in the file */
    double slope, inter; /* value = slope * stored + inter */
    bool sparse;         /* only active voxels exist; the others hold `background` */
    double background;
    const char *format; /* "nrrd", "openvdb", ... */
    char space[8];      /* how world space lies in the patient, as in anatomy.h; "": unknown */
    bool oriented;      /* the file gives the directions of its axes in world space */
    char modality[17];  /* of DICOM: "CT", "MR", ...; "": unknown */
    char name[128];     /* grid name where the format has one */
    char note[512];     /* for the user: what was chosen where the file leaves a choice, or "" */
} trip_volume_info;

typedef enum trip_level_set_mode {
    TRIP_LEVEL_SET_UNSET = 0, /* filled, if the grid is a level set */
    /* Density 1 inside, 0 outside, and between them a ramp about the surface, 4 voxels wide where
     * the band is: central differences, by which light comes, are exact within a voxel of the
     * surface. */
    TRIP_LEVEL_SET_FILLED,
    TRIP_LEVEL_SET_BAND, /* density max(0, 1 - |distance| / half band width) */
} trip_level_set_mode;

/* Zero means the default everywhere. */
typedef struct trip_volume_params {
    const char *grid; /* OpenVDB grid name; default: "density", else the first fog volume,
                       * else the first scalar grid */
    trip_level_set_mode level_set;
    int64_t raw_dims[3];     /* headerless raw only: --size */
    const char *raw_type;    /* --type; default: from the file's name, else uint8 */
    const char *coordinates; /* --coordinates: files, as volume_coordinates.h has them */
    double spacing[3];       /* --spacing: raw and image stacks; elsewhere overrides the file's */
    /* --axes: three letters as trip_anatomy_axes_valid() takes them, where in the patient x, y and
     * z of a file point to that does not say. */
    const char *axes;
    int raw_endian;            /* 0 native, 1 little, 2 big */
    uint64_t raw_offset_bytes; /* --offset */
    bool allow_gaps;           /* accept stacks in which slices are missing */
    uint64_t max_voxels; /* of larger volumes every second, third, ... voxel along each axis */
} trip_volume_params;

typedef struct trip_volume trip_volume;

/* A box of voxels that is ready to be decoded: whole slices of a dense volume, or a box around
 * active voxels of a sparse one. Origin and size are in voxels. Portions do not overlap and
 * together hold every existing voxel once. */
typedef struct trip_volume_portion {
    int64_t origin[3];
    int64_t size[3];
    void *data; /* the reader's */
} trip_volume_portion;

/* `path` may be a file, a folder, or a printf-like or glob pattern of slices. Reports failures. */
int trip_volume_open(trip_volume **out, const char *path, const trip_volume_params *params,
                     trip_budget *budget);
const trip_volume_info *trip_volume_get_info(const trip_volume *v);
/* Reports and returns negative where an axis has more than TRIP_VOLUME_AXIS_MAX voxels. */
int trip_volume_check_axes(const char *path, const trip_volume_info *info);
void trip_volume_close(trip_volume *v);

/* Starts again from the first portion; all portions must have been released. */
int trip_volume_rewind(trip_volume *v);
/* 1: *portion is filled; 0: there are no more; negative: reported failure. A portion of a dense
 * volume holds `slices_hint` slices (0 lets the reader choose), fewer at the end, and in memory one
 * more on each side. */
int trip_volume_next(trip_volume *v, int64_t slices_hint, trip_volume_portion *portion);
/* Skips slices before the next portion without reading them. Returns how many were skipped:
 * `slices`, fewer at the end, or 0 where the format has to be read to get past them. Negative:
 * reported failure. */
int64_t trip_volume_skip(trip_volume *v, int64_t slices);
/* Decodes the box [lo, lo + size) to float32, i fastest, into size[0] * size[1] * size[2] entries
 * of `values`; entries of `active`, when not NULL, become 1 where the voxel exists, else 0. The box
 * may exceed the portion by one voxel on every side. Values outside the volume repeat the voxel at
 * the edge (dense) or are the background (sparse), and are not active. */
int trip_portion_decode(const trip_volume *v, const trip_volume_portion *portion,
                        const int64_t lo[3], const int64_t size[3], float *values, uint8_t *active);
/* The volume keeps the memory of one released portion for the next one, until it is rewound or
 * closed. */
void trip_portion_release(trip_volume *v, trip_volume_portion *portion);

#ifdef __cplusplus
}
#endif

#endif
