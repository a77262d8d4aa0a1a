/* Times in milliseconds and their medians. Any thread. */
#ifndef TRIP_MEASURE_TIMES_H
#define TRIP_MEASURE_TIMES_H

/* Returns the time of the monotonic clock. */
double measure_now_ms(void);
/* Sorts values in ascending order. */
void measure_sort(double *values, int count);
/* Sorts the values and returns the median, or the lower of two middle values. */
double measure_median(double *values, int count);

#endif
