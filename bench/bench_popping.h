/* Measures popping: the jump of pixels while the camera turns in small steps through the change of
 * the dominant axis, for each method and h. Also plots the result. `bench popping` and the report
 * of `accuracy` draw the steps themselves. One thread. */
#ifndef TRIP_BENCH_POPPING_H
#define TRIP_BENCH_POPPING_H

#include <stdbool.h>
#include <stdio.h>

#include "budget.h"
#include "triptych.h"

enum { BENCH_POPPING_SETTINGS = 8, BENCH_POPPING_STEPS = 40 };

typedef struct bench_popping_setting {
    const char *name, *label; /* for the table, for the plot */
    triptych_method method;
    double h;
} bench_popping_setting;

/* In the order of the plot. The last one, image, is for splats and for renderers that implement
 * it. */
extern const bench_popping_setting bench_popping_settings[BENCH_POPPING_SETTINGS];

/* Returns the angle of the eye at a step, from X of index space towards Y. Steps have 0.05 degrees
 * and pass through 45. */
static inline double bench_popping_degrees(int step)
{
    return 45 + 0.05 * (step - 0.5 * BENCH_POPPING_STEPS);
}

/* Changes of every pixel in every step. A change is the maximum over the components. The motion of
 * a pixel is the median of its changes, because a jump affects a single step. */
typedef struct bench_popping_changes {
    trip_budget *budget;
    size_t pixels;
    float (*changes)[BENCH_POPPING_STEPS]; /* of each pixel */
    float *before;                         /* picture of the previous step */
    float *sorted;                         /* scratch memory for the changes of a step */
} bench_popping_changes;

/* Takes bench_popping_bytes() from the budget. Returns false if they do not fit. */
bool bench_popping_begin(bench_popping_changes *p, trip_budget *budget, size_t pixels);
size_t bench_popping_bytes(size_t pixels);
void bench_popping_end(bench_popping_changes *p);

/* Adds the premultiplied picture of a step, from 0 to BENCH_POPPING_STEPS in this order. */
void bench_popping_add(bench_popping_changes *p, int step, const float *rgba);

/* Figures of 255, over the pixels that change. */
typedef struct bench_popping_row {
    const char *label;               /* for the plot */
    bool has_h;                      /* the method is merge */
    double mean, percentile_99, max; /* changes minus motion, in the step with the largest */
    double motion;                   /* mean over the pixels */
} bench_popping_row;

/* Computes the figures of a setting after all steps were added. Overwrites the changes. */
void bench_popping_find(bench_popping_changes *p, const bench_popping_setting *of,
                        bench_popping_row *out);

/* Draws the rows as SVG, in their order. */
void bench_popping_draw(FILE *f, const bench_popping_row *rows, int count);
/* Draws the rows into an SVG file. */
int bench_popping_plot(const char *path, const bench_popping_row *rows, int count);

#endif
