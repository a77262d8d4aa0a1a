/* The open sheet of a layer if splats are composited sheet by sheet (splat.h). Each band has a
 * surface that sums the splats of the open sheet. When the sheet ends, its sums are composited into
 * the layer. Owned by one renderer; the context must be current. */
#ifndef TRIP_GL_SUMS_H
#define TRIP_GL_SUMS_H

#include "gl/target.h"
#include "gl/variant.h"

typedef struct trip_gl_sums {
    trip_gl_variants *variants;
    const trip_gl_target *target;
    trip_method method;
    int axis; /* of the layer */
    bool front_to_back;
    uint64_t open[TRIP_GL_BANDS_MAX]; /* for each band: the open sheet, or TRIP_GL_NO_SHEET */
} trip_gl_sums;

#define TRIP_GL_NO_SHEET UINT64_MAX

/* Begins the layer of `axis`. The target's layer must have begun with sums. */
void trip_gl_sums_begin_layer(trip_gl_sums *s, int axis);
/* Prepares a band to sum splats of a sheet. If another sheet is open, it is composited first. All
 * lists of a level share a sheet. */
int trip_gl_sums_use(trip_gl_sums *s, const trip_gl_band *band, unsigned level, int32_t sheet);
/* Composites the open sheets, ignoring the stencil. Call it at the end of a layer or between its
 * passes. */
int trip_gl_sums_end_layer(trip_gl_sums *s);

#endif
