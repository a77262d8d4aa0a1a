/* Reads slices from one byte stream or from several in sequence: what a reader of a dense format
 * does after its header. The functions below fit into trip_volume_reader. One thread at a time. */
#ifndef TRIP_DENSE_FILE_H
#define TRIP_DENSE_FILE_H

#include "byte_stream.h"
#include "volume_reader.h"

/* Opens `count` sources, each of which holds an equal part of the volume that *info describes (dims
 * and type); their size_bytes are filled in here. swap: the files' byte order is not the machine's.
 * *state is for the calls below. */
int trip_dense_open(void **state, const trip_byte_source *sources, int64_t count,
                    const trip_volume_info *info, bool swap);

void trip_dense_close(void *state);
int trip_dense_rewind(void *state);
int trip_dense_read_slices(void *state, int64_t count, void *values);
int trip_dense_skip_slices(void *state, int64_t count);
bool trip_dense_swap(const void *state);

/* Whether this machine stores the most significant byte first. */
bool trip_machine_is_big_endian(void);

#endif
