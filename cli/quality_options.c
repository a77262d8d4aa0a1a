#include "quality_options.h"

#include <stdlib.h>

#include "fastest.h"
#include "options.h"
#include "report.h"

int quality_option_quality(const char *text, quality_options *q)
{
    static const char *const names[] = { "draft", "normal", "high", "exact", NULL };
    int which = 0, status = trip_option_choice("--quality", text, names, &which);
    q->given = true;
    q->quality = (triptych_quality)(TRIPTYCH_DRAFT + which);
    return status;
}

int quality_option_error(const char *text, quality_options *q)
{
    return trip_option_number("--error", text, 1e-6, 255, &q->error);
}

int quality_options_check(const quality_options *q)
{
    if (q->given && q->error > 0)
        return trip_option_fail("--error", "finds settings, and so does --quality: give one or the "
                                           "other");
    if (q->report && !(q->error > 0))
        return trip_option_fail("--report", "is what --error takes settings from: give that");
    return 0;
}

static int use_report(const quality_options *q, const quality_drawn *drawn, triptych_settings *s,
                      triptych_renderer *renderer, bool slow_too)
{
    const unsigned fast = 1u << TRIPTYCH_RENDERER_CPU | 1u << TRIPTYCH_RENDERER_GL;
    const accuracy_wanted wanted = {
        .error = q->error,
        .renderers = *renderer  ? 1u << *renderer
                     : slow_too ? 0
                                : fast,
        .function = drawn->function,
    };
    accuracy_found found = { .setting.settings = *s };
    char *beside = q->report ? NULL : accuracy_report_path(drawn->input);
    const char *path = q->report ? q->report : beside;
    int status = path ? accuracy_fastest(path, &wanted, &found)
                      : trip_fail(TRIP_ERROR, "--error", drawn->input, "out of memory");
    if (!status) {
        *s = found.setting.settings;
        *renderer = found.setting.renderer;
        trip_note("--error", "%s, measured to be off by %.2f, in %.1f ms", found.setting.name,
                  found.error, found.ms);
    }
    free(beside);
    return status;
}

int quality_options_use(const quality_options *q, const quality_drawn *drawn, triptych_settings *s,
                        triptych_renderer *renderer, bool slow_too)
{
    if (q->error > 0)
        return use_report(q, drawn, s, renderer, slow_too);
    if (q->given && triptych_set_quality(s, q->quality))
        return trip_option_fail("--quality", "there is no such quality");
    return 0;
}
