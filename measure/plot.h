/* Plots of figures as SVG, with a logarithmic y axis and a legend. One thread. */
#ifndef TRIP_MEASURE_PLOT_H
#define TRIP_MEASURE_PLOT_H

#include <cjson/cJSON.h>
#include <stdbool.h>

typedef struct measure_point {
    double x, y;
    const char *label; /* written beside the mark where there is room; may be NULL */
    int rank;          /* labels of lower ranks get room first */
    bool large;
} measure_point;

typedef struct measure_series {
    const char *name, *colour;
    const measure_point *points;
    int count;
    int joined; /* a line joins this many points at the beginning */
    bool steps; /* the line runs along x first, then along y; without marks */
    bool square;
} measure_series;

typedef struct measure_plot {
    int width, height; /* in pixels */
    const char *x_title, *y_title;
    /* These names are along x, which counts them. NULL makes x logarithmic. */
    const char *const *names;
    int name_count;
    double y_min; /* smaller y are drawn here; 0 for none */
    const measure_series *series;
    int count;
} measure_plot;

/* Returns the plot as SVG, for free(). Returns NULL if memory is exhausted. */
char *measure_plot_svg(const measure_plot *p);
/* A series of the numbers of a key, one for each row of a table. */
typedef struct measure_curve {
    const char *key, *name, *colour;
} measure_curve;

/* Plots curves over the names of *p, one name for each row. Lines join the first `joined` points.
 * Takes everything but the series from *p. Returns SVG as measure_plot_svg() does. */
char *measure_plot_rows(const measure_plot *p, const cJSON *rows, const measure_curve *curves,
                        int count, int joined);
/* Writes SVG from measure_plot_svg() into a new file, and frees it. */
int measure_plot_save(char *svg, const char *path);

#endif
