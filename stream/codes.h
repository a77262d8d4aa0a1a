/* The values that codes of level 0 and coarse values stand for.
 *
 * Even codes: code c stands for lo + (hi - lo) * c / 65535.
 *
 * A table: entry n is the value of code n * 2^step_log2. Between entries, values are linear in the
 * code. Behind the last entry, its value holds. There are two uses:
 * - Knots (step_log2 8, 257 entries). Values that are dense get finer codes than the others.
 * - Ids (step_log2 0). Each code stands for one of the few distinct values of the volume.
 *
 * Values ascend with the codes. Pure functions. */
#ifndef TRIP_CODES_H
#define TRIP_CODES_H

#include <stdbool.h>
#include <stdint.h>

#include "format.h"

enum { TRIP_CODES = 65536, TRIP_CODE_TABLE_MAX = 65537, TRIP_CODE_STEP_LOG2_MAX = 16 };

typedef struct trip_codes {
    double lo, hi;       /* values of codes 0 and 65535 */
    const double *table; /* NULL means even codes */
    uint32_t entries;
    unsigned step_log2;
} trip_codes;

/* Returns the codes of a data set. `table` is NULL or the table of its index. */
trip_codes trip_codes_of(const trip_file_header *h, const double *table);
/* Returns codes with a table. lo and hi follow from the table. */
trip_codes trip_codes_from_table(const double *table, uint32_t entries, unsigned step_log2);

/* Returns the fault of a table, or NULL. Values must be finite and must not descend. The
 * first must be less than the last, unless there is one. At most 65,537 entries fit, and the last
 * must not lie behind code 65536. */
const char *trip_codes_fault(const double *table, uint32_t entries, unsigned step_log2);

static inline bool trip_codes_even(const trip_codes *c)
{
    return !c->table;
}

/* Whether each code stands for one value and interpolation between codes has no meaning. */
static inline bool trip_codes_ids(const trip_codes *c)
{
    return c->table && c->step_log2 == 0;
}

/* Returns the value of a code from 0 to 65535, which may be fractional. Codes outside count as the
 * nearest. */
double trip_codes_value(const trip_codes *c, double code);
/* Returns the code of a value, in general fractional, from 0 to 65535. If several codes have the
 * value, returns the lowest. Values outside count as the nearest. NaN gives 0. */
double trip_codes_code(const trip_codes *c, double value);
/* Returns the whole code with the nearest value. */
unsigned trip_codes_nearest(const trip_codes *c, double value);

/* Whether two data sets have the same codes. */
bool trip_codes_equal(const trip_codes *a, const trip_codes *b);

#endif
