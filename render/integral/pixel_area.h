/* The mean of a function of the picture's plane over the area of a pixel: each point of the pixel
 * counts alike (box filter). Here the function is the integral along the ray of a point.
 *
 * Squares
 * -------
 * The pixel is divided into `first` x `first` squares. The rule of a square is
 *
 *     (2 centre + mean of the corners) / 3,
 *
 * which is exact for polynomials of degree 3. A square may differ by a bound. It is accepted if its
 * centre and the mean of its corners differ by at most twice the bound. Other squares are divided
 * into four. The four are accepted if their mean and the rule of the square differ by at most the
 * bound; else each of them is treated alike.
 *
 * Tolerance
 * ---------
 * The errors of smooth squares have random signs, and are much smaller than the differences. A step
 * of the function crosses about sqrt(n) of n squares. Their errors are at most twice the difference
 * between the rules, and two thirds of the difference between centre and corners. So the mean of n
 * equal squares is right to the tolerance with a bound of sqrt(n) / 2 times the tolerance. This is
 * the bound of a square of 1/n of the pixel.
 *
 * Detail between the points of all first squares is missed. An interpolated volume has little of it
 * if first squares are smaller than a voxel. */
#ifndef TRIP_PIXEL_AREA_H
#define TRIP_PIXEL_AREA_H

/* Squares are divided at most TRIP_PIXEL_AREA_DEPTH times. */
enum { TRIP_PIXEL_AREA_DEPTH = 10 };

/* Writes the components at a point. Returns a negative code to stop. */
typedef int (*trip_pixel_function)(void *user, double x, double y, double out[4]);

typedef struct trip_pixel_area {
    trip_pixel_function function;
    void *user;
    double tolerance; /* of each component */
    int first;        /* squares along each side of a pixel, at least 1 */
} trip_pixel_area;

/* Writes the mean over the first square with its top left corner at (x, y). `corners` are the
 * values at its top left, top right, bottom left and bottom right. Returns the negative code of the
 * function. */
int trip_pixel_area_square(const trip_pixel_area *a, double x, double y,
                           const double *const corners[4], double out[4]);

#endif
