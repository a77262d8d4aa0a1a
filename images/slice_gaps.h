/* Detects missing slices, by the numbers in their names or by their positions. Pure functions,
 * except for warnings. */
#ifndef TRIP_SLICE_GAPS_H
#define TRIP_SLICE_GAPS_H

#include <string>
#include <vector>

/* Returns a name with its numbers replaced. Names with one shape differ only in their numbers. */
std::string trip_name_shape(const std::string &name);

/* Checks names that differ in exactly one number. The steps between the numbers must be equal; with
 * two names the step must be 1. Names of several shapes are checked shape by shape. Names that
 * differ in several numbers, such as dates and times, are not checked. Throws trip_slice_error for
 * `path` with the number and name of a missing slice, or warns if `allow_gaps` is set. */
void trip_check_numbers(const std::string &path, const std::vector<std::string> &names,
                        bool allow_gaps);

/* Checks `positions`, in ascending order, with one entry of `names` each. The median step is the
 * normal one, and a step of about two or more times its length has slices missing. Throws or warns
 * as trip_check_numbers() does. Returns the normal step divided by the mean step if gaps were found
 * and allowed, else 1. */
double trip_check_positions(const std::vector<double> &positions,
                            const std::vector<std::string> &names, bool allow_gaps);

#endif
