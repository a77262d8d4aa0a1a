/* How much pixels jump while the camera turns in small steps through the change of the axis that
 * rays are most aligned with, by each method and h, and a picture of it. `bench popping` and the
 * report of `accuracy` draw the steps, each by its own means. One thread. */
#ifndef TRIP_BENCH_POPPING_H
#define TRIP_BENCH_POPPING_H

#include <stdbool.h>
#include <stdio.h>

#include "budget.h"
#include "triptych.h"

enum { BENCH_POPPING_SETTINGS = 8, BENCH_POPPING_STEPS = 40 };

typedef struct bench_popping_setting {
    const char *name, *label; /* of a table, below a plot */
    triptych_method method;
    double h;
} bench_popping_setting;

/* In the plot's order; the last is of splats alone, by renderers that have it. */
extern const bench_popping_setting bench_popping_settings[BENCH_POPPING_SETTINGS];

/* Where the eye is at a step, from X of index space towards Y: 0.05 degrees a step, through 45. */
static inline double bench_popping_degrees(int step)
{
    return 45 + 0.05 * (step - 0.5 * BENCH_POPPING_STEPS);
}

/* What changes from step to step. A pixel's change is that of the component that changes most. What
 * the motion changes is the median of the pixel's changes over the steps: a jump takes one of them.
 */
typedef struct bench_popping_changes {
    trip_budget *budget;
    size_t pixels;
    float (*changes)[BENCH_POPPING_STEPS]; /* by pixel */
    float *before;                         /* the picture of the step before */
    float *sorted;                         /* room for the changes of a step */
} bench_popping_changes;

/* Takes bench_popping_bytes() of the budget; false where it does not suffice. */
bool bench_popping_begin(bench_popping_changes *p, trip_budget *budget, size_t pixels);
size_t bench_popping_bytes(size_t pixels);
void bench_popping_end(bench_popping_changes *p);

/* The picture of a step, premultiplied; from 0 on, to BENCH_POPPING_STEPS. */
void bench_popping_add(bench_popping_changes *p, int step, const float *rgba);

/* Of 255, over the pixels that change at all. */
typedef struct bench_popping_row {
    const char *label;               /* below the plot */
    bool has_h;                      /* it is merged */
    double mean, percentile_99, max; /* changes beyond the motion, in the step where most */
    double motion;                   /* its mean */
} bench_popping_row;

/* The figures of a setting of which all steps were added; they take the changes' place. */
void bench_popping_find(bench_popping_changes *p, const bench_popping_setting *of,
                        bench_popping_row *out);

/* Draws them as .svg, in their order. */
void bench_popping_draw(FILE *f, const bench_popping_row *rows, int count);
/* Into a file. */
int bench_popping_plot(const char *path, const bench_popping_row *rows, int count);

#endif
