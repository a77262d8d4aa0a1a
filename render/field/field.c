#include "field.h"

#include <string.h>

#include "report.h"

enum {
    EDGE = TRIP_FIELD_EDGE,
    CUBE_VOXELS = EDGE * EDGE * EDGE,
    CHUNK_CUBES = 256, /* taken from the budget at once */
};

struct trip_field {
    trip_budget *budget;
    int64_t dims[3], cubes[3];
    size_t positions;    /* number of cubes in the grid, and of directory entries */
    uint32_t *directory; /* by the cube's position in the grid: 1 + its number, or 0 if it has no
                            voxels */
    trip_field_cube **chunks;
    size_t chunk_room, count;
    trip_field_unit unit;
};

static size_t chunks_of(size_t cubes)
{
    return cubes / CHUNK_CUBES + (cubes % CHUNK_CUBES > 0);
}

static int fail_memory(const char *stage)
{
    return trip_fail(TRIP_ERROR, "render", "field",
                     "%s does not fit the memory given; the whole volume takes 16 bytes per "
                     "voxel; raise --memory",
                     stage);
}

int trip_field_create(trip_field **out, const int64_t dims[3], trip_budget *budget)
{
    trip_field *f = *out = trip_budget_take(budget, sizeof *f);
    if (!f)
        return fail_memory("the volume");
    f->budget = budget;
    f->unit.scale = 1;
    f->positions = 1;
    bool fits = true;
    for (int a = 0; a < 3; a++) {
        f->dims[a] = dims[a];
        f->cubes[a] = (dims[a] + EDGE - 1) / EDGE;
        fits &= !__builtin_mul_overflow(f->positions, (size_t)f->cubes[a], &f->positions);
    }
    if (!fits || f->positions >= UINT32_MAX) {
        f->positions = 0;
        trip_field_destroy(f);
        *out = NULL;
        return fail_memory("the directory of the large grid");
    }
    f->chunk_room = chunks_of(f->positions);
    f->directory = trip_budget_take(budget, f->positions * sizeof *f->directory);
    f->chunks = trip_budget_take(budget, f->chunk_room * sizeof(trip_field_cube *));
    if (f->directory && f->chunks)
        return 0;
    trip_field_destroy(f);
    *out = NULL;
    return fail_memory("the directory of the grid");
}

void trip_field_destroy(trip_field *f)
{
    if (!f)
        return;
    trip_budget *budget = f->budget;
    for (size_t i = 0; i < chunks_of(f->count); i++)
        trip_budget_release(budget, f->chunks[i], CHUNK_CUBES * sizeof **f->chunks);
    trip_budget_release(budget, f->chunks, f->chunk_room * sizeof(trip_field_cube *));
    trip_budget_release(budget, f->directory, f->positions * sizeof *f->directory);
    trip_budget_release(budget, f, sizeof *f);
}

void trip_field_set_unit(trip_field *f, trip_field_unit unit)
{
    f->unit = unit;
}

trip_field_unit trip_field_get_unit(const trip_field *f)
{
    return f->unit;
}

const int64_t *trip_field_dims(const trip_field *f)
{
    return f->dims;
}

size_t trip_field_cubes(const trip_field *f)
{
    return f->count;
}

static trip_field_cube *cube_by_number(const trip_field *f, size_t number)
{
    return &f->chunks[number / CHUNK_CUBES][number % CHUNK_CUBES];
}

const trip_field_cube *trip_field_cube_by_number(const trip_field *f, size_t number)
{
    return cube_by_number(f, number);
}

static uint32_t *position_of(const trip_field *f, const int64_t at[3])
{
    const size_t i = (size_t)at[0] / EDGE, j = (size_t)at[1] / EDGE, k = (size_t)at[2] / EDGE;
    return &f->directory[(k * (size_t)f->cubes[1] + j) * (size_t)f->cubes[0] + i];
}

static bool is_in_grid(const trip_field *f, const int64_t at[3])
{
    return at[0] >= 0 && at[1] >= 0 && at[2] >= 0 && at[0] < f->dims[0] && at[1] < f->dims[1] &&
           at[2] < f->dims[2];
}

const trip_field_cube *trip_field_cube_at(const trip_field *f, const int64_t at[3])
{
    uint32_t number = is_in_grid(f, at) ? *position_of(f, at) : 0;
    return number ? cube_by_number(f, number - 1) : NULL;
}

static size_t index_in_cube(const int64_t at[3])
{
    return ((size_t)at[2] % EDGE * EDGE + (size_t)at[1] % EDGE) * EDGE + (size_t)at[0] % EDGE;
}

const trip_field_voxel *trip_field_at(const trip_field *f, int64_t i, int64_t j, int64_t k)
{
    const int64_t at[3] = { i, j, k };
    const trip_field_cube *cube = trip_field_cube_at(f, at);
    const trip_field_voxel *voxel = cube ? &cube->voxels[index_in_cube(at)] : NULL;
    return voxel && !isnan(voxel->code) ? voxel : NULL;
}

/* Adds an empty cube. Returns NULL if it exceeds the budget. */
static trip_field_cube *begin_cube(trip_field *f, const int64_t at[3])
{
    size_t chunk = f->count / CHUNK_CUBES;
    if (f->count % CHUNK_CUBES == 0 &&
        !(f->chunks[chunk] = trip_budget_take(f->budget, CHUNK_CUBES * sizeof **f->chunks)))
        return NULL;
    trip_field_cube *cube = cube_by_number(f, f->count++);
    *position_of(f, at) = (uint32_t)f->count;
    for (int a = 0; a < 3; a++)
        cube->at[a] = at[a] / EDGE * EDGE;
    cube->own[0] = INFINITY;
    cube->own[1] = -INFINITY;
    for (int i = 0; i < CUBE_VOXELS; i++)
        cube->voxels[i] = (trip_field_voxel){ NAN, { NAN, NAN, NAN } };
    return cube;
}

int trip_field_put(trip_field *f, const int64_t at[3], double code, const double gradient[3])
{
    uint32_t number = *position_of(f, at);
    trip_field_cube *cube = number ? cube_by_number(f, number - 1) : begin_cube(f, at);
    if (!cube)
        return fail_memory("the volume");
    trip_field_voxel *voxel = &cube->voxels[index_in_cube(at)];
    voxel->code = (float)code;
    for (int a = 0; a < 3 && gradient; a++)
        voxel->gradient[a] = (float)gradient[a];
    cube->own[0] = fminf(cube->own[0], voxel->code);
    cube->own[1] = fmaxf(cube->own[1], voxel->code);
    return 0;
}

/* Returns the distance between two neighbours, for a difference. */
static double apart(const trip_field_map *map, int axis, int64_t before, int64_t after)
{
    if (!map->coordinates)
        return (double)(after - before);
    return trip_coordinates_at(map->coordinates, axis, after) -
           trip_coordinates_at(map->coordinates, axis, before);
}

/* Returns a number of which values are multiples: a draw code, or the value of a stored code. */
static double even(const trip_field_map *map, double code)
{
    return map->stored ? trip_codes_value(map->stored, code) : code;
}

/* Returns the derivative along an axis, in codes per index or per unit of position. */
static double difference(const trip_field *f, const trip_field_map *map, const int64_t at[3],
                         double here, int axis)
{
    int64_t after[3] = { at[0], at[1], at[2] }, before[3] = { at[0], at[1], at[2] };
    after[axis]++;
    before[axis]--;
    const trip_field_voxel *a = trip_field_at(f, after[0], after[1], after[2]);
    const trip_field_voxel *b = trip_field_at(f, before[0], before[1], before[2]);
    double rise = even(map, a ? (double)a->code : here) - even(map, b ? (double)b->code : here);
    if (!a && !b)
        return 0;
    return rise / apart(map, axis, b ? before[axis] : at[axis], a ? after[axis] : at[axis]);
}

static void set_gradient(const trip_field *f, const trip_field_map *map,
                         const trip_affine *to_index, const int64_t at[3], trip_field_voxel *voxel)
{
    bool given = !isnan(voxel->gradient[0]);
    if (given && !map->signless)
        return;
    trip_vec3 rise =
        trip_v3(difference(f, map, at, voxel->code, 0), difference(f, map, at, voxel->code, 1),
                difference(f, map, at, voxel->code, 2));
    trip_vec3 g = trip_affine_transpose_vector(to_index, trip_scale(rise, map->value_per_code));
    float *stored = voxel->gradient;
    if (!given) {
        stored[0] = (float)g.x;
        stored[1] = (float)g.y;
        stored[2] = (float)g.z;
    } else if (trip_dot(g, trip_v3(stored[0], stored[1], stored[2])) < 0) {
        for (int a = 0; a < 3; a++)
            stored[a] = -stored[a];
    }
}

static void finish_cube(const trip_field *f, const trip_field_map *map, const trip_affine *to_index,
                        trip_field_cube *cube)
{
    for (int n = 0; n < CUBE_VOXELS; n++) {
        const int64_t at[3] = { cube->at[0] + n % EDGE, cube->at[1] + n / EDGE % EDGE,
                                cube->at[2] + n / (EDGE * EDGE) };
        if (!isnan(cube->voxels[n].code))
            set_gradient(f, map, to_index, at, &cube->voxels[n]);
    }
    memcpy(cube->range, cube->own, sizeof cube->range);
    for (int n = 0; n < 27; n++) {
        const int64_t at[3] = { cube->at[0] + (n % 3 - 1) * EDGE,
                                cube->at[1] + (n / 3 % 3 - 1) * EDGE,
                                cube->at[2] + (n / 9 - 1) * EDGE };
        const trip_field_cube *next = trip_field_cube_at(f, at);
        cube->range[0] = next ? fminf(cube->range[0], next->own[0]) : cube->range[0];
        cube->range[1] = next ? fmaxf(cube->range[1], next->own[1]) : cube->range[1];
    }
}

int trip_field_finish(trip_field *f, const trip_field_map *map)
{
    trip_affine to_index;
    if (!trip_affine_invert(&map->index_to_world, &to_index))
        return trip_fail(TRIP_ERROR, "render", "field",
                         "the map from index space to world space is singular");
    for (size_t i = 0; i < f->count; i++) {
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "render", "field", "interrupted");
        finish_cube(f, map, &to_index, cube_by_number(f, i));
    }
    return 0;
}

/* Linear and gaussian weights form a mean. The absolute cubic weights add up to at most 1.25 along
 * each axis. */
void trip_field_code_bounds(trip_kernel kernel, double min, double max, double bounds[2])
{
    double sum = kernel == TRIP_KERNEL_CUBIC ? 1.25 * 1.25 * 1.25 : 1;
    double beyond = (sum - 1) / 2 * (max - min);
    bounds[0] = min - beyond;
    bounds[1] = max + beyond;
}

static void set_bounds(trip_kernel kernel, trip_field_cell *cell, trip_field_unit unit)
{
    float lo = INFINITY, hi = -INFINITY;
    double bounds[2];
    for (int n = 0; n < cell->edge * cell->edge * cell->edge; n++) {
        float code = cell->voxels[n]->code;
        lo = code < lo ? code : lo;
        hi = code > hi ? code : hi;
    }
    cell->unit = unit;
    trip_field_code_bounds(kernel, trip_field_code(unit, lo), trip_field_code(unit, hi), bounds);
    cell->min = bounds[0];
    cell->max = bounds[1];
}

static bool is_within_cube(const int64_t at[3])
{
    return at[0] % EDGE < EDGE - 1 && at[1] % EDGE < EDGE - 1 && at[2] % EDGE < EDGE - 1;
}

static bool take_corners_in_cube(const trip_field_cube *cube, const int64_t at[3],
                                 const trip_field_voxel **corners)
{
    bool there = true;
    for (int n = 0; n < 8; n++) {
        int next = (n & 1) + (n >> 1 & 1) * EDGE + (n >> 2) * EDGE * EDGE;
        corners[n] = &cube->voxels[index_in_cube(at) + (size_t)next];
        there &= !isnan(corners[n]->code);
    }
    return there;
}

static bool take_corners(const trip_field *f, const int64_t at[3], const trip_field_voxel **corners)
{
    const trip_field_cube *cube = trip_field_cube_at(f, at);
    if (!cube)
        return false;
    if (is_within_cube(at))
        return take_corners_in_cube(cube, at, corners);
    for (int n = 0; n < 8; n++) {
        corners[n] = trip_field_at(f, at[0] + (n & 1), at[1] + (n >> 1 & 1), at[2] + (n >> 2));
        if (!corners[n])
            return false;
    }
    return true;
}

/* Returns the voxel at position 0 to 3 along an axis, clamped to the grid. */
static int64_t position_along(const trip_field *f, const int64_t at[3], int axis, int position)
{
    int64_t i = at[axis] + position - 1, last = f->dims[axis] - 1;
    return i < 0 ? 0 : i > last ? last : i;
}

/* Returns the cell's corner, 0 or 1, nearest to position 0 to 3 along an axis. */
static int next_corner(int position)
{
    return position > 1;
}

static void take_surroundings(const trip_field *f, const int64_t at[3],
                              const trip_field_voxel *const *corners,
                              const trip_field_voxel **voxels)
{
    for (int n = 0; n < 64; n++) {
        int x = n % 4, y = n / 4 % 4, z = n / 16;
        const trip_field_voxel *v =
            trip_field_at(f, position_along(f, at, 0, x), position_along(f, at, 1, y),
                          position_along(f, at, 2, z));
        voxels[n] = v ? v : corners[next_corner(x) + 2 * next_corner(y) + 4 * next_corner(z)];
    }
}

bool trip_field_take_cell(const trip_field *f, trip_kernel kernel, const int64_t at[3],
                          trip_field_cell *out)
{
    const trip_field_voxel *corners[8];
    if (!take_corners(f, at, corners))
        return false;
    memcpy(out->at, at, sizeof out->at);
    out->edge = kernel == TRIP_KERNEL_LINEAR ? 2 : 4;
    if (out->edge == 2)
        memcpy(out->voxels, corners, sizeof corners);
    else
        take_surroundings(f, at, corners, out->voxels);
    set_bounds(kernel, out, f->unit);
    return true;
}
