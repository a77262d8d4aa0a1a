/* The cache: the folder in which `render`, `view` and `serve` keep data sets of volumes. It is
 * $XDG_CACHE_HOME/triptych, else $HOME/.cache/triptych, or the folder that a link of this name
 * leads to. Its file names are the index. KEY is 32 hexadecimal digits. The first 20 are the
 * source: the volume and the options except for kept values. The others are the options for kept
 * values.
 *
 *   KEY.trip    a data set; its modification time is the time of its last use.
 *   STATE.link  a symbolic link from the state of a volume's files to the source of its data sets.
 *   KEY.quality the choices of quality for a data set, also for data sets outside the cache.
 *   KEY.lock, KEY.trip.partial, KEY.trip.spill, KEY.gone    while one is made or removed.
 *
 * Only the user may write in the folder. No operation follows a link in it, or removes anything
 * outside the folder. Any number of processes may use it at once. Each cache_folder belongs to one
 * thread. */
#ifndef TRIP_CLI_CACHE_FOLDER_H
#define TRIP_CLI_CACHE_FOLDER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* 32 hexadecimal digits and a terminating zero. */
typedef struct cache_key {
    char text[33];
} cache_key;

enum { CACHE_SOURCE_DIGITS = 20 };

/* The first digits of a key and a terminating zero. */
typedef struct cache_source {
    char text[CACHE_SOURCE_DIGITS + 1];
} cache_source;

typedef struct cache_folder {
    char *path;
    int fd;               /* -1 if the folder does not exist */
    uint64_t limit_bytes; /* for all data sets together */
} cache_folder;

typedef struct cache_entry {
    cache_key key;
    uint64_t bytes;
    int64_t used_ns; /* since 1970 */
} cache_entry;

/* The data sets that cache_folder_shrink() should have removed. */
typedef struct cache_left {
    size_t used, stuck; /* in use; cannot be removed */
    size_t making;      /* that other processes are making */
} cache_left;

/* Opens the folder, and creates it if `make` is true. Otherwise a missing folder is no failure, and
 * fd is -1. TRIPTYCH_CACHE_SIZE sets the limit; its default is a tenth of the disk, at least 4 GiB.
 * The caller closes the object even after a failure. */
int cache_folder_open(cache_folder *c, bool make);
void cache_folder_close(cache_folder *c);

/* Takes the digits from two texts of at least 20 digits each. */
cache_key cache_key_of(const char *source, const char *kept);
bool cache_key_has_source(const cache_key *key, const cache_source *source);

/* Returns the path of a data set; the caller frees it. Returns NULL after reporting that memory is
 * exhausted. */
char *cache_folder_path(const cache_folder *c, const cache_key *key);

/* Opens a data set's folder. The data set cannot be removed until the caller closes the descriptor.
 * Returns -1 if it does not exist. */
int cache_folder_hold(const cache_folder *c, const cache_key *key);

/* Finds the source that was remembered for a state; false if there is none. */
bool cache_folder_recall(const cache_folder *c, const cache_key *state, cache_source *source);
void cache_folder_remember(const cache_folder *c, const cache_key *state,
                           const cache_source *source);

/* Waits until no other process makes this data set, and calls `waiting` every 50 ms meanwhile. The
 * caller passes the descriptor to cache_folder_unlock(). A negative value is a reported failure. */
int cache_folder_lock(const cache_folder *c, const cache_key *key, void (*waiting)(void *user),
                      void *user);
void cache_folder_unlock(const cache_folder *c, const cache_key *key, int fd);
/* Makes room for a new data set: removes links and files from its place. The caller has the lock.
 * Fails if something remains. */
int cache_folder_make_room(const cache_folder *c, const cache_key *key);

/* Returns the folder's path for triptych_resources.choices_folder, for free(). Returns NULL without
 * a message if the folder cannot be used. */
char *cache_folder_choices(void);
/* Counts the files with choices, and their bytes. */
int cache_folder_count_choices(const cache_folder *c, size_t *count, uint64_t *bytes);

/* Lists all data sets, the least recently used first; the caller frees *out. */
int cache_folder_list(const cache_folder *c, cache_entry **out, size_t *count);
/* Returns false if the data set is in use or in the making, or cannot be removed. `locked` says
 * that the caller has the lock. */
bool cache_folder_remove(const cache_folder *c, const cache_key *key, bool locked);
/* Removes the least recently used data sets until all take at most `bytes`, then the leftovers of
 * killed processes. Removes all choices too if `bytes` is 0. Data sets in use or in the making
 * stay. `left` may be NULL. */
int cache_folder_shrink(const cache_folder *c, uint64_t bytes, cache_left *left);

#endif
