/* The bytes of a data set on disk, `NAME.trip/`, format version 7. FORMAT.md describes them for
 * people. Fixed width, little-endian, no pointers. Reserved bits are zero; other values are
 * refused.
 *
 *   index.trip               header, list descriptors, slabs, bricks, runs, page checksums, text
 *   x0.voxels x0.normals     plane files of the list of voxels along X at level 0
 *   x0.halo                  plane file of its halo list; likewise for Y, Z and other levels
 *   x1.values x1.deviations  plane files of the list of values along X at level 1
 *
 * A list along axis a holds its records by ascending sheet (coordinate along a). Within a sheet
 * they are in the order of the Morton code of (u, v), with u = axis (a + 1) mod 3 in the even bits
 * and v = axis (a + 2) mod 3 in the odd bits. Tiles are aligned powers of two, so this order does
 * not depend on the tile size. The records of one tile in one sheet (a run) are contiguous.
 *
 * A brick is a tile over the sheets of one slab (slab_sheets consecutive sheets). A list's file has
 * its slabs in order. A slab has its sheets in order. A sheet has the tiles of the slab's bricks in
 * Morton order of (tile_u, tile_v).
 *
 * In the voxel plane a run is a block (block.h). In the plane of normals it has normal_bytes per
 * record, in the plane of deviations one byte.
 *
 * Every plane file has a checksum (XXH64, seed 0) per page of 2^page_log2 bytes; the last page is
 * short. The index file is checked in the same way. Its page checksums are at its end, and their
 * own checksum is in the header. */
#ifndef TRIP_FORMAT_H
#define TRIP_FORMAT_H

#include <assert.h>
#include <stddef.h>
#include <stdint.h>

#define TRIP_MAGIC "TRIPTYCH"
#define TRIP_GAUSSIAN_MAGIC "TRIPGAUS" /* of a Gaussian scene (gaussians/gaussian_format.h) */
#define TRIP_FORMAT_VERSION 7
#define TRIP_FORMAT_OLDEST 6 /* the oldest version that is read; it has no deviations */
#define TRIP_HEADER_BYTES 1024
#define TRIP_LISTS_MAX 4096
#define TRIP_TEXT_BYTES_MAX (UINT64_C(1) << 24)
#define TRIP_RECORD_BYTES 4 /* of a voxel and of a normal, in memory */
#define TRIP_FILE_PLANES 4  /* room for planes in a list descriptor */

enum trip_plane {
    TRIP_PLANE_VOXELS,
    TRIP_PLANE_NORMALS,
    TRIP_PLANE_DEVIATIONS, /* of lists of values (deviation.h) */
    TRIP_PLANES,
    TRIP_PLANES_OF_VOXELS = TRIP_PLANE_DEVIATIONS, /* lists of voxels have only these planes */
};

/* The header, at offset 0 of index.trip. Offsets are from the start of index.trip. */
typedef struct trip_file_header {
    char magic[8];            /* TRIP_MAGIC, without a terminator */
    uint32_t version;         /* TRIP_FORMAT_OLDEST to TRIP_FORMAT_VERSION */
    uint32_t header_bytes;    /* TRIP_HEADER_BYTES */
    uint64_t header_checksum; /* XXH64 of the header with this field zero */
    uint64_t index_bytes;     /* length of index.trip */
    /* Page checksums of the index, 8 bytes per page of [header_bytes, checksums_offset). Pages are
     * counted from header_bytes. */
    uint64_t checksums_offset;
    uint64_t checksums_checksum; /* XXH64 of the page checksums */
    uint64_t dims[3];            /* voxels along i, j, k */
    double index_to_world[12];   /* row-major 3 x 4; voxel centres at integer indices */
    double code_lo, code_hi;     /* values of code 0 and code 65535 */
    double value_min, value_max; /* range of the volume's finite values */
    uint64_t reserved1;
    /* 3-byte normals: index-space gradient of 1, along i, j, k. */
    double gradient_step[3];
    /* Normals: gradients at least this long in world space are stored as a direction (normal.h). */
    double gradient_full;
    uint64_t voxels;       /* voxels read; in sparse grids, existing voxels */
    uint64_t kept;         /* records of a list of voxels at level 0 */
    uint64_t halo;         /* records of a halo list at level 0; 0 without a halo */
    uint32_t tile_log2;    /* 4 to 7, for a tile edge of 16 to 128 voxels */
    uint32_t slab_sheets;  /* sheets per slab, 1 to 64 */
    uint32_t page_log2;    /* 12 to 24 */
    uint32_t planes;       /* one bit per trip_plane in use; voxels always */
    uint32_t code_bytes;   /* 1 or 2 */
    uint32_t normal_bytes; /* 3 or 4; 0 without normals */
    uint32_t list_count;   /* 3 (X, Y and Z of voxels at level 0) to TRIP_LISTS_MAX */
    uint32_t reserved0;
    uint64_t lists_offset; /* trip_file_list[list_count] */
    uint64_t text_offset;  /* UTF-8 JSON: source, envelope, transfer function */
    uint64_t text_bytes;
    /* Positions of voxels along i, j and k (coordinates.h), as dims[0] + dims[1] + dims[2] doubles.
     * 0 means even spacing. */
    uint64_t coordinates_offset;
    /* Values of codes (codes.h), as code_table_entries doubles. 0 means even codes. */
    uint64_t code_table_offset;
    uint32_t code_table_entries, code_table_step_log2;
    /* Range of the values without the few that stand far outside. Functions made for the data
     * cover it. It lies in value_min to value_max. */
    double typical_min, typical_max;
    uint8_t reserved[TRIP_HEADER_BYTES - 360];
} trip_file_header;

typedef struct trip_file_list {
    uint32_t axis;  /* 0, 1, 2 */
    uint32_t level; /* 0 is the finest */
    uint32_t kind;  /* a trip_kind; (axis, level, kind) is unique */
    uint32_t planes;
    uint64_t dims[3];          /* of the list's grid */
    double index_to_world[12]; /* of the list's grid */
    double sheet_first; /* list coordinate of sheet 0, in indices of level 0 along the axis */
    double sheet_step;  /* distance of sheets in list coordinates, positive */
    uint64_t records;
    uint64_t slab_count, slabs_offset; /* trip_file_slab, ascending, without empty slabs */
    uint64_t brick_count,
        /* trip_file_brick, by slab, then Morton code of (tile_u, tile_v). */
        bricks_offset;
    uint64_t runs_offset;                             /* trip_file_run [brick][sheet of the slab] */
    uint64_t plane_bytes[TRIP_FILE_PLANES];           /* of the files; 0 if absent */
    uint64_t page_checksums_offset[TRIP_FILE_PLANES]; /* 8 bytes per page; 0 if absent */
    uint64_t reserved[7];
} trip_file_list;

typedef struct trip_file_slab {
    uint64_t first_brick;
    uint64_t first_record;
    uint64_t first_block; /* offset of its blocks in the voxel plane */
    uint32_t brick_count;
    uint32_t slab; /* first sheet = slab * slab_sheets */
} trip_file_slab;

typedef struct trip_file_brick {
    uint32_t tile_u, tile_v;            /* tile origin = tile << tile_log2 */
    uint32_t records;                   /* sum over its runs, >= 1 */
    uint16_t code_min, code_max;        /* of its records, as 16-bit codes */
    uint8_t u_min, u_max, v_min, v_max; /* tight bounds within the tile, inclusive */
    uint8_t sheet_min, sheet_max;       /* within the slab, inclusive */
    uint8_t deviation_max;              /* of its records; 0 without the plane */
    uint8_t reserved;
} trip_file_brick;

typedef struct trip_file_run {
    uint16_t records;
    uint16_t words; /* length of its block, in units of 8 bytes */
} trip_file_run;

static_assert(sizeof(trip_file_header) == TRIP_HEADER_BYTES, "header size");
static_assert(offsetof(trip_file_header, dims) == 48, "header layout");
static_assert(offsetof(trip_file_header, voxels) == 240, "header layout");
static_assert(offsetof(trip_file_header, text_bytes) == 312, "header layout");
static_assert(offsetof(trip_file_header, coordinates_offset) == 320, "header layout");
static_assert(offsetof(trip_file_header, reserved) == 360, "header layout");
static_assert(sizeof(trip_file_list) == 320, "list size");
static_assert(offsetof(trip_file_list, records) == 152, "list layout");
static_assert(sizeof(trip_file_slab) == 32, "slab size");
static_assert(sizeof(trip_file_brick) == 24, "brick size");
static_assert(sizeof(trip_file_run) == 4, "run size");

/* Codes of 8 bits. A byte c of the file stands for the code (c + TRIP_CODE_FIRST) * TRIP_CODE_STEP.
 */
enum {
    TRIP_CODE_STEP = 85,   /* the 65536 codes have 771 such steps */
    TRIP_CODE_FIRST = 258, /* as many steps lie below the 8-bit codes as above */
};

/* A voxel in memory: byte 0 is u within the tile, byte 1 is v within the tile, bytes 2-3 are the
 * 16-bit code. */
static inline uint32_t trip_voxel_pack(unsigned u, unsigned v, unsigned code)
{
    return (uint32_t)u | (uint32_t)v << 8 | (uint32_t)code << 16;
}

static inline unsigned trip_voxel_u(uint32_t voxel)
{
    return voxel & 255;
}

static inline unsigned trip_voxel_v(uint32_t voxel)
{
    return voxel >> 8 & 255;
}

static inline unsigned trip_voxel_code(uint32_t voxel)
{
    return voxel >> 16;
}

/* Interleaves the bits of u (even) and v (odd). */
uint64_t trip_morton(uint32_t u, uint32_t v);
/* Returns u, the even bits of a Morton code. For code >> 1 it returns v. */
uint32_t trip_morton_even(uint64_t code);

/* Returns the number of pages of a file. The last page may be short. */
static inline uint64_t trip_page_count(uint64_t bytes, unsigned page_log2)
{
    return (bytes >> page_log2) + ((bytes & ((UINT64_C(1) << page_log2) - 1)) != 0);
}

#endif
