/* Data sets of volumes, for triptych.h: what `triptych brick` does. Zero means the default
 * everywhere. Needs no data set open; one that is open stays open. While it works, the context's
 * progress goes by the stages "sample", "scan" and "read" (of voxels), "merge" (of splats),
 * "levels" (of sheets) and "look" (of bytes). */
#ifndef TRIPTYCH_BRICK_H
#define TRIPTYCH_BRICK_H

#include <stddef.h>
#include <triptych.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum triptych_level_set {
    TRIPTYCH_LEVEL_SET_DEFAULT, /* filled */
    TRIPTYCH_LEVEL_SET_FILLED,  /* dense inside; a ramp of 4 voxels, or of the stored band
                                   where that is narrower */
    TRIPTYCH_LEVEL_SET_BAND,    /* densest at the surface */
} triptych_level_set;

typedef enum triptych_endian {
    TRIPTYCH_ENDIAN_NATIVE,
    TRIPTYCH_ENDIAN_LITTLE,
    TRIPTYCH_ENDIAN_BIG,
} triptych_endian;

typedef enum triptych_code_bits {
    TRIPTYCH_CODE_BITS_AUTO, /* 8 where these keep all values of the type exactly, else 16 */
    TRIPTYCH_CODE_BITS_8, /* values are rounded to 256 codes between the least and the greatest */
    TRIPTYCH_CODE_BITS_16,
} triptych_code_bits;

typedef enum triptych_normals {
    TRIPTYCH_NORMALS_AUTO,    /* compact where they change no colour by half of 1/255 */
    TRIPTYCH_NORMALS_COMPACT, /* 3 bytes */
    TRIPTYCH_NORMALS_FULL,    /* 4 bytes */
    TRIPTYCH_NORMALS_NONE,
} triptych_normals;

/* What coarse levels are drawn by: interpolated values (post), splats (pre). */
typedef enum triptych_levels_for {
    TRIPTYCH_LEVELS_FOR_AUTO, /* post, or pre where there is no halo */
    TRIPTYCH_LEVELS_FOR_POST, /* not without a halo */
    TRIPTYCH_LEVELS_FOR_PRE,
    TRIPTYCH_LEVELS_FOR_BOTH, /* not without a halo */
} triptych_levels_for;

typedef struct triptych_range {
    double lo, hi; /* inclusive */
} triptych_range;

typedef struct triptych_brick_options {
    /* How the volume is read. */
    const char *grid; /* OpenVDB: default "density", else the first fog, else the first scalars */
    triptych_level_set level_set; /* OpenVDB */
    int64_t raw_dims[3];          /* raw data: voxels along each axis, the fastest first */
    const char *raw_type;         /* "uint8", "int16", "float", ...; default: by the file's name */
    triptych_endian raw_endian;
    uint64_t raw_offset_bytes;
    const char *coordinates; /* of voxels along the axes, "X.txt,Y.txt,Z.txt": files of as many
                                numbers, ascending or descending; an axis whose name is empty has
                                even spacing; NULL: the file's, else even */
    double spacing[3];       /* of voxels; default: the file's, else 1 */
    /* Where in the patient x, y and z of a volume point to whose file does not say: three letters,
     * one of R and L, of A and P and of S and I each, as "PIR". */
    const char *axes;
    int allow_gaps;      /* not 0: slices may be missing in a stack */
    uint64_t max_voxels; /* not 0: of a volume of more voxels every second, third, ... along each
                             axis is read, so that there are at most so many */

    /* What is kept: the union of these; with none of them, as with `automatic`. */
    const char *const *functions; /* presets or files, */
    size_t function_count;        /* so many: what they show */
    const triptych_range *ranges;
    size_t range_count;
    int keep_all;  /* every finite value */
    int automatic; /* what the automatic transfer function shows */
    /* Of these, voxels from `first` to before `past` along i, j, k alone; past 0: to the end. All
     * 0: of the whole volume, which is read whatever the region is: regions of a volume have codes
     * alike, and the halo reaches beyond them, so that triptych_add() puts them together. */
    int64_t region_first[3], region_past[3];

    /* What is made. */
    triptych_code_bits code_bits; /* of a value */
    triptych_normals normals;
    int no_halo; /* not 0: not the transparent neighbours of what is kept */
    int levels;  /* coarse levels; 0: down to one brick, below 0: none */
    triptych_levels_for levels_for;
    unsigned tile_voxels;  /* 16, 32, 64 or 128; default 64 */
    unsigned slab_sheets;  /* 1 to 64; default 8 */
    int replace;           /* not 0: a data set of that name */
    int resume;            /* not 0: goes on from where the same was killed, if it was */
    uint64_t max_bytes;    /* more is refused before it is written */
    uint64_t memory_bytes; /* default: a quarter of what may be used */
    unsigned threads;      /* up to 256; default: one a processor */
} triptych_brick_options;

/* Its stages; none overlap. */
enum {
    TRIPTYCH_STAGE_SCAN,   /* a pass over the volume, where what is kept depends on all values */
    TRIPTYCH_STAGE_READ,   /* the pass that makes splats */
    TRIPTYCH_STAGE_MERGE,  /* of what was spilled, into the lists */
    TRIPTYCH_STAGE_LEVELS, /* coarse levels, of the lists written */
    TRIPTYCH_STAGE_FINISH, /* the index, and everything onto the disk */
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
    unsigned code_bytes, normal_bytes; /* of a splat in a list */
    const char *kind, *kind_title;     /* what it was taken for: "ct", "CT in Hounsfield units" */
    uint64_t input_bytes;              /* decompressed */
    uint64_t bytes, halo_bytes;        /* of all lists, of those of the halo */
    uint64_t level_bytes;              /* of those of coarse levels, of which there are */
    unsigned levels;                   /* so many */
    uint64_t temporary_bytes;          /* written and removed again */
    int resumed;
    char note[1024]; /* what was chosen where the file leaves a choice, or "" */
    triptych_brick_stage stages[TRIPTYCH_STAGES];
    uint64_t memory_bytes, peak_memory_bytes; /* that could be taken, and were */
} triptych_brick_summary;

/* Makes a data set of a volume: .nrrd, .nhdr, .nii (.gz, or .hdr with .img), .nc, .vdb, .vol, raw
 * data, DICOM, or slices by their folder or a pattern of names. `options` and `summary` may be
 * NULL. */
TRIPTYCH_API int triptych_brick(triptych *t, const char *volume, const char *data_set,
                                const triptych_brick_options *options,
                                triptych_brick_summary *summary);

/* For the integral renderer, once the data set is open: values come from the volume that it was
 * made of, all of them and not rounded, and gradients from those values. Reads the volume; of
 * `options`, which may be NULL, only how it is read counts. Opening a data set ends this. */
TRIPTYCH_API int triptych_set_source(triptych *t, const char *volume,
                                     const triptych_brick_options *options);

typedef struct triptych_brick_estimate {
    uint64_t voxels, kept, halo;
    uint64_t bytes, temporary_bytes, free_bytes; /* where the data set would be */
    double seconds;
} triptych_brick_estimate;

/* What that would come to, from parts of the volume. */
TRIPTYCH_API int triptych_estimate(triptych *t, const char *volume, const char *data_set,
                                   const triptych_brick_options *options,
                                   triptych_brick_estimate *out);

/* Names for what a data set would be made of, of 32 hexadecimal digits each: for a cache. */
typedef struct triptych_identity {
    char state[33];   /* of the options and the files' places, sizes and times */
    char content[33]; /* of the options and all bytes of the files; "" where they were not read */
    uint64_t bytes;   /* of the files */
    int stable; /* 0: a file changed so lately that changing again may leave `state` as it is */
} triptych_identity;

/* Files of up to `max_content_bytes` together are read for `content`; 0: none are. What does not
 * change the data set, such as memory and threads, does not count. */
TRIPTYCH_API int triptych_identify(triptych *t, const char *volume,
                                   const triptych_brick_options *options,
                                   uint64_t max_content_bytes, triptych_identity *out);

/* Calls `found` with the path of every file that a volume is read from; of a folder or a pattern
 * perhaps with some more. Of `options`, which may be NULL, only how it is read counts. What `found`
 * returns below 0 ends it, and is returned. */
TRIPTYCH_API int triptych_list_files(triptych *t, const char *volume,
                                     const triptych_brick_options *options,
                                     int (*found)(void *user, const char *path), void *user);

/* Whether a type is one of triptych_brick_options.raw_type. */
TRIPTYCH_API int triptych_is_raw_type(const char *name);

#ifdef __cplusplus
}
#endif

#endif
