#include "median.h"

#include <math.h>
#include <stdlib.h>

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
