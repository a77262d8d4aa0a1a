/* Slices out of one byte stream, or of several one after the other: all that a dense format needs
 * to do once it has read its header. The functions below fit trip_volume_reader as they are. */
#ifndef TRIP_DENSE_FILE_H
#define TRIP_DENSE_FILE_H

#include "byte_stream.h"
#include "volume_reader.h"

/* Opens the `count` sources, whose sizes are filled in here: the volume described by *info (dims
 * and type) divided by `count`. swap: the file's byte order is not the machine's. *state is for
 * the calls below. */
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
