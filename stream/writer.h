/* Writes a data set: runs appended in list order to each of the three lists, then the index. All
 * files grow in `NAME.trip.partial/`, which becomes `NAME.trip/` only when trip_writer_finish() has
 * synced everything. Different lists may be appended to by different threads at once. The bytes
 * depend on what is appended only. */
#ifndef TRIP_WRITER_H
#define TRIP_WRITER_H

#include <stdbool.h>

#include "budget.h"
#include "format.h"
#include "geometry.h"

typedef struct trip_writer trip_writer;

/* Zero means the default. */
typedef struct trip_writer_params {
    bool replace; /* an existing NAME.trip is replaced; otherwise refused */
    bool normals;
    unsigned tile_voxels; /* 16, 32, 64 (default) or 128 */
    unsigned slab_sheets; /* default 8 */
    unsigned page_bytes;  /* default 16384 */
    int64_t dims[3];
    trip_affine index_to_world;
    double code_lo, code_hi;
    double gradient_scale;
} trip_writer_params;

int trip_writer_open(trip_writer **out, const char *path, const trip_writer_params *params,
                     trip_budget *budget);

/* One run: `count` splats of tile (tile_u, tile_v) in `sheet` of the list along `axis`, records in
 * Morton order of (u, v), normals NULL without that plane. Runs must come in list order (sheet,
 * then Morton code of the tile). */
int trip_writer_append(trip_writer *w, int axis, uint32_t sheet, uint32_t tile_u, uint32_t tile_v,
                       const uint32_t *voxels, const uint32_t *normals, uint32_t count);

/* Replaces what the parameters said of codes and gradients: records hold codes, so that their range
 * may be found while the volume is read. Before finish. */
int trip_writer_set_codes(trip_writer *w, double code_lo, double code_hi, double gradient_scale);

/* What is known only at the end. */
typedef struct trip_writer_summary {
    double value_min, value_max;
    uint64_t voxels;
    const char *text; /* JSON */
} trip_writer_summary;

/* Fails when the three lists hold different numbers of splats. On any failure call abort. */
int trip_writer_finish(trip_writer *w, const trip_writer_summary *summary);
/* Removes the partial folder. Also frees `w`; finish frees it itself on success only. */
void trip_writer_abort(trip_writer *w);

uint64_t trip_writer_bytes(const trip_writer *w);

#endif
