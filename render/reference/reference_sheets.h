/* Draws `post` frames for the reference renderer, which owns it: sheet.h in double precision, pixel
 * by pixel. The voxels of all passes go into one field for all layers. A voxel that the plan leaves
 * out of a layer cannot change that layer, so it may be present for another. One thread. */
#ifndef TRIP_REFERENCE_SHEETS_H
#define TRIP_REFERENCE_SHEETS_H

#include "layer.h"
#include "renderer.h"

typedef struct trip_reference_sheets trip_reference_sheets;

int trip_reference_sheets_create(trip_reference_sheets **out, const trip_frame *frame,
                                 trip_budget *budget);
void trip_reference_sheets_destroy(trip_reference_sheets *s);

int trip_reference_sheets_put(trip_reference_sheets *s, const trip_batch *batch,
                              const trip_run *run);

/* Prepares the voxels put so far. Call it before trip_reference_sheets_layer(). Fails (reported) if
 * memory is exhausted or the frame is interrupted. */
int trip_reference_sheets_prepare(trip_reference_sheets *s);
/* Computes the layer of `axis` at the centre of pixel (x, y). The layer must have weight there.
 * Depths are distances. */
void trip_reference_sheets_layer(const trip_reference_sheets *s, int axis, int x, int y,
                                 double layer[TRIP_CHANNELS_MAX]);

#endif
