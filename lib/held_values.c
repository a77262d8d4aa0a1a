/* Compares the values that a data set keeps with those that options keep or a function shows. */
#include "triptych_brick.h"

#include <math.h>

#include "envelope.h"
#include "library_context.h"
#include "report.h"

/* Every integer up to this is a float. */
#define EXACT_FLOATS 0x1p24

static int add_function(trip_envelope *e, const session *s, const session_look *look)
{
    trip_tf *tf = NULL;
    int status = session_load_function(s, look, &tf);
    if (!status)
        status = trip_envelope_add_tf(e, tf);
    trip_tf_destroy(tf);
    return status;
}

/* Adds the values that bricking with the options keeps. */
static int add_kept(trip_envelope *e, const session *s, const triptych_brick_options *o)
{
    const bool none = !o->keep_all && !o->function_count && !o->range_count;
    int status = o->keep_all ? trip_envelope_add_all(e) : 0;
    if (!status && (o->automatic || none))
        status = add_function(e, s, &(session_look){ .tf = "auto" });
    for (size_t i = 0; i < o->range_count && !status; i++)
        status = trip_envelope_add_range(e, o->ranges[i].lo, o->ranges[i].hi);
    for (size_t i = 0; i < o->function_count && !status; i++)
        status = add_function(e, s, &(session_look){ .tf = o->functions[i] });
    return status;
}

static bool part_holds(const trip_dataset *d, const trip_dataset_metadata *text,
                       const trip_envelope *e)
{
    const trip_file_header *h = &d->header;
    bool holds = true;
    for (size_t i = 0; i < e->count && holds; i++) {
        const double lo = fmax(e->intervals[i].lo, h->value_min);
        const double hi = fmin(e->intervals[i].hi, h->value_max);
        holds = lo > hi || trip_dataset_metadata_keeps(text, lo, hi);
    }
    return holds;
}

/* The envelopes hold floats. Some ids beyond EXACT_FLOATS are no floats, so only a data set with
 * all values certainly holds them. */
static bool holds(const session *s, trip_envelope *e)
{
    const trip_file_header *h = &s->data->header;
    const bool exact = !trip_codes_ids(&s->data->codes) ||
                       fmax(fabs(h->value_min), fabs(h->value_max)) <= EXACT_FLOATS;
    const trip_interval all = { (float)h->value_min, (float)h->value_max };
    const trip_envelope whole = { .intervals = (trip_interval[]){ all }, .count = 1 };
    bool held = true;
    for (unsigned i = 0; i < s->part_count && held; i++)
        held = part_holds(s->parts[i], s->texts[i], exact ? e : &whole);
    return held;
}

int triptych_holds(triptych *t, const triptych_brick_options *options,
                   const triptych_transfer_function *shown)
{
    trip_scope *before = trip_context_enter_anew(t);
    trip_envelope e = { 0 };
    int status = trip_context_check_idle(t, true);
    if (!status)
        status = trip_context_check_volume(t);
    if (!status)
        status = session_read_text(&t->session);
    if (!status && options)
        status = add_kept(&e, &t->session, options);
    if (!status && shown)
        status = add_function(&e, &t->session,
                              &(session_look){ .tf = shown->name,
                                               .tf_text = shown->text,
                                               .window = shown->window,
                                               .level = shown->level });
    if (!status)
        status = holds(&t->session, &e);
    trip_envelope_destroy(&e);
    return trip_context_leave(before, status);
}
