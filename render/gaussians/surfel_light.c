#include "surfel_light.h"

#include <string.h>

#include "shade.h"

static void find_normal(const trip_gaussian *g, double normal[3])
{
    const double w = (double)g->rotation[0], x = (double)g->rotation[1];
    const double y = (double)g->rotation[2], z = (double)g->rotation[3];
    const double axes[3][3] = {
        { 1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y) },
        { 2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x) },
        { 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y) },
    };
    int least = 2;
    for (int i = 0; i < 2; i++)
        least = g->deviations[i] < g->deviations[least] ? i : least;
    memcpy(normal, axes[least], sizeof axes[least]);
}

void trip_surfel_light(const trip_settings *s, const trip_camera *c, trip_gaussian *surfels,
                       size_t count)
{
    for (size_t i = 0; s && i < count; i++) {
        trip_gaussian *g = &surfels[i];
        double normal[3], rgb[3];
        find_normal(g, normal);
        for (int k = 0; k < 3; k++)
            rgb[k] = 0.5 + TRIP_SH_CONSTANT * (double)g->sh[0][k];
        trip_shade(s, c, 1, trip_v3(g->centre[0], g->centre[1], g->centre[2]), normal, rgb);
        for (int k = 0; k < 3; k++)
            g->sh[0][k] = trip_sh_of_colour(rgb[k]);
    }
}
