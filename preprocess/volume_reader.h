/* What a file format implements. Two kinds: a slice reader only delivers whole slices in order
 * (volume.c keeps the neighbours, converts and replicates edges); a block reader does it all. */
#ifndef TRIP_VOLUME_READER_H
#define TRIP_VOLUME_READER_H

#include <stddef.h>

#include "volume.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_volume_reader {
    const char *format;
    /* Whether this reader should take the file: `head` holds its first `bytes` bytes (0 for a
     * folder or pattern). */
    bool (*probe)(const char *path, const unsigned char *head, size_t bytes,
                  const trip_volume_params *params);
    /* Calls visit(user, FILE) for `path` and each further file that it refers to, and returns what
     * it returned when that is negative. NULL: there are no others. */
    int (*list)(const char *path, int (*visit)(void *user, const char *file), void *user);
    /* Fills *info; *state is passed to the other calls. Reports and returns negative on failure. */
    int (*open)(const char *path, const trip_volume_params *params, trip_budget *budget,
                trip_volume_info *info, void **state);
    void (*close)(void *state);
    int (*rewind)(void *state);

    /* Slice readers: the next `count` slices, each dims[0] * dims[1] values of the stored type, in
     * the file's byte order. Short data is a reported failure. */
    int (*read_slices)(void *state, int64_t count, void *values);
    int (*skip_slices)(void *state, int64_t count); /* passes over them; NULL: they must be read */
    bool (*swap)(
        const void *state); /* slice readers: stored byte order differs from the machine's */

    /* Block readers (read_slices NULL): as trip_volume_next, trip_block_decode, _release. decode
     * is called by many threads at once. */
    int (*next)(void *state, trip_volume_block *block);
    int (*decode)(const void *state, const trip_volume_block *block, const int64_t lo[3],
                  const int64_t size[3], float *values, uint8_t *active);
    void (*release)(void *state, trip_volume_block *block);
} trip_volume_reader;

/* By content, then name; refuses options that are not for the format. */
int trip_volume_choose_reader(const trip_volume_reader **out, const char *path,
                              const trip_volume_params *params);

/* Reports and returns negative unless each of dims is at least 1 and the volume's bytes can be
 * counted in an int64_t. volume.c asks it of every volume; readers that compute sizes ask first. */
int trip_volume_check_dims(const char *path, const trip_volume_info *info);

/* `count` stored values, in the other byte order if `swap`, to slope * stored + inter, which is
 * computed in double and rounded once. */
void trip_scalar_decode(trip_scalar type, bool swap, double slope, double inter, const void *stored,
                        size_t count, float *values);

extern const trip_volume_reader trip_read_vdb;    /* read_vdb.cpp */
extern const trip_volume_reader trip_read_nrrd;   /* read_nrrd.c */
extern const trip_volume_reader trip_read_nifti;  /* read_nifti.c */
extern const trip_volume_reader trip_read_vol;    /* read_vol.c */
extern const trip_volume_reader trip_read_images; /* read_images.c */
extern const trip_volume_reader trip_read_raw;    /* read_raw.c */

#ifdef __cplusplus
}
#endif

#endif
