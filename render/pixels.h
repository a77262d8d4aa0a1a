/* The pixels of a row or column with centres (at + 0.5) inside given bounds.
 * shaders/project.glsl and cpu/kernels/project_tmpl.h compute the same in their own number
 * types. Pure functions. */
#ifndef TRIP_PIXELS_H
#define TRIP_PIXELS_H

/* Inclusive; empty if first > last. */
typedef struct trip_pixels {
    int first, last;
} trip_pixels;

/* Returns the pixels with centres in [lo, hi], limited to a line of `size` pixels. The result is
 * empty if a bound is NaN. */
static inline trip_pixels trip_pixels_within(double lo, double hi, int size)
{
    trip_pixels p = { 0, size - 1 };
    lo -= 0.5;
    hi -= 0.5;
    if (!(lo <= size - 1 && hi >= 0 && lo <= hi))
        return (trip_pixels){ 0, -1 };
    if (lo > 0)
        p.first = (int)lo + ((int)lo < lo);
    if (hi < size - 1)
        p.last = (int)hi;
    return p;
}

#endif
