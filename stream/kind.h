/* The kinds of records in a list. A kind is a row of a constant table with the properties that
 * decoding, culling and drawing use. */
#ifndef TRIP_KIND_H
#define TRIP_KIND_H

#include <stdbool.h>

typedef enum trip_kind {
    TRIP_KIND_VOXELS, /* voxels that are visible under some transfer function */
    /* Transparent neighbours of kept voxels: values only, for interpolation. */
    TRIP_KIND_HALO,
    /* Coarse voxels: means of the kept voxels in each, for splats (mean.h). */
    TRIP_KIND_MEANS,
    /* Coarse voxels: mean values of all known voxels, for interpolation. */
    TRIP_KIND_VALUES,
    TRIP_KINDS,
} trip_kind;

typedef struct trip_kind_info {
    const char *name;           /* "voxels", "halo", ... */
    const char *plane_names[2]; /* file names by trip_plane; NULL if the kind lacks the plane */
    unsigned planes;            /* one bit per trip_plane that such a list may have */
    bool splatted;              /* drawn as splats */
    bool lattice;               /* records are grid points and are culled as such */
    /* code_bytes: 0 selects the header's. The lowest axis_bits of a code depend on the list's axis,
     * so lists along other axes hold other codes. */
    unsigned code_bytes, axis_bits;
    bool steps;   /* codes are multiples of TRIP_CODE_STEP if the header's codes have 8 bits */
    bool coarse;  /* only at levels above 0 */
    double reach; /* radius of a splat, as a multiple of the kernel radius */
} trip_kind_info;

/* Returns NULL for an invalid number. */
const trip_kind_info *trip_kind_of(trip_kind kind);

#endif
