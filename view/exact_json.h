/* JSON numbers that read back exactly, bit for bit. Pure functions. */
#ifndef TRIP_VIEW_EXACT_JSON_H
#define TRIP_VIEW_EXACT_JSON_H

#include <stdbool.h>

struct cJSON;

/* Return NULL if memory is exhausted. cJSON_AddItemToObject() ignores a NULL item. */
struct cJSON *trip_exact_number(double value);
struct cJSON *trip_exact_numbers(const double *values, int count);

/* Reads a number. Returns false if `item` is NULL, no number, or outside lo to hi. */
bool trip_exact_read(const struct cJSON *item, double lo, double hi, double *out);
/* Reads an array of exactly `count` numbers, each from lo to hi. Returns false otherwise. */
bool trip_exact_read_numbers(const struct cJSON *item, int count, double lo, double hi,
                             double *out);

#endif
