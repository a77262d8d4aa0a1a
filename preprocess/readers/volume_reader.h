/* The interface that each file format implements, in one of two ways. A slice reader delivers whole
 * slices in order; volume.c keeps neighbouring slices, converts values and repeats edges. A portion
 * reader does all of this itself. One thread at a time may use a reader, except for decode(). */
#ifndef TRIP_VOLUME_READER_H
#define TRIP_VOLUME_READER_H

#include <stddef.h>

#include "budget.h"
#include "volume_info.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_volume_reader {
    const char *format;
    /* Returns whether the file is of this format. `head` holds its first `bytes` bytes, 0 for a
     * folder or a pattern. */
    bool (*probe)(const char *path, const unsigned char *head, size_t bytes,
                  const trip_volume_params *params);
    /* Calls visit(user, FILE) for `path` and for each file that it refers to. Stops at a negative
     * result and returns it. NULL if the format has no other files. */
    int (*list)(const char *path, int (*visit)(void *user, const char *file), void *user);
    /* Reads the headers, fills *info and creates *state for the other calls. Reports failures and
     * returns a negative status. */
    int (*open)(const char *path, const trip_volume_params *params, trip_budget *budget,
                trip_volume_info *info, void **state);
    bool decompresses; /* reads compressed files */
    void (*close)(void *state);
    int (*rewind)(void *state);

    /* Slice readers only. Reads the next `count` slices, each dims[0] * dims[1] values of the
     * stored type in the file's byte order. Fails if the data end early. */
    int (*read_slices)(void *state, int64_t count, void *values);
    /* Skips the next `count` slices. NULL if slices must be read. */
    int (*skip_slices)(void *state, int64_t count);
    /* Returns whether the stored byte order differs from the machine's. */
    bool (*swap)(const void *state);

    /* Portion readers only, with read_slices NULL. Like trip_volume_next(), trip_portion_decode()
     * and trip_portion_release(). Many threads call decode() at once, with boxes anywhere in the
     * grid. */
    int (*next)(void *state, trip_volume_portion *portion);
    int (*decode)(const void *state, const trip_volume_portion *portion, const int64_t lo[3],
                  const int64_t size[3], float *values, uint8_t *active);
    void (*release)(void *state, trip_volume_portion *portion);
} trip_volume_reader;

/* Chooses a reader by content, then by name. Refuses options that do not apply to the format. */
int trip_volume_choose_reader(const trip_volume_reader **out, const char *path,
                              const trip_volume_params *params);

extern const trip_volume_reader trip_read_vdb; /* loads vdb/ */
extern const trip_volume_reader trip_read_nrrd;
extern const trip_volume_reader trip_read_nifti;
extern const trip_volume_reader trip_read_netcdf;
extern const trip_volume_reader trip_read_netcdf4;
extern const trip_volume_reader trip_read_vol;
extern const trip_volume_reader trip_read_images;
extern const trip_volume_reader trip_read_raw;
extern const trip_volume_reader trip_read_memory; /* of trip_volume_params.memory; has no probe() */

#ifdef __cplusplus
}
#endif

#endif
