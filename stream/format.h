/* The bytes of a data set on disk, `NAME.trip/`, format version 5; FORMAT.md describes the same for
 * people. Fixed width, little-endian, no pointers; reserved bits are zero and refused otherwise.
 *
 *   index.trip               header, list descriptors, slabs, bricks, runs, page checksums, text
 *   x0.voxels x0.normals     plane files of the list of voxels along X at level 0
 *   x0.halo                  of the list of the halo there; and so on for Y, Z and other levels
 *
 * A list along axis a holds its records by ascending sheet (coordinate along a), within a sheet by
 * the Morton code of (u, v), u = axis (a + 1) mod 3 in the even bits, v = axis (a + 2) mod 3 in the
 * odd ones. Tiles are aligned powers of two, so this order does not depend on the tile size, and
 * the records of one tile in one sheet (a run) are contiguous. A brick is a tile over the sheets of
 * one slab (slab_sheets consecutive sheets); a list's file is slab after slab, in a slab sheet
 * after sheet, in a sheet the tiles of the slab's bricks in Morton order of (tile_u, tile_v).
 *
 * In the voxel plane a run is a block (block.h); in the plane of normals, normal_bytes a record.
 *
 * Every plane file is checked in pages of 2^page_log2 bytes (XXH64, seed 0), the last one short.
 * The index file is checked the same way: its page checksums stand at its end, theirs in the
 * header. */
#ifndef TRIP_FORMAT_H
#define TRIP_FORMAT_H

#include <assert.h>
#include <stddef.h>
#include <stdint.h>

#define TRIP_MAGIC "TRIPTYCH"
#define TRIP_FORMAT_VERSION 5
#define TRIP_HEADER_BYTES 1024
#define TRIP_LISTS_MAX 4096
#define TRIP_TEXT_BYTES_MAX (UINT64_C(1) << 24)
#define TRIP_RECORD_BYTES 4 /* of a voxel, and of a normal, in memory */
#define TRIP_FILE_PLANES 4  /* places for planes in a list descriptor */

enum trip_plane {
    TRIP_PLANE_VOXELS,
    TRIP_PLANE_NORMALS,
    TRIP_PLANES,
};

/* index.trip, offset 0. Offsets are from the start of index.trip. */
typedef struct trip_file_header {
    char magic[8];               /* TRIP_MAGIC, no terminator */
    uint32_t version;            /* TRIP_FORMAT_VERSION */
    uint32_t header_bytes;       /* TRIP_HEADER_BYTES */
    uint64_t header_checksum;    /* XXH64 of the header with this field zero */
    uint64_t index_bytes;        /* length of index.trip */
    uint64_t checksums_offset;   /* index page checksums: 8 bytes per page of
                                    [header_bytes, checksums_offset), pages counted from there */
    uint64_t checksums_checksum; /* XXH64 of that table */
    uint64_t dims[3];            /* voxels along i, j, k */
    double index_to_world[12];   /* row-major 3 x 4; voxel centres at integer indices */
    double code_lo, code_hi;     /* value of code 0 and of code 65535 */
    double value_min, value_max; /* range of the volume's finite values */
    uint64_t reserved1;
    double gradient_step[3]; /* of 3-byte normals: index-space gradient of 1, along i, j, k */
    double gradient_full;    /* of normals: gradients at least this long in world space are kept
                                as a direction (normal.h) */
    uint64_t voxels;         /* voxels read (existing ones, for sparse grids) */
    uint64_t kept;           /* records of a list of voxels at level 0 */
    uint64_t halo;           /* records of a list of the halo at level 0; 0 without one */
    uint32_t tile_log2;      /* 4 to 7: tile edge 16 to 128 voxels */
    uint32_t slab_sheets;    /* sheets per slab, 1 to 64 */
    uint32_t page_log2;      /* 12 to 24 */
    uint32_t planes;         /* bit per trip_plane that some list has; voxels always */
    uint32_t code_bytes;     /* 1 or 2 */
    uint32_t normal_bytes;   /* 3 or 4; 0 without normals */
    uint32_t list_count;     /* 3 (X, Y and Z of voxels at level 0) to TRIP_LISTS_MAX */
    uint32_t reserved0;
    uint64_t lists_offset; /* trip_file_list[list_count] */
    uint64_t text_offset;  /* UTF-8 JSON: source, envelope, transfer function */
    uint64_t text_bytes;
    uint64_t coordinates_offset; /* where voxels lie along i, j and k (coordinates.h): doubles,
                                    dims[0] + dims[1] + dims[2] of them; 0: spacing is even */
    uint8_t reserved[TRIP_HEADER_BYTES - 328];
} trip_file_header;

typedef struct trip_file_list {
    uint32_t axis;  /* 0, 1, 2 */
    uint32_t level; /* 0: full resolution */
    uint32_t kind;  /* a trip_kind; (axis, level, kind) is unique */
    uint32_t planes;
    uint64_t dims[3];          /* of the list's own grid */
    double index_to_world[12]; /* of that */
    double sheet_first;        /* list coordinate of sheet 0, in level-0 indices along the axis */
    double sheet_step;         /* and from one sheet to the next, positive */
    uint64_t records;
    uint64_t slab_count, slabs_offset; /* trip_file_slab, ascending; empty slabs are left out */
    uint64_t brick_count,
        bricks_offset;    /* trip_file_brick, by slab, then Morton (tile_u, tile_v) */
    uint64_t runs_offset; /* trip_file_run [brick][sheet of the slab] */
    uint64_t plane_bytes[TRIP_FILE_PLANES];           /* of the files; 0 where absent */
    uint64_t page_checksums_offset[TRIP_FILE_PLANES]; /* 8 bytes per page; 0 where absent */
    uint64_t reserved[7];
} trip_file_list;

typedef struct trip_file_slab {
    uint64_t first_brick;
    uint64_t first_record;
    uint64_t first_block; /* where its blocks start in the voxel plane */
    uint32_t brick_count;
    uint32_t slab; /* first sheet = slab * slab_sheets */
} trip_file_slab;

typedef struct trip_file_brick {
    uint32_t tile_u, tile_v;            /* tile origin = tile << tile_log2 */
    uint32_t records;                   /* sum of its runs', >= 1 */
    uint16_t code_min, code_max;        /* of its records, as 16-bit codes */
    uint8_t u_min, u_max, v_min, v_max; /* tight bounds within the tile, inclusive */
    uint8_t sheet_min, sheet_max;       /* within the slab, inclusive */
    uint16_t reserved;
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
static_assert(sizeof(trip_file_list) == 320, "list size");
static_assert(offsetof(trip_file_list, records) == 152, "list layout");
static_assert(sizeof(trip_file_slab) == 32, "slab size");
static_assert(sizeof(trip_file_brick) == 24, "brick size");
static_assert(sizeof(trip_file_run) == 4, "run size");

/* Codes that 8 bits tell apart: a byte c of the file stands for (c + TRIP_CODE_FIRST)
 * TRIP_CODE_STEP.
 */
enum {
    TRIP_CODE_STEP = 85,   /* of the 65536 codes there are 771 steps, */
    TRIP_CODE_FIRST = 258, /* of which as many lie below those of 8 bits as above */
};

/* A voxel in memory: byte 0 u within the tile, byte 1 v within the tile, bytes 2-3 the 16-bit code.
 */
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
/* The even bits of a code side by side, which are its u; those of code >> 1 are its v. */
uint32_t trip_morton_even(uint64_t code);

/* Pages of a file of so many bytes; the last may be cut off. */
static inline uint64_t trip_page_count(uint64_t bytes, unsigned page_log2)
{
    return (bytes >> page_log2) + ((bytes & ((UINT64_C(1) << page_log2) - 1)) != 0);
}

#endif
