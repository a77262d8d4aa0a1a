/* Stacks of pictures as a slice reader: a folder, a pattern or one file with several slices.
 *
 * Voxel (i, j, k) is pixel i from the left in row j from the top of slice k. Without metadata
 * voxels are 1 apart; DICOM says how far, and where. */
#include <cstring>
#include <memory>
#include <new>
#include <string>

#include "report.h"
#include "slice_stack.h"
#include "volume_reader.h"

namespace
{

struct State {
    std::string path;
    std::unique_ptr<trip_slice_stack> stack;
    int64_t next = 0; /* slice */
};

/* Runs body(); no exception gets past, each becomes one line. */
template <typename Body> int guard(const std::string &path, const Body &body)
try {
    return body();
} catch (const trip_slice_error &e) {
    return trip_fail(e.status, "read", e.where.c_str(), "%s", e.what());
} catch (const std::bad_alloc &) {
    return trip_fail(TRIP_ERROR, "read", path.c_str(), "no memory to read its slices");
} catch (const std::exception &e) {
    return trip_fail(TRIP_ERROR, "read", path.c_str(), "%s", e.what());
}

bool probe(const char *, const unsigned char *head, size_t bytes, const trip_volume_params *)
{
    return bytes == 0 || trip_slice_kind_of(head, bytes) != trip_slice_kind::OTHER;
}

int open_images(const char *path, const trip_volume_params *, trip_budget *budget,
                trip_volume_info *info, void **out)
{
    return guard(path, [&] {
        trip_slice_files files = trip_slice_find(path);
        auto state = std::make_unique<State>();
        state->path = path;
        state->stack = files.kind == trip_slice_kind::DICOM ? trip_dicom_stack(files, budget)
                                                            : trip_picture_stack(files, budget);
        const trip_slice_stack &stack = *state->stack;
        std::memcpy(info->dims, stack.dims, sizeof info->dims);
        info->index_to_world = stack.index_to_world;
        info->type = stack.type;
        info->slope = stack.slope;
        info->inter = stack.inter;
        info->sparse = false;
        info->background = 0;
        info->format = "images";
        info->name[0] = 0;
        *out = state.release();
        return 0;
    });
}

void close_images(void *state)
{
    delete (State *)state;
}

int rewind_images(void *state)
{
    ((State *)state)->next = 0;
    return 0;
}

int read_slices(void *opaque, int64_t count, void *values)
{
    State &state = *(State *)opaque;
    trip_slice_stack &stack = *state.stack;
    size_t slice_bytes =
        (size_t)stack.dims[0] * (size_t)stack.dims[1] * trip_scalar_bytes(stack.type);
    return guard(state.path, [&] {
        for (int64_t k = 0; k < count; k++)
            stack.read(state.next++, (char *)values + (size_t)k * slice_bytes);
        return 0;
    });
}

/* OpenImageIO and DCMTK deliver the machine's byte order. */
bool swap_images(const void *)
{
    return false;
}

} // namespace

trip_slice_buffer::~trip_slice_buffer()
{
    if (memory_)
        trip_budget_release(budget_, memory_, bytes_);
}

void trip_slice_buffer::take(trip_budget *budget, const std::string &file, uint64_t bytes)
{
    char needed[32], left[32];
    memory_ = trip_budget_take(budget, bytes);
    if (!memory_)
        throw trip_slice_error(file, std::string("a slice needs ") +
                                         trip_format_bytes(bytes, needed) + ", but " +
                                         trip_format_bytes(trip_budget_left_bytes(budget), left) +
                                         " are left of the memory allowed; a larger --memory would "
                                         "do");
    budget_ = budget;
    bytes_ = bytes;
}

const trip_volume_reader trip_read_images = { "images",      probe,       open_images, close_images,
                                              rewind_images, read_slices, swap_images, nullptr,
                                              nullptr,       nullptr };
