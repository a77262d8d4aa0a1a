#include "times.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>

double measure_now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void measure_sort(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, ascending);
}

double measure_median(double *values, int count)
{
    measure_sort(values, count);
    return count ? values[(count - 1) / 2] : NAN;
}
