/* Contexts of the library, one for each data set and renderer, opened at their first use. They
 * divide the memory equally, together with the pictures for comparison. One thread. */
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
    char why[ACCURACY_DATA_MAX][ACCURACY_RENDERERS]
            [256]; /* reason why opening failed; "" if it was not tried */
    const accuracy_view *view;
    trip_budget *budget; /* for pictures */
    uint64_t share_bytes;
} accuracy_contexts;

int accuracy_contexts_create(accuracy_contexts *c, const accuracy_options *o);
void accuracy_contexts_close(accuracy_contexts *c);

/* Opens a context with the transfer function of the options. ACCURACY_SOURCE as renderer selects
 * the integral of the source volume. If this is impossible, returns TRIP_ERROR, reports nothing,
 * and keeps the reason in c->why. TRIP_INTERRUPTED is reported. */
int accuracy_contexts_open(accuracy_contexts *c, int data, int renderer, triptych **out);

/* Sets the view for all frames that follow. `view` must outlive its use. */
int accuracy_contexts_look(accuracy_contexts *c, const accuracy_view *view);

/* Draws a frame. *ms is the time from its beginning to the complete picture. Returns errors like
 * accuracy_contexts_open(). */
int accuracy_contexts_draw(accuracy_contexts *c, int data, int renderer,
                           const draw_settings *settings, float *rgba, double *ms);

#endif
