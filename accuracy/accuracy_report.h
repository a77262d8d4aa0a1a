/* The report of a measurement: a folder with accuracy.json, accuracy.csv and index.html. The folder
 * gets its name only when it is complete. One thread. */
#ifndef TRIP_ACCURACY_REPORT_H
#define TRIP_ACCURACY_REPORT_H

#include <limits.h>
#include <stdio.h>

#include "measure.h"

typedef struct accuracy_folder {
    const char *path; /* owned by the caller */
    char temporary[PATH_MAX];
} accuracy_folder;

/* Creates the folder under a temporary name. Fails before any work if `path` exists. With `force`
 * it fails only if the existing folder is not a report. */
int accuracy_folder_begin(accuracy_folder *f, const char *path, bool force);
/* Renames the folder to its name, and replaces an older report. */
int accuracy_folder_finish(accuracy_folder *f);
/* Removes the folder, unless it is finished. */
void accuracy_folder_abandon(accuracy_folder *f);

/* Data that all parts of a report share. */
typedef struct accuracy_report {
    const accuracy_measured *m;
    const char *command; /* command line of the measurement */
    double load_before, load_after;
    accuracy_error_figures (*figures)[ACCURACY_STEPS]; /* of each row and step */
    double *ms;                                        /* median time of each row */
    bool *front, *front_of_mean; /* whether a row is on the Pareto front by the 99th percentile, and
                                    by the mean */
} accuracy_report;

int accuracy_report_make(accuracy_report *r, const accuracy_measured *m, const char *command);
void accuracy_report_free(accuracy_report *r);
int accuracy_report_write(const accuracy_report *r, const char *folder);

/* Names of the steps: "total", "storage", ... */
extern const char *const accuracy_step_names[ACCURACY_STEPS];

/* Return the parts as text; the caller frees it. NULL if memory is exhausted. */
char *accuracy_report_json(const accuracy_report *r);
char *accuracy_report_csv(const accuracy_report *r);
char *accuracy_report_html(const accuracy_report *r);
/* Writes a plot of time and error as SVG, by the mean error or by the 99th percentile. */
void accuracy_report_plot(FILE *f, const accuracy_report *r, bool mean);
/* Prints a short table for people. */
void accuracy_report_print(FILE *f, const accuracy_report *r);

/* Write the options of `triptych render` for a view and for a setting, as shell words. */
void accuracy_write_view(FILE *f, const accuracy_view *view);
void accuracy_write_options(FILE *f, const accuracy_setting *s);

#endif
