/* A renderer without a picture, of two kinds. One takes batches and does nothing, so that reading
 * can be timed alone. The other measures, on a sample of the splats, how many pixels a footprint
 * covers. Render thread only. */
#ifndef TRIP_BENCH_PROBE_H
#define TRIP_BENCH_PROBE_H

#include "renderer.h"

typedef struct bench_probe {
    trip_renderer base;
    unsigned sample_stride; /* examines one of this many splats; 0 disables it */
    const trip_frame *frame;
    int axis;
    uint64_t seen;           /* splats of the frame so far */
    uint64_t sampled, drawn; /* examined; examined and with a pixel where the list has weight */
    uint64_t pixels;         /* sum of the covered pixels */
} bench_probe;

bench_probe bench_probe_make(unsigned sample_stride);

#endif
