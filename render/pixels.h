/* The pixels of a line whose centres (at + 0.5) lie within bounds. shaders/project.glsl and
 * cpu/kernels/project_tmpl.h do the same in their own numbers. */
#ifndef TRIP_PIXELS_H
#define TRIP_PIXELS_H

/* Inclusive; none when first > last. */
typedef struct trip_pixels {
    int first, last;
} trip_pixels;

/* Those with centres in [lo, hi], cut to a line of `size`; none where a bound is not a number. */
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
