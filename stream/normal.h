/* Normals as a data set stores them: what shading needs of the gradient of the values at a voxel.
 *
 * 4 bytes: bits 0-11 and 12-23 octahedral coordinates of the world-space direction (unorm12 over
 * [-1, 1]), bits 24-31 the magnitude m: |gradient| = (m / 255)^2 * gradient_scale. Magnitude 0 has
 * no direction. Directions are off by 0.06 degrees at most.
 *
 * 3 bytes, without the sign of the whole, since both sides of a surface are lit alike:
 *   bit 23 clear   the gradient in index space is (step[0] x, step[1] y, step[2] z), x = bits 0-7
 *                  and y = bits 8-15 signed, z = bits 16-22 unsigned
 *   bit 23 set     the gradient is at least `full`, where shading is full, and stands for that
 *                  length: bits 0-11 and 12-22 are the coordinates p and q, unorm over [-1, 1], of
 *                  its world-space direction on the upper half of the octahedron,
 *                  ((p + q) / 2, (p - q) / 2, 1 - max(|p|, |q|)) / its length
 * Central differences of integers are multiples of half of one. Where the step is that half, all
 * gradients below `full` are exact, and an error in direction of 0.1 degrees changes no colour by
 * half of 1/255 (tests/render/test_shade.c). */
#ifndef TRIP_NORMAL_H
#define TRIP_NORMAL_H

#include <stdint.h>

#include "geometry.h"

/* Gradient at which shading is full, as a fraction of the range of values per voxel length. Not of
 * the codes' range, which is the type's: 12 bits stored in 16 are lit like the same in floats. */
#define TRIP_GRADIENT_FULL 0.04

uint32_t trip_normal_pack(const double gradient[3], double gradient_scale);
void trip_normal_unpack(uint32_t normal, double gradient_scale, double gradient[3]);

/* What 3-byte normals of a data set mean. */
typedef struct trip_compact_normals {
    double full;           /* value units per world unit */
    double step[3];        /* value units per index, along each axis */
    double to_world[3][3]; /* of gradients: the inverse transpose of index_to_world */
} trip_compact_normals;

/* Steps that hold every gradient below `full`, and hold it exactly where the multiples of `unit`
 * reach that far; 0: values have no smallest difference. */
void trip_compact_normals_choose(const trip_affine *index_to_world, double full, double unit,
                                 double step[3]);
trip_compact_normals trip_compact_normals_make(const trip_affine *index_to_world, double full,
                                               const double step[3]);
/* From the index-space gradient; 0 where that is not finite. */
uint32_t trip_compact_normal_pack(const trip_compact_normals *c, const double gradient[3]);
/* To the world-space gradient. */
void trip_compact_normal_unpack(const trip_compact_normals *c, uint32_t normal, double gradient[3]);

#endif
