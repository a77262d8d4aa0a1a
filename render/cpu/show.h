/* Which voxels of a batch's runs may show: those whose squares are not hidden by closed blocks of
 * pixels. Voxels lie in Morton order, so that those of a square follow one another. Any thread may
 * ask. */
#ifndef TRIP_CPU_SHOW_H
#define TRIP_CPU_SHOW_H

#include "cpu/cover.h"

/* Voxels of a run, one after the other in memory. */
typedef struct trip_cpu_span {
    const trip_run *run;
    uint64_t first;
    uint32_t count;
} trip_cpu_span;

/* The part of a span in draw order: `count` voxels after `skip`. */
static inline trip_cpu_span trip_cpu_span_part(const trip_cpu_span *s, bool reversed, uint32_t skip,
                                               uint32_t count)
{
    return (trip_cpu_span){ s->run, s->first + (reversed ? s->count - skip - count : skip), count };
}

/* Who asks. */
typedef struct trip_cpu_asking {
    const trip_cpu_kernels *kernels;
    const trip_cpu_view *view;
    const trip_cpu_mask *mask;
    const uint32_t *voxels; /* of spans */
    bool reversed;          /* the draw order is */
    trip_cpu_lanes *lanes;  /* to work in */
} trip_cpu_asking;

/* Writes those of a span's voxels that may show to `shown`, in draw order, and returns how many
 * spans they are: at most one a voxel. */
uint32_t trip_cpu_show(const trip_cpu_asking *asking, const trip_cpu_span *span,
                       trip_cpu_span *shown);

#endif
