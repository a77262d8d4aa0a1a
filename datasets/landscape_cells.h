/* The cells of a landscape: the ground, and the place of the copy that stands on it. */
#ifndef TRIP_LANDSCAPE_CELLS_H
#define TRIP_LANDSCAPE_CELLS_H

#include <stddef.h>
#include <stdint.h>

#include "scatter.h"

#define TRIP_LANDSCAPE_CELL 1.25 /* the widest scene with scale 1 has the width 1 */
#define TRIP_LANDSCAPE_SMALLEST 0.7
#define TRIP_LANDSCAPE_LARGEST 1.2
#define TRIP_LANDSCAPE_SCENES_MAX 64

enum { TRIP_LANDSCAPE_GROUND = 16 }; /* ground Gaussians along each side of a cell */

/* Returns the height of the ground:
 * 0.8 sin(0.35 x + 0.6) cos(0.27 z) + 0.2 sin(0.9 z + 0.4 x). */
double trip_landscape_height(double x, double z);

/* A scene or cloud, turned so that -y points up. */
typedef struct trip_upright {
    double turn[3][3]; /* its rows are the axes x, y and z of the landscape */
    double middle[3];  /* the point of the ground below the middle */
    double width;      /* the greater extent along x and z */
} trip_upright;

/* Finds these from `count` centres, which are `stride` bytes apart. `up` is such as "z" or "-y". */
int trip_upright_find(trip_upright *u, const double *centres, size_t stride, uint64_t count,
                      const char up[3], const char *path);

/* Returns a number in [0, 1) that depends on a cell and on the use. */
double trip_cell_chance(uint64_t cell, unsigned use);

/* Sets the transform of the copy in a cell that has its middle at x and z. */
void trip_cell_transform(uint64_t cell, double x, double z, const trip_upright *u, double m[3][4]);

/* Sets the colour of the ground, 0 to 1. */
void trip_ground_colour(double x, double z, double rgb[3]);

#endif
