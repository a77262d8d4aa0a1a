/* Contexts of the library, one for each data set and renderer, opened when first needed. They
 * divide the memory given between them, together with the pictures that are compared. One thread.
 */
#ifndef TRIP_ACCURACY_CONTEXTS_H
#define TRIP_ACCURACY_CONTEXTS_H

#include "accuracy_options.h"
#include "budget.h"
#include "setting.h"
#include "views.h"

enum { ACCURACY_SOURCE = TRIPTYCH_RENDERER_INTEGRAL + 1, ACCURACY_RENDERERS };

typedef struct accuracy_contexts {
    const accuracy_options *options;
    triptych *contexts[ACCURACY_DATA_MAX][ACCURACY_RENDERERS];
    char why[ACCURACY_DATA_MAX][ACCURACY_RENDERERS][256]; /* there is none; "": not tried */
    const accuracy_view *view;
    trip_budget *budget; /* of pictures */
    uint64_t share_bytes;
} accuracy_contexts;

int accuracy_contexts_create(accuracy_contexts *c, const accuracy_options *o);
void accuracy_contexts_close(accuracy_contexts *c);

/* A context with the options' function; `renderer` may be ACCURACY_SOURCE: the integral of the
 * source volume. Where it cannot be had the reason is in c->why, and TRIP_ERROR is returned with
 * nothing reported. TRIP_INTERRUPTED is reported. */
int accuracy_contexts_open(accuracy_contexts *c, int data, int renderer, triptych **out);

/* From here on frames are drawn from there. */
int accuracy_contexts_look(accuracy_contexts *c, const accuracy_view *view);

/* Draws a frame; *ms: what it took from its beginning to the picture. Returns as above. */
int accuracy_contexts_draw(accuracy_contexts *c, int data, int renderer,
                           const triptych_settings *settings, float *rgba, double *ms);

#endif
