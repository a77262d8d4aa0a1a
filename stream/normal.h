/* Normals in a data set, which store the gradient of the values at a voxel as precisely as shading
 * needs it.
 *
 * 4 bytes, in world space; `full` is a gradient at which shading is full:
 *   bit 31 clear   the gradient is full / 511 * (x + h, y + h, z + h), with x = bits 0-9,
 *                  y = bits 10-19 and z = bits 20-29 signed, h = half of bit 30. The nearest point
 *                  of this body-centred cubic lattice is closer than in other lattices of as many
 *                  points.
 *   bit 31 set     the gradient is at least `full` long. Bits 0-11 and 12-23 are octahedral
 *                  coordinates of its direction (unorm12 over [-1, 1]), at most 0.06 degrees off.
 *                  Bits 24-30 are n: its length is full * (1 + n / 32)^2, or more for n = 127.
 * Rounding changes no colour by half of 1/255 (tests/render/test_shade.c).
 *
 * 3 bytes, without the sign of the gradient, since both sides of a surface are lit alike:
 *   bit 23 clear   the gradient in index space is (step[0] x, step[1] y, step[2] z), with
 *                  x = bits 0-7 and y = bits 8-15 signed, z = bits 16-22 unsigned.
 *   bit 23 set     the gradient is at least `full`, where shading is full, and counts as that long.
 *                  Bits 0-11 and 12-22 are the coordinates p and q, unorm over [-1, 1], of its
 *                  world-space direction on the upper half of the octahedron,
 *                  ((p + q) / 2, (p - q) / 2, 1 - max(|p|, |q|)) / its length.
 * Central differences of integers are multiples of 1/2. If the steps divide 1/2, all such gradients
 * below `full` are exact. An error in direction of 0.1 degrees then changes no colour by half of
 * 1/255. Other gradients, such as means over voxels, change a colour by up to 2/255. */
#ifndef TRIP_NORMAL_H
#define TRIP_NORMAL_H

#include <stdbool.h>
#include <stdint.h>

#include "geometry.h"

/* Gradient at which shading is full, as a fraction of the range of values per voxel length. The
 * range of values is used and not the range of codes, which depends on the type. Thus 12-bit values
 * in 16 bits are lit like the same values in floats. */
#define TRIP_GRADIENT_FULL 0.04

/* Packs 4 bytes. Returns 0 if the gradient is not finite or `full` is not positive. */
uint32_t trip_normal_pack(const double gradient[3], double full);
void trip_normal_unpack(uint32_t normal, double full, double gradient[3]);

/* Packs 64 gradients, given in units of `full`, in single precision. */
void trip_normals_pack_64(const float x[64], const float y[64], const float z[64],
                          uint32_t normals[64]);

/* Packs a direction alone, as octahedral coordinates of 16 bits each. */
uint32_t trip_direction_pack(const double gradient[3]);
/* Unpacks to a vector of length 1. */
void trip_direction_unpack(uint32_t direction, double unit[3]);

/* The meaning of a data set's 3-byte normals. */
typedef struct trip_compact_normals {
    double full;           /* value units per world unit */
    double step[3];        /* value units per index, along each axis */
    double to_world[3][3]; /* for gradients: the inverse transpose of index_to_world */
} trip_compact_normals;

/* Chooses the finest steps that can store every gradient below `full`. If possible, all multiples
 * of `unit` are exact; returns whether they are along all axes. `unit` 0 means that values have no
 * smallest difference. */
bool trip_compact_normals_choose(const trip_affine *index_to_world, double full, double unit,
                                 double step[3]);
/* Returns whether renderers can compute with the steps in single precision: none is longer than
 * 1024 gradients of length `full`. trip_compact_normals_choose() makes far shorter ones. */
bool trip_compact_normals_possible(const trip_affine *index_to_world, double full,
                                   const double step[3]);
trip_compact_normals trip_compact_normals_make(const trip_affine *index_to_world, double full,
                                               const double step[3]);
/* Packs the gradient in index space. Returns 0 if it is not finite. */
uint32_t trip_compact_normal_pack(const trip_compact_normals *c, const double gradient[3]);
/* Unpacks to the gradient in world space. */
void trip_compact_normal_unpack(const trip_compact_normals *c, uint32_t normal, double gradient[3]);

#endif
