/* Renderers that make no picture: one that takes batches and does nothing, so that reading can be
 * timed alone, and one that measures on a sample of the splats how many pixels a footprint covers.
 */
#ifndef TRIP_BENCH_PROBE_H
#define TRIP_BENCH_PROBE_H

#include "renderer.h"

typedef struct bench_probe {
    trip_renderer base;
    unsigned sample_stride; /* of every so many splats one is looked at; 0: none */
    const trip_frame *frame;
    int axis;
    uint64_t seen;           /* splats of the frame so far */
    uint64_t sampled, drawn; /* looked at; of those, with a pixel where the list has weight */
    uint64_t pixels;         /* those pixels */
} bench_probe;

bench_probe bench_probe_make(unsigned sample_stride);

#endif
