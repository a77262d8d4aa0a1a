#include "debug_view.h"

#include <string.h>

#include "weight.h"

/* Colours of the levels, finest first. Coarser levels share the last colour. */
static const double level_colours[][3] = {
    { 0.9, 0.9, 0.9 },   { 0.3, 0.6, 1 },     { 0.25, 0.8, 0.4 },  { 0.95, 0.85, 0.2 },
    { 0.95, 0.5, 0.15 }, { 0.9, 0.25, 0.25 }, { 0.75, 0.3, 0.85 },
};
enum { LEVEL_COLOURS = sizeof level_colours / sizeof *level_colours };

bool trip_debug_view_of(const trip_settings *settings, int axis, unsigned level, double rgb[3])
{
    if (settings->show == TRIP_SHOW_LISTS) {
        for (int i = 0; i < 3; i++)
            rgb[i] = i == axis;
        return true;
    }
    if (settings->show != TRIP_SHOW_LEVELS)
        return false;
    memcpy(rgb, level_colours[level < LEVEL_COLOURS ? level : LEVEL_COLOURS - 1], 3 * sizeof *rgb);
    return true;
}

void trip_debug_view_merge(const trip_settings *settings, const trip_camera *camera,
                           int axis_of_view, double x, double y, double rgb[3])
{
    const trip_vec3 ray = trip_camera_ray(camera, x, y);
    double sum = 0;
    for (int axis = 0; axis < 3; axis++) {
        double w = trip_weight(settings, axis_of_view, ray, axis);
        rgb[axis] = w * w;
        sum += w * w;
    }
    for (int axis = 0; axis < 3; axis++)
        rgb[axis] /= sum;
}
