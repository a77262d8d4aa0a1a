#include "slice_stack.h"

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
                                         trip_format_bytes(bytes, needed) +
                                         " of memory, but only " +
                                         trip_format_bytes(trip_budget_left_bytes(budget), left) +
                                         " are left; raise --memory");
    budget_ = budget;
    bytes_ = bytes;
}

void trip_check_entry(const std::string &file, const char *what, int64_t index, int64_t count)
{
    char why[TRIP_ENTRY_WHY_BYTES];
    if (!trip_entry_exists(why, what, index, count))
        throw trip_slice_error(file, why, TRIP_USAGE);
}
