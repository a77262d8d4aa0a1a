/* The distinct values of a volume of labels. Integers of 32 and 64 bits do not fit in floats, and
 * 16-bit codes over their range merge them. The reader therefore reads such a volume as ranks. The
 * rank of an id is the number of smaller ids in the volume.
 *
 * A key stands for an integer and ascends with it. */
#ifndef TRIP_IDS_H
#define TRIP_IDS_H

#include "budget.h"
#include "volume_info.h"

enum { TRIP_IDS_MAX = 65535, TRIP_IDS_NUMBERS = 16384 };

/* A key, the number of its voxels, and the number of its voxels that follow another one along x. */
typedef struct trip_id_entry {
    uint64_t key, voxels, equal;
} trip_id_entry;

/* The distinct keys that one thread has met. All zero is empty. */
typedef struct trip_id_set {
    trip_id_entry *entries; /* a hash table of `room`, from the budget; free ones have no voxels */
    uint32_t room, count;
    bool many;              /* there are more than TRIP_IDS_MAX; the table is empty */
    bool other;             /* there are values other than integers */
    bool starved;           /* memory was exhausted */
    uint64_t voxels, equal; /* sums over all keys but 0 */
} trip_id_set;

/* Returns the key of an integer value, for float types. Sets *integer to false for other values. */
uint64_t trip_id_key(double value, bool *integer);
/* Adds the keys of a row. */
void trip_id_set_add_row(trip_id_set *s, const uint64_t *keys, size_t count, uint64_t zero,
                         trip_budget *budget);
void trip_id_set_add(trip_id_set *s, const trip_id_set *other, trip_budget *budget);
void trip_id_set_free(trip_id_set *s, trip_budget *budget);

/* The ids of a volume. */
typedef struct trip_ids {
    uint32_t count; /* number of ids; 0 means that the values are no ids */
    /* If there are too many ids, id k is read as a number from 1 to TRIP_IDS_NUMBERS - 1, and 0 as
     * 0. Then `keys` is NULL, and `values` are the numbers. */
    bool numbered;
    uint64_t zero;  /* key of 0 */
    uint64_t *keys; /* ascending or, with `descending`, the reverse */
    bool descending;
    double *values; /* strictly ascending */
} trip_ids;

/* Whether the keys of a set are labels by intent: the voxels of most keys lie together. */
bool trip_id_set_coherent(const trip_id_set *s);
/* Makes the ids of a set. Takes memory from the budget. */
int trip_ids_make(trip_ids *out, const trip_id_set *s, const trip_volume_info *info,
                  const char *path, trip_budget *budget);
void trip_ids_free(trip_ids *ids, trip_budget *budget);

/* Replaces keys with ranks, as floats. An unknown key gives NaN. */
void trip_ids_ranks(const trip_ids *ids, const uint64_t *keys, size_t count, float *ranks);

#endif
