/* Reads slices from one or several byte streams in sequence. Readers of dense formats use it after
 * their header. The functions fit into trip_volume_reader. One thread at a time. */
#ifndef TRIP_DENSE_FILE_H
#define TRIP_DENSE_FILE_H

#include "byte_stream.h"
#include "volume_reader.h"

/* The other axes of files that hold more than one value per voxel, or more than one volume. An axis
 * of each place may have any number of entries, of which the volume takes one. */
typedef enum trip_dense_place {
    TRIP_DENSE_IN_VOXEL,      /* faster than i, such as the components of a vector */
    TRIP_DENSE_BETWEEN_I_J,   /* slower than i, faster than j */
    TRIP_DENSE_BETWEEN_J_K,   /* slower than j, faster than k */
    TRIP_DENSE_AFTER_VOLUMES, /* slower than k, such as time */
    TRIP_DENSE_PLACES
} trip_dense_place;

typedef struct trip_dense_layout {
    int64_t count[TRIP_DENSE_PLACES]; /* entries; at least 1 */
    int64_t index[TRIP_DENSE_PLACES]; /* the entry that is taken */
    /* The entries in a voxel are red, green and blue, possibly with more after them, in the type
     * `stored`. The volume gets their luma, of type float. */
    bool luma;
    trip_scalar stored;
} trip_dense_layout;

/* Opens `count` sources. Each holds an equal part of the values. These are the volume that *info
 * describes by dims and type, unless `layout` (may be NULL) tells of more. Sets the sources'
 * size_bytes. `swap` means that the files have the other byte order. *state is for the calls below.
 */
int trip_dense_open(void **state, const trip_byte_source *sources, int64_t count,
                    const trip_volume_info *info, const trip_dense_layout *layout, bool swap);

void trip_dense_close(void *state);
int trip_dense_rewind(void *state);
int trip_dense_read_slices(void *state, int64_t count, void *values);
int trip_dense_skip_slices(void *state, int64_t count);
bool trip_dense_swap(const void *state);

/* Returns whether this machine is big-endian. */
bool trip_machine_is_big_endian(void);

#endif
