#include "surfel_light.h"

#include "shade.h"

void trip_surfel_light(const trip_settings *s, const trip_camera *c, trip_gaussian *surfels,
                       size_t count)
{
    for (size_t i = 0; s && i < count; i++) {
        trip_gaussian *g = &surfels[i];
        const trip_vec3 n = trip_surfel_normal(g);
        const double normal[3] = { n.x, n.y, n.z };
        double rgb[3];
        for (int k = 0; k < 3; k++)
            rgb[k] = 0.5 + TRIP_SH_CONSTANT * (double)g->sh[0][k];
        trip_shade(s, c, 1, trip_v3(g->centre[0], g->centre[1], g->centre[2]), normal, rgb);
        for (int k = 0; k < 3; k++)
            g->sh[0][k] = trip_sh_of_colour(rgb[k]);
    }
}
