/* Draws every setting from every view, measures its time, and splits its error into steps. Each
 * step compares two consecutive pictures of this list:
 * - the truth: the mean of the integral of the source volume over the area of each pixel,
 * - the integral of the source volume along the rays of the setting,
 * - the integral of the stored values along these rays,
 * - the integral of the drawn field along these rays,
 * - the reference in double precision,
 * - the picture.
 *
 * A quality chooses its rays by itself and has no steps. One thread. */
#ifndef TRIP_ACCURACY_MEASURE_H
#define TRIP_ACCURACY_MEASURE_H

#include "accuracy_options.h"
#include "accuracy_popping.h"
#include "compared_programs.h"
#include "error.h"
#include "setting.h"
#include "views.h"

enum {
    ACCURACY_ROWS_MAX =
        ACCURACY_SETTINGS_MAX + 2 * ACCURACY_DATA_MAX + ACCURACY_COMPARED_PROGRAMS_MAX,
    ACCURACY_COMMAND_BYTES = 4200
};

/* The largest tolerance of the integral along rays. */
#define ACCURACY_RAY_TOLERANCE 1e-4

typedef enum accuracy_step {
    ACCURACY_TOTAL,   /* picture against the truth, of the source, or of the data set without
                         --source */
    ACCURACY_PIXEL,   /* integral along the rays against the truth */
    ACCURACY_RAYS,    /* picture against the integral along the rays: all of the later steps */
    ACCURACY_STORAGE, /* integral of the stored values against the integral of the source */
    ACCURACY_MODEL,   /* integral of the drawn field (splats or values) against the integral of the
                         stored values */
    ACCURACY_METHOD,  /* reference at the finest level against the integral of the drawn field */
    ACCURACY_LEVEL,   /* reference at the drawn levels against the reference at the finest level */
    ACCURACY_PRECISION, /* picture against the reference */
    ACCURACY_STEPS
} accuracy_step;

typedef struct accuracy_row {
    accuracy_setting setting;
    int data;                  /* index into accuracy_options.data */
    accuracy_program *program; /* another program, which provides the name; NULL for a setting */
    bool is_vtk;               /* VTK was added without --compare */
    accuracy_state state;
    char why[256]; /* reason if the row was left out */
    measure_error error[ACCURACY_STEPS];
    bool has[ACCURACY_STEPS];
    double bound; /* total error in the worst view: measure_error_bound() of 99 % of the pixels */
    double ssim, flip; /* sums over the views */
    int views, frames;
    double *ms;                 /* of each frame */
    double splats, bytes_read;  /* read per frame; sums over the views */
    double splats_drawn;        /* counted in the first view; negative if not counted */
    char *picture, *difference; /* of the first view, as data URLs */
} accuracy_row;

typedef struct accuracy_measured {
    const accuracy_options *options;
    char vtk[ACCURACY_COMMAND_BYTES]; /* command of VTK's ray caster, or "" */
    const char *folder;               /* folder of the report, which is being written */
    accuracy_row *rows;
    int row_count;
    accuracy_popping popping[ACCURACY_POPPINGS];
    int popping_count; /* number of popping tables to measure */
    accuracy_view *views;
    int view_count; /* number of measured views */
    char *truth;    /* data URL of the integral in the first view */
    double seconds;
    uint64_t checksum;  /* of the first data set, from triptych_info */
    char levels_for[8]; /* --levels-for of the first data set */
} accuracy_measured;

int accuracy_measure(accuracy_measured *m, const accuracy_options *o, const char *folder);
void accuracy_measured_free(accuracy_measured *m);

#endif
