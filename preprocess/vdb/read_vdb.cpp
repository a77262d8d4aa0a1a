/* Reads OpenVDB grids, as a portion reader. Opening reads the grid's tree and checks its leaves
 * without reading their values. Decoding a portion reads the values.
 *
 * Memory counted against the budget before it is allocated:
 * - about 130 bytes for each leaf of up to 512 voxels,
 * - 32 KiB for each 128-voxel cube in use,
 * - 256 KiB for each 4096-voxel cube,
 * - 16 bytes for each portion.
 *
 * Each decoding thread also holds one leaf and a 16 KiB buffer. */
#include <cmath>
#include <cstring>
#include <memory>
#include <new>
#include <string>

#include <openvdb/openvdb.h>

#include "module.h"
#include "report.h"
#include "vdb_grid.h"
#include "vdb_transform.h"

namespace
{

struct State {
    State(const char *file) : path(file), fd(file)
    {
    }
    std::string path;
    trip_vdb_fd fd;
    std::unique_ptr<trip_vdb_grid> grid;
    size_t next = 0; /* index of the next box */
};

/* Runs body(). Reports every exception as a failure. */
template <typename Body> int guard(const std::string &path, const Body &body)
try {
    return body();
} catch (const trip_vdb_error &e) {
    return trip_fail(e.status, "read", path.c_str(), "%s", e.what());
} catch (const std::bad_alloc &) {
    return trip_fail(TRIP_ERROR, "read", path.c_str(), "out of memory for its tree");
} catch (const std::exception &e) {
    return trip_fail(TRIP_ERROR, "read", path.c_str(), "is corrupt or unsupported: %s", e.what());
}

std::string list_grids(const trip_vdb_contents &contents)
{
    std::string list;
    for (size_t i = 0; i < contents.grids.size() && i < 20; i++)
        list += (i ? ", " : "") + contents.grids[i].name + " (" + contents.grids[i].type + ")";
    return list + (contents.grids.size() > 20 ? ", ..." : "");
}

const trip_vdb_entry &find_grid(const trip_vdb_contents &contents, const char *wanted)
{
    for (const trip_vdb_entry &entry : contents.grids) {
        if (entry.name != wanted)
            continue;
        if (!trip_vdb_is_scalar(entry))
            throw trip_vdb_error("grid \"" + entry.name + "\" holds " + entry.type +
                                 ", not scalars; the file contains: " + list_grids(contents));
        return entry;
    }
    throw trip_vdb_error(std::string("has no grid \"") + wanted +
                             "\"; the file contains: " + list_grids(contents) +
                             (contents.has_offsets ? "" : " and perhaps more, as it is a stream"),
                         TRIP_USAGE);
}

/* Also returns false for a damaged grid; opening that grid will report the damage. */
bool is_fog(trip_vdb_stream &is, const trip_vdb_contents &contents, const trip_vdb_entry &entry)
try {
    return trip_vdb_read_head(is, contents, entry).grid_class == "fog volume";
} catch (const std::exception &) {
    is.clear();
    return false;
}

/* Chooses "density", the usual name in smoke and clouds; else the first fog volume; else the first
 * scalar grid. */
const trip_vdb_entry &choose_grid(trip_vdb_stream &is, const trip_vdb_contents &contents)
{
    const trip_vdb_entry *first = nullptr, *fog = nullptr;
    for (const trip_vdb_entry &entry : contents.grids) {
        if (!trip_vdb_is_scalar(entry))
            continue;
        if (entry.name == "density" || entry.name == "density[0]")
            return entry;
        if (!fog && is_fog(is, contents, entry))
            fog = &entry;
        if (!first)
            first = &entry;
    }
    if (!first)
        throw trip_vdb_error("has no scalar grid; it contains: " + list_grids(contents));
    return fog ? *fog : *first;
}

/* Returns the map from (i, j, k), counted from `lo`, to world space. OpenVDB's matrices act on row
 * vectors. */
trip_affine index_to_world(const openvdb::math::Transform &transform, const int32_t lo[3])
{
    openvdb::Mat4d m = transform.baseMap()->getAffineMap()->getMat4();
    trip_affine a = {};
    for (int r = 0; r < 3; r++) {
        a.m[r][3] = m(3, r);
        for (int c = 0; c < 3; c++) {
            a.m[r][c] = m(c, r);
            a.m[r][3] += m(c, r) * lo[c];
        }
    }
    return a;
}

trip_vdb_conversion choose_conversion(const trip_vdb_head &head, const trip_vdb_entry &entry,
                                      trip_level_set_mode wanted,
                                      const openvdb::math::Transform &transform)
{
    bool real = entry.type == "float" || entry.type == "double";
    bool is_set = head.grid_class == "level set";
    const std::string grid = "grid \"" + entry.name + "\" ";
    if (wanted == TRIP_LEVEL_SET_UNSET && is_set)
        wanted = TRIP_LEVEL_SET_FILLED;
    if (wanted != TRIP_LEVEL_SET_UNSET && is_set && !real)
        throw trip_vdb_error(grid + "is a level set of " + entry.type +
                             "; only level sets of float and double can be read");
    if (wanted != TRIP_LEVEL_SET_UNSET && (head.grid_class == "fog volume" || !real))
        throw trip_vdb_error(grid + "is not a level set, so --level-set does not apply",
                             TRIP_USAGE);
    double volume = std::fabs(transform.baseMap()->getAffineMap()->determinant());
    if (wanted == TRIP_LEVEL_SET_FILLED && !(volume > 0 && std::isfinite(volume)))
        throw trip_vdb_error(grid + "has a singular map from index space to world space");
    return { wanted, std::cbrt(volume) };
}

/* Moves the stream to the grid's tree. A grid with a parent has its own metadata and transform, but
 * uses the parent's tree. */
void seek_tree(trip_vdb_stream &is, const trip_vdb_contents &contents, const trip_vdb_entry &entry,
               trip_vdb_head &head)
{
    if (entry.parent.empty())
        return;
    for (const trip_vdb_entry &other : contents.grids)
        if (other.unique_name == entry.parent && other.parent.empty() && other.type == entry.type &&
            other.half == entry.half) {
            head.compression = trip_vdb_read_head(is, contents, other).compression;
            trip_vdb_read_transform(is);
            return;
        }
    throw trip_vdb_error("is corrupt: grid \"" + entry.name +
                         "\" shares the tree of a missing grid");
}

/* Describes the choices that neither the file nor the options decide. */
void write_note(const trip_vdb_contents &contents, const trip_vdb_entry &entry,
                const trip_vdb_conversion &conversion, const trip_volume_params &params,
                trip_volume_info *info)
{
    std::string note, others;
    if (!params.grid && contents.grids.size() > 1) {
        for (const trip_vdb_entry &other : contents.grids)
            if (&other != &entry && trip_vdb_is_scalar(other))
                others += (others.empty() ? "" : ", ") + other.name;
        if (others.size() > 200)
            others.replace(200, std::string::npos, "...");
        if (!others.empty())
            note = "grid \"" + entry.name + "\" is used; --grid selects another: " + others;
    }
    if (params.level_set == TRIP_LEVEL_SET_UNSET && conversion.mode == TRIP_LEVEL_SET_FILLED)
        note += (note.empty() ? "grid \"" + entry.name + "\"" : "; it") +
                " is a level set, drawn filled; --level-set band draws a shell";
    snprintf(info->note, sizeof info->note, "%s", note.c_str());
}

void fill_info(const State &state, const trip_vdb_entry &entry,
               const openvdb::math::Transform &transform, trip_volume_info *info)
{
    const trip_vdb_grid &grid = *state.grid;
    for (int a = 0; a < 3; a++)
        info->dims[a] = (int64_t)grid.hi[a] - grid.lo[a] + 1;
    info->index_to_world = index_to_world(transform, grid.lo);
    info->type = grid.type;
    info->slope = 1;
    info->inter = 0;
    info->sparse = true;
    info->background = grid.background;
    info->format = "openvdb";
    snprintf(info->name, sizeof info->name, "%s", entry.name.c_str());
}

/* OpenVDB itself has no up direction, so the program that wrote the file decides. */
const char *up_of(const std::string &creator)
{
    static const struct {
        const char *creator, *up;
    } customs[] = { { "Houdini", "+y" }, { "Maya", "+y" }, { "Blender", "+z" } };
    for (const auto &custom : customs)
        if (creator.find(custom.creator) != std::string::npos)
            return custom.up;
    return "";
}

int open_vdb(const char *path, const trip_volume_params *params, trip_budget *budget,
             trip_volume_info *info, void **out)
{
    return guard(path, [&] {
        static const bool initialized = (openvdb::initialize(), true);
        (void)initialized;
        auto state = std::make_unique<State>(path);
        const trip_vdb_contents contents = trip_vdb_read_contents(state->fd);
        trip_vdb_stream is(state->fd);
        openvdb::io::setVersion(is, { contents.library[0], contents.library[1] }, contents.version);
        const trip_vdb_entry &entry =
            params->grid ? find_grid(contents, params->grid) : choose_grid(is, contents);
        trip_vdb_head head = trip_vdb_read_head(is, contents, entry);
        auto transform = trip_vdb_read_transform(is);
        auto conversion = choose_conversion(head, entry, params->level_set, *transform);
        seek_tree(is, contents, entry, head);
        state->grid = trip_vdb_load(state->fd, is, contents, head, entry, conversion, budget);
        fill_info(*state, entry, *transform, info);
        snprintf(info->up, sizeof info->up, "%s",
                 up_of(head.creator.empty() ? contents.creator : head.creator));
        write_note(contents, entry, conversion, *params, info);
        *out = state.release();
        return 0;
    });
}

void close_vdb(void *state)
{
    delete (State *)state;
}

int rewind_vdb(void *state)
{
    ((State *)state)->next = 0;
    return 0;
}

int next_box(void *opaque, trip_volume_portion *portion)
{
    State &state = *(State *)opaque;
    const trip_vdb_grid &grid = *state.grid;
    if (state.next == grid.boxes.size())
        return 0;
    const trip_vdb_box &box = grid.boxes[state.next++];
    for (int a = 0; a < 3; a++) {
        portion->origin[a] = (int64_t)box.lo[a] - grid.lo[a];
        portion->size[a] = box.size[a];
    }
    portion->data = &state; /* must not be NULL; boxes own no memory */
    return 1;
}

int decode_box(const void *opaque, const trip_volume_portion *, const int64_t lo[3],
               const int64_t size[3], float *values, uint8_t *active)
{
    const State &state = *(const State *)opaque;
    const trip_vdb_grid &grid = *state.grid;
    return guard(state.path, [&] {
        int64_t at[3];
        for (int a = 0; a < 3; a++)
            at[a] = lo[a] + grid.lo[a];
        grid.decode(at, size, values, active);
        return 0;
    });
}

void release_box(void *, trip_volume_portion *)
{
}

} // namespace

extern "C" const trip_volume_reader trip_vdb_reader = {
    .format = "openvdb",
    .probe = nullptr,
    .list = nullptr,
    .open = open_vdb,
    .decompresses = false,
    .close = close_vdb,
    .rewind = rewind_vdb,
    .read_slices = nullptr,
    .skip_slices = nullptr,
    .swap = nullptr,
    .next = next_box,
    .decode = decode_box,
    .release = release_box,
};
