/* The open sheet of a layer, where splats are composited sheet by sheet (splat.h): they are added
 * up in a surface of its own, one for each band, which is composited into the layer once the sheet
 * is over. Owned by one renderer; needs its context current. */
#ifndef TRIP_GL_SUMS_H
#define TRIP_GL_SUMS_H

#include "gl/target.h"
#include "gl/variant.h"

typedef struct trip_gl_sums {
    trip_gl_variants *variants;
    const trip_gl_target *target;
    trip_method method; /* of the frame */
    int axis;           /* of the layer */
    bool front_to_back;
    uint64_t open[TRIP_GL_BANDS_MAX]; /* by band: the sheet, TRIP_GL_NO_SHEET: none */
} trip_gl_sums;

#define TRIP_GL_NO_SHEET UINT64_MAX

/* The target's layer of `axis` was begun with sums. */
void trip_gl_sums_begin_layer(trip_gl_sums *s, int axis);
/* Readies a band for splats of a sheet, which lists of a level have in common: they are to be added
 * up from now on. */
int trip_gl_sums_use(trip_gl_sums *s, const trip_gl_band *band, unsigned level, int32_t sheet);
/* Composites what is open, whatever the stencil: of the layer, or of its passes so far. */
int trip_gl_sums_end_layer(trip_gl_sums *s);

#endif
