#include "write_vdb.h"

#include <openvdb/openvdb.h>

#include <exception>

extern "C" {
#include "report.h"
}

struct trip_vdb_writer {
    openvdb::FloatGrid::Ptr grid;
};

int trip_vdb_writer_create(trip_vdb_writer **out, double voxel_size)
try {
    openvdb::initialize();
    auto grid = openvdb::FloatGrid::create(0.0f);
    grid->setName("density");
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel_size));
    *out = new trip_vdb_writer{ grid };
    return TRIP_OK;
} catch (const std::exception &e) {
    return trip_fail(TRIP_ERROR, "generate", "vdb", "%s", e.what());
}

int trip_vdb_writer_leaf(trip_vdb_writer *w, const int64_t origin[3], const float *values)
try {
    const openvdb::Coord first{ openvdb::Int32(origin[0]), openvdb::Int32(origin[1]),
                                openvdb::Int32(origin[2]) };
    openvdb::FloatTree::LeafNodeType *leaf = nullptr;
    for (int n = 0; n < 512; n++) {
        if (!(values[n] > 0))
            continue;
        if (!leaf)
            leaf = w->grid->tree().touchLeaf(first);
        leaf->setValueOn(openvdb::Coord(n & 7, n >> 3 & 7, n >> 6), values[n]);
    }
    return TRIP_OK;
} catch (const std::exception &e) {
    return trip_fail(TRIP_ERROR, "generate", "vdb", "%s", e.what());
}

int trip_vdb_writer_save(trip_vdb_writer *w, const char *path)
try {
    openvdb::io::File file(path);
    file.write({ w->grid });
    file.close();
    return TRIP_OK;
} catch (const std::exception &e) {
    return trip_fail(TRIP_ERROR, "generate", path, "%s", e.what());
}

void trip_vdb_writer_destroy(trip_vdb_writer *w)
{
    delete w;
}
