/* Tables of figures. A row is a JSON object. A table is printed as aligned Markdown, HTML or CSV.
 * One thread. */
#ifndef TRIP_MEASURE_TABLE_H
#define TRIP_MEASURE_TABLE_H

#include <cjson/cJSON.h>
#include <stdio.h>

/* The key "a.b" names b in the object a. A number is divided by `unit` (0 means 1) and printed with
 * `decimals`. An object of errors is printed as its mean / 99th percentile. Missing values and null
 * are printed as "-". */
typedef struct measure_column {
    const char *key, *heading;
    int decimals;
    double unit;
} measure_column;

typedef struct measure_table {
    const char *title; /* printed above the table; may be NULL */
    const cJSON *rows;
    const measure_column *columns;
    int count;
    const char *mark;    /* key of a boolean that marks the first cell of its row; may be NULL */
    const char *tips[2]; /* keys of the first cell's tooltip in HTML; the first one found is used */
} measure_table;

/* Marked cells get an asterisk in Markdown, and bold type in HTML. */
void measure_table_print(FILE *f, const measure_table *t);
void measure_table_html(FILE *f, const measure_table *t);
/* Writes these keys of rows in the format of RFC 4180. A point in a key becomes an underscore.
 * Missing values and null are empty fields. */
void measure_table_csv(FILE *f, const cJSON *rows, const char *const *keys, int count);

/* Writes a text with the characters of HTML and XML escaped, without control characters except line
 * feeds. */
void measure_write_escaped(FILE *f, const char *text);

/* Appends an empty row and returns it. */
cJSON *measure_new_row(cJSON *rows);
/* Returns a number of a row, or NaN if it is missing. */
double measure_number(const cJSON *row, const char *key);

typedef struct measure_figure {
    const char *key;
    double value; /* becomes null if it is not finite */
} measure_figure;

void measure_add_figures(cJSON *row, const measure_figure *figures, int count);
/* measure_add(row, { "ms", 3.5 }, { "fps", 1e3 / 3.5 }) */
#define measure_add(row, ...)                                                                      \
    measure_add_figures(row, (const measure_figure[]){ __VA_ARGS__ },                              \
                        sizeof((const measure_figure[]){ __VA_ARGS__ }) / sizeof(measure_figure))

#endif
