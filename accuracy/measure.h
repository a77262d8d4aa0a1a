/* Draws every setting from every view, times it, and holds it to the steps of the ladder: the
 * integral of the source volume, that of the values stored, that of the splats where these are
 * drawn, the reference in double precision, and what ran. One thread. */
#ifndef TRIP_ACCURACY_MEASURE_H
#define TRIP_ACCURACY_MEASURE_H

#include "accuracy_options.h"
#include "compared_programs.h"
#include "error.h"
#include "popping.h"
#include "setting.h"
#include "views.h"

enum {
    ACCURACY_ROWS_MAX =
        ACCURACY_SETTINGS_MAX + 2 * ACCURACY_DATA_MAX + ACCURACY_COMPARED_PROGRAMS_MAX,
    ACCURACY_COMMAND_BYTES = 4200
};

typedef enum accuracy_step {
    ACCURACY_TOTAL,   /* what ran to the integral that is true */
    ACCURACY_STORAGE, /* integral of the values stored to that of the source */
    ACCURACY_MODEL,   /* integral of what is drawn, splats or values, to that of the values */
    ACCURACY_METHOD,  /* the reference at the finest level to that: order, sheets, slices, lists */
    ACCURACY_LEVEL,   /* the reference at the levels drawn to that */
    ACCURACY_PRECISION, /* what ran to the reference */
    ACCURACY_STEPS
} accuracy_step;

typedef struct accuracy_row {
    accuracy_setting setting;
    int data;                  /* of accuracy_options.data */
    accuracy_program *program; /* another program, whose name is the setting's; NULL: a setting */
    bool is_vtk;               /* without being given */
    accuracy_state state;
    char why[256]; /* it was left out */
    accuracy_error error[ACCURACY_STEPS];
    bool has[ACCURACY_STEPS];
    double worst_percentile_99; /* of a view, in total */
    double ssim, flip;          /* sums over views */
    int views, frames;
    double *ms;                 /* of each frame */
    double splats, bytes_read;  /* sums over views: read, a frame */
    double splats_drawn;        /* of the first view, counted; below 0: not */
    char *picture, *difference; /* of the first view */
} accuracy_row;

typedef struct accuracy_measured {
    const accuracy_options *options;
    char vtk[ACCURACY_COMMAND_BYTES]; /* the command of VTK's ray caster; "": there is none */
    const char *folder;               /* that is being written */
    accuracy_row *rows;
    int row_count;
    accuracy_popping popping[ACCURACY_POPPINGS];
    int popping_count; /* wanted */
    accuracy_view *views;
    int view_count; /* done */
    char *truth;    /* picture of the first view */
    double seconds;
    uint64_t checksum;  /* of the first data set, triptych_info */
    char levels_for[8]; /* what it was bricked with, as of `triptych brick --levels-for` */
} accuracy_measured;

int accuracy_measure(accuracy_measured *m, const accuracy_options *o, const char *folder);
void accuracy_measured_free(accuracy_measured *m);

/* The middle one (of two, the faster) of `count` times, which are sorted. */
double accuracy_median(double *ms, int count);

#endif
