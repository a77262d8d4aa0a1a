/* Results of a benchmark: tables of rows, and the limits of the figures. All results are JSON;
 * people get columns of them as tables. One thread. */
#ifndef TRIP_BENCH_REPORT_H
#define TRIP_BENCH_REPORT_H

#include "table.h"

enum { BENCH_REPORT_TABLES = 8 };

typedef struct bench_report {
    cJSON *root;
    cJSON *settings; /* strings, numbers and booleans; names that end in _bytes print as sizes */
    cJSON *machine;  /* from measure_describe_machine(); the caller may add to it */
    cJSON *tables, *limits;
    measure_table shown[BENCH_REPORT_TABLES];
    int table_count;
} bench_report;

/* `command` is the command line, which the report repeats. */
int bench_report_create(bench_report **out, const char *name, const char *command);
void bench_report_destroy(bench_report *r);

/* Adds a table and returns the array for its row objects. `columns` is an array that outlives the
 * report, and `title` too. */
#define bench_report_table(r, key, title, columns)                                                 \
    bench_report_add_table(r, key, title, columns, sizeof(columns) / sizeof *(columns))
cJSON *bench_report_add_table(bench_report *r, const char *key, const char *title,
                              const measure_column *columns, int count);
/* Adds the size of pictures, for example "512 x 384". */
void bench_report_add_size(cJSON *to, const int size[2]);
/* Adds a sentence about a limit of the figures, at most 1023 bytes. */
__attribute__((format(printf, 2, 3))) void bench_report_limit(bench_report *r, const char *sentence,
                                                              ...);

int bench_report_print(bench_report *r, int json);

#endif
