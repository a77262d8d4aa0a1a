#include "write_vdb.h"

#include <openvdb/io/GridDescriptor.h>
#include <openvdb/openvdb.h>

#include <exception>
#include <fstream>
#include <memory>
#include <vector>

extern "C" {
#include "report.h"
}

namespace
{

using openvdb::Coord;
using Grid = openvdb::FloatGrid;
using Upper = Grid::TreeType::RootNodeType::ChildNodeType; /* 4096^3 voxels */
using Lower = Upper::ChildNodeType;                        /* 128^3 voxels */
using UpperMask = openvdb::util::NodeMask<Upper::LOG2DIM>;
static_assert(Lower::DIM == TRIP_VDB_CUBE, "the cube is a node");

const float background = 0;

struct Stopped {
    int status; /* already reported by the source */
};

/* Returns the origins of the nodes that intersect [first, end), in file order. */
std::vector<Coord> nodes(const Coord &first, const Coord &end, openvdb::Index dim)
{
    std::vector<Coord> origins;
    const int step = (int)dim;
    for (int x = first.x(); x < end.x(); x += step)
        for (int y = first.y(); y < end.y(); y += step)
            for (int z = first.z(); z < end.z(); z += step)
                origins.emplace_back(x, y, z);
    return origins;
}

/* Writes the same file as the library's File class without holding the whole tree. It writes the
 * two upper levels directly, and creates one lower node at a time. */
class CubeArchive : public openvdb::io::Archive
{
  public:
    CubeArchive(const Coord &dims, trip_vdb_source *source, void *user)
        : m_dims(dims), m_source(source), m_user(user), m_values(Lower::NUM_VOXELS)
    {
    }

    /* `grid` holds no voxels, only name, class and transform. */
    void write_grid(std::ostream &os, const Grid &grid)
    {
        const int32_t grid_count = 1;
        openvdb::io::GridDescriptor descriptor(grid.getName(), grid.type());
        writeHeader(os, true);
        openvdb::MetaMap().writeMeta(os);
        os.write((const char *)&grid_count, sizeof grid_count);
        descriptor.writeHeader(os);
        const std::streampos positions = os.tellp();
        descriptor.writeStreamPos(os);
        descriptor.setGridPos(os.tellp());
        setGridCompression(os, grid);
        grid.writeMeta(os);
        grid.writeTransform(os);
        write_topology(os);
        descriptor.setBlockPos(os.tellp());
        for (const Coord &origin : m_used)
            make_lower(origin)->writeBuffers(os, false);
        descriptor.setEndPos(os.tellp());
        os.seekp(positions);
        descriptor.writeStreamPos(os);
    }

  private:
    void write_topology(std::ostream &os)
    {
        const std::vector<Coord> uppers = nodes(Coord(0), m_dims, Upper::DIM);
        const int32_t buffers = 1;
        const openvdb::Index counts[2] = { 0, (openvdb::Index)uppers.size() }; /* tiles, children */
        os.write((const char *)&buffers, sizeof buffers);
        os.write((const char *)&background, sizeof background);
        openvdb::io::setGridBackgroundValuePtr(os, &background);
        os.write((const char *)counts, sizeof counts);
        for (const Coord &origin : uppers) {
            os.write((const char *)origin.data(), 3 * sizeof(openvdb::Int32));
            write_upper(os, origin);
        }
    }

    /* Writes the head twice, because the set of children is known only after them. */
    void write_upper(std::ostream &os, const Coord &origin)
    {
        UpperMask children;
        const std::streampos begin = os.tellp();
        write_upper_head(os, children);
        const Coord end = Coord::minComponent(m_dims, origin.offsetBy(Upper::DIM));
        for (const Coord &at : nodes(origin, end, Lower::DIM)) {
            const auto node = make_lower(at);
            if (node->isChildMaskOff())
                continue;
            node->writeTopology(os, false);
            children.setOn(Upper::coordToOffset(at));
            m_used.push_back(at);
        }
        const std::streampos after = os.tellp();
        os.seekp(begin);
        write_upper_head(os, children);
        os.seekp(after);
    }

    /* Its length does not depend on the mask, because no value is active. */
    static void write_upper_head(std::ostream &os, const UpperMask &children)
    {
        const UpperMask active;
        std::vector<float> values(Upper::NUM_VALUES, background);
        children.save(os);
        active.save(os);
        openvdb::io::writeCompressedValues(os, values.data(), Upper::NUM_VALUES, active, children,
                                           false);
    }

    std::unique_ptr<Lower> make_lower(const Coord &origin)
    {
        const Coord end = Coord::minComponent(m_dims, origin.offsetBy(Lower::DIM));
        const int64_t first[3] = { origin.x(), origin.y(), origin.z() };
        const int64_t size[3] = { end.x() - first[0], end.y() - first[1], end.z() - first[2] };
        int status = m_source(m_user, first, size, m_values.data());
        if (status != TRIP_OK)
            throw Stopped{ status };
        auto node = std::make_unique<Lower>(origin, background, false);
        const float *row = m_values.data();
        for (int z = origin.z(); z < end.z(); z++)
            for (int y = origin.y(); y < end.y(); y++, row += TRIP_VDB_CUBE)
                for (int x = origin.x(); x < end.x(); x++)
                    if (row[x - origin.x()] > 0)
                        node->setValueOn(Coord(x, y, z), row[x - origin.x()]);
        return node;
    }

    const Coord m_dims;
    trip_vdb_source *const m_source;
    void *const m_user;
    std::vector<float> m_values;
    std::vector<Coord> m_used; /* the lower nodes written */
};

} // namespace

int trip_vdb_write(const char *path, const int64_t dims[3], trip_vdb_source *source, void *user)
try {
    openvdb::initialize();
    Grid grid;
    grid.setName("density");
    grid.setGridClass(openvdb::GRID_FOG_VOLUME);
    std::ofstream file(path, std::ios::binary);
    if (!file)
        return trip_fail_errno("generate", path, "cannot create");
    file.exceptions(std::ios::badbit | std::ios::failbit);
    CubeArchive archive(Coord((int)dims[0], (int)dims[1], (int)dims[2]), source, user);
    archive.write_grid(file, grid);
    file.close();
    return TRIP_OK;
} catch (const Stopped &s) {
    return s.status;
} catch (const std::ios::failure &) {
    return trip_fail_errno("generate", path, "cannot write");
} catch (const std::exception &e) {
    return trip_fail(TRIP_ERROR, "generate", path, "%s", e.what());
}
