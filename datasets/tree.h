/* Scatters points over a tree of tapered branches and flat leaves.
 *
 * The trunk starts at the origin and grows along +y. A branch splits into three, TRIP_TREE_FORKS
 * times. Each of the thinnest branches has leaves: ellipses. Points are spread evenly over the area
 * of bark and leaves. The result is a PLY file with normals and colours. The memory holds the
 * branches and leaves, and does not grow with the number of points. */
#ifndef TRIP_TREE_H
#define TRIP_TREE_H

#include <stdint.h>

enum { TRIP_TREE_FORKS = 6, TRIP_TREE_LEAVES = 24 /* of a branch */ };

/* Writes exactly `count` points. */
int trip_tree_write(const char *output, uint64_t count);

#endif
