/* Reads volumes of all formats: grids of scalar values with an affine map to world space. The
 * values arrive once, front to back, in portions small enough for memory. Opening reads headers
 * only. One file per format implements trip_volume_reader; volume.c selects it by content, then by
 * name.
 *
 * One thread calls trip_volume_next(). Any thread may decode and release the portions that it
 * returned. A portion lives until it is released.
 *
 * Voxel (i, j, k) has its centre at index coordinates (i, j, k), i fastest in memory. The first
 * voxel is (0, 0, 0), whatever its index in the file. The map index_to_world takes these
 * coordinates to the world space of the file, made right-handed. It negates x if the file's space
 * is left-handed. */
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
/* Returns the unsigned type of the same size. Returns floats and unsigned types unchanged. */
trip_scalar trip_scalar_unsigned(trip_scalar type);
/* Returns the value of the same bits in an unsigned type: adds 2 to the power of the type's bits to
 * a negative integer. */
double trip_scalar_without_sign(trip_scalar type, double value);
/* Parses "uint8", "int16", "float", "double", "half", ... and common aliases. Returns -1 for
 * unknown names. */
int trip_scalar_from_name(const char *name);
const char *trip_scalar_name(trip_scalar type);

/* Maximum number of voxels along an axis of a volume that is bricked or has coordinate tables. */
#define TRIP_VOLUME_AXIS_MAX (INT64_C(1) << 24)

typedef struct trip_volume_info {
    int64_t dims[3]; /* voxels along i, j, k; each >= 1 */
    trip_affine index_to_world;
    /* Tables for trip_coordinates, all NULL for even spacing. The volume owns them. */
    double *coordinates[3];
    trip_scalar type;    /* as stored in the file */
    double slope, inter; /* value = slope * stored + inter */
    bool sparse;         /* only active voxels exist; all others hold `background` */
    double background;
    const char *format; /* "nrrd", "openvdb", ... */
    char space[8]; /* orientation of world space in the patient, as in anatomy.h; "" if unknown */
    bool oriented; /* the file gives the directions of its axes in world space */
    char modality[17]; /* DICOM modality, "CT", "MR", ...; "" if unknown */
    char name[128];    /* grid name, if the format has one */
    char note[512];    /* tells the user which grid or variable was chosen by default, or "" */
} trip_volume_info;

typedef enum trip_level_set_mode {
    TRIP_LEVEL_SET_UNSET = 0, /* filled, if the grid is a level set */
    /* Density 1 inside and 0 outside, with a ramp about the surface. The ramp is 4 voxels wide if
     * the band is. Central differences, which light uses, are then exact within a voxel of the
     * surface. */
    TRIP_LEVEL_SET_FILLED,
    TRIP_LEVEL_SET_BAND, /* density max(0, 1 - |distance| / half band width) */
} trip_level_set_mode;

/* A dense volume in memory, with values in the machine's byte order. The values must stay valid and
 * unchanged until the volume is closed. */
typedef struct trip_volume_memory {
    int64_t dims[3];
    trip_scalar type;
    trip_affine index_to_world; /* all zeros: identity, without orientation */
    const void *data;           /* voxel (0, 0, 0) */
    int64_t stride_bytes[3];    /* from a voxel to the next along i, j, k; none is 0 */
    /* Used if `data` is NULL: fills `values` with slices [first, first + count), i fastest. A
     * result other than 0 is a failure. The thread that reads the volume calls it. */
    int (*read_slices)(void *user, int64_t first, int64_t count, void *values);
    void *user;
} trip_volume_memory;

/* Zero selects the default of every field. */
typedef struct trip_volume_params {
    /* If it has data or a function, the volume is read from there, and its path is only a name. */
    trip_volume_memory memory;
    const char *grid; /* OpenVDB grid or netCDF variable; the OpenVDB default is "density", else the
                         first fog volume, else the first scalar grid */
    trip_level_set_mode level_set;
    int64_t raw_dims[3];     /* --size, for raw data only */
    const char *raw_type;    /* --type; default: from the file's name, else uint8 */
    const char *coordinates; /* --coordinates: files as in volume_coordinates.h */
    double spacing[3];       /* --spacing; overrides the file's spacing */
    /* --axes: three letters as in trip_anatomy_axes_valid(). They give the directions in the
     * patient of x, y and z of a file without orientation. */
    const char *axes;
    int raw_endian;            /* 0 native, 1 little, 2 big */
    uint64_t raw_offset_bytes; /* --offset */
    bool allow_gaps;           /* accept stacks with missing slices */
    uint64_t
        max_voxels; /* for larger volumes, reads every second, third, ... voxel along each axis */
} trip_volume_params;

typedef struct trip_volume trip_volume;

/* A box of voxels ready for decoding: whole slices of a dense volume, or a box around active voxels
 * of a sparse volume. Origin and size are in voxels. Portions do not overlap, and together they
 * hold every existing voxel once. */
typedef struct trip_volume_portion {
    int64_t origin[3];
    int64_t size[3];
    void *data; /* owned by the reader */
} trip_volume_portion;

/* Opens a volume. `path` may be a file, a folder, or a printf-like or glob pattern of slices.
 * Reports failures. */
int trip_volume_open(trip_volume **out, const char *path, const trip_volume_params *params,
                     trip_budget *budget);
const trip_volume_info *trip_volume_get_info(const trip_volume *v);
/* Reports and returns a negative status if an axis has more than TRIP_VOLUME_AXIS_MAX voxels. */
int trip_volume_check_axes(const char *path, const trip_volume_info *info);
void trip_volume_close(trip_volume *v);

/* Starts again at the first portion. All portions must have been released. */
int trip_volume_rewind(trip_volume *v);
/* Fills *portion and returns 1, or returns 0 after the last portion. Reports failures and returns a
 * negative status. A portion of a dense volume has `slices_hint` slices, fewer at the end; 0 lets
 * the reader choose. In memory it has one more slice on each side. */
int trip_volume_next(trip_volume *v, int64_t slices_hint, trip_volume_portion *portion);
/* Skips slices before the next portion without reading them. Returns the number of skipped slices:
 * `slices`, or fewer at the end. Returns 0 if the format can only read past slices. Reports
 * failures and returns a negative status. */
int64_t trip_volume_skip(trip_volume *v, int64_t slices);
/* Decodes the box [lo, lo + size) to float32, i fastest, into size[0] * size[1] * size[2] entries
 * of `values`. If `active` is not NULL, sets its entries to 1 for voxels that exist, else 0.
 *
 * The box may exceed the portion by one voxel on every side. Outside the volume, voxels are not
 * active; values repeat the border voxel (dense) or are the background (sparse). */
int trip_portion_decode(const trip_volume *v, const trip_volume_portion *portion,
                        const int64_t lo[3], const int64_t size[3], float *values, uint8_t *active);
/* Releases a portion. The volume keeps the memory of one released portion for the next, until it is
 * rewound or closed. */
void trip_portion_release(trip_volume *v, trip_volume_portion *portion);

#ifdef __cplusplus
}
#endif

#endif
