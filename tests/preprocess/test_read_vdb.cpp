#include "volume_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <unistd.h>

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <csetjmp>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
extern "C" {
#include <cmocka.h>
}

#include "report.h"
#include "sanitizers.h"
#include "scope.h"

namespace
{

using openvdb::Coord;
using openvdb::CoordBBox;

int lines;
std::string last_line;

void keep_line(const char *line, void *)
{
    lines++;
    last_line = line;
}

/* Catches reports from here on. */
void expect_line()
{
    lines = 0;
    last_line.clear();
    trip_report_redirect(keep_line, nullptr);
}

void assert_one_line(const char *part)
{
    trip_report_redirect(nullptr, nullptr);
    assert_int_equal(lines, 1);
    if (last_line.find(part) == std::string::npos)
        fail_msg("\"%s\" is not in: %s", part, last_line.c_str());
}

/* A file that the destructor removes. */
struct File {
    File() : path("test_read_vdb-" + std::to_string(getpid()) + ".vdb")
    {
    }
    explicit File(const openvdb::GridCPtrVec &grids) : File()
    {
        openvdb::io::File(path).write(grids);
    }
    ~File()
    {
        ::unlink(path.c_str());
    }
    std::string bytes() const
    {
        std::ifstream in(path, std::ios::binary);
        return { std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>() };
    }
    void put(const std::string &bytes) const
    {
        std::ofstream(path, std::ios::binary) << bytes;
    }
    std::string path;
};

/* A volume that the reader opened with a separate budget. */
struct Volume {
    explicit Volume(const File &file, const trip_volume_params &params = {},
                    uint64_t memory = 1 << 28)
    {
        assert_int_equal(trip_budget_create(&budget, memory), 0);
        status = trip_read_vdb.open(file.path.c_str(), &params, budget, &info, &state);
    }
    Volume(const Volume &) = delete;
    ~Volume()
    {
        if (state)
            trip_read_vdb.close(state);
        trip_budget_destroy(budget);
    }
    std::vector<trip_volume_portion> portions() const
    {
        std::vector<trip_volume_portion> all;
        trip_volume_portion portion;
        trip_read_vdb.rewind(state);
        while (trip_read_vdb.next(state, &portion) == 1)
            all.push_back(portion);
        return all;
    }
    trip_budget *budget = nullptr;
    trip_volume_info info = {};
    void *state = nullptr;
    int status;
};

/* A decoded portion with a border of one voxel. */
struct Decoded {
    Decoded(const Volume &v, const trip_volume_portion &portion)
    {
        for (int a = 0; a < 3; a++) {
            lo[a] = portion.origin[a] - 1;
            size[a] = portion.size[a] + 2;
        }
        values.resize((size_t)(size[0] * size[1] * size[2]));
        active.resize(values.size());
        status = trip_read_vdb.decode(v.state, &portion, lo, size, values.data(), active.data());
    }
    int64_t lo[3], size[3];
    std::vector<float> values;
    std::vector<uint8_t> active;
    int status;
};

using Expected = std::function<void(const Coord &at, float &value, bool &active)>;

/* Compares every voxel of every portion and border with `expected`, at the grid coordinates of the
 * voxel. `first` is the grid position of the volume's first voxel. Checks that portions come in
 * order and share no voxel. Returns the number of active voxels. */
size_t check_voxels(const Volume &v, const Coord &first, const Expected &expected)
{
    size_t existing = 0;
    Coord before = Coord::min();
    for (const trip_volume_portion &portion : v.portions()) {
        Decoded d(v, portion);
        assert_int_equal(d.status, 0);
        Coord order((int)portion.origin[2], (int)portion.origin[1], (int)portion.origin[0]);
        assert_true(before < order);
        before = order;
        for (size_t n = 0; n < d.values.size(); n++) {
            int64_t i = (int64_t)n % d.size[0], j = (int64_t)n / d.size[0] % d.size[1],
                    k = (int64_t)n / d.size[0] / d.size[1];
            Coord at = first + Coord((int)(d.lo[0] + i), (int)(d.lo[1] + j), (int)(d.lo[2] + k));
            float value = 0;
            bool active = false;
            expected(at, value, active);
            if (d.values[n] != value || d.active[n] != active)
                fail_msg("at %d %d %d: %g %d, expected %g %d", at.x(), at.y(), at.z(),
                         (double)d.values[n], d.active[n], (double)value, active);
            bool border = i == 0 || j == 0 || k == 0 || i == d.size[0] - 1 || j == d.size[1] - 1 ||
                          k == d.size[2] - 1;
            existing += !border && active;
        }
    }
    return existing;
}

/* Returns the first voxel of the volume, which has a border of one background voxel around the
 * active voxels. */
template <typename GridT> Coord first_of(const GridT &grid)
{
    return grid.evalActiveVoxelBoundingBox().min() - Coord(1, 1, 1);
}

/* Expects the values that the library returns. Inactive voxels have the background value. */
template <typename GridT> Expected as_in(const GridT &grid)
{
    return [&grid](const Coord &at, float &value, bool &active) {
        active = grid.tree().isValueOn(at);
        value = (float)(active ? grid.tree().getValue(at) : grid.background());
    };
}

/* Fills voxels in several leaves and nodes, also at negative coordinates, and a tile of the size of
 * a leaf. */
template <typename GridT> void fill_scattered(GridT &grid)
{
    std::mt19937 random(7);
    for (int n = 0; n < 3000; n++) {
        Coord at((int)(random() % 150) - 70, (int)(random() % 90) - 20, (int)(random() % 40) - 130);
        grid.tree().setValueOn(at, typename GridT::ValueType(random() % 1000 - 300.0));
    }
    grid.tree().addTile(1, Coord(8, 16, -120), typename GridT::ValueType(5), true);
}

template <typename GridT> void check_type(trip_scalar type, bool half_stored = false)
{
    openvdb::initialize();
    typename GridT::Ptr grid = GridT::create(typename GridT::ValueType(2));
    grid->setName("g");
    grid->setSaveFloatAsHalf(half_stored);
    fill_scattered(*grid);
    File file({ grid });
    Volume v(file);
    assert_int_equal(v.status, 0);
    assert_int_equal(v.info.type, type);
    assert_true(v.info.sparse);
    assert_string_equal(v.info.name, "g");
    assert_true(v.info.background == (double)grid->background());
    CoordBBox box = grid->evalActiveVoxelBoundingBox();
    for (int a = 0; a < 3; a++)
        assert_int_equal(v.info.dims[a], box.dim()[a] + 2);
    /* Half floats represent all values of this test exactly. */
    assert_int_equal(check_voxels(v, first_of(*grid), as_in(*grid)), grid->activeVoxelCount());
}

void float_grids_are_read(void **)
{
    check_type<openvdb::FloatGrid>(TRIP_F32);
}

void double_grids_are_read(void **)
{
    check_type<openvdb::DoubleGrid>(TRIP_F64);
}

void floats_stored_as_half_are_read(void **)
{
    check_type<openvdb::FloatGrid>(TRIP_F16, true);
    check_type<openvdb::DoubleGrid>(TRIP_F16, true);
}

void integer_grids_are_read(void **)
{
    check_type<openvdb::Int32Grid>(TRIP_I32);
    check_type<openvdb::Int64Grid>(TRIP_I64);
}

void bool_grids_are_read(void **)
{
    openvdb::initialize();
    openvdb::BoolGrid::Ptr grid = openvdb::BoolGrid::create(false);
    std::mt19937 random(3);
    for (int n = 0; n < 2000; n++)
        grid->tree().setValueOn(
            Coord((int)(random() % 30), (int)(random() % 20), -(int)(random() % 9)), random() % 2);
    File file({ grid });
    Volume v(file);
    assert_int_equal(v.status, 0);
    assert_int_equal(v.info.type, TRIP_U8);
    Coord first = first_of(*grid);
    assert_int_equal(check_voxels(v, first, as_in(*grid)), grid->activeVoxelCount());
}

void mask_grids_are_one_where_active(void **)
{
    openvdb::initialize();
    openvdb::MaskGrid::Ptr grid = openvdb::MaskGrid::create();
    for (int n = 0; n < 500; n++)
        grid->tree().setValueOn(Coord(n * 7 % 31, n * 5 % 17, n % 23));
    grid->tree().addTile(1, Coord(64, 0, 0), true, true);
    File file({ grid });
    Volume v(file);
    assert_int_equal(v.status, 0);
    Coord first = first_of(*grid);
    size_t count = check_voxels(v, first, [&](const Coord &at, float &value, bool &active) {
        active = grid->tree().isValueOn(at);
        value = active;
    });
    assert_int_equal(count, grid->activeVoxelCount());
}

void every_compression_is_read(void **)
{
    openvdb::initialize();
    openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(1);
    fill_scattered(*grid);
    Coord first = first_of(*grid);
    namespace io = openvdb::io;
    for (uint32_t flags : { (uint32_t)io::COMPRESS_NONE, (uint32_t)io::COMPRESS_ZIP,
                            (uint32_t)io::COMPRESS_BLOSC, (uint32_t)io::COMPRESS_ACTIVE_MASK,
                            (uint32_t)(io::COMPRESS_ZIP | io::COMPRESS_ACTIVE_MASK) }) {
        File file;
        io::File out(file.path);
        out.setCompression(flags);
        out.write({ grid });
        out.close();
        Volume v(file);
        assert_int_equal(v.status, 0);
        assert_int_equal(check_voxels(v, first, as_in(*grid)), grid->activeVoxelCount());
    }
}

/* Uses tiles of 8, 128 and 4096 voxels a side. Counts the portions of all tiles but decodes only a
 * few. */
void active_tiles_of_any_level_become_boxes(void **)
{
    openvdb::initialize();
    openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(0);
    grid->tree().addTile(1, Coord(-8, 0, 0), 1, true);
    grid->tree().addTile(2, Coord(128, 0, 0), 2, true);
    grid->tree().addTile(3, Coord(4096, 0, 0), 3, true);
    File file({ grid });
    Volume v(file);
    assert_int_equal(v.status, 0);
    assert_int_equal(v.info.dims[0], 1 + 8 + 8192 + 1);
    std::vector<trip_volume_portion> portions = v.portions();
    uint64_t voxels = 0;
    for (const trip_volume_portion &b : portions) {
        assert_true(b.size[0] <= 64 && b.size[1] <= 64 && b.size[2] <= 64);
        voxels += (uint64_t)(b.size[0] * b.size[1] * b.size[2]);
    }
    assert_true(voxels == 512 + (uint64_t)128 * 128 * 128 + (uint64_t)4096 * 4096 * 4096);
    for (size_t n = 0; n < portions.size(); n += 20000) {
        Decoded d(v, portions[n]);
        float expected = portions[n].origin[0] < 9 ? 1 : portions[n].origin[0] < 4105 ? 2 : 3;
        size_t inside = (size_t)((d.size[1] + 1) * d.size[0] + 1);
        assert_true(d.values[inside] == expected && d.active[inside] == 1);
    }
}

/* The first active voxel is at (1, 1, 1) of the volume, whatever its coordinates in the file are.
 */
void rotation_shear_and_offset_reach_world_space(void **)
{
    openvdb::initialize();
    openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(0);
    grid->tree().setValueOn(Coord(-5, 7, 11), 1);
    grid->tree().setValueOn(Coord(20, 9, 40), 1);
    openvdb::Mat4R m = openvdb::Mat4R::identity();
    m.setToRotation(openvdb::math::X_AXIS, 0.3);
    m.postShear(openvdb::math::Y_AXIS, openvdb::math::X_AXIS, 0.4);
    m.postScale(openvdb::Vec3d(0.5, 2, 1.25));
    m.postTranslate(openvdb::Vec3d(10, -20, 30));
    grid->setTransform(openvdb::math::Transform::createLinearTransform(m));
    File file({ grid });
    Volume v(file);
    assert_int_equal(v.status, 0);
    for (Coord c : { Coord(-5, 7, 11), Coord(20, 9, 40), Coord(0, 0, 0) }) {
        openvdb::Vec3d world = grid->indexToWorld(c);
        trip_vec3 p =
            trip_affine_point(&v.info.index_to_world, trip_v3(c.x() + 6, c.y() - 6, c.z() - 10));
        assert_true(std::fabs(p.x - world.x()) < 1e-9 && std::fabs(p.y - world.y()) < 1e-9 &&
                    std::fabs(p.z - world.z()) < 1e-9);
    }
}

openvdb::FloatGrid::Ptr one_voxel(const char *name, float value)
{
    openvdb::initialize();
    openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(0);
    grid->setName(name);
    grid->tree().setValueOn(Coord(0, 0, 0), value);
    return grid;
}

float only_value(const Volume &v)
{
    Decoded d(v, v.portions().at(0));
    return *std::max_element(d.values.begin(), d.values.end());
}

void a_grid_is_chosen_by_name_or_is_the_first_scalar_one(void **)
{
    openvdb::initialize();
    openvdb::Vec3SGrid::Ptr vectors = openvdb::Vec3SGrid::create();
    vectors->setName("v");
    vectors->tree().setValueOn(Coord(0, 0, 0), openvdb::Vec3f(1, 2, 3));
    File file({ vectors, one_voxel("a", 1), one_voxel("b", 2), one_voxel("a", 3) });
    trip_volume_params params = {};
    assert_true(only_value(Volume(file)) == 1);
    params.grid = "b";
    assert_true(only_value(Volume(file, params)) == 2);
    params.grid = "a[1]";
    assert_true(only_value(Volume(file, params)) == 3);
    params.grid = "c";
    expect_line();
    assert_int_equal(Volume(file, params).status, TRIP_USAGE);
    assert_one_line("v (vec3s), a[0] (float), b (float), a[1] (float)");
    params.grid = "v";
    expect_line();
    assert_int_equal(Volume(file, params).status, TRIP_ERROR);
    assert_one_line("not scalars");
}

openvdb::FloatGrid::Ptr fog_voxel(const char *name, float value)
{
    openvdb::FloatGrid::Ptr grid = one_voxel(name, value);
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    return grid;
}

/* Files of smoke and fire contain several grids in any order. */
void density_comes_before_other_fog_and_fog_before_other_scalars(void **)
{
    File named({ fog_voxel("flame", 1), fog_voxel("temperature", 2), one_voxel("density", 3) });
    assert_true(only_value(Volume(named)) == 3);
    File fog({ one_voxel("temperature", 1), fog_voxel("smoke", 2), fog_voxel("flame", 3) });
    assert_true(only_value(Volume(fog)) == 2);
    File plain({ one_voxel("temperature", 1), one_voxel("heat", 2) });
    assert_true(only_value(Volume(plain)) == 1);
    File twice({ one_voxel("heat", 1), one_voxel("density", 2), one_voxel("density", 3) });
    assert_true(only_value(Volume(twice)) == 2);
}

void the_note_names_the_chosen_grid(void **)
{
    File file({ fog_voxel("flame", 1), one_voxel("density", 3), one_voxel("heat", 3) });
    Volume v(file);
    assert_non_null(std::strstr(v.info.note, "\"density\" is used"));
    assert_non_null(std::strstr(v.info.note, ": flame, heat"));
    trip_volume_params params = {};
    params.grid = "heat";
    assert_string_equal(Volume(file, params).info.note, "");
    File alone({ one_voxel("heat", 3) });
    assert_string_equal(Volume(alone).info.note, "");
}

void grids_that_share_a_tree_have_separate_transforms(void **)
{
    openvdb::FloatGrid::Ptr a = one_voxel("a", 4);
    openvdb::FloatGrid::Ptr b = a->copy();
    b->setName("b");
    b->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
    File file({ a, b });
    trip_volume_params params = {};
    params.grid = "b";
    Volume v(file, params);
    assert_int_equal(v.status, 0);
    assert_true(only_value(v) == 4 && v.info.index_to_world.m[1][1] == 0.25);
}

void a_streamed_file_gives_its_first_grid(void **)
{
    openvdb::FloatGrid::Ptr grid = one_voxel("first", 6);
    File file;
    std::ofstream out(file.path, std::ios::binary);
    openvdb::io::Stream(out).write(openvdb::GridCPtrVec{ grid, one_voxel("second", 7) });
    out.close();
    assert_true(only_value(Volume(file)) == 6);
    trip_volume_params params = {};
    params.grid = "second";
    expect_line();
    assert_int_equal(Volume(file, params).status, TRIP_USAGE);
    assert_one_line("perhaps more");
}

/* Returns the distance to a sphere with a radius of 20 voxels. Voxels are 0.1 wide. */
openvdb::FloatGrid::Ptr sphere()
{
    openvdb::initialize();
    auto grid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
        2, openvdb::Vec3f(0.33f, 0, 0), 0.1f, 3);
    grid->setName("ball");
    return grid;
}

void level_set_options_need_level_sets(void **)
{
    File fog({ fog_voxel("fog", 1) });
    trip_volume_params params = {};
    params.level_set = TRIP_LEVEL_SET_BAND;
    expect_line();
    assert_int_equal(Volume(fog, params).status, TRIP_USAGE);
    assert_one_line("does not apply");
}

void a_level_set_is_filled_by_default_with_a_note(void **)
{
    File file({ sphere() });
    Volume by_default(file);
    trip_volume_params params = {};
    params.level_set = TRIP_LEVEL_SET_FILLED;
    Volume filled(file, params);
    assert_int_equal(by_default.status, 0);
    std::vector<trip_volume_portion> portions = by_default.portions(), same = filled.portions();
    assert_int_equal(portions.size(), same.size());
    for (size_t i = 0; i < portions.size(); i++)
        assert_true(Decoded(by_default, portions[i]).values == Decoded(filled, same[i]).values);
    assert_non_null(std::strstr(by_default.info.note, "--level-set band"));
    assert_string_equal(filled.info.note, "");
}

/* The density is 1 inside and 0 outside, with a smooth ramp six voxels wide between. The file has
 * no active voxels in the interior. The sum of densities is the mean volume of balls of radius
 * 20 - 3 to 20 + 3, weighted by the slope of the ramp. The variance of the radius is then 9 / 5. */
void a_filled_level_set_is_a_ball(void **)
{
    openvdb::FloatGrid::Ptr grid = sphere();
    File file({ grid });
    trip_volume_params params = {};
    params.level_set = TRIP_LEVEL_SET_FILLED;
    Volume v(file, params);
    assert_int_equal(v.status, 0);
    assert_true(v.info.background == 0);
    double sum = 0;
    Coord first = first_of(*grid);
    check_voxels(v, first, [&](const Coord &at, float &value, bool &active) {
        double d = (double)grid->tree().getValue(at) / grid->voxelSize()[0];
        double t = std::min(1.0, std::max(0.0, 0.5 - d / 6));
        value = (float)(t * t * (3 - 2 * t));
        active = value > 0;
    });
    for (const trip_volume_portion &portion : v.portions()) {
        std::vector<float> values((size_t)(portion.size[0] * portion.size[1] * portion.size[2]));
        assert_int_equal(trip_read_vdb.decode(v.state, &portion, portion.origin, portion.size,
                                              values.data(), nullptr),
                         0);
        for (float value : values)
            sum += value;
    }
    const double mean_cube = 20.0 * 20 * 20 + 3 * 20 * 9 / 5.0;
    assert_true(std::fabs(sum / (4 / 3.0 * M_PI * mean_cube) - 1) < 0.001);
}

/* Light follows the gradient, and rings show where its size or direction jumps. Away from the
 * centre, the gradient of a ball points to the centre. Central differences of a function of the
 * distance have the derivative to the third order. */
void a_filled_level_set_has_smooth_gradients(void **)
{
    openvdb::FloatGrid::Ptr grid = sphere();
    File file({ grid });
    trip_volume_params params = {};
    params.level_set = TRIP_LEVEL_SET_FILLED;
    Volume v(file, params);
    std::map<std::array<int, 3>, double> density;
    check_voxels(v, first_of(*grid), [&](const Coord &at, float &value, bool &active) {
        double t = std::min(
            1.0, std::max(0.0, 0.5 - (double)grid->tree().getValue(at) / grid->voxelSize()[0] / 6));
        value = (float)(t * t * (3 - 2 * t));
        active = value > 0;
        density[{ at.x(), at.y(), at.z() }] = (double)value;
    });
    const auto at = [&](int x, int y, int z) {
        auto found = density.find({ x, y, z });
        return found == density.end() ? 0.0 : found->second;
    };
    double angle = 0, size = 0;
    for (const auto &[p, value] : density) {
        const auto [x, y, z] = p;
        const double dx = x - 3.3; /* the centre is at 3.3, 0, 0 */
        const double r = std::sqrt(dx * dx + y * y + z * z), t = 0.5 - (r - 20) / 6;
        const double g[3] = { (at(x + 1, y, z) - at(x - 1, y, z)) / 2,
                              (at(x, y + 1, z) - at(x, y - 1, z)) / 2,
                              (at(x, y, z + 1) - at(x, y, z - 1)) / 2 };
        const double length = std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
        if (value < 0.02 || value > 0.98)
            continue;
        const double along = -(g[0] * dx + g[1] * y + g[2] * z) / r;
        angle = std::max(angle, std::acos(std::min(1.0, along / length)));
        size = std::max(size, std::fabs(along - t * (1 - t)) / 0.25);
    }
    assert_true(angle < 2 * M_PI / 180);
    assert_true(size < 0.08);
}

/* The density is 1 at the surface and falls to 0 at the edges of the band, 3 voxels away on each
 * side. */
void a_band_is_one_at_the_surface(void **)
{
    openvdb::FloatGrid::Ptr grid = sphere();
    File file({ grid });
    trip_volume_params params = {};
    params.level_set = TRIP_LEVEL_SET_BAND;
    Volume v(file, params);
    assert_int_equal(v.status, 0);
    Coord first = first_of(*grid);
    double half_width = (double)grid->background();
    size_t count = check_voxels(v, first, [&](const Coord &at, float &value, bool &active) {
        active = grid->tree().isValueOn(at);
        double d = std::fabs((double)grid->tree().getValue(at));
        value = active ? (float)std::max(0.0, 1 - d * (1 / half_width)) : 0;
    });
    assert_int_equal(count, grid->activeVoxelCount());
}

void grids_that_cannot_be_drawn_are_refused(void **)
{
    openvdb::FloatGrid::Ptr frustum = one_voxel("camera", 1);
    frustum->setTransform(openvdb::math::Transform::createFrustumTransform(
        openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(10)), 0.5, 10));
    expect_line();
    assert_int_equal(Volume(File({ frustum })).status, TRIP_ERROR);
    assert_one_line("frustum");
    openvdb::FloatGrid::Ptr empty = openvdb::FloatGrid::create(0);
    expect_line();
    assert_int_equal(Volume(File({ empty })).status, TRIP_ERROR);
    assert_one_line("without active voxels");
    openvdb::FloatGrid::Ptr far = one_voxel("far", 1);
    far->tree().setValueOn(Coord(2000000000, 0, 0), 1);
    expect_line();
    assert_int_equal(Volume(File({ far })).status, TRIP_ERROR);
    assert_one_line("2^30");
    expect_line();
    assert_int_equal(Volume(File(openvdb::GridCPtrVec{})).status, TRIP_ERROR);
    assert_one_line("contains no grid");
}

void insufficient_memory_is_refused_first(void **)
{
    openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(0);
    fill_scattered(*grid);
    File file({ grid });
    expect_line();
    assert_int_equal(Volume(file, {}, 100000).status, TRIP_ERROR);
    assert_one_line("--memory");
    openvdb::FloatGrid::Ptr tiles = openvdb::FloatGrid::create(0);
    for (int n = 0; n < 8; n++)
        tiles->tree().addTile(3, Coord(n * 4096, 0, 0), 1, true);
    expect_line();
    assert_int_equal(Volume(File({ tiles }), {}, 20000000).status, TRIP_ERROR);
    assert_one_line("--memory");
}

void many_threads_decode_at_once(void **)
{
    openvdb::initialize();
    openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(0);
    fill_scattered(*grid);
    File file({ grid });
    Volume v(file);
    assert_int_equal(v.status, 0);
    std::vector<trip_volume_portion> portions = v.portions();
    std::vector<std::vector<float>> serial, parallel(portions.size());
    for (const trip_volume_portion &portion : portions)
        serial.push_back(Decoded(v, portion).values);
    std::vector<std::thread> threads;
    for (size_t t = 0; t < 4; t++)
        threads.emplace_back([&, t] {
            for (size_t n = t; n < portions.size(); n += 4)
                parallel[n] = Decoded(v, portions[n]).values;
        });
    for (std::thread &thread : threads)
        thread.join();
    assert_true(serial == parallel);
}

/* Opens the file and decodes up to `most` portions. Expects one line for each failure and no other
 * line. */
void read_whatever_it_is(const File &file, size_t most)
{
    expect_line();
    Volume v(file);
    int failures = v.status < 0;
    if (v.status == 0) {
        std::vector<trip_volume_portion> portions = v.portions();
        for (size_t n = 0; n < portions.size() && n < most; n++)
            failures += Decoded(v, portions[n]).status < 0;
    }
    trip_report_redirect(nullptr, nullptr);
    assert_int_equal(lines, failures);
}

std::string small_file(uint32_t compression)
{
    openvdb::initialize();
    openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(0);
    for (int n = 0; n < 700; n++)
        grid->tree().setValueOn(Coord(n % 11, n % 13, n % 9), (float)(n % 17));
    grid->setName("density");
    File file;
    openvdb::io::File out(file.path);
    out.setCompression(compression);
    out.write({ grid });
    out.close();
    return file.bytes();
}

/* Opening and decoding both read the file, and check for an interruption before each piece. */
void an_interruption_ends_opening_and_decoding(void **)
{
    openvdb::initialize();
    openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(2);
    fill_scattered(*grid);
    File file({ grid });
    Volume whole(file);
    assert_int_equal(whole.status, 0);
    const trip_volume_portion portion = whole.portions()[0];
    std::vector<float> values((size_t)(portion.size[0] * portion.size[1] * portion.size[2]));
    trip_scope cancelled = {};
    trip_scope *before = trip_scope_enter(&cancelled);
    trip_scope_cancel(&cancelled);
    expect_line();
    Volume v(file);
    assert_int_equal(v.status, TRIP_INTERRUPTED);
    assert_one_line("interrupted");
    assert_int_equal(trip_read_vdb.decode(whole.state, &portion, portion.origin, portion.size,
                                          values.data(), nullptr),
                     TRIP_INTERRUPTED);
    trip_scope_enter(before);
}

void a_truncated_file_is_refused(void **)
{
    const std::string whole =
        small_file(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
    File file;
    for (size_t length = 1; length < whole.size(); length += length < 400 ? 1 : 97) {
        file.put(whole.substr(0, length));
        expect_line();
        assert_int_equal(Volume(file).status, TRIP_ERROR);
        assert_one_line("test_read_vdb");
    }
}

/* Writes wrong single bytes, and wrong sizes of eight and four bytes. Reading must succeed or fail
 * with a line. */
void a_corrupted_file_does_no_harm(void **)
{
    namespace io = openvdb::io;
    std::mt19937_64 random(11);
    File file;
    for (uint32_t flags : { (uint32_t)io::COMPRESS_NONE, (uint32_t)io::COMPRESS_ZIP,
                            (uint32_t)(io::COMPRESS_BLOSC | io::COMPRESS_ACTIVE_MASK) }) {
        const std::string whole = small_file(flags);
        for (int n = 0; n < 100; n++) {
            std::string bad = whole;
            const int64_t sizes[] = { -1, -100000, INT64_MIN, INT64_MAX, 0, 1 << 30 };
            size_t bytes = n % 3 == 0 ? 1 : n % 3 == 1 ? 4 : 8;
            int64_t value = bytes == 1 ? (int64_t)random() : sizes[random() % 6];
            std::memcpy(&bad[random() % (bad.size() - 8)], &value, bytes);
            file.put(bad);
            read_whatever_it_is(file, 100);
        }
    }
}

/* Returns a file with nodes of every level and a background other than 0. Values of tiles fill
 * compressed chunks. */
std::string tiled_file(uint32_t compression)
{
    openvdb::initialize();
    openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(3);
    for (int n = 0; n < 40; n++) {
        grid->tree().addTile(2, Coord(128 * n, 1024, 0), 7, true);
        grid->tree().addTile(1, Coord(8 * (n % 8), 8 * (n / 8), 0), 5, true);
        grid->tree().addTile(1, Coord(8 * (n % 8), 8 * (n / 8), 128), 5, true);
    }
    grid->tree().setValueOn(Coord(100, 100, 100), 1);
    grid->tree().setValueOn(Coord(100, 100, 228), 1);
    File file;
    openvdb::io::File out(file.path);
    out.setCompression(compression);
    out.write({ grid });
    out.close();
    return file.bytes();
}

/* Returns where the root of the file's tree begins: at the background value. */
size_t tree_of(const std::string &file)
{
    const float background = 3;
    return file.find(std::string((const char *)&background, sizeof background));
}

/* Inverts each byte of the tree in turn, and opens the file. Sanitized builds invert every third
 * byte, which reaches every chunk. Leaves out the zeros inside the nodes' masks. */
void any_wrong_byte_of_a_node_does_no_harm(void **)
{
    namespace io = openvdb::io;
    File file;
    for (uint32_t flags : { (uint32_t)io::COMPRESS_ZIP, (uint32_t)io::COMPRESS_BLOSC,
                            (uint32_t)(io::COMPRESS_ZIP | io::COMPRESS_ACTIVE_MASK),
                            (uint32_t)(io::COMPRESS_BLOSC | io::COMPRESS_ACTIVE_MASK) }) {
        const std::string whole = tiled_file(flags);
        for (size_t at = tree_of(whole); at < whole.size(); at += TEST_BY_TURNS ? 3 : 1) {
            if (whole.find_first_not_of('\0', at - 8) > at)
                continue;
            std::string bad = whole;
            bad[at] = (char)~bad[at];
            file.put(bad);
            read_whatever_it_is(file, 0);
        }
    }
}

/* The byte before the values of a node or leaf is 6 in an unmasked grid. For other values, the
 * library reads the values from another byte than it skips to. */
void masked_values_in_an_unmasked_grid_are_refused(void **)
{
    const std::string whole = tiled_file(openvdb::io::COMPRESS_BLOSC);
    std::string leaf_mask(512 / 8, '\0');
    leaf_mask[36] = 0x10; /* voxel (4, 4, 4) of the leaf */
    const size_t top_values = tree_of(whole) + 3 * 4 + 3 * 4 + 2 * 32768 / 8;
    const size_t leaf_values = whole.rfind(leaf_mask) + leaf_mask.size();
    File file;
    for (size_t at : { top_values, leaf_values })
        for (char masking : { 0, 1, 2, 3, 4, 5, 7, -1 }) {
            std::string bad = whole;
            assert_int_equal(bad[at], 6);
            bad[at] = masking;
            file.put(bad);
            expect_line();
            assert_int_equal(Volume(file).status, TRIP_ERROR);
            assert_one_line("masked values");
        }
}

} // namespace

int main()
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(float_grids_are_read),
        cmocka_unit_test(double_grids_are_read),
        cmocka_unit_test(floats_stored_as_half_are_read),
        cmocka_unit_test(integer_grids_are_read),
        cmocka_unit_test(bool_grids_are_read),
        cmocka_unit_test(mask_grids_are_one_where_active),
        cmocka_unit_test(every_compression_is_read),
        cmocka_unit_test(active_tiles_of_any_level_become_boxes),
        cmocka_unit_test(rotation_shear_and_offset_reach_world_space),
        cmocka_unit_test(a_grid_is_chosen_by_name_or_is_the_first_scalar_one),
        cmocka_unit_test(density_comes_before_other_fog_and_fog_before_other_scalars),
        cmocka_unit_test(the_note_names_the_chosen_grid),
        cmocka_unit_test(grids_that_share_a_tree_have_separate_transforms),
        cmocka_unit_test(a_streamed_file_gives_its_first_grid),
        cmocka_unit_test(level_set_options_need_level_sets),
        cmocka_unit_test(a_level_set_is_filled_by_default_with_a_note),
        cmocka_unit_test(a_filled_level_set_is_a_ball),
        cmocka_unit_test(a_filled_level_set_has_smooth_gradients),
        cmocka_unit_test(a_band_is_one_at_the_surface),
        cmocka_unit_test(grids_that_cannot_be_drawn_are_refused),
        cmocka_unit_test(insufficient_memory_is_refused_first),
        cmocka_unit_test(many_threads_decode_at_once),
        cmocka_unit_test(an_interruption_ends_opening_and_decoding),
        cmocka_unit_test(a_truncated_file_is_refused),
        cmocka_unit_test(a_corrupted_file_does_no_harm),
        cmocka_unit_test(any_wrong_byte_of_a_node_does_no_harm),
        cmocka_unit_test(masked_values_in_an_unmasked_grid_are_refused),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
