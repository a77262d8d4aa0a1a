/* The mean of a function of the picture's plane over the area of a pixel: each point of the pixel
 * counts alike (box filter). Here the function is the integral along the ray of a point.
 *
 * Squares
 * -------
 * The pixel is divided into `first` x `first` squares. The rule of a square is
 *
 *     (2 centre + mean of the corners) / 3,
 *
 * which is exact for polynomials of degree 3. A square is accepted if its centre and the mean of
 * its corners differ by at most what it may differ. Other squares are divided into four. The four
 * are accepted if their mean and the rule of the square differ by at most as much; else each of
 * them is treated alike.
 *
 * Tolerance
 * ---------
 * The errors of smooth squares have random signs, and are much smaller than the difference. A step
 * of the function crosses about sqrt(n) of n squares, and their errors are at most twice the
 * difference. So the mean of n equal squares is right to the tolerance if each differs by at most
 * sqrt(n) / 2 times the tolerance. This is what a square of 1/n of the pixel may differ.
 *
 * Detail between the points of all first squares is missed. An interpolated volume has little of it
 * if first squares are smaller than a voxel. */
#ifndef TRIP_PIXEL_AREA_H
#define TRIP_PIXEL_AREA_H

/* Squares are divided at most TRIP_PIXEL_AREA_DEPTH times. */
enum { TRIP_PIXEL_AREA_DEPTH = 10, TRIP_PIXEL_AREA_FIRST_MAX = 64 };

/* Writes the components at a point. Returns a negative code to stop. */
typedef int (*trip_pixel_function)(void *user, double x, double y, double out[4]);

typedef struct trip_pixel_area {
    trip_pixel_function function;
    void *user;
    double tolerance; /* of each component */
    int first;        /* squares along each side of a pixel, 1 to TRIP_PIXEL_AREA_FIRST_MAX */
} trip_pixel_area;

/* Writes the mean over the pixel with its top left corner at (x, y). `corners` are the values at
 * the corners (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1); only a single first square uses
 * them. Returns the negative code of the function. */
int trip_pixel_area_mean(const trip_pixel_area *a, double x, double y,
                         const double *const corners[4], double out[4]);

#endif
