/* Medians of times and other figures. Any thread. */
#ifndef TRIP_MEASURE_MEDIAN_H
#define TRIP_MEASURE_MEDIAN_H

/* Sorts values in ascending order. */
void measure_sort(double *values, int count);
/* Sorts the values and returns the median, or the lower of two middle values. */
double measure_median(double *values, int count);

#endif
