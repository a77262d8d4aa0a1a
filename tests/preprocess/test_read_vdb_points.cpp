/* Tests the reader of OpenVDB points. The library writes grids of points with all codecs, and
 * without compression. Each point is compared with the one that was stored. */
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include <unistd.h>

#include <openvdb/openvdb.h>
#include <openvdb/points/PointAttribute.h>
#include <openvdb/points/PointConversion.h>

#include <csetjmp>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
extern "C" {
#include <cmocka.h>
#include "point_file.h"
}

#include "report.h"

namespace
{

using openvdb::Index64;
using openvdb::Vec3R;
using openvdb::Vec3s;
using Grid = openvdb::points::PointDataGrid;

constexpr const char *path = "test_read_vdb_points.vdb";
constexpr double voxel = 0.5;
constexpr size_t count = 20000;

struct Points {
    std::vector<Vec3R> positions;
    std::vector<Vec3s> colours;
    std::vector<float> radii;
};

Points make_points()
{
    Points p;
    std::mt19937 random(1);
    std::uniform_real_distribution<double> place(-30, 40), part(0, 1);
    for (size_t i = 0; i < count; i++) {
        p.positions.push_back(Vec3R(place(random), place(random) / 4, 5 + place(random) / 8));
        p.colours.push_back(Vec3s((float)part(random), (float)part(random), (float)part(random)));
        p.radii.push_back((float)part(random));
    }
    return p;
}

template <typename PositionCodec, typename ColourCodec, typename RadiusCodec>
Grid::Ptr make_grid(const Points &p, const openvdb::math::Transform &transform)
{
    namespace points = openvdb::points;
    points::PointAttributeVector<Vec3R> positions(p.positions);
    auto index =
        openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(positions, transform);
    auto grid = points::createPointDataGrid<PositionCodec, Grid>(*index, positions, transform);
    points::appendAttribute<Vec3s, ColourCodec>(grid->tree(), "Cd");
    points::appendAttribute<float, RadiusCodec>(grid->tree(), "pscale");
    points::appendAttribute<int32_t>(grid->tree(), "id");
    points::PointAttributeVector<Vec3s> colours(p.colours);
    points::PointAttributeVector<float> radii(p.radii);
    points::populateAttribute(grid->tree(), index->tree(), "Cd", colours);
    points::populateAttribute(grid->tree(), index->tree(), "pscale", radii);
    grid->setName("dust");
    return grid;
}

void write_file(const openvdb::GridBase::Ptr &grid, uint32_t compression)
{
    openvdb::io::File file(path);
    file.setCompression(compression);
    file.write(openvdb::GridPtrVec{ grid });
    file.close();
}

std::vector<trip_point> read_all(trip_point_file *f)
{
    std::vector<trip_point> out;
    trip_point batch[777];
    for (size_t got = 1; got > 0;) {
        assert_int_equal(trip_point_file_read(f, batch, 777, &got), 0);
        out.insert(out.end(), batch, batch + got);
    }
    return out;
}

/* Finds each stored point among the points that were read, by its radius and its position. */
void check(const Points &p, std::vector<trip_point> read, double place, double colour,
           double radius)
{
    assert_int_equal(read.size(), count);
    std::vector<size_t> order(count);
    for (size_t i = 0; i < count; i++)
        order[i] = i;
    std::sort(order.begin(), order.end(),
              [&](size_t a, size_t b) { return p.radii[a] < p.radii[b]; });
    std::sort(read.begin(), read.end(),
              [](const trip_point &a, const trip_point &b) { return a.radius < b.radius; });
    size_t matched = 0;
    for (size_t i = 0; i < count; i++) {
        /* Rounded radii may exchange neighbours, so a few places beside are tried. */
        bool found = false;
        for (size_t k = i > 200 ? i - 200 : 0; k < std::min(count, i + 200) && !found; k++) {
            const size_t n = order[i];
            double apart = 0;
            for (int a = 0; a < 3; a++)
                apart = std::max(apart, std::abs(read[k].position[a] - p.positions[n][a]));
            found = apart <= place && std::abs(read[k].radius - p.radii[n]) <= radius;
            for (int c = 0; c < 3 && found; c++)
                assert_true(std::abs(read[k].colour[c] - p.colours[n][c]) <= colour);
        }
        matched += found;
    }
    assert_int_equal(matched, count);
}

template <typename PositionCodec, typename ColourCodec, typename RadiusCodec>
void round_trip(double place, double colour, double radius, uint32_t compression)
{
    const Points p = make_points();
    auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    transform->postTranslate(openvdb::Vec3d(0.25, -1, 3));
    write_file(make_grid<PositionCodec, ColourCodec, RadiusCodec>(p, *transform), compression);
    trip_point_file *f;
    assert_true(trip_point_file_is(path));
    assert_int_equal(trip_point_file_open(path, &f), 0);
    assert_string_equal(trip_point_file_info(f)->format, "OpenVDB points");
    assert_string_equal(trip_point_file_info(f)->extras, "id");
    const auto first = read_all(f);
    check(p, first, place, colour, radius);
    assert_int_equal(trip_point_file_survey(f), 0);
    assert_int_equal(trip_point_file_info(f)->points, count);
    assert_int_equal(trip_point_file_info(f)->attributes, TRIP_POINT_COLOUR | TRIP_POINT_RADIUS);
    const auto second = read_all(f);
    assert_int_equal(first.size(), second.size());
    assert_memory_equal(first.data(), second.data(), first.size() * sizeof(trip_point));
    trip_point_file_close(f);
    unlink(path);
}

void test_points_without_loss(void **)
{
    using openvdb::points::NullCodec;
    const uint32_t compressions[] = { openvdb::io::COMPRESS_NONE, openvdb::io::COMPRESS_ZIP,
                                      openvdb::io::COMPRESS_BLOSC |
                                          openvdb::io::COMPRESS_ACTIVE_MASK };
    for (uint32_t compression : compressions)
        round_trip<NullCodec, NullCodec, NullCodec>(1e-5, 1e-7, 1e-7, compression);
}

void test_points_with_codecs(void **)
{
    using namespace openvdb::points;
    const uint32_t blosc = openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK;
    /* The library rounds down to steps of the codec. The margin is for the rounding of floats. */
    round_trip<FixedPointCodec<false>, FixedPointCodec<true, UnitRange>, NullCodec>(
        voxel / 65535 * 1.01 + 1e-6, 1.01 / 255, 1e-7, blosc);
    round_trip<FixedPointCodec<true>, FixedPointCodec<false, UnitRange>, TruncateCodec>(
        voxel / 255 * 1.01 + 1e-6, 1.01 / 65535 + 1e-7, 3e-4, blosc);
}

void test_volumes_are_no_points(void **)
{
    auto grid = openvdb::FloatGrid::create(0);
    grid->setName("density");
    grid->tree().setValue(openvdb::Coord(1, 2, 3), 1);
    write_file(grid, openvdb::io::COMPRESS_BLOSC);
    assert_false(trip_point_file_is(path));
    unlink(path);
}

int lines;

void count_line(const char *, void *)
{
    lines++;
}

/* Reads a file, which may be refused. Returns whether it was refused with one line. */
bool read_hostile()
{
    trip_point_file *f = nullptr;
    lines = 0;
    int status = trip_point_file_open(path, &f);
    trip_point batch[500];
    for (size_t got = 1; got > 0 && status == 0;)
        status = trip_point_file_read(f, batch, 500, &got);
    trip_point_file_close(f);
    assert_int_equal(lines, status < 0 ? 1 : 0);
    return status < 0;
}

void test_damaged_files_get_one_line(void **)
{
    using namespace openvdb::points;
    auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    Points p = make_points();
    for (auto *v : { &p.positions })
        v->resize(1500);
    p.colours.resize(1500);
    p.radii.resize(1500);
    write_file(make_grid<FixedPointCodec<false>, NullCodec, NullCodec>(p, *transform),
               openvdb::io::COMPRESS_BLOSC);
    std::ifstream in(path, std::ios::binary);
    const std::string good((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    std::mt19937 random(2);
    trip_report_redirect(count_line, nullptr);
    auto write = [&](const std::string &bytes) { std::ofstream(path, std::ios::binary) << bytes; };
    for (size_t bytes = 5; bytes < good.size(); bytes += good.size() / 60) {
        write(good.substr(0, bytes));
        assert_true(read_hostile());
    }
    int refused = 0;
    for (int i = 0; i < 400; i++) {
        std::string bytes = good;
        for (int k = 0; k < 3; k++)
            bytes[100 + random() % (bytes.size() - 100)] = (char)random();
        write(bytes);
        refused += read_hostile();
    }
    assert_true(refused > 40);
    trip_report_redirect(nullptr, nullptr);
    unlink(path);
}

} // namespace

int main()
{
    openvdb::initialize();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_points_without_loss),
        cmocka_unit_test(test_points_with_codecs),
        cmocka_unit_test(test_volumes_are_no_points),
        cmocka_unit_test(test_damaged_files_get_one_line),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
