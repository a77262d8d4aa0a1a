/* What `bench popping` finds of each setting, and a picture of it. */
#ifndef TRIP_BENCH_POPPING_H
#define TRIP_BENCH_POPPING_H

#include <stdbool.h>

/* Of 255, over the pixels that change at all. */
typedef struct bench_popping_row {
    const char *label;                /* below the plot */
    bool has_h;                       /* it is merged */
    double mean, percentile_99, most; /* changes beyond the motion, in the step where most */
    double motion;                    /* its mean */
} bench_popping_row;

/* Draws them into an .svg, in their order. */
int bench_popping_plot(const char *path, const bench_popping_row *rows, int count);

#endif
