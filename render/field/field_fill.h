/* Fills a field from a frame's batches of voxels and halo, with exact draw codes. It takes normals
 * if they are read and wanted. A voxel may arrive twice with the same value. One thread. */
#ifndef TRIP_FIELD_FILL_H
#define TRIP_FIELD_FILL_H

#include "draw_codes.h"
#include "field.h"
#include "normal.h"
#include "reader.h"

typedef struct trip_field_fill {
    trip_field *field;
    /* Takes the deviation code of each voxel (deviation.h) in draw codes, if not NULL. The caller
     * sets it afterwards. Voxels without a deviation have 0. */
    trip_field *deviations;
    bool has_normals;
    const trip_file_header *header;
    trip_draw_codes draw;
    trip_compact_normals compact; /* decodes normals of 3 bytes */
    uint32_t voxels[TRIP_RUN_RECORDS_MAX], normals[TRIP_RUN_RECORDS_MAX]; /* of a run */
} trip_field_fill;

/* `planes` selects the planes to use, a bit per trip_plane. */
void trip_field_fill_begin(trip_field_fill *f, const trip_dataset *data,
                           const trip_draw_codes *draw, trip_field *field, unsigned planes);
int trip_field_fill_run(trip_field_fill *f, const trip_batch *batch, const trip_run *run);

#endif
