/* Makes data sets of volumes for triptych.h, as `triptych brick` does. Zero selects the default for
 * every option. Only triptych_set_source() needs an open data set. An open data set stays open.
 * Functions that take a context fail with TRIPTYCH_USAGE for invalid options, and all but
 * triptych_list_files() also while a frame is begun.
 *
 * Progress (triptych_set_progress()) has the stages "sample", "scan" and "read" (in voxels),
 * "merge" (in splats), "levels" (in sheets) and "look" (in bytes). */
#ifndef TRIPTYCH_BRICK_H
#define TRIPTYCH_BRICK_H

#include <stddef.h>
#include <triptych.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum triptych_level_set {
    TRIPTYCH_LEVEL_SET_DEFAULT, /* filled */
    /* Dense inside. The border is a ramp of 4 voxels, or of the stored band if that is narrower. */
    TRIPTYCH_LEVEL_SET_FILLED,
    TRIPTYCH_LEVEL_SET_BAND, /* densest at the surface */
} triptych_level_set;

typedef enum triptych_endian {
    TRIPTYCH_ENDIAN_NATIVE,
    TRIPTYCH_ENDIAN_LITTLE,
    TRIPTYCH_ENDIAN_BIG,
} triptych_endian;

typedef enum triptych_code_bits {
    TRIPTYCH_CODE_BITS_AUTO, /* 8 if that keeps all values of the type exactly, otherwise 16 */
    /* Rounds values to 256 codes between the minimum and the maximum. */
    TRIPTYCH_CODE_BITS_8,
    TRIPTYCH_CODE_BITS_16,
} triptych_code_bits;

typedef enum triptych_normals {
    /* None, since drawing computes normals from the values. Stored in two cases: the data set lacks
     * voxels and has no halo, or its coarse levels are for pre alone. */
    TRIPTYCH_NORMALS_AUTO,
    TRIPTYCH_NORMALS_COMPACT, /* 3 bytes */
    TRIPTYCH_NORMALS_FULL,    /* 4 bytes */
    TRIPTYCH_NORMALS_NONE,
    /* Compact if no colour changes by half of 1/255 or more, otherwise full. */
    TRIPTYCH_NORMALS_STORED,
} triptych_normals;

/* The classification for which coarse levels are made. */
/* How the coefficients of spherical harmonics of degree 1 and above are stored. */
typedef enum triptych_stored_harmonics {
    TRIPTYCH_STORED_HARMONICS_AUTO,    /* by a palette if colours change by less than 0.5 of 255 */
    TRIPTYCH_STORED_HARMONICS_PALETTE, /* two bytes a Gaussian: an entry of a palette */
    TRIPTYCH_STORED_HARMONICS_WHOLE,   /* a byte a coefficient */
} triptych_stored_harmonics;

typedef enum triptych_levels_for {
    TRIPTYCH_LEVELS_FOR_AUTO, /* post, or pre if there is no halo */
    TRIPTYCH_LEVELS_FOR_POST, /* interpolated values; needs a halo */
    TRIPTYCH_LEVELS_FOR_PRE,
    TRIPTYCH_LEVELS_FOR_BOTH, /* needs a halo */
} triptych_levels_for;

/* The source of the colours of a cloud. */
typedef enum triptych_point_colour {
    TRIPTYCH_POINT_COLOUR_AUTO, /* their colours, else their intensity, else their height */
    TRIPTYCH_POINT_COLOUR_RGB,
    TRIPTYCH_POINT_COLOUR_INTENSITY,      /* from black to white */
    TRIPTYCH_POINT_COLOUR_HEIGHT,         /* by the colours of viridis */
    TRIPTYCH_POINT_COLOUR_CLASSIFICATION, /* a fixed colour for each class of LAS */
    TRIPTYCH_POINT_COLOUR_RETURN,         /* by the colours of viridis */
    TRIPTYCH_POINT_COLOUR_TIME,           /* by the colours of viridis */
    TRIPTYCH_POINT_COLOUR_DENSITY,        /* by the colours of viridis */
} triptych_point_colour;

typedef struct triptych_range {
    double lo, hi; /* both inclusive */
} triptych_range;

/* Fills `values` with slices `first` to first + count - 1. */
typedef int (*triptych_read_slices_callback)(void *user, int64_t first, int64_t count,
                                             void *values);

/* A volume in memory, dense, with values in the machine's byte order. `type`, `dims`, and either
 * `data` or `read_slices` are required. */
typedef struct triptych_volume {
    const char *type; /* as triptych_brick_options.raw_type */
    int64_t dims[3];  /* voxels along x, y and z */
    /* Voxel (0, 0, 0). The values must not change during the call. The library reads them in place
     * and copies only the slices that it works on. */
    const void *data;
    /* Distance from one voxel to the next along x, y and z. May be negative. All 0 means that all
     * values are contiguous, x fastest and z slowest. */
    int64_t stride_bytes[3];
    /* Only if `data` is NULL: a function that fills `values` with slices `first` to
     * first + count - 1 along z. The values are contiguous, x fastest. Returns 0; any other result
     * ends the call with TRIPTYCH_ERROR.
     * - The library calls it on the calling thread, while other threads work on earlier slices.
     * - Bricking makes several passes from the first slice to the last, and a pass may skip slices.
     *   All passes must get the same values.
     * - The function may call triptych_cancel(), but nothing else with the same context. */
    triptych_read_slices_callback read_slices;
    void *user;
    /* Takes index space to world space, as in triptych_info. All 0: the options give the spacing,
     * and voxel (0, 0, 0) lies at the origin. If not all 0, z is up unless `axes` says otherwise.
     * `spacing` replaces the lengths of its columns. */
    double index_to_world[3][4];
} triptych_volume;

typedef struct triptych_brick_options {
    /* ---- reading the volume ---- */

    /* If not NULL, the volume is read from memory. The argument `volume` is then only its name, for
     * messages and for triptych_info.notes. Options for files and `resume` are refused. */
    const triptych_volume *in_memory;
    /* OpenVDB grid. The default is "density", then the first fog volume, then the first scalar
     * grid. */
    const char *grid;
    triptych_level_set level_set; /* for OpenVDB */
    int64_t raw_dims[3];          /* raw data: voxels along each axis, the fastest first */
    /* Raw data: "uint8", "int16", "float", ... The default comes from the file's name. */
    const char *raw_type;
    triptych_endian raw_endian;
    uint64_t raw_offset_bytes;
    /* Positions of voxels along the axes: three file names, "X.txt,Y.txt,Z.txt". Each file has one
     * number per voxel along its axis, ascending or descending. An empty name means even spacing.
     * The default is the positions in the volume's file, otherwise even spacing. */
    const char *coordinates;
    double spacing[3]; /* between voxels; default: from the file, otherwise 1 */
    /* Anatomical directions of x, y and z for a volume without orientation. Three letters, one of R
     * and L, one of A and P, one of S and I, such as "PIR". */
    const char *axes;
    int allow_gaps; /* if not 0, a stack of slices may have gaps */
    /* DICOM: the number of a series, as triptych_describe() lists it; default: the largest. */
    int series;
    /* The channel or component, and the time, of a file with several; both count from 0. In DICOM,
     * slices that share their positions are times. */
    int channel, time;
    /* A value that stands for "no value", as text, such as "-9999". Its voxels count as absent.
     * "none" keeps all values. By default, known fill values that stand far outside of all other
     * values count as absent, such as 1e20, -9999 or -32768. */
    const char *fill;
    /* If not 0 and the volume has more voxels, reads only every second, third, ... voxel along each
     * axis, so that at most this many are read. */
    uint64_t max_voxels;

    /* ---- clouds of points alone ---- */

    triptych_point_colour point_colour;
    /* Neighbours that tell the radius and the normal of a point: 3 to 64; default: 12. */
    unsigned point_neighbours;
    /* Radius of all points, in units of the cloud. Default: from the file or from neighbours. */
    double point_radius;
    double point_radius_factor; /* multiplies all radii; default: 1 */
    /* Leaves out a point if the mean distance of its neighbours exceeds the mean over all points by
     * more than this many standard deviations, up to 1000. Default: keeps all points. */
    double point_outliers;
    /* If not 0, samples of range images and of scans with poses become ellipsoids with the
     * uncertainty of their distance. Clouds without the place of a scanner are refused. */
    int point_uncertainty;
    /* If not 0, range images are fused into points with the colours of several cameras. */
    int point_hyperlines;

    /* ---- the opacity envelope: the union of the following; `automatic` if none is given ---- */

    /* Presets or files; keeps the values that are visible with one of them. */
    const char *const *functions;
    size_t function_count; /* number of `functions` */
    const triptych_range *ranges;
    size_t range_count;
    int keep_all;  /* if not 0, keeps every finite value */
    int automatic; /* if not 0, keeps the values visible with the automatic transfer function */
    /* Keeps only voxels from `first` up to, but without, `past` along i, j, k. 0 for `past` selects
     * the end of the axis. All 0 selects the whole volume. Bricking reads the whole volume in any
     * case, so all regions have the same codes, and the halo reaches beyond the region.
     * triptych_add() draws several regions together. */
    int64_t region_first[3], region_past[3];

    /* ---- the data set ---- */
    triptych_code_bits code_bits; /* per value */
    triptych_normals normals;
    int no_halo; /* if not 0, stores no halo */
    int levels;  /* number of coarse levels; 0: until one is a single brick; below 0: none */
    triptych_levels_for levels_for;
    triptych_stored_harmonics harmonics; /* of a Gaussian scene */
    unsigned tile_voxels;                /* edge of a tile: 16, 32, 64 or 128; default 64 */
    unsigned slab_sheets;                /* 1 to 64; default 8 */
    int replace; /* if not 0, replaces an existing data set of the same name */
    /* If not 0, resumes an interrupted run with the same input and options, if there is one. */
    int resume;
    /* Limit of the data set's size. A larger data set is refused before it is written. 0 sets no
     * limit. */
    uint64_t max_bytes;
    uint64_t memory_bytes; /* default: a quarter of the memory available */
    unsigned threads;      /* up to 256; default: one per processor */
} triptych_brick_options;

/* Stages of bricking, one after the other. */
enum {
    TRIPTYCH_STAGE_SCAN,   /* reads all values, if the envelope or the normals depend on them */
    TRIPTYCH_STAGE_READ,   /* makes splats */
    TRIPTYCH_STAGE_MERGE,  /* merges spilled splats into the lists */
    TRIPTYCH_STAGE_LEVELS, /* makes coarse levels from the lists */
    TRIPTYCH_STAGE_FINISH, /* writes the index and syncs all files */
    TRIPTYCH_STAGES
};

typedef struct triptych_brick_stage {
    double seconds;
    uint64_t bytes_read, bytes_written; /* without the index */
} triptych_brick_stage;

typedef struct triptych_brick_summary {
    int64_t dims[3];
    double spacing[3], value_min, value_max;
    uint64_t voxels, kept, halo, not_finite;
    /* Bytes per splat in a list. */
    unsigned code_bytes, normal_bytes;
    /* Recognised kind of data, such as "ct" and "CT in Hounsfield units". */
    const char *kind, *kind_title;
    uint64_t input_bytes;       /* size of the volume, decompressed */
    uint64_t bytes, halo_bytes; /* size of all files on disk; size of the halo lists */
    uint64_t level_bytes;       /* size of the coarse levels' lists */
    unsigned levels;            /* number of coarse levels */
    /* Written to temporary files and removed again. */
    uint64_t temporary_bytes;
    int resumed;
    char note[1536]; /* choices made where the file leaves several, or "" */
    triptych_brick_stage stages[TRIPTYCH_STAGES];
    uint64_t memory_bytes, peak_memory_bytes; /* limit; maximum used */
} triptych_brick_summary;

/* Makes the data set `data_set` of the volume `volume`. NULL is allowed for `options` and
 * `summary`. Volumes are:
 * - a file: .nrrd, .nhdr, .nii, .nii.gz, .hdr with .img, .nc, .vdb, .vol, or raw data
 * - DICOM files
 * - slices: their folder, or a pattern of their names
 * - memory: triptych_brick_options.in_memory
 * The data set appears under its name only when it is complete. */
TRIPTYCH_API int triptych_brick(triptych *t, const char *volume, const char *data_set,
                                const triptych_brick_options *options,
                                triptych_brick_summary *summary);

/* Lets the integral renderer use the volume's own values and their gradients. These values are
 * not rounded to codes and include dropped voxels. Reads the volume. The data set made of it must
 * be open, with the integral renderer, and its grid must match. Only the options for reading count;
 * NULL is allowed. Opening another data set ends this. */
TRIPTYCH_API int triptych_set_source(triptych *t, const char *volume,
                                     const triptych_brick_options *options);

typedef struct triptych_brick_estimate {
    uint64_t voxels, kept, halo;
    /* Size of the data set, size of temporary files, and free space on their disk. */
    uint64_t bytes, temporary_bytes, free_bytes;
    double seconds;
} triptych_brick_estimate;

/* Estimates triptych_brick() with the same arguments from parts of the volume. Writes nothing. */
TRIPTYCH_API int triptych_estimate(triptych *t, const char *volume, const char *data_set,
                                   const triptych_brick_options *options,
                                   triptych_brick_estimate *out);

/* Identifies the data set that a volume and options would give, as keys for a cache. Each key has
 * 32 hexadecimal digits. Data sets with the same `content` and different `kept` differ only in the
 * values that they keep. */
typedef struct triptych_identity {
    /* From the paths, sizes and times of the files, and the options other than for kept values. */
    char state[33];
    /* From all bytes of the files, and the same options. "" if the files were not read. */
    char content[33];
    char kept[33];  /* from the options for kept values, the opacity envelope */
    uint64_t bytes; /* total size of the files */
    /* 0 if a file changed so recently that another change might not change `state`. */
    int stable;
} triptych_identity;

/* Computes the keys. Refuses volumes in memory. Reads the files for `content` if they have at most
 * `max_content_bytes` in total; 0 never reads them. Options that do not change the data set, such
 * as memory and threads, do not count. */
TRIPTYCH_API int triptych_identify(triptych *t, const char *volume,
                                   const triptych_brick_options *options,
                                   uint64_t max_content_bytes, triptych_identity *out);

/* Returns 1 if the open data set holds every value that it would keep if its volume were bricked
 * with these options, and every value that `shown` shows. Otherwise returns 0, or a negative code
 * after a failure. Only the options for kept values count. Either may be NULL. */
TRIPTYCH_API int triptych_holds(triptych *t, const triptych_brick_options *options,
                                const triptych_transfer_function *shown);

/* Receives the path of a file of a volume. A negative result ends triptych_list_files(). */
typedef int (*triptych_file_callback)(void *user, const char *path);

/* Calls `found` with the path of every file of the volume. For a folder or a pattern there may be
 * further files. A volume in memory has none. Only the options for reading count; NULL is allowed.
 * If `found` returns a negative number, the function stops and returns that number. */
TRIPTYCH_API int triptych_list_files(triptych *t, const char *volume,
                                     const triptych_brick_options *options,
                                     triptych_file_callback found, void *user);

/* The grid of a volume, as its file gives it. */
typedef struct triptych_description {
    const char *format; /* "nrrd", "images", ...; a constant */
    const char *type;   /* of the stored values, as triptych_brick_options.raw_type; a constant */
    int64_t dims[3];
    double index_to_world[3][4];
    double spacing_min[3], spacing_max[3]; /* distances of neighbouring voxels; equal if even */
    char space[8];                         /* "RAS" or "" */
    /* The source of the orientation, a constant: "space", "file", "axes", "program", "format", or
     * "values" for a guess that bricking makes. */
    const char *orientation;
    char grid[128];    /* name of the grid or variable, or "" */
    char modality[24]; /* of DICOM: "CT", "MR", ..., or "" */
    char note[1024];   /* choices made where the file leaves several, or "" */
} triptych_description;

/* Receives a line of text. A negative result ends the function that calls it. */
typedef int (*triptych_text_callback)(void *user, const char *text);

/* Describes a volume from its headers. Only the options for reading count; NULL is allowed. For
 * DICOM, calls `series`, unless it is NULL, with a line for each series: its number, name, modality
 * and size. */
TRIPTYCH_API int triptych_describe(triptych *t, const char *volume,
                                   const triptych_brick_options *options, triptych_description *out,
                                   triptych_text_callback series, void *user);

/* A Gaussian scene: splats with shapes of their own. */
typedef struct triptych_gaussians {
    char format[64];   /* "3DGS PLY", ... */
    char trainer[256]; /* the program that trained or wrote it, and other comments; or "" */
    char up[3];        /* the axis that points up: "x", "y", "z", or with a minus */
    uint64_t count;    /* of Gaussians, without those that are left out */
    uint64_t left_out; /* Gaussians with a value that is not finite */
    uint64_t outliers; /* points that triptych_brick_options.point_outliers left out */
    int degree;        /* of spherical harmonics, 0 to 3 */
    uint64_t coarse;   /* Gaussians of coarse levels; 0 before bricking, like the next two */
    uint64_t palette;  /* entries of the palette of harmonics; 0 without one */
    /* Mean error of colours by a palette, of 1, over all directions; 0 if none was tried. */
    double palette_error;
    int antialiased;     /* not 0: trained with a compensated opacity */
    int flat;            /* not 0: surfels, with two deviations each */
    double lo[3], hi[3]; /* of the centres */
} triptych_gaussians;

/* Returns 1 if a file is a Gaussian scene, 2 for the data set of one, 3 for a cloud of points,
 * otherwise 0. Reports nothing. */
TRIPTYCH_API int triptych_is_gaussians(triptych *t, const char *path);
/* Reads a Gaussian scene and describes it. Refuses clouds of points. */
TRIPTYCH_API int triptych_describe_gaussians(triptych *t, const char *path,
                                             triptych_gaussians *out);
/* Bricks a Gaussian scene, or a cloud of points as flat Gaussians. Only the options `replace` and
 * `memory_bytes` apply, and for clouds `threads` and those for clouds alone. *out gets the
 * description of the scene; NULL is allowed. */
TRIPTYCH_API int triptych_brick_gaussians(triptych *t, const char *path, const char *data_set,
                                          const triptych_brick_options *options,
                                          triptych_gaussians *out);

/* Attributes of points, as bits. */
enum {
    TRIPTYCH_POINT_NORMAL = 1,
    TRIPTYCH_POINT_RADIUS = 2,
    TRIPTYCH_POINT_COLOUR = 4,
    TRIPTYCH_POINT_INTENSITY = 8,
    TRIPTYCH_POINT_CLASSIFICATION = 16,
    TRIPTYCH_POINT_RETURNS = 32,
    TRIPTYCH_POINT_TIME = 64,
    TRIPTYCH_POINT_SCAN = 128,        /* several scans, or one with a pose */
    TRIPTYCH_POINT_UNCERTAINTY = 256, /* of distances */
};

/* A cloud of points, such as a laser scan. */
typedef struct triptych_points {
    char format[64];     /* "LAS 1.2, point format 3", ... */
    char extras[1024];   /* further attributes, by names; or "" */
    char comments[1024]; /* of the program that wrote it; or "" */
    uint64_t points;     /* without those that are left out */
    uint64_t left_out;   /* points with a position that is not finite, or marked as deleted */
    uint64_t empty;      /* cells of range grids without a point */
    unsigned attributes; /* TRIPTYCH_POINT_NORMAL and so on */
    double lo[3], hi[3]; /* of the positions */
    double intensity_min, intensity_max;
    double time_min, time_max;
    uint64_t classes[256];  /* points of each classification */
    unsigned returns_max;   /* of a pulse */
    unsigned scans;         /* with a pose or a grid */
    unsigned posed_scans;   /* scans with a pose */
    uint64_t width, height; /* of the range grid of a lone scan, or 0 */
    unsigned notes;
    char note[16][256]; /* choices and faults of the file, one sentence each */
} triptych_points;

/* Returns 1 if a file is a cloud of points, otherwise 0. Reports nothing. */
TRIPTYCH_API int triptych_is_points(triptych *t, const char *path);
/* Reads a cloud of points and describes it. */
TRIPTYCH_API int triptych_describe_points(triptych *t, const char *path, triptych_points *out);

/* The range of a part of a volume's values. */
typedef struct triptych_values {
    double share; /* of the volume; 1 for all of it, 0 if nothing is known */
    double value_min, value_max;
    double typical_min, typical_max; /* without the few values far outside */
    unsigned fill_count;
    double fills[8]; /* values among them that count as absent; see triptych_brick_options.fill */
} triptych_values;

/* Looks at a volume's values for about a second, whatever its size. Only the options for reading
 * count; NULL is allowed. */
TRIPTYCH_API int triptych_sample_values(triptych *t, const char *volume,
                                        const triptych_brick_options *options,
                                        triptych_values *out);

/* Returns 1 if `name` is a valid triptych_brick_options.raw_type, otherwise 0. */
TRIPTYCH_API int triptych_is_raw_type(const char *name);

#ifdef __cplusplus
}
#endif

#endif
