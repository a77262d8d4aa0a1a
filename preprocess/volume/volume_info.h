/* The types that describe a volume: its scalar type, grid, parameters and portions.
 *
 * Voxel (i, j, k) has its centre at index coordinates (i, j, k), i fastest in memory. The first
 * voxel is (0, 0, 0), whatever its index in the file. The map index_to_world takes these
 * coordinates to the world space of the file, made right-handed. It negates x if the file's space
 * is left-handed. */
#ifndef TRIP_VOLUME_INFO_H
#define TRIP_VOLUME_INFO_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

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

/* Converts `count` stored values to slope * stored + inter, computed in double precision and
 * rounded once. `swap` reverses their byte order. */
void trip_scalar_decode(trip_scalar type, bool swap, double slope, double inter, const void *stored,
                        size_t count, float *values);

/* Returns the luma (Rec. ITU-R BT.709-6, 3.2) of red, green and blue, which follow each other at
 * `stored`. */
float trip_scalar_luma(trip_scalar type, bool swap, const void *stored);

/* Values that stand for "no value" in a volume. Their voxels count as absent. */
enum { TRIP_FILLS_MAX = 8 };
typedef struct trip_fills {
    uint64_t count;
    double values[TRIP_FILLS_MAX];
} trip_fills;

/* Parses the value of --fill. Sets *fills to the value, or to none for "none". Returns false for
 * other texts. */
bool trip_fills_parse(const char *text, trip_fills *fills);

/* Maximum number of voxels along an axis of a volume that is bricked or has coordinate tables. */
#define TRIP_VOLUME_AXIS_MAX ((int64_t)TRIP_AXIS_VOXELS_MAX)

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
    char space[8]; /* orientation of world space in the patient: "RAS", or "" if unknown. Readers
                      may set "LPS"; opening a volume turns it into "RAS". */
    bool oriented; /* the file gives the directions of its axes in world space */
    char up[3];    /* "+y" or "+z", which is up in the program that wrote the file, or by the custom
                      of image stacks from microscopes; "" if unknown */
    char modality[17]; /* DICOM modality, "CT", "MR", ...; "" if unknown */
    bool labels;       /* the file states that its values are labels */
    bool named_labels; /* its name does */
    char name[128];    /* grid name, if the format has one */
    char note[1024];   /* tells the user the choices made by default, or "" */
    char *parts;       /* the series of a DICOM folder, one a line, or NULL. The volume owns it. */
    trip_fills fills;  /* decoded as NaN */
} trip_volume_info;

/* Returns whether a word of a file's name says that its values are labels: "labels", "seg", ... */
bool trip_volume_is_named_labels(const char *path);

/* Reports and returns a negative status unless each of dims is at least 1 and the size in bytes
 * fits in an int64_t. Readers that compute sizes call it first. In any case volume.c calls it for
 * every volume. */
int trip_volume_check_dims(const char *path, const trip_volume_info *info);
/* Reports and returns a negative status if an axis has more than TRIP_VOLUME_AXIS_MAX voxels. */
int trip_volume_check_axes(const char *path, const trip_volume_info *info);

#define TRIP_VOLUME_COLOUR_NOTE "the values are colours; their luma (Rec. 709) is read"

/* Why MINC files, which are netCDF or HDF5, are refused. */
#define TRIP_VOLUME_MINC                                                                           \
    "is a MINC file; the scales of its slices are not read: convert it to NIfTI with `mnc2nii`"

/* The names of dimensions that all Exodus files have, which are netCDF, and why they are refused.
 */
#define TRIP_VOLUME_EXODUS_NODES "num_nodes"
#define TRIP_VOLUME_EXODUS_BLOCKS "num_el_blk"
#define TRIP_VOLUME_EXODUS "is an Exodus file of finite elements, not a volume; ParaView opens it"

/* Checks --channel ("channel") or --time ("time") against the number of entries in the file.
 * Returns false and fills `why` if `index` is none of them. The second function reports this and
 * returns a negative status. */
#define TRIP_ENTRY_WHY_BYTES 128
bool trip_entry_exists(char why[TRIP_ENTRY_WHY_BYTES], const char *what, int64_t index,
                       int64_t count);
int trip_volume_check_entry(const char *path, const char *what, int index, int64_t count);
/* Appends to a note of `room` bytes that one of `count` entries is read, if there are several.
 * `detail` may be "". */
void trip_entry_note(char *note, size_t room, const char *what, int64_t index, int64_t count,
                     const char *detail);
/* Appends a text to a note of `room` bytes. */
void trip_append_note(char *note, size_t room, const char *text);

typedef enum trip_level_set_mode {
    TRIP_LEVEL_SET_UNSET = 0, /* filled, if the grid is a level set */
    /* Density 1 inside and 0 outside, with the ramp t^2 (3 - 2 t) about the surface. The ramp is 6
     * voxels wide, or as wide as the band. It has no kinks. Central differences, which light uses,
     * would show a kink as rings. */
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
    int series;                /* --series, for DICOM: its number; 0 chooses the largest */
    int channel, time;         /* --channel, --time: of files with several, from 0 */
    /* --fill: a value that counts as absent, or "none". By default, known values far outside of
     * everything else count as absent (typical.h). */
    const char *fill;
    uint64_t
        max_voxels; /* for larger volumes, reads every second, third, ... voxel along each axis */
} trip_volume_params;

/* The voxels from `first` up to, but not including, `past` along i, j, k. past 0 stands for the end
 * of the grid. */
typedef struct trip_region {
    int64_t first[3], past[3];
} trip_region;

static inline bool trip_region_is_whole(const trip_region *r)
{
    bool whole = true;
    for (int a = 0; a < 3; a++)
        whole = whole && r->first[a] == 0 && r->past[a] == 0;
    return whole;
}

/* A box of voxels ready for decoding: whole slices of a dense volume, or a box around active voxels
 * of a sparse volume. Origin and size are in voxels. Portions do not overlap, and together they
 * hold every existing voxel once. */
typedef struct trip_volume_portion {
    int64_t origin[3];
    int64_t size[3];
    void *data; /* owned by the reader */
} trip_volume_portion;

#ifdef __cplusplus
}
#endif

#endif
