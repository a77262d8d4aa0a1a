/* Reads slices through a helper program (image_helper.h), one at a time. Readers use it once the
 * helper has opened the file. Functions without a comment fit into trip_volume_reader. One thread
 * at a time. */
#ifndef TRIP_HELPER_SLICES_H
#define TRIP_HELPER_SLICES_H

#include "image_helper.h"
#include "volume_reader.h"

typedef struct trip_helper_slices {
    trip_image_helper *helper; /* NULL until it is started */
    trip_budget *budget;
    void *reserved; /* budget reserved for the helper's memory, never touched */
    size_t reserved_bytes;
    int64_t next; /* index of the next slice */
    size_t slice_bytes;
    char path[];
} trip_helper_slices;

/* Returns NULL after a reported failure if memory is exhausted. */
trip_helper_slices *trip_helper_slices_create(const char *path, trip_budget *budget);
/* Reserves the helper's memory in the budget: one slice plus the amount it declares. */
int trip_helper_slices_reserve(trip_helper_slices *s, const int64_t dims[3], trip_scalar type,
                               uint64_t helper_bytes);

void trip_helper_slices_close(void *slices);
int trip_helper_slices_rewind(void *slices);
int trip_helper_slices_skip(void *slices, int64_t count);
int trip_helper_slices_read(void *slices, int64_t count, void *values);
/* Always false: the helper delivers the machine's byte order. */
bool trip_helper_slices_swap(const void *slices);

#endif
