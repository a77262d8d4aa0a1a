/* One scalar grid of an OpenVDB file as boxes of existing voxels. Memory holds the grid's tree
 * without the values of its leaves, the file offset of each leaf, and the boxes. Decoding a box
 * reads its values from the file. Everything here may throw. Only read_vdb.cpp includes it. */
#ifndef TRIP_VDB_GRID_H
#define TRIP_VDB_GRID_H

#include <memory>
#include <vector>

#include "budget.h"
#include "vdb_file.h"
#include "volume_info.h"

/* A box around existing voxels with at most 64 voxels on each side, in the grid's own coordinates.
 * It crosses no multiple of 64, so boxes do not overlap. */
struct trip_vdb_box {
    int32_t lo[3];
    uint8_t size[3];
};

/* Memory taken from the budget but never touched. It accounts for memory that the library
 * allocates. */
class trip_vdb_reservation
{
  public:
    trip_vdb_reservation() = default;
    trip_vdb_reservation(const trip_vdb_reservation &) = delete;
    trip_vdb_reservation &operator=(const trip_vdb_reservation &) = delete;
    ~trip_vdb_reservation();
    /* Throws if the bytes do not fit in the budget; `stage` names their purpose in the message.
     * Call it only once. */
    void take(trip_budget *budget, uint64_t bytes, const char *stage);

  private:
    trip_budget *budget_ = nullptr;
    void *memory_ = nullptr;
    size_t bytes_ = 0;
};

/* The conversion of stored values to densities. */
struct trip_vdb_conversion {
    trip_level_set_mode mode; /* TRIP_LEVEL_SET_UNSET keeps the values */
    double voxel_world;       /* side of a voxel in world units, the units of distances */
};

class trip_vdb_grid
{
  public:
    virtual ~trip_vdb_grid() = default;
    /* Fills the values and, if not NULL, `active` of a box in the grid's coordinates. Any thread
     * may call it. */
    virtual void decode(const int64_t lo[3], const int64_t size[3], float *values,
                        uint8_t *active) const = 0;

    trip_scalar type;      /* as stored */
    double background = 0; /* after conversion */
    /* Inclusive bounds of all existing voxels and one voxel of background around them. Interpolated
     * values then end at the background, as in the library. */
    int32_t lo[3], hi[3];
    std::vector<trip_vdb_box> boxes; /* sorted by k, then j, then i of their corner */
};

/* Returns whether a grid of this type ("float", "vec3s", ...) can be loaded. */
bool trip_vdb_is_scalar(const trip_vdb_entry &entry);

/* Loads the tree of `entry` from `is`, a stream of `fd` positioned at the tree. `fd` must outlive
 * the grid. */
std::unique_ptr<trip_vdb_grid> trip_vdb_load(const trip_vdb_fd &fd, trip_vdb_stream &is,
                                             const trip_vdb_contents &contents,
                                             const trip_vdb_head &head, const trip_vdb_entry &entry,
                                             const trip_vdb_conversion &conversion,
                                             trip_budget *budget);

#endif
