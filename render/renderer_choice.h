/* Chooses and creates a renderer. Any thread may call it; the caller owns the renderer. */
#ifndef TRIP_RENDERER_CHOICE_H
#define TRIP_RENDERER_CHOICE_H

#include "renderer.h"

typedef enum trip_renderer_kind {
    TRIP_RENDERER_AUTO, /* gl on graphics hardware, otherwise cpu */
    TRIP_RENDERER_GL,
    TRIP_RENDERER_CPU,
    TRIP_RENDERER_REFERENCE,
    TRIP_RENDERER_INTEGRAL,
} trip_renderer_kind;

/* Creates a renderer. `threads` 0 selects one thread per processor. AUTO falls back without a
 * message. Fails (reported) if the renderer cannot run here. */
int trip_renderer_create(trip_renderer **out, trip_renderer_kind kind, unsigned threads,
                         trip_budget *budget);

#endif
