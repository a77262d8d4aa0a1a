/* Parses JSON from files within the memory budget, and prints JSON that any terminal and parser can
 * take. Any thread. */
#ifndef TRIP_JSON_H
#define TRIP_JSON_H

#include <stdbool.h>
#include <stdint.h>

#include "budget.h"

struct cJSON;

typedef struct trip_json {
    struct cJSON *root; /* NULL where the text is not JSON */
    const char *end;    /* in the text: behind its value, or where it is not JSON */
    trip_budget *budget;
    uint64_t bytes; /* charged to it */
} trip_json;

/* Parses `text` of the file `path`. Takes time in proportion to its length, and at most as much
 * memory as is charged to the budget first (NULL: not charged). What does not fit or is nested more
 * than 64 deep is a reported failure; what is not JSON is none. */
int trip_json_parse(trip_json *out, const char *text, const char *path, trip_budget *budget);
/* May also be called for a zeroed *j. */
void trip_json_free(trip_json *j);

/* The tree as text, for free(): valid UTF-8 whatever its strings hold, control characters escaped.
 * NULL when memory runs out. */
char *trip_json_print(const struct cJSON *root, bool formatted);

#endif
