/* The report of a measurement: a folder with accuracy.json, accuracy.csv and index.html. The folder
 * gets its name only when it is complete. One thread. */
#ifndef TRIP_ACCURACY_REPORT_H
#define TRIP_ACCURACY_REPORT_H

#include <limits.h>
#include <stdio.h>

#include "measure.h"
#include "table.h"

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
    cJSON *json;  /* accuracy.json */
    cJSON *shown; /* references to all measured rows: settings, then other programs */
} accuracy_report;

int accuracy_report_make(accuracy_report *r, const accuracy_measured *m, const char *command);
void accuracy_report_free(accuracy_report *r);
int accuracy_report_write(const accuracy_report *r, const char *folder);

/* Returns whether a row of `rows` has settings on the Pareto front of time and error. No other
 * settings are better in one without being worse in the other. `error` is the key of the error. */
bool accuracy_is_on_front(const cJSON *rows, const cJSON *row, const char *error);

/* Returns whether `render --error` may choose a row: settings for the report's own data set. */
bool accuracy_is_for_render(const cJSON *report, const cJSON *row);

/* Makes accuracy.json without "front". */
void accuracy_report_json(accuracy_report *r);
void accuracy_report_html(FILE *f, const accuracy_report *r);
/* Returns a plot of time and error as SVG, as measure_plot_svg() does. */
char *accuracy_report_plot(const cJSON *rows, const char *error, const char *title);
/* Prints a short table for people. */
void accuracy_report_print(FILE *f, const accuracy_report *r);
/* Prints the settings and views that were not measured, each on a line after `before`. `write`
 * prints a text. */
void accuracy_print_left_out(FILE *f, const accuracy_report *r, const char *before,
                             void (*write)(FILE *f, const char *text));

/* Writes a file of a report: `write` prints it from `data`. */
int accuracy_write_part(const char *folder, const char *name,
                        void (*write)(FILE *f, const void *data), const void *data);
/* The style sheet of the page. */
extern const char accuracy_page_style[];

/* Write the options of `triptych render` for a view and for a setting, as shell words. */
void accuracy_write_view(FILE *f, const accuracy_view *view);
void accuracy_write_options(FILE *f, const accuracy_setting *s);

#endif
