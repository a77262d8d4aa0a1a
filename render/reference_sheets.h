/* The reference renderer's pictures of frames that classify after interpolation: sheet.h in double
 * precision, pixel by pixel. What the passes bring is gathered in one field for all layers; what a
 * plan leaves out changes nothing in the layer that it is left out of, so it may as well be there
 * for another. Owned by the reference renderer. */
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

/* Before the layers of what was put so far. */
int trip_reference_sheets_prepare(trip_reference_sheets *s);
/* The layer of `axis` at the centre of pixel (x, y), which has weight there; depths are distances.
 */
void trip_reference_sheets_layer(const trip_reference_sheets *s, int axis, int x, int y,
                                 double layer[TRIP_CHANNELS_MAX]);

#endif
