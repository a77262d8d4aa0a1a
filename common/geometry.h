/* Vectors and affine maps in double precision. The reference renderer and all preprocessing
 * geometry use double precision, which cglm does not offer. GL code converts on upload. */
#ifndef TRIP_GEOMETRY_H
#define TRIP_GEOMETRY_H

#include <math.h>
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_vec3 {
    double x, y, z;
} trip_vec3;

/* Maps p to linear * p + translation. A row-major 3 x 4 matrix with the translation in the last
 * column. */
typedef struct trip_affine {
    double m[3][4];
} trip_affine;

/* Bounds of the voxel length in world units that can be drawn. Extinctions are floats per world
 * unit. */
#define TRIP_VOXEL_WORLD_MIN 1e-32
#define TRIP_VOXEL_WORLD_MAX 1e32

/* Maximum number of voxels along an axis of a grid. */
#define TRIP_AXIS_VOXELS_MAX (1 << 24)

/* Maximum distance of a voxel from the origin of world space, in voxels. Double precision has an
 * error of an eighth of a voxel there. Drawing itself loses nothing, since it works in index space.
 */
#define TRIP_FARTHEST_VOXELS 0x1p50

static inline trip_vec3 trip_v3(double x, double y, double z)
{
    return (trip_vec3){ x, y, z };
}

static inline trip_vec3 trip_add(trip_vec3 a, trip_vec3 b)
{
    return trip_v3(a.x + b.x, a.y + b.y, a.z + b.z);
}

static inline trip_vec3 trip_sub(trip_vec3 a, trip_vec3 b)
{
    return trip_v3(a.x - b.x, a.y - b.y, a.z - b.z);
}

static inline trip_vec3 trip_scale(trip_vec3 a, double s)
{
    return trip_v3(a.x * s, a.y * s, a.z * s);
}

static inline double trip_dot(trip_vec3 a, trip_vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

/* Multiplies component by component. */
static inline trip_vec3 trip_vec3_times(trip_vec3 a, trip_vec3 b)
{
    return trip_v3(a.x * b.x, a.y * b.y, a.z * b.z);
}

static inline trip_vec3 trip_vec3_over(trip_vec3 a, trip_vec3 b)
{
    return trip_v3(a.x / b.x, a.y / b.y, a.z / b.z);
}

static inline trip_vec3 trip_cross(trip_vec3 a, trip_vec3 b)
{
    return trip_v3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

static inline double trip_length(trip_vec3 a)
{
    return sqrt(trip_dot(a, a));
}

/* Returns the zero vector for the zero vector. */
static inline trip_vec3 trip_normalize(trip_vec3 a)
{
    double l = trip_length(a);
    return l > 0 ? trip_scale(a, 1 / l) : a;
}

static inline double trip_component(trip_vec3 a, int axis)
{
    return axis == 0 ? a.x : axis == 1 ? a.y : a.z;
}

/* Rotates about an axis of unit length, counterclockwise seen against the axis. */
static inline trip_vec3 trip_turned(trip_vec3 v, trip_vec3 axis, double radians)
{
    const trip_vec3 along = trip_scale(axis, trip_dot(axis, v)), across = trip_sub(v, along);
    return trip_add(along, trip_add(trip_scale(across, cos(radians)),
                                    trip_scale(trip_cross(axis, across), sin(radians))));
}

trip_affine trip_affine_identity(void);
trip_vec3 trip_affine_point(const trip_affine *a, trip_vec3 p);
trip_vec3 trip_affine_vector(const trip_affine *a, trip_vec3 v);
/* Returns linear^T * n, which maps a gradient in the target space of `a` to its source space. With
 * the inverse of index-to-world it maps gradients from index space to world space. */
trip_vec3 trip_affine_transpose_vector(const trip_affine *a, trip_vec3 n);
trip_affine trip_affine_multiply(const trip_affine *a, const trip_affine *b);
double trip_affine_determinant(const trip_affine *a);
/* Whether the map is a rotation, possibly mirrored, times one scale. A voxel then has the same
 * length in all directions. */
bool trip_affine_is_similarity(const trip_affine *a);
/* Returns false if the map is singular or not finite. */
bool trip_affine_invert(const trip_affine *a, trip_affine *out);

/* Returns the greatest coordinate in world space of the voxels of a grid, divided by the length of
 * its shortest voxel. Beyond TRIP_FARTHEST_VOXELS, positions lose their place. Infinite if numbers
 * overflow. */
double trip_affine_farthest_voxels(const trip_affine *a, const double dims[3]);

#ifdef __cplusplus
}
#endif

#endif
