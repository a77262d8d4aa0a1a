/* Reads the transform of a grid of OpenVDB. It may throw. */
#ifndef TRIP_VDB_TRANSFORM_H
#define TRIP_VDB_TRANSFORM_H

#include <openvdb/openvdb.h>

#include "vdb_file.h"

inline openvdb::math::Transform::Ptr trip_vdb_read_transform(trip_vdb_stream &is)
{
    int64_t start = is.tellg();
    is.get_string(1024); /* the transform's name; the library does not check its length */
    is.seekg(start);
    auto transform = openvdb::math::Transform::createLinearTransform();
    transform->read(is);
    if (!transform->isLinear())
        throw trip_vdb_error("its voxels lie in a frustum, which cannot be drawn: resample "
                             "the grid");
    return transform;
}

#endif
