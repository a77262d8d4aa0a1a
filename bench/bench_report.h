/* Results of a benchmark: tables of rows, and the limits of the figures. All results are JSON;
 * people get columns of them as aligned Markdown tables. One thread. */
#ifndef TRIP_BENCH_REPORT_H
#define TRIP_BENCH_REPORT_H

#include <cjson/cJSON.h>

/* A number is divided by `unit` (0 means 1) and printed with `decimals`. Missing values and null
 * print as "-". */
typedef struct bench_column {
    const char *key, *heading;
    int decimals;
    double unit;
} bench_column;

typedef struct bench_report bench_report;

/* Adds the CPU, its cores, memory and kernel. */
void bench_describe_machine(cJSON *machine);

/* `command` is the command line, which the report repeats. */
int bench_report_create(bench_report **out, const char *name, const char *command);
void bench_report_destroy(bench_report *r);

/* Returns the object for the settings of the measurement: strings, numbers and booleans, printed
 * one per line. Names that end in _bytes print as sizes. */
cJSON *bench_report_settings(bench_report *r);
/* Returns the object for the machine, which has the CPU, its cores, memory and kernel. */
cJSON *bench_report_machine(bench_report *r);
/* Adds a table and returns the array for its row objects. `columns` must outlive the report. */
cJSON *bench_report_table(bench_report *r, const char *key, const char *title,
                          const bench_column *columns, int column_count);
/* Adds a sentence about a limit of the figures, at most 1023 bytes. */
__attribute__((format(printf, 2, 3))) void bench_report_limit(bench_report *r, const char *sentence,
                                                              ...);

int bench_report_print(bench_report *r, int json);

#endif
