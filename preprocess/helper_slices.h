/* Slices that a helper program (image_helper.h) reads, one at a time: what readers of such formats
 * do once it has opened the file. The functions below without more to say fit into
 * trip_volume_reader. One thread at a time. */
#ifndef TRIP_HELPER_SLICES_H
#define TRIP_HELPER_SLICES_H

#include "image_helper.h"
#include "volume_reader.h"

typedef struct trip_helper_slices {
    trip_image_helper *helper; /* NULL: to be started */
    trip_budget *budget;
    void *reserved; /* budget for the helper's memory, never touched */
    size_t reserved_bytes;
    int64_t next; /* slice */
    size_t slice_bytes;
    char path[];
} trip_helper_slices;

/* NULL: there is no memory, which is reported. */
trip_helper_slices *trip_helper_slices_create(const char *path, trip_budget *budget);
/* Takes the helper's memory from the budget: one slice, and what it says that it uses. */
int trip_helper_slices_reserve(trip_helper_slices *s, const int64_t dims[3], trip_scalar type,
                               uint64_t helper_bytes);

void trip_helper_slices_close(void *slices);
int trip_helper_slices_rewind(void *slices);
int trip_helper_slices_skip(void *slices, int64_t count);
int trip_helper_slices_read(void *slices, int64_t count, void *values);
/* Never: it delivers the machine's byte order. */
bool trip_helper_slices_swap(const void *slices);

#endif
