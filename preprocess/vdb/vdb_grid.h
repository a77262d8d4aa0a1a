/* One scalar grid of an OpenVDB file as boxes of existing voxels. Memory holds the grid's tree
 * without the values of its leaves, the place of each leaf in the file, and the boxes. The values
 * of a box are read from the file when it is decoded. Everything here may throw; only read_vdb.cpp
 * includes it. */
#ifndef TRIP_VDB_GRID_H
#define TRIP_VDB_GRID_H

#include <memory>
#include <vector>

#include "vdb_file.h"
#include "volume.h"

/* A box of at most 64 voxels a side around existing voxels, in the grid's own coordinates. It
 * crosses no multiple of 64, so boxes do not overlap. */
struct trip_vdb_box {
    int32_t lo[3];
    uint8_t size[3];
};

/* Memory taken from the budget but never touched, in place of the memory that the library
 * allocates. */
class trip_vdb_reservation
{
  public:
    trip_vdb_reservation() = default;
    trip_vdb_reservation(const trip_vdb_reservation &) = delete;
    trip_vdb_reservation &operator=(const trip_vdb_reservation &) = delete;
    ~trip_vdb_reservation();
    /* Throws when it does not fit; `what` names the purpose in the message. Called once only. */
    void take(trip_budget *budget, uint64_t bytes, const char *stage);

  private:
    trip_budget *budget_ = nullptr;
    void *memory_ = nullptr;
    size_t bytes_ = 0;
};

/* How stored values become densities. */
struct trip_vdb_conversion {
    trip_level_set_mode mode; /* TRIP_LEVEL_SET_UNSET: values remain as they are */
    double voxel_world;       /* a voxel's side; distances are in world units */
};

class trip_vdb_grid
{
  public:
    virtual ~trip_vdb_grid() = default;
    /* Fills the values and, where not NULL, `active` of a box in the grid's coordinates; any
     * thread. */
    virtual void decode(const int64_t lo[3], const int64_t size[3], float *values,
                        uint8_t *active) const = 0;

    trip_scalar type;      /* as stored */
    double background = 0; /* after conversion */
    /* Of all existing voxels and one of the background around them, so that values interpolated
     * between voxels end there as they do in the library; inclusive. */
    int32_t lo[3], hi[3];
    std::vector<trip_vdb_box> boxes; /* sorted by their corner's k, then j, then i */
};

/* Whether a grid of this type ("float", "vec3s", ...) can be loaded. */
bool trip_vdb_is_scalar(const trip_vdb_entry &entry);

/* Loads the tree of `entry` from `is`, a stream of `fd` that is positioned there; `fd` must outlive
 * the grid. */
std::unique_ptr<trip_vdb_grid> trip_vdb_load(const trip_vdb_fd &fd, trip_vdb_stream &is,
                                             const trip_vdb_contents &contents,
                                             const trip_vdb_head &head, const trip_vdb_entry &entry,
                                             const trip_vdb_conversion &conversion,
                                             trip_budget *budget);

#endif
