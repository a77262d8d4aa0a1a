#include "eye_dome.h"

#include <float.h>
#include <math.h>
#include <stddef.h>

enum { NEIGHBOURS = 8 };

#define FACTOR 300.0
#define EIGHTH_TURN 0.78539816339744831
#define LN_2 0.69314718055994531
#define TAN_15_DEGREES 0.26794919243112271

static void find_levels(const trip_camera *c, const float *distances, float *levels)
{
    const double parallel = 2 * TAN_15_DEGREES / (c->params.ortho_height * LN_2);
    size_t at = 0;
    for (int y = 0; y < c->height; y++)
        for (int x = 0; x < c->width; x++, at++) {
            const double d = (double)distances[at];
            if (!isfinite(d))
                levels[at] = INFINITY;
            else if (c->ortho)
                levels[at] = (float)(d * parallel);
            else
                levels[at] =
                    (float)log2(fmax(d / trip_camera_ray_length(c, x + 0.5, y + 0.5), DBL_MIN));
        }
}

void trip_eye_dome_darken(const trip_eye_dome *e, const trip_camera *camera, const float *distances,
                          float *levels, float *rgba)
{
    const int width = camera->width, height = camera->height;
    int right[NEIGHBOURS], down[NEIGHBOURS];
    for (int i = 0; i < NEIGHBOURS; i++) {
        right[i] = (int)lround(e->radius_px * cos(i * EIGHTH_TURN));
        down[i] = (int)lround(e->radius_px * sin(i * EIGHTH_TURN));
    }
    find_levels(camera, distances, levels);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            const size_t p = (size_t)y * (size_t)width + (size_t)x;
            double sum = 0;
            for (int i = 0; i < NEIGHBOURS && isfinite(levels[p]); i++) {
                const int nx = x + right[i], ny = y + down[i];
                if (nx < 0 || ny < 0 || nx >= width || ny >= height)
                    continue;
                const size_t n = (size_t)ny * (size_t)width + (size_t)nx;
                if (levels[n] < levels[p])
                    sum += (double)rgba[4 * n + 3] * ((double)levels[p] - (double)levels[n]);
            }
            if (sum <= 0)
                continue;
            const double shade = exp(-FACTOR * e->strength / NEIGHBOURS * sum);
            for (int k = 0; k < 3; k++)
                rgba[4 * p + (size_t)k] = (float)((double)rgba[4 * p + (size_t)k] * shade);
        }
}
