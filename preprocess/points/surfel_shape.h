/* The radius and the normal of a point from its neighbours. Pure functions.
 *
 * Radius: let R be the distance of the last of k neighbours. A surface with even random points of
 * distance s has k = pi R^2 / s^2 neighbours on average. So s = R sqrt(pi / k). A disc of radius
 * s / sqrt(2) about each point of a square grid covers the surface. At a border, and for a point
 * far from all others, R misleads. R is at most TRIP_SURFEL_SPREAD times the root mean square
 * distance of the neighbours from their mean.
 *
 * Normal: the direction in which the neighbours and the point vary least. Where neighbours lie on a
 * line, the direction across it that is nearest to `towards`. A normal points to the side of
 * `towards`.
 *
 * Roughness: the root mean square distance of the neighbours and the point from the plane through
 * their mean with this normal.
 *
 * Density: k / (pi R^2) points per unit of area. */
#ifndef TRIP_SURFEL_SHAPE_H
#define TRIP_SURFEL_SHAPE_H

#include "neighbours.h"

#define TRIP_SURFEL_SPREAD 1.7

typedef struct trip_surfel_shape {
    double radius; /* infinite without neighbours */
    double normal[3];
    double roughness; /* 0 without neighbours */
} trip_surfel_shape;

/* `towards` need not have unit length. Without neighbours, it is the normal's direction. */
trip_surfel_shape trip_surfel_shape_of(const trip_neighbours *n, const double towards[3]);
/* Returns the density of points; 1 without neighbours. */
double trip_surfel_density(const trip_neighbours *n);
/* Returns the mean distance of the neighbours; 0 without any. */
double trip_surfel_spread(const trip_neighbours *n);

#endif
