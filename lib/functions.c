/* Transfer functions on their own: presets, histograms, and conversion to the formats of other
 * programs. */
#include <stdlib.h>
#include <string.h>

#include "library_context.h"
#include "report.h"
#include "volume_tf.h"
#include "text.h"

int triptych_get_preset(unsigned number, triptych_preset *out)
{
    *out = (triptych_preset){ trip_tf_preset_name(number), trip_tf_preset_basis(number),
                              trip_tf_preset_summary(number) };
    return out->name != NULL;
}

int triptych_get_histogram(triptych *t, triptych_histogram *out)
{
    trip_scope *before = trip_context_enter(t);
    trip_histogram histogram;
    *out = (triptych_histogram){ 0 };
    int status = trip_context_check_volume(t);
    if (!status)
        status = session_read_text(&t->session);
    if (!status && trip_dataset_metadata_histogram(t->session.text, &histogram)) {
        *out = (triptych_histogram){ .lo = histogram.value_min,
                                     .hi = histogram.value_max,
                                     .total = histogram.total };
        memcpy(out->counts, histogram.counts, sizeof out->counts);
    }
    return trip_context_leave(before, status);
}

static int load_for_data_set(triptych *t, const char *function, trip_tf **tf)
{
    session *s = &t->session;
    int status = session_read_text(s);
    if (!status)
        status =
            function ? trip_tf_load(tf, function) : trip_dataset_metadata_tf(s->text, s->data, tf);
    return status ? status : trip_dataset_metadata_adapt(s->text, s->data, *tf, t->name);
}

static int load_for_volume(triptych *t, const triptych_conversion *c, trip_tf **tf)
{
    const trip_brick_params params = {
        .input = c->volume,
        .functions = &c->function,
        .function_count = c->function != NULL,
        .progress = t->show ? trip_context_show_stage : NULL,
        .progress_user = t,
    };
    return trip_volume_tf(&params, tf);
}

static int fail_histogram(const char *function, const char *name)
{
    char *word = trip_text_word(function);
    int status =
        trip_fail(TRIP_USAGE, "tf", name,
                  "needs a histogram; use `triptych tf show --tf %s DATA`, where DATA is a "
                  "data set or a volume",
                  word ? word : "NAME");
    free(word);
    return status;
}

static int load_alone(const triptych_conversion *c, const char *name, trip_tf **tf)
{
    if (!c->function)
        return trip_fail(TRIP_USAGE, "tf", name, "give a transfer function or data");
    int status = trip_tf_load(tf, c->function);
    if (!status && trip_tf_needs_histogram(*tf))
        return fail_histogram(c->function, name);
    if (!status && c->lo < c->hi)
        trip_tf_denormalise(*tf, c->lo, c->hi);
    return status;
}

static const char *name_of(const triptych *t, const triptych_conversion *c)
{
    if (c->name)
        return c->name;
    if (c->function)
        return c->function;
    return c->volume ? c->volume : t->name ? t->name : "";
}

static int check(const triptych *t, const triptych_conversion *c)
{
    int status = trip_context_draws_scene(t) ? trip_context_check_volume(t)
                                             : trip_context_check_idle(t, false);
    bool known = c->form >= TRIPTYCH_FORM_TF && c->form <= TRIPTYCH_FORM_VTK;
    if (!status && !known)
        return trip_fail(TRIP_USAGE, "tf", name_of(t, c), "unknown format");
    if (!status && !(isfinite(c->lo) && isfinite(c->hi)))
        return trip_fail(TRIP_USAGE, "tf", name_of(t, c), "the range is not finite");
    return status;
}

int triptych_convert(triptych *t, const triptych_conversion *wanted, char **text)
{
    trip_scope *before = trip_context_enter_anew(t);
    const char *name = name_of(t, wanted);
    trip_tf *tf = NULL;
    *text = NULL;
    int status = check(t, wanted);
    if (!status && wanted->volume)
        status = load_for_volume(t, wanted, &tf);
    else if (!status && t->open)
        status = load_for_data_set(t, wanted->function, &tf);
    else if (!status)
        status = load_alone(wanted, name, &tf);
    if (!status)
        status = trip_tf_write(tf, (trip_tf_format)wanted->form, name, text);
    trip_tf_destroy(tf);
    return trip_context_leave(before, status);
}
