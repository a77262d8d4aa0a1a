/* The kinds of records in a list. A kind is a row of a constant table. It has the properties that
 * culling and drawing use. It also has functions for the bytes of its runs, which writing, reading
 * and checking call. */
#ifndef TRIP_KIND_H
#define TRIP_KIND_H

#include <stdbool.h>

#include "block.h"

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
    const char *name;                     /* "voxels", "halo", ... */
    const char *plane_names[TRIP_PLANES]; /* file names; NULL if the kind lacks the plane */
    unsigned planes;                      /* one bit per trip_plane that such a list may have */
    bool splatted;                        /* drawn as splats */
    bool lattice;                         /* records are grid points and are culled as such */
    /* code_bytes: 0 selects the header's. The lowest axis_bits of a code depend on the list's axis,
     * so lists along other axes hold other codes. */
    unsigned code_bytes, axis_bits;
    bool steps;   /* codes are multiples of TRIP_CODE_STEP if the header's codes have 8 bits */
    bool coarse;  /* only at levels above 0 */
    double reach; /* radius of a splat, as a multiple of the kernel radius */
    /* Returns the words of the largest block of a run. */
    uint32_t (*max_words)(const trip_block_form *f);
    /* Whether a run of `records` records, at least 1, can have a block of `words` words. */
    bool (*words_fit)(const trip_block_form *f, uint32_t records, uint32_t words);
    /* Packs the records of a run; see trip_block_pack(). */
    uint32_t (*pack)(const trip_block_form *f, const uint32_t *records, uint32_t count,
                     uint64_t *block);
    /* Checks a block from a file against its brick. Returns the fault, or NULL. */
    const char *(*check)(const trip_block *b, const trip_file_brick *brick);
    /* Whether the unused bytes of a checked block are zero. */
    bool (*is_padded)(const trip_block *b);
    /* Unpacks records [first, first + count) of a checked block; see trip_block_voxels(). */
    void (*unpack)(const trip_block *b, uint32_t first, uint32_t count, uint32_t *records);
} trip_kind_info;

/* Returns NULL for an invalid number. */
const trip_kind_info *trip_kind_of(trip_kind kind);

static inline trip_block_form trip_block_form_of(const trip_file_header *h, trip_kind kind)
{
    const trip_kind_info *of = trip_kind_of(kind);
    return (trip_block_form){ h->tile_log2, of->code_bytes ? of->code_bytes : h->code_bytes,
                              h->normal_bytes, of->steps && h->code_bytes == 1 };
}

#endif
