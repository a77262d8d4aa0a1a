/* Cameras and clouds of surfels that tests share. */
#ifndef TRIP_SURFEL_SCENES_H
#define TRIP_SURFEL_SCENES_H

#include "surfels_cpu.h"

enum {
    SURFEL_WIDTH = 150,
    SURFEL_HEIGHT = 90,
    SURFEL_PIXELS = SURFEL_WIDTH * SURFEL_HEIGHT,
    SURFEL_SCENE = 6000,
    SURFEL_SIDE = 120,
};

static const trip_gaussian_settings surfel_full = { .background = { 0.2, 0.4, 0.6, 0.9 },
                                                    .depth = true };

/* Looks along z from the origin; x goes left. */
trip_camera surfel_camera(double ortho_height);

void surfel_colour(trip_gaussian *g, double red, double green, double blue);

/* A surfel with a radius. Its normal points along z, turned about x by an angle. */
trip_gaussian surfel_at(double x, double y, double z, double radius, double angle);

/* A plane through (0, 0, z), turned about x: SURFEL_SIDE * SURFEL_SIDE surfels of a square grid.
 * Their radii are the distance over the root of 2, as in clouds of points. */
trip_gaussian *surfel_plane(trip_gaussian *to, double z, double distance, double angle);

/* A repeatable scene of SURFEL_SCENE surfels: of all directions and sizes, some merged, some near
 * the eye, and two planes. */
const trip_gaussian *surfel_scene(void);

/* Adds a wall to a picture of surfel_camera(9). It covers the left half. Checks the rectangles that
 * it hides. */
void surfel_check_hidden(trip_surfels_cpu *s);

#endif
