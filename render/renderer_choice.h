/* Picks and makes a renderer. */
#ifndef TRIP_RENDERER_CHOICE_H
#define TRIP_RENDERER_CHOICE_H

#include "renderer.h"

typedef enum trip_renderer_kind {
    TRIP_RENDERER_AUTO, /* gl on graphics hardware, else cpu */
    TRIP_RENDERER_GL,
    TRIP_RENDERER_CPU,
    TRIP_RENDERER_REFERENCE,
    TRIP_RENDERER_INTEGRAL,
} trip_renderer_kind;

/* `threads` 0: as many as there are processors. AUTO says nothing about what it found missing. */
int trip_renderer_create(trip_renderer **out, trip_renderer_kind kind, unsigned threads,
                         trip_budget *budget);

#endif
