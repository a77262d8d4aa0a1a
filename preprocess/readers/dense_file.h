/* Reads slices from one or several byte streams in sequence. Readers of dense formats use it after
 * their header. The functions fit into trip_volume_reader. One thread at a time. */
#ifndef TRIP_DENSE_FILE_H
#define TRIP_DENSE_FILE_H

#include "byte_stream.h"
#include "volume_reader.h"

/* Opens `count` sources. Each holds an equal part of the volume that *info describes by dims and
 * type. Sets their size_bytes. `swap` means that the files have the other byte order. *state is for
 * the calls below. */
int trip_dense_open(void **state, const trip_byte_source *sources, int64_t count,
                    const trip_volume_info *info, bool swap);

void trip_dense_close(void *state);
int trip_dense_rewind(void *state);
int trip_dense_read_slices(void *state, int64_t count, void *values);
int trip_dense_skip_slices(void *state, int64_t count);
bool trip_dense_swap(const void *state);

/* Returns whether this machine is big-endian. */
bool trip_machine_is_big_endian(void);

#endif
