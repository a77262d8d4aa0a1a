#include "surfel_light.h"

#include <math.h>

#include "hyperline.h"
#include "shade.h"

/* Multiplies the colours by the openness. Directions to cameras of hyperlines stay. */
static void dim(trip_gaussian *g, double open)
{
    bool is_direction[TRIP_SH_MAX] = { 0 };
    for (int i = 0; i < TRIP_HYPERLINE_CAMERAS && g->hyperline; i++)
        is_direction[trip_hyperline_at(i)] = true;
    for (int k = 0; k < 3; k++)
        g->sh[0][k] = trip_sh_of_colour(open * (0.5 + TRIP_SH_CONSTANT * (double)g->sh[0][k]));
    for (int i = 1; i < TRIP_SH_MAX; i++)
        for (int k = 0; k < 3 && !is_direction[i]; k++)
            g->sh[i][k] *= (float)open;
}

/* Lights a colour with an openness: the formula of effects.h. */
static void light_open(const trip_light *l, const double normal[3], double open, double rgb[3])
{
    const trip_lit lit = trip_light_on(l, normal);
    for (int k = 0; k < 3; k++)
        rgb[k] = fmin(1, fmax(0, rgb[k] * (TRIP_AMBIENT * open + TRIP_DIFFUSE * lit.diffuse) +
                                     TRIP_SPECULAR * lit.specular));
}

static void light_one(const trip_settings *s, const trip_camera *c, double open, trip_gaussian *g)
{
    const trip_vec3 n = trip_surfel_normal(g);
    const trip_vec3 centre = trip_v3(g->centre[0], g->centre[1], g->centre[2]);
    const double normal[3] = { n.x, n.y, n.z };
    double rgb[3];
    for (int k = 0; k < 3; k++)
        rgb[k] = 0.5 + TRIP_SH_CONSTANT * (double)g->sh[0][k];
    const trip_light light = trip_light_at(s, c, 1, centre);
    if (g->hidden)
        light_open(&light, normal, open, rgb);
    else
        trip_light_colour(&light, normal, rgb);
    for (int k = 0; k < 3; k++)
        g->sh[0][k] = trip_sh_of_colour(rgb[k]);
}

void trip_surfel_light(const trip_settings *s, const trip_camera *c, trip_gaussian *surfels,
                       size_t count)
{
    for (size_t i = 0; i < count; i++) {
        trip_gaussian *g = &surfels[i];
        const double open = 1 - g->hidden / 65535.0;
        if (s)
            light_one(s, c, open, g);
        else if (g->hidden)
            dim(g, open);
    }
}
