/* Contents of the netCDF test files, and checks of the volumes read from them. Variable "t" of (z,
 * lat, x) is the sample volume. */
#ifndef NETCDF_FILES_H
#define NETCDF_FILES_H

#include "volume_files.h"

/* Coordinates: x is 1, 2, 4, 8, 16, z is 6, 5, 4 ... 0. */
static inline int x_position(int i)
{
    return 1 << i;
}

static inline int z_position(int k)
{
    return NZ - 1 - k;
}

/* Checks the volume's coordinates against x_position() and z_position(), and its name. */
static inline void assert_placed(const char *path, const char *name)
{
    static const double x[NX] = { 0, 4.0 / 15, 12.0 / 15, 28.0 / 15, 4 };
    trip_budget *budget;
    trip_volume *v;
    assert_int_equal(trip_budget_create(&budget, 64 << 20), 0);
    assert_int_equal(trip_volume_open(&v, path, NULL, budget), 0);
    const trip_volume_info *info = trip_volume_get_info(v);
    assert_map(&info->index_to_world,
               (const double[3][4]){ { 3.75, 0, 0, 1 }, { 0, 1, 0, 0 }, { 0, 0, -1, 6 } });
    for (int i = 0; i < NX; i++)
        assert_true(fabs(info->coordinates[0][i] - x[i]) < 1e-12);
    for (int k = 0; k < NZ; k++)
        assert_true(info->coordinates[2][k] == k);
    assert_string_equal(info->name, name);
    trip_volume_close(v);
    trip_budget_destroy(budget);
}

/* Coordinates for variables of a signed type with an attribute that declares them unsigned. */
static inline int unsigned_x_position(int i)
{
    return 100 + 25 * i;
}

/* Checks a volume stored as signed `type` and declared unsigned. If `missing`, a voxel stored as -7
 * has no value. The x coordinates are unsigned_x_position(). */
static inline void assert_unsigned(const char *path, trip_scalar type, bool missing)
{
    const double beyond = type == TRIP_I8 ? 256 : 65536;
    float values[VOXELS];
    trip_volume_info info;
    int none = 0;
    assert_int_equal(read_volume(path, NULL, 2, values, VOXELS, &info), 0);
    assert_int_equal(info.type, missing ? TRIP_F32 : type == TRIP_I8 ? TRIP_U8 : TRIP_U16);
    for (int v = 0; v < VOXELS; v++) {
        const int stored = sample(type, v % NX, v / NX % NY, v / NX / NY);
        const bool is_none = missing && stored == -7;
        none += is_none;
        assert_true(is_none ? isnan(values[v]) : values[v] == stored + (stored < 0 ? beyond : 0));
    }
    assert_true(missing == (none > 0));
    assert_map(&info.index_to_world,
               (const double[3][4]){ { 25, 0, 0, 100 }, { 0, 1, 0, 0 }, { 0, 0, -1, 6 } });
}

/* Checks a volume with scale 2 and offset 3. A voxel stored as 5 has no value. */
static inline void assert_scaled(const char *path, trip_scalar type)
{
    float values[VOXELS];
    trip_volume_info info;
    int missing = 0;
    assert_int_equal(read_volume(path, NULL, 2, values, VOXELS, &info), 0);
    for (int v = 0; v < VOXELS; v++) {
        int stored = sample(type, v % NX, v / NX % NY, v / NX / NY);
        missing += stored == 5;
        assert_true(stored == 5 ? isnan(values[v]) : values[v] == 2.0F * (float)stored + 3);
    }
    assert_in_range(missing, 1, VOXELS / 10);
}

#endif
