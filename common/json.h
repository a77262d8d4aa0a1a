/* Parses JSON from files within the memory budget. Prints JSON that is safe for any terminal and
 * parser. Any thread. */
#ifndef TRIP_JSON_H
#define TRIP_JSON_H

#include <stdbool.h>
#include <stdint.h>

#include "budget.h"

struct cJSON;

typedef struct trip_json {
    struct cJSON *root; /* NULL if the text is not JSON */
    /* In the text: after the JSON value, or at the first error. */
    const char *end;
    trip_budget *budget;
    uint64_t bytes; /* charged to the budget */
} trip_json;

/* Parses `text`, the content of the file `path`. Takes time linear in its length. Charges the
 * memory to the budget before it parses; NULL charges nothing. Text that does not fit or is nested
 * more than 64 deep is a reported failure. Text that is not JSON is not a failure. */
int trip_json_parse(trip_json *out, const char *text, const char *path, trip_budget *budget);
/* Frees the tree. *j may be zeroed. */
void trip_json_free(trip_json *j);

/* Returns the tree as text, for free(). The text is valid UTF-8 for any strings, with control
 * characters escaped. Returns NULL if memory is exhausted. */
char *trip_json_print(const struct cJSON *root, bool formatted);
/* Prints the tree to standard output and deletes it. Fails (reported for `stage` and `where`) if
 * memory is exhausted. */
int trip_json_put(struct cJSON *root, const char *stage, const char *where);

#endif
