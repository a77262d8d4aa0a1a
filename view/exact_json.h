/* Numbers in JSON that read back as they were, to the last bit. Pure functions. */
#ifndef TRIP_VIEW_EXACT_JSON_H
#define TRIP_VIEW_EXACT_JSON_H

#include <stdbool.h>

struct cJSON;

/* NULL without memory; what cJSON_AddItemToObject() and the like then leave out. */
struct cJSON *trip_exact_number(double value);
struct cJSON *trip_exact_numbers(const double *values, int count);

/* False where the item, which may be NULL, is not a number between these. */
bool trip_exact_read(const struct cJSON *item, double lo, double hi, double *out);
/* The same for an array of so many. */
bool trip_exact_read_numbers(const struct cJSON *item, int count, double lo, double hi,
                             double *out);

#endif
