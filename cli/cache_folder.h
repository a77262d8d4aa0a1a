/* The folder that `render` keeps data sets of volumes in: $XDG_CACHE_HOME/triptych, else
 * $HOME/.cache/triptych. The folder is the index; KEY is 32 hexadecimal digits:
 *
 *   KEY.trip                     a data set; its time of change is when it was last used
 *   KEY.link                     a symbolic link, to KEY: what a file in a known state has become
 *   KEY.lock, KEY.trip.partial, KEY.trip.spill, KEY.gone   while one is made or removed
 *
 * Only the user may write there, nothing outside of it is ever followed or removed, and any number
 * of processes may use it at once. One thread. */
#ifndef TRIP_CLI_CACHE_FOLDER_H
#define TRIP_CLI_CACHE_FOLDER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* 32 hexadecimal digits. */
typedef struct cache_key {
    char text[33];
} cache_key;

typedef struct cache_folder {
    char *path;
    int fd;               /* -1: there is none */
    uint64_t limit_bytes; /* for all data sets together */
} cache_folder;

typedef struct cache_entry {
    cache_key key;
    uint64_t bytes;
    int64_t used_ns; /* since 1970 */
} cache_entry;

/* Makes the folder if `make`; else fd is -1 where there is none. TRIPTYCH_CACHE_SIZE sets the
 * limit; without it, it is a tenth of the disk, at least 4 GiB. Close it also after a failure. */
int cache_folder_open(cache_folder *c, bool make);
void cache_folder_close(cache_folder *c);

/* Path of a data set, for free(); NULL once reported that memory is out. */
char *cache_folder_path(const cache_folder *c, const cache_key *key);

/* Opens a data set's folder, so that it stays while the descriptor is open, and notes that it was
 * used. -1: there is none. */
int cache_folder_hold(const cache_folder *c, const cache_key *key);

/* The key that was remembered for a state. */
bool cache_folder_recall(const cache_folder *c, const cache_key *state, cache_key *key);
void cache_folder_remember(const cache_folder *c, const cache_key *state, const cache_key *key);

/* Waits until no other process makes this data set; `waiting` is called now and then. The
 * descriptor goes to cache_folder_unlock(); negative: a reported failure. */
int cache_folder_lock(const cache_folder *c, const cache_key *key, void (*waiting)(void *user),
                      void *user);
void cache_folder_unlock(const cache_folder *c, const cache_key *key, int fd);

/* All data sets, the least recently used first; for free(). */
int cache_folder_list(const cache_folder *c, cache_entry **out, size_t *count);
/* False where it is in use, or cannot be removed. */
bool cache_folder_remove(const cache_folder *c, const cache_key *key);
/* Removes what was used least recently until all takes at most `bytes`, and what killed processes
 * left. Data sets in use stay. */
int cache_folder_shrink(const cache_folder *c, uint64_t bytes);

#endif
