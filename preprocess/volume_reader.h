/* What a file format implements, in one of two ways. A slice reader delivers whole slices in order;
 * volume.c keeps neighbouring slices, converts values and repeats edges. A portion reader does all
 * of this itself. One thread at a time, but for decode(). */
#ifndef TRIP_VOLUME_READER_H
#define TRIP_VOLUME_READER_H

#include <stddef.h>

#include "volume.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_volume_reader {
    const char *format;
    /* Whether the file is of this format; `head` holds its first `bytes` bytes (0 for a folder or a
     * pattern). */
    bool (*probe)(const char *path, const unsigned char *head, size_t bytes,
                  const trip_volume_params *params);
    /* Calls visit(user, FILE) for `path` and for each file that it refers to; ends with the first
     * negative result, which it returns. NULL: the format has no other files. */
    int (*list)(const char *path, int (*visit)(void *user, const char *file), void *user);
    /* Reads the headers and fills *info; *state is passed to the other calls. Reports failures and
     * returns negative. */
    int (*open)(const char *path, const trip_volume_params *params, trip_budget *budget,
                trip_volume_info *info, void **state);
    void (*close)(void *state);
    int (*rewind)(void *state);

    /* Slice readers: reads the next `count` slices, each dims[0] * dims[1] values of the stored
     * type in the file's byte order. Data that ends early is a reported failure. */
    int (*read_slices)(void *state, int64_t count, void *values);
    /* Skips the next `count` slices; NULL: they have to be read. */
    int (*skip_slices)(void *state, int64_t count);
    /* Whether the stored byte order differs from the machine's. */
    bool (*swap)(const void *state);

    /* Portion readers (read_slices NULL): as trip_volume_next, trip_portion_decode, _release.
     * decode is called by many threads at once, and takes boxes anywhere in the grid. */
    int (*next)(void *state, trip_volume_portion *portion);
    int (*decode)(const void *state, const trip_volume_portion *portion, const int64_t lo[3],
                  const int64_t size[3], float *values, uint8_t *active);
    void (*release)(void *state, trip_volume_portion *portion);
} trip_volume_reader;

/* Chooses by content, then by name; refuses options that do not apply to the format. */
int trip_volume_choose_reader(const trip_volume_reader **out, const char *path,
                              const trip_volume_params *params);

/* Reports and returns negative unless each of dims is at least 1 and the volume's bytes can be
 * counted in an int64_t. volume.c checks every volume; readers that compute sizes check first. */
int trip_volume_check_dims(const char *path, const trip_volume_info *info);

/* Converts `count` stored values, of the other byte order if `swap`, to slope * stored + inter,
 * which is computed in double precision and rounded once. */
void trip_scalar_decode(trip_scalar type, bool swap, double slope, double inter, const void *stored,
                        size_t count, float *values);

extern const trip_volume_reader trip_read_vdb;     /* read_vdb.c, which loads vdb/ */
extern const trip_volume_reader trip_read_nrrd;    /* read_nrrd.c */
extern const trip_volume_reader trip_read_nifti;   /* read_nifti.c */
extern const trip_volume_reader trip_read_netcdf;  /* read_netcdf.c */
extern const trip_volume_reader trip_read_netcdf4; /* read_netcdf4.c */
extern const trip_volume_reader trip_read_vol;     /* read_vol.c */
extern const trip_volume_reader trip_read_images;  /* read_images.c */
extern const trip_volume_reader trip_read_raw;     /* read_raw.c */

#ifdef __cplusplus
}
#endif

#endif
