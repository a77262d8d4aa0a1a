/* Popping is the jump of pixels while the camera turns in small steps through the change of the
 * dominant axis. Measures it for each method and h, and plots it. The caller draws the pictures.
 * One thread. */
#ifndef TRIP_MEASURE_POPPING_H
#define TRIP_MEASURE_POPPING_H

#include <cjson/cJSON.h>

#include "triptych.h"

enum { MEASURE_POPPING_SETTINGS = 8, MEASURE_POPPING_STEPS = 40 };

/* Steps in degrees of index space. They pass through 45. */
#define MEASURE_POPPING_DEGREES 0.05

typedef struct measure_popping_setting {
    const char *name, *label; /* for the table, for the plot */
    triptych_method method;
    double h;
} measure_popping_setting;

/* In the order of the plot. The last one, image, is for splats and for renderers that implement
 * it. */
extern const measure_popping_setting measure_popping_settings[MEASURE_POPPING_SETTINGS];

/* Returns the size of the memory for measure_popping_all(). */
size_t measure_popping_bytes(size_t pixels);

/* Draws the picture of a setting with the eye at an angle of index space, from X towards Y,
 * slightly above. The picture is premultiplied, without background. */
typedef int measure_popping_draw(void *user, const measure_popping_setting *of, double degrees);

/* Draws the first `count` settings, and adds a row for each: settings, mean, percentile_99, max and
 * motion. They are figures of 255, over the pixels that change. A change is the maximum over the
 * components. The motion of a pixel is the median of its changes, because a jump affects a single
 * step; motion is the mean over the pixels. The other figures are of changes minus motion, in the
 * step with the largest. `rgba` has the picture after each draw(). Returns the status of a failed
 * draw(). */
int measure_popping_all(measure_popping_draw *draw, void *user, const float *rgba, size_t pixels,
                        void *memory, int count, cJSON *rows);

/* Plots the rows: merge over h, then the other methods. Returns SVG as measure_plot_svg() does. */
char *measure_popping_svg(const cJSON *rows);

#endif
