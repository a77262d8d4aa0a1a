#include "helper_slices.h"

#include <stdlib.h>
#include <string.h>

#include "report.h"

trip_helper_slices *trip_helper_slices_create(const char *path, trip_budget *budget)
{
    const size_t path_bytes = strlen(path) + 1;
    trip_helper_slices *s = calloc(1, sizeof *s + path_bytes);
    if (!s) {
        trip_fail(TRIP_ERROR, "read", path, "no memory to open it");
        return NULL;
    }
    memcpy(s->path, path, path_bytes);
    s->budget = budget;
    return s;
}

int trip_helper_slices_reserve(trip_helper_slices *s, const int64_t dims[3], trip_scalar type,
                               uint64_t helper_bytes)
{
    if (__builtin_mul_overflow((uint64_t)dims[0], (uint64_t)dims[1], &s->slice_bytes) ||
        __builtin_mul_overflow(s->slice_bytes, trip_scalar_bytes(type), &s->slice_bytes) ||
        __builtin_add_overflow(s->slice_bytes, helper_bytes, &s->reserved_bytes))
        return trip_fail(TRIP_ERROR, "read", s->path, "has slices of an impossible size");
    s->reserved = trip_budget_take(s->budget, s->reserved_bytes);
    if (s->reserved)
        return 0;
    char needed[32], left[32];
    trip_format_bytes(s->reserved_bytes, needed);
    trip_format_bytes(trip_budget_left_bytes(s->budget), left);
    return trip_fail(TRIP_ERROR, "read", s->path,
                     "its slices need %s, but %s are left; raise --memory", needed, left);
}

void trip_helper_slices_close(void *slices)
{
    trip_helper_slices *s = slices;
    trip_image_helper_stop(s->helper);
    trip_budget_release(s->budget, s->reserved, s->reserved_bytes);
    free(s);
}

int trip_helper_slices_rewind(void *slices)
{
    ((trip_helper_slices *)slices)->next = 0;
    return 0;
}

int trip_helper_slices_skip(void *slices, int64_t count)
{
    ((trip_helper_slices *)slices)->next += count;
    return 0;
}

int trip_helper_slices_read(void *slices, int64_t count, void *values)
{
    trip_helper_slices *s = slices;
    for (int64_t i = 0; i < count; i++) {
        const int64_t numbers[5] = { s->next++ };
        int status =
            trip_image_helper_request(s->helper, TRIP_IMAGE_READ_SLICE, s->path, numbers, -1);
        if (status == 0)
            status = trip_image_helper_expect(s->helper, s->slice_bytes);
        if (status == 0)
            status = trip_image_helper_receive(
                s->helper, (char *)values + (size_t)i * s->slice_bytes, s->slice_bytes);
        if (status < 0)
            return status;
    }
    return 0;
}

bool trip_helper_slices_swap(const void *slices)
{
    (void)slices;
    return false;
}
