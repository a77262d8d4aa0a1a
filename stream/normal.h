/* Normals as a data set stores them: what shading needs of the gradient of the values at a voxel.
 *
 * 4 bytes, in world space; `full` is a gradient at which shading is full:
 *   bit 31 clear   the gradient is full / 511 * (x + h, y + h, z + h), x = bits 0-9, y = bits 10-19
 *                  and z = bits 20-29 signed, h half of bit 30: a body-centred cubic lattice, of
 *                  whose points one is nearer than of any other lattice of as many
 *   bit 31 set     the gradient is at least `full` long: bits 0-11 and 12-23 are octahedral
 *                  coordinates of its direction (unorm12 over [-1, 1]), 0.06 degrees off at most;
 *                  bits 24-30 are n: it is full * (1 + n / 32)^2 long, or longer for n = 127
 * No colour changes by half of 1/255 for what is rounded (tests/render/test_shade.c).
 *
 * 3 bytes, without the sign of the whole, since both sides of a surface are lit alike:
 *   bit 23 clear   the gradient in index space is (step[0] x, step[1] y, step[2] z), x = bits 0-7
 *                  and y = bits 8-15 signed, z = bits 16-22 unsigned
 *   bit 23 set     the gradient is at least `full`, where shading is full, and stands for that
 *                  length: bits 0-11 and 12-22 are the coordinates p and q, unorm over [-1, 1], of
 *                  its world-space direction on the upper half of the octahedron,
 *                  ((p + q) / 2, (p - q) / 2, 1 - max(|p|, |q|)) / its length
 * Central differences of integers are multiples of half of one. Where the steps divide that half,
 * all of these below `full` are exact, and an error in direction of 0.1 degrees changes no colour
 * by half of 1/255. Other gradients, means over voxels for one, change a colour by up to 2/255. */
#ifndef TRIP_NORMAL_H
#define TRIP_NORMAL_H

#include <stdbool.h>
#include <stdint.h>

#include "geometry.h"

/* Gradient at which shading is full, as a fraction of the range of values per voxel length. Not of
 * the codes' range, which is the type's: 12 bits stored in 16 are lit like the same in floats. */
#define TRIP_GRADIENT_FULL 0.04

/* 4 bytes; 0 where the gradient is not finite or `full` is not positive. */
uint32_t trip_normal_pack(const double gradient[3], double full);
void trip_normal_unpack(uint32_t normal, double full, double gradient[3]);

/* A direction alone, where the length is kept apart: octahedral coordinates of 16 bits each. */
uint32_t trip_direction_pack(const double gradient[3]);
/* To a vector of length 1. */
void trip_direction_unpack(uint32_t direction, double unit[3]);

/* What 3-byte normals of a data set mean. */
typedef struct trip_compact_normals {
    double full;           /* value units per world unit */
    double step[3];        /* value units per index, along each axis */
    double to_world[3][3]; /* of gradients: the inverse transpose of index_to_world */
} trip_compact_normals;

/* The finest steps that hold every gradient below `full`. They hold all multiples of `unit` exactly
 * where that is possible; whether it is along all axes is returned. `unit` 0: values have no
 * smallest difference. */
bool trip_compact_normals_choose(const trip_affine *index_to_world, double full, double unit,
                                 double step[3]);
trip_compact_normals trip_compact_normals_make(const trip_affine *index_to_world, double full,
                                               const double step[3]);
/* From the index-space gradient; 0 where that is not finite. */
uint32_t trip_compact_normal_pack(const trip_compact_normals *c, const double gradient[3]);
/* To the world-space gradient. */
void trip_compact_normal_unpack(const trip_compact_normals *c, uint32_t normal, double gradient[3]);

#endif
