/* Reads volumes of all formats: grids of scalar values with an affine map to world space. The
 * values arrive once, front to back, in portions small enough for memory. Opening reads headers
 * only. One file per format implements trip_volume_reader; volume.c selects it by content, then by
 * name.
 *
 * One thread calls trip_volume_next(). Any thread may decode and release the portions that it
 * returned. A portion lives until it is released. */
#ifndef TRIP_VOLUME_H
#define TRIP_VOLUME_H

#include "budget.h"
#include "ids.h"
#include "volume_info.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct trip_volume trip_volume;

/* Opens a volume. `path` may be a file, a folder, or a printf-like or glob pattern of slices.
 * Reports failures. */
int trip_volume_open(trip_volume **out, const char *path, const trip_volume_params *params,
                     trip_budget *budget);
const trip_volume_info *trip_volume_get_info(const trip_volume *v);
void trip_volume_close(trip_volume *v);
/* Sets the fill values. Decoding turns them into NaN. */
void trip_volume_set_fills(trip_volume *v, const trip_fills *fills);
/* Adds to the note for the user. */
void trip_volume_add_note(trip_volume *v, const char *note);
/* From now on, decoding gives ranks instead of values, and NaN for other values. The ids must exist
 * until the volume is closed. Dense volumes only. */
void trip_volume_set_ids(trip_volume *v, const trip_ids *ids);

/* Starts again at the first portion. All portions must have been released. */
int trip_volume_rewind(trip_volume *v);
/* Fills *portion and returns 1, or returns 0 after the last portion. Reports failures and returns a
 * negative status. A portion of a dense volume has `slices_hint` slices, fewer at the end; 0 lets
 * the reader choose. In memory it has one more slice on each side. */
int trip_volume_next(trip_volume *v, int64_t slices_hint, trip_volume_portion *portion);
/* Skips slices before the next portion without reading them. Returns the number of skipped slices:
 * `slices`, or fewer at the end. Returns 0 if the format can only read past slices. Reports
 * failures and returns a negative status. */
int64_t trip_volume_skip(trip_volume *v, int64_t slices);
/* Decodes the box [lo, lo + size) to float32, i fastest, into size[0] * size[1] * size[2] entries
 * of `values`. If `active` is not NULL, sets its entries to 1 for voxels that exist, else 0.
 *
 * The box may exceed the portion by one voxel on every side. Outside the volume, voxels are not
 * active; values repeat the border voxel (dense) or are the background (sparse). */
int trip_portion_decode(const trip_volume *v, const trip_volume_portion *portion,
                        const int64_t lo[3], const int64_t size[3], float *values, uint8_t *active);
/* Gets the keys (ids.h) of `count` voxels from voxel `at` on along i. Only for integers in a dense
 * volume, inside the portion. */
void trip_portion_keys(const trip_volume *v, const trip_volume_portion *portion,
                       const int64_t at[3], int64_t count, uint64_t *keys);
/* Releases a portion. The volume keeps the memory of one released portion for the next, until it is
 * rewound or closed. */
void trip_portion_release(trip_volume *v, trip_volume_portion *portion);

#ifdef __cplusplus
}
#endif

#endif
