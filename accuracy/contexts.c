#include "contexts.h"

#include <stdio.h>
#include <string.h>

#include "clock.h"
#include "report.h"
#include "triptych_brick.h"

int accuracy_contexts_create(accuracy_contexts *c, const accuracy_options *o)
{
    *c = (accuracy_contexts){ .options = o };
    uint64_t all = o->memory_bytes ? o->memory_bytes : trip_memory_available_bytes() / 4;
    /* Shares: four renderers for each data set, the integral of the source, and the pictures. */
    c->share_bytes = all / (2 + 4 * (uint64_t)o->data_count);
    return trip_budget_create(&c->budget, c->share_bytes);
}

void accuracy_contexts_close(accuracy_contexts *c)
{
    for (int d = 0; d < ACCURACY_DATA_MAX; d++)
        for (int r = 0; r < ACCURACY_RENDERERS; r++)
            triptych_destroy(c->contexts[d][r]);
    trip_budget_destroy(c->budget);
    *c = (accuracy_contexts){ 0 };
}

/* Keeps the context's error message, without its "triptych: STAGE: " prefix. */
static int keep_why(accuracy_contexts *c, int data, int renderer, triptych *t, int status)
{
    const char *why = triptych_error(t);
    if (status == TRIPTYCH_CANCELLED)
        return trip_fail(TRIP_INTERRUPTED, "accuracy", c->options->data[0], "interrupted");
    for (int i = 0; i < 2; i++) {
        const char *colon = strstr(why, ": ");
        why = colon ? colon + 2 : why;
    }
    snprintf(c->why[data][renderer], sizeof c->why[data][renderer], "%s", why);
    return TRIP_ERROR;
}

static int open_context(const accuracy_contexts *c, int data, int renderer, triptych *t)
{
    const accuracy_options *o = c->options;
    bool source = renderer == ACCURACY_SOURCE;
    const triptych_resources resources = {
        .memory_bytes = c->share_bytes,
        .threads = o->threads,
        .renderer = source ? TRIPTYCH_RENDERER_INTEGRAL : (triptych_renderer)renderer,
    };
    int status = triptych_open(t, o->data[data], &resources);
    if (!status)
        status = triptych_set_transfer_function(t, &(triptych_transfer_function){ .name = o->tf });
    if (!status && source)
        status = triptych_set_source(t, o->source, NULL);
    if (!status && c->view)
        status = accuracy_view_use(t, c->view);
    return status;
}

int accuracy_contexts_open(accuracy_contexts *c, int data, int renderer, triptych **out)
{
    triptych **t = &c->contexts[data][renderer];
    *out = *t;
    if (*t)
        return 0;
    if (c->why[data][renderer][0])
        return TRIP_ERROR;
    if (triptych_create(t))
        return trip_fail(TRIP_ERROR, "accuracy", "library", "out of memory");
    int status = open_context(c, data, renderer, *t);
    if (status) {
        status = keep_why(c, data, renderer, *t, status);
        triptych_destroy(*t);
        *t = NULL;
    }
    *out = *t;
    return status;
}

int accuracy_contexts_look(accuracy_contexts *c, const accuracy_view *view)
{
    int status = 0;
    c->view = view;
    for (int d = 0; d < ACCURACY_DATA_MAX; d++)
        for (int r = 0; r < ACCURACY_RENDERERS && !status; r++)
            if (c->contexts[d][r] && (status = accuracy_view_use(c->contexts[d][r], view)))
                status = keep_why(c, d, r, c->contexts[d][r], status);
    return status;
}

int accuracy_contexts_draw(accuracy_contexts *c, int data, int renderer,
                           const triptych_settings *settings, float *rgba, double *ms)
{
    triptych *t;
    int status = accuracy_contexts_open(c, data, renderer, &t);
    if (status)
        return status;
    status = triptych_set_settings(t, settings);
    double begin = trip_now_ms();
    if (!status)
        status = triptych_draw(t, rgba);
    *ms = trip_now_ms() - begin;
    return status ? keep_why(c, data, renderer, t, status) : 0;
}
