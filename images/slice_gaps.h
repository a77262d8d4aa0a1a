/* Slices that are missing among others, found by the numbers in their names or by their places. */
#ifndef TRIP_SLICE_GAPS_H
#define TRIP_SLICE_GAPS_H

#include <string>
#include <vector>

/* A name with its numbers replaced: names of one shape differ in their numbers only. */
std::string trip_name_shape(const std::string &name);

/* Slices that one number in their names counts, the names otherwise alike, must have equal steps
 * between their numbers; two slices, a step of 1. Names in several shapes are looked at shape by
 * shape, and those in which several numbers differ, as dates and times do, not at all. Throws
 * trip_slice_error for `path` with the number and name of a missing slice; with `allow_gaps` that
 * is a warning. */
void trip_check_numbers(const std::string &path, const std::vector<std::string> &names,
                        bool allow_gaps);

/* The same by where slices are, `places` in ascending order, one for each of `names`: most steps
 * have one length, the usual one, and a step of about two or more of it has slices missing in it.
 * Returns the usual step over the mean one where gaps were found and allowed, else 1. */
double trip_check_positions(const std::vector<double> &positions,
                            const std::vector<std::string> &names, bool allow_gaps);

#endif
