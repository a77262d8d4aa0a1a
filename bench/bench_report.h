/* What a benchmark found: tables of rows, and the limits to read them by. Everything is kept as
 * JSON; for people, columns of it are printed as aligned Markdown tables. One thread. */
#ifndef TRIP_BENCH_REPORT_H
#define TRIP_BENCH_REPORT_H

#include <cjson/cJSON.h>

/* A number is shown divided by `unit` (0: as it is) with `decimals`; what is missing or null as
 * "-". */
typedef struct bench_column {
    const char *key, *heading;
    int decimals;
    double unit;
} bench_column;

typedef struct bench_report bench_report;

/* Adds the CPU, its cores, memory and kernel. */
void bench_describe_machine(cJSON *machine);

/* `command`: the command line, which the report repeats. */
int bench_report_create(bench_report **out, const char *name, const char *command);
void bench_report_destroy(bench_report *r);

/* What was measured how: texts, numbers and truths, printed one a line; names that end in _bytes as
 * sizes.
 */
cJSON *bench_report_settings(bench_report *r);
/* The CPU, its cores, memory and kernel; more may be added. */
cJSON *bench_report_machine(bench_report *r);
/* A new table "key"; returns its rows, an array to add objects to. `columns` outlives the report.
 */
cJSON *bench_report_table(bench_report *r, const char *key, const char *title,
                          const bench_column *columns, int column_count);
/* A sentence on what bounds the figures or what they leave out. */
__attribute__((format(printf, 2, 3))) void bench_report_limit(bench_report *r, const char *sentence,
                                                              ...);

int bench_report_print(bench_report *r, int json);

#endif
