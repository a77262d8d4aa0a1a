#include "list_colours.h"

#include <math.h>
#include <string.h>

#include "debug_view.h"

static double luminance_of(const trip_gaussian *g)
{
    static const double shares[3] = { 0.2126, 0.7152, 0.0722 };
    double sum = 0;
    for (int i = 0; i < 3; i++)
        sum += shares[i] * fmin(1, fmax(0, 0.5 + TRIP_SH_CONSTANT * (double)g->sh[0][i]));
    return sum;
}

void trip_list_colours(const trip_settings *s, int axis, trip_gaussian *batch, size_t count)
{
    double rgb[3];
    if (s->show != TRIP_SHOW_LISTS || !trip_debug_view_of(s, axis, 0, rgb))
        return;
    for (size_t i = 0; i < count; i++) {
        const double factor = 0.3 + 0.7 * luminance_of(&batch[i]);
        memset(batch[i].sh, 0, sizeof batch[i].sh);
        for (int k = 0; k < 3; k++)
            batch[i].sh[0][k] = trip_sh_of_colour(factor * rgb[k]);
    }
}
