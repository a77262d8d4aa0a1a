/* What kinds of records a list can hold. A kind is a row of a table of constants, which
 * says what decoding, culling and drawing need of a list's records. */
#ifndef TRIP_KIND_H
#define TRIP_KIND_H

#include <stdbool.h>

typedef enum trip_kind {
    TRIP_KIND_VOXELS, /* voxels that show under some transfer function */
    TRIP_KIND_HALO,   /* transparent neighbours of those: values alone, for interpolation */
    TRIP_KIND_MEANS, /* coarse voxels: of the voxels kept in each, as a splat needs them (mean.h) */
    TRIP_KIND_VALUES, /* coarse voxels: mean values of all voxels known, for interpolation */
    TRIP_KINDS,
} trip_kind;

typedef struct trip_kind_info {
    const char *name;           /* "voxels", "halo" */
    const char *plane_names[2]; /* of its files, by trip_plane; NULL where it has none */
    unsigned planes;            /* bit per trip_plane that such a list may have */
    bool splatted;              /* drawn by splatting */
    bool lattice;               /* records are points of the list's grid, and are culled as such */
    /* Of its codes; 0: the header's. The lowest axis_bits of them belong to the list's axis, so
     * that lists along other axes hold others. */
    unsigned code_bytes, axis_bits;
    bool steps;   /* its codes are whole steps where the header's have 8 bits */
    bool coarse;  /* at levels above 0 alone */
    double reach; /* how far a splat reaches from its voxel, as multiple of the kernel radius */
} trip_kind_info;

/* NULL for a number that is no kind. */
const trip_kind_info *trip_kind_of(trip_kind kind);

#endif
