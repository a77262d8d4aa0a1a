/* The bytes of the data set of a Gaussian scene. GAUSSIANS.md describes them for people. Fixed
 * width, little-endian, no pointers. Reserved bits are zero; other values are refused.
 *
 *   index.trip                    header, nodes, bricks of the lists along X, Y and Z, text
 *   x.gaussians                   records of the list along X, by brick; likewise Y and Z
 *   x.harmonics1 .. x.harmonics3  coefficients of degree 1 to 3 of the same records, or
 *   x.palette                     numbers of entries of a palette of coefficients */
#ifndef TRIP_GAUSSIAN_FORMAT_H
#define TRIP_GAUSSIAN_FORMAT_H

#include <assert.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "format.h"

#define TRIP_GAUSSIAN_VERSION 3
#define TRIP_GAUSSIAN_HEADER_BYTES 512

enum {
    TRIP_GAUSSIAN_RECORD_BYTES = 24,
    TRIP_GAUSSIAN_BRICK_RECORDS_MAX = 6144,
    TRIP_GAUSSIAN_PLANES = 4, /* records, and coefficients of degree 1 to 3 */
    TRIP_GAUSSIAN_PALETTE_MAX = 65536,
    TRIP_GAUSSIAN_DEPTH_MAX = 64, /* nodes around one another */
};

/* A splat counts as nothing beyond so many deviations: exp(-3.33^2 / 2) < 1 / 255. */
#define TRIP_GAUSSIAN_REACH 3.33

enum trip_gaussian_flag {
    TRIP_GAUSSIAN_ANTIALIASED = 1, /* trained with opacities that make up for the blur of pixels */
    TRIP_GAUSSIAN_FLAT = 2,        /* surfels: the third deviation is 0 everywhere */
    TRIP_GAUSSIAN_Y_DOWN = 4,      /* the scene's y axis points down */
    TRIP_GAUSSIAN_PALETTE = 8,     /* a palette holds the coefficients of degree 1 and above */
    TRIP_GAUSSIAN_Z_UP = 16,       /* the scene's z axis points up; not with Y_DOWN */
    TRIP_GAUSSIAN_CLOUD = 32,      /* surfels of a cloud of points */
    TRIP_GAUSSIAN_SHADED = 64,     /* of a cloud: light shades its colours by default */
    /* samples of range images: the third axis points to the camera */
    TRIP_GAUSSIAN_FROM_CAMERA = 128,
    TRIP_GAUSSIAN_HYPERLINES = 256, /* the coefficients hold colours of cameras (hyperline.h) */
    TRIP_GAUSSIAN_FLAGS = 511,
};

typedef struct trip_file_gaussian_header {
    char magic[8];             /* TRIP_GAUSSIAN_MAGIC, without a terminator */
    uint32_t version;          /* TRIP_GAUSSIAN_VERSION */
    uint32_t header_bytes;     /* TRIP_GAUSSIAN_HEADER_BYTES */
    uint64_t header_checksum;  /* XXH64 of the header with this field zero */
    uint64_t tables_checksum;  /* XXH64 of all bytes behind the header */
    uint64_t index_bytes;      /* length of index.trip */
    uint64_t records;          /* Gaussians of the scene, without the coarse ones */
    uint32_t degree;           /* of the spherical harmonics, 0 to 3 */
    uint32_t flags;            /* trip_gaussian_flag */
    uint64_t brick_count[3];   /* of the lists along X, Y, Z */
    uint64_t bricks_offset[3]; /* trip_file_gaussian_brick[brick_count] */
    uint64_t text_offset;      /* UTF-8 JSON, at the end of the file */
    uint64_t text_bytes;
    double centre_lo[3], centre_hi[3];      /* bounds of all centres */
    double reach_lo[3], reach_hi[3];        /* bounds of all ellipsoids of TRIP_GAUSSIAN_REACH */
    double typical_lo[3], typical_hi[3];    /* bounds of the centres without the outer 1 % a side */
    uint64_t list_records;                  /* of each list, with the coarse ones */
    uint64_t node_count, nodes_offset;      /* trip_file_gaussian_node[node_count] */
    uint64_t palette_count, palette_offset; /* entries; see trip_gaussian_entry_bytes() */
    uint8_t reserved[TRIP_GAUSSIAN_HEADER_BYTES - 304];
} trip_file_gaussian_header;

/* A part of the scene. A node with nodes inside it holds coarse Gaussians, which stand for all
 * Gaussians of these nodes. Every other node holds Gaussians of the scene. The nodes inside a node
 * follow it. */
typedef struct trip_file_gaussian_node {
    double lo[3], hi[3];     /* bounds of the centres of the node and of all nodes inside it */
    double width;            /* of the voxels that were merged; 0 if nothing was */
    uint64_t nodes;          /* this one and those inside it */
    uint64_t first_brick[3]; /* of the lists along X, Y, Z */
    uint32_t brick_count[3];
    uint32_t level; /* 0 if no node is inside, otherwise 1 more than the highest of them */
} trip_file_gaussian_node;

typedef struct trip_file_gaussian_brick {
    double centre_lo[3], centre_hi[3]; /* bounds of the centres; codes of centres count from them */
    double reach_lo[3], reach_hi[3];   /* bounds of the ellipsoids of TRIP_GAUSSIAN_REACH */
    uint64_t first_record;
    uint32_t records;                 /* 1 to TRIP_GAUSSIAN_BRICK_RECORDS_MAX */
    int32_t size_class;               /* trip_gaussian_size_class() of the records */
    float log_lo, log_hi;             /* natural logarithms of the deviations, except zeros */
    float colour_lo[3], colour_hi[3]; /* of the coefficient of degree 0, by channel */
    float scale[3];                   /* largest magnitude of the coefficients of degree 1 to 3 */
    float opacity_max;
    uint64_t checksums[TRIP_GAUSSIAN_PLANES]; /* XXH64 of the brick's bytes in each file */
    /* The cone that holds the normals of all surfels: its axis of unit length, and the cosine of
     * the angle from its axis to its side, above 0. All are 0 for no cone. */
    float cone_axis[3], cone_cosine;
} trip_file_gaussian_brick;

static_assert(sizeof(trip_file_gaussian_header) == TRIP_GAUSSIAN_HEADER_BYTES, "header size");
static_assert(offsetof(trip_file_gaussian_header, records) == 40, "header layout");
static_assert(offsetof(trip_file_gaussian_header, centre_lo) == 120, "header layout");
static_assert(offsetof(trip_file_gaussian_header, reserved) == 304, "header layout");
static_assert(sizeof(trip_file_gaussian_node) == 104, "node size");
static_assert(offsetof(trip_file_gaussian_node, first_brick) == 64, "node layout");
static_assert(offsetof(trip_file_gaussian_node, level) == 100, "node layout");
static_assert(sizeof(trip_file_gaussian_brick) == 208, "brick size");
static_assert(offsetof(trip_file_gaussian_brick, first_record) == 96, "brick layout");
static_assert(offsetof(trip_file_gaussian_brick, checksums) == 160, "brick layout");
static_assert(offsetof(trip_file_gaussian_brick, cone_axis) == 192, "brick layout");

/* Returns whether the normals of a scene's Gaussians point away from front sides. */
static inline bool trip_gaussian_has_sides(const trip_file_gaussian_header *h)
{
    const uint32_t surfels = TRIP_GAUSSIAN_FLAT | TRIP_GAUSSIAN_CLOUD;
    return (h->flags & surfels) == surfels;
}

/* Returns the number of planes up to a degree. With a palette, one plane serves all degrees. */
static inline unsigned trip_gaussian_plane_count(const trip_file_gaussian_header *h, int degree)
{
    return h->flags & TRIP_GAUSSIAN_PALETTE && degree > 0 ? 2 : (unsigned)degree + 1;
}

/* Returns the bytes of a record in a plane: 24, then 9, 15 and 21, or 2 with a palette. */
static inline unsigned trip_gaussian_plane_bytes(const trip_file_gaussian_header *h, unsigned plane)
{
    return !plane                             ? TRIP_GAUSSIAN_RECORD_BYTES
           : h->flags & TRIP_GAUSSIAN_PALETTE ? 2
                                              : 3 * (2 * plane + 1);
}

/* Returns the number of an entry from the two bytes of a record. */
static inline unsigned trip_gaussian_entry_number(const unsigned char *bytes)
{
    return bytes[0] | (unsigned)bytes[1] << 8;
}

/* Returns the bytes of an entry of a palette up to a degree. For each degree n it has the largest
 * magnitude, a float, and 3 (2 n + 1) signed bytes. */
static inline unsigned trip_gaussian_entry_bytes(int degree)
{
    unsigned bytes = 0;
    for (int n = 1; n <= degree; n++)
        bytes += 4 + 3 * (2 * (unsigned)n + 1);
    return bytes;
}

#endif
