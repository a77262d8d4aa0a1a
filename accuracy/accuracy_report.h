/* The report of what was measured: a folder with accuracy.json, accuracy.csv and index.html, which
 * gets its name only when it is whole. One thread. */
#ifndef TRIP_ACCURACY_REPORT_H
#define TRIP_ACCURACY_REPORT_H

#include <limits.h>
#include <stdio.h>

#include "measure.h"

typedef struct accuracy_folder {
    const char *path; /* the caller's */
    char temporary[PATH_MAX];
} accuracy_folder;

/* Makes the folder under another name. Refuses, before any work, what is there already; with
 * `force` only what is no report. */
int accuracy_folder_begin(accuracy_folder *f, const char *path, bool force);
/* Gives it its name, in place of an older report. */
int accuracy_folder_finish(accuracy_folder *f);
/* Removes it, unless it is finished. */
void accuracy_folder_abandon(accuracy_folder *f);

/* What the parts of a report have in common. */
typedef struct accuracy_report {
    const accuracy_measured *m;
    const char *command; /* that made it */
    double load_before, load_after;
    accuracy_error_figures (*figures)[ACCURACY_STEPS]; /* of each row */
    double *ms;                                        /* the median of each row */
    bool *front, *front_of_mean;                       /* no other setting is as fast and closer */
} accuracy_report;

int accuracy_report_make(accuracy_report *r, const accuracy_measured *m, const char *command);
void accuracy_report_free(accuracy_report *r);
int accuracy_report_write(const accuracy_report *r, const char *folder);

/* "total", "storage", ... */
extern const char *const accuracy_step_names[ACCURACY_STEPS];

/* The parts, each as text for free(); NULL without memory. */
char *accuracy_report_json(const accuracy_report *r);
char *accuracy_report_csv(const accuracy_report *r);
char *accuracy_report_html(const accuracy_report *r);
/* Time and error as SVG, written to `f`; by the mean, else by the 99th percentile. */
void accuracy_report_plot(FILE *f, const accuracy_report *r, bool mean);
/* A short table for people. */
void accuracy_report_print(FILE *f, const accuracy_report *r);

/* The options of `triptych render` for a view and for a row, as a shell takes them. */
void accuracy_write_view(FILE *f, const accuracy_view *view);
void accuracy_write_options(FILE *f, const accuracy_setting *s);

#endif
