#include "quality_options.h"

#include <stdio.h>
#include <stdlib.h>

#include "cached_volume.h"
#include "fastest.h"
#include "library.h"
#include "report.h"

#define AT(member) .at = offsetof(quality_options, member)

static const trip_option rows[] = {
    { "error", "E",
      "Selects the fastest settings that keep 99 % of the pixels within E of 255 in each view, as "
      "`triptych accuracy` measured for this data",
      NULL, "excludes --quality", .brief = "Keeps the measured error within E of 255",
      .group = DRAW_GROUP_ACCURACY, .type = TRIP_OPTION_NUMBER, AT(error), .lo = 1e-6, .hi = 255 },
    { "report", "REPORT/", "Names the report that --error reads", "NAME.accuracy beside the data",
      .group = DRAW_GROUP_ACCURACY, .type = TRIP_OPTION_TEXT, AT(report) },
};

const trip_option_table quality_table = { rows, sizeof rows / sizeof *rows };

/* Returns the name of a given setting that a report measures, or NULL. */
static const char *find_measured(const draw_settings *given)
{
    for (int i = 0; i < DRAW_OPTIONS; i++)
        if (draw_settings_table.rows[i].measured &&
            trip_option_is_set(&draw_settings_table.rows[i], given))
            return draw_settings_table.rows[i].name;
    return NULL;
}

int quality_options_check(const quality_options *q, const draw_settings *given,
                          triptych_renderer renderer)
{
    const char *measured = find_measured(given);
    if (q->error > 0 && given->all.quality)
        return trip_option_fail("--error", "excludes --quality; give one of them");
    if (q->error > 0 && renderer == TRIPTYCH_RENDERER_INTEGRAL)
        return trip_option_fail("--error", "does not apply to --renderer integral, which is exact");
    if (q->error > 0 && measured)
        return trip_fail(TRIP_USAGE, "usage", "--error",
                         "excludes --%s, because --error selects that setting too", measured);
    if (q->report && !(q->error > 0))
        return trip_option_fail("--report", "requires --error E");
    return 0;
}

/* Returns the checksum of a data set. For a volume, which is bricked later, text becomes "". */
static int find_checksum(const char *input, char text[ACCURACY_CHECKSUM_BYTES])
{
    triptych *t = NULL;
    triptych_info info;
    text[0] = 0;
    if (cached_volume_wanted(input))
        return 0;
    int status = library_create(&t, NULL);
    if (!status)
        status = triptych_open(t, input, NULL);
    if (!status)
        status = triptych_get_info(t, &info);
    if (!status)
        accuracy_checksum_text(info.checksum, text);
    triptych_destroy(t);
    return status;
}

int quality_options_check_data(const char *measured, triptych *t, const char *volume)
{
    char checksum[ACCURACY_CHECKSUM_BYTES];
    triptych_info info;
    if (!measured[0])
        return 0;
    int status = triptych_get_info(t, &info);
    accuracy_checksum_text(info.checksum, checksum);
    return status ? status : accuracy_check_data(measured, checksum, volume);
}

triptych_levels_for quality_options_levels(const quality_options *q, bool coarse_splats)
{
    return q->says_levels  ? q->levels_for
           : coarse_splats ? TRIPTYCH_LEVELS_FOR_BOTH
                           : TRIPTYCH_LEVELS_FOR_AUTO;
}

static void take_measured(draw_settings *s, const draw_settings *found)
{
    s->all.quality = found->all.quality;
    for (int i = 0; i < DRAW_OPTIONS; i++)
        if (draw_settings_table.rows[i].measured)
            trip_option_copy(&draw_settings_table.rows[i], s, found);
}

static int use_report(quality_options *q, const quality_drawn *drawn, draw_settings *s,
                      triptych_renderer *renderer, bool slow_too)
{
    char checksum[ACCURACY_CHECKSUM_BYTES];
    int status = find_checksum(drawn->input, checksum);
    if (status)
        return status;
    const unsigned fast = 1u << TRIPTYCH_RENDERER_CPU | 1u << TRIPTYCH_RENDERER_GL;
    const accuracy_wanted wanted = {
        .error = q->error,
        .renderers = *renderer  ? 1u << *renderer
                     : slow_too ? 0
                                : fast,
        .function = drawn->function,
        .checksum = checksum[0] ? checksum : NULL,
    };
    accuracy_found found = { .setting.settings = *s };
    char *beside = q->report ? NULL : accuracy_report_path(drawn->input);
    const char *path = q->report ? q->report : beside;
    status = path ? accuracy_fastest(path, &wanted, &found)
                  : trip_fail(TRIP_ERROR, "--error", drawn->input, "out of memory");
    if (!status) {
        take_measured(s, &found.setting.settings);
        *renderer = found.setting.renderer;
        snprintf(q->measured, sizeof q->measured, "%s", checksum[0] ? "" : found.checksum);
        q->says_levels = found.says_levels;
        q->levels_for = found.levels_for;
        trip_note("--error", "uses %s, measured error %.2f of 255, measured time %.1f ms",
                  found.setting.name, found.error, found.ms);
    }
    free(beside);
    return status;
}

int quality_options_use(quality_options *q, const quality_drawn *drawn, draw_settings *s,
                        triptych_renderer *renderer, bool slow_too)
{
    return q->error > 0 ? use_report(q, drawn, s, renderer, slow_too) : 0;
}
