#include "rounding.h"

#include <math.h>

#include "report.h"

double trip_rounding_opacity(const session *s, const trip_settings *settings)
{
    const trip_file_header *h = &s->data->header;
    const double voxel = cbrt(fabs(trip_affine_determinant(&s->data->index_to_world)));
    const double sigma = settings->kernel_radius / TRIP_CUTOFF;
    const double share =
        trip_settings_sum_sheets(settings) ? 1 : 1 / (2 * 3.14159265358979323846 * sigma * sigma);
    double max = 0;
    const trip_codes *codes = &s->data->codes;
    const int last = (int)trip_codes_code(codes, h->typical_max);
    for (int code = (int)trip_codes_code(codes, h->typical_min); code <= last; code++)
        max = fmax(max, (double)s->table[code].extinction);
    return -expm1(-max * voxel * share);
}

/* A splat of opacity a changes an opacity of 3/4 by a / 4. Rounding to steps of size u adds an
 * error of up to u / 2 to each constant splat. Float layers store transmittance, which starts near
 * 1, where steps are 2^-24. */
double trip_rounding_min(trip_target target)
{
    static const double steps[] = { [TRIP_TARGET_RGBA32F] = 0x1p-24,
                                    [TRIP_TARGET_RGBA16F] = 0x1p-11 * 4,
                                    [TRIP_TARGET_RGBA8] = 4.0 / 255 };
    return steps[target] / 2 / 0.1;
}

void trip_rounding_check(const session *s, const trip_settings *settings)
{
    static const char *const names[] = { "rgba32f", "rgba16f", "rgba8" };
    const double opacity = trip_rounding_opacity(s, settings);
    const bool by_sheets = trip_settings_sum_sheets(settings);
    if (!(opacity > 0) || opacity >= trip_rounding_min(settings->target))
        return;
    trip_warn(s->input,
              "%s have an opacity of at most %.2g; layers of %s lose much of opacities below %.2g "
              "to rounding; %s",
              by_sheets ? "sheets" : "splats", opacity, names[settings->target],
              trip_rounding_min(settings->target),
              !by_sheets ? "--compositing sheet rounds once per sheet"
              : settings->target != TRIP_TARGET_RGBA32F ? "--target rgba32f rounds less"
                                                        : "--renderer reference rounds nothing");
}
