/* The transfer function blurred by deviations (Younesy, Moller & Carr 2006, "Improving the quality
 * of multi-resolution volume rendering"). A coarse value is the mean of voxels of level 0. Their
 * codes count as a normal distribution about it, with the value's deviation s (deviation.h).
 * Extinction k, and extinction times each colour, are the means over this distribution:
 *
 *     K(c, s) = integral of k(c + s t) g(t) dt.
 *
 * g is the normal density of deviation 1, cut at TRIP_BLURRED_REACH and divided by its integral.
 * Below code 0 and above code 65535 the function k is constant.
 *
 * Row 0 of 33 is the function itself. Row r > 0 has the deviation of d = 255 ((r + 4) / 36)^2, from
 * 12 codes on. Between rows, K is linear in the variance. For a smooth k and a small s, the
 * integral is linear in the variance too. Entries of a row are at most a sixteenth of its deviation
 * apart, or one code, and K is linear between them. So all rows but row 0 take less than 4
 * megabytes. Each entry is within TRIP_BLURRED_ERROR of the integral, relative to the function's
 * maximum. Read-only once made; any thread may use it. */
#ifndef TRIP_BLURRED_FUNCTION_H
#define TRIP_BLURRED_FUNCTION_H

#include "budget.h"
#include "deviation.h"
#include "segments.h"

/* TRIP_BLURRED_BEFORE is the 4 in the formula of d. */
enum { TRIP_BLURRED_ROWS = 33, TRIP_BLURRED_BEFORE = 4 };

#define TRIP_BLURRED_REACH 4.0
#define TRIP_BLURRED_ERROR 5e-4

/* Entry `first` + i belongs to code i 2^log2; the last one belongs to code 65536. */
typedef struct trip_blurred_row {
    double deviation; /* codes */
    unsigned log2;
    uint32_t first, entries;
} trip_blurred_row;

typedef struct trip_blurred_function {
    trip_blurred_row rows[TRIP_BLURRED_ROWS]; /* row 0 has no entries */
    float (*entries)[4]; /* extinction per world unit; extinction times red, green, blue */
} trip_blurred_function;

/* Returns the shape of all rows, without entries. */
trip_blurred_function trip_blurred_function_shape(void);
/* Returns the number of entries of all rows. */
uint32_t trip_blurred_function_entries(const trip_blurred_function *f);

/* Blurs a table of 65536 entries. Returns false if the budget has too little left. */
bool trip_blurred_function_create(trip_blurred_function *f, const trip_tf_entry *table,
                                  trip_budget *budget);
void trip_blurred_function_destroy(trip_blurred_function *f, trip_budget *budget);

/* Returns the deviation code d of a row. */
double trip_blurred_d_of_row(unsigned row);
/* Return how many codes away from a visible code a value may be visible. It has a row or a
 * deviation code up to the argument. The result is 0 for 0. */
double trip_blurred_reach_of_row(unsigned row);
double trip_blurred_reach(unsigned d);

/* Returns the means over a segment from code a to code b, with deviation code d from 0 to 255.
 * `plain` has the segments of the function itself. Beyond the ends of the table, rows are constant.
 */
trip_segment trip_blurred_segment_of(const trip_blurred_function *f, const trip_segments *plain,
                                     double a, double b, double d);

#endif
