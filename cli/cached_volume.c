#include "cached_volume.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "budget.h"
#include "clock.h"
#include "report.h"

#define INDEX_NAME "index.trip"

/* Files up to this size in total are identified by their content. Reading them takes about a
 * second. */
static const uint64_t max_content_bytes = UINT64_C(1) << 30;

/* State of a search for a volume's data set, and of bricking it. */
typedef struct search {
    cached_volume *v;
    triptych *t;
    const char *volume;
    triptych_brick_options options;
    triptych_identity identity; /* of the files when the key was found */
} search;

static bool has_index(const char *folder)
{
    struct stat st;
    char *path;
    if (asprintf(&path, "%s/" INDEX_NAME, folder) < 0)
        return false;
    bool found = lstat(path, &st) == 0;
    free(path);
    return found;
}

bool cached_volume_wanted(const char *input)
{
    size_t length = strlen(input);
    while (length > 1 && input[length - 1] == '/')
        length--;
    bool named = length >= 5 && strncmp(input + length - 5, ".trip", 5) == 0;
    return !named && !has_index(input);
}

int cached_volume_check_options(const char *input)
{
    return cached_volume_wanted(input)
               ? 0
               : trip_fail(
                     TRIP_USAGE, "usage", input,
                     "is a data set; --grid, --level-set, --spacing, --coordinates, --axes, "
                     "--series, --time, --channel, --allow-gaps and --fill apply to volumes only");
}

/* Shows on a terminal that another process is bricking the same volume. */
static void on_wait(void *user)
{
    trip_progress *p = user;
    trip_progress_show(p, "wait", 0, 1, "");
}

static int identify(search *s, uint64_t max_bytes)
{
    return triptych_identify(s->t, s->volume, &s->options, max_bytes, &s->identity);
}

/* Large files are identified by their modification times. Waits until these are old enough that any
 * later change gives a different time, at most 3 seconds in case the clock is wrong. */
static int wait_until_stable(search *s)
{
    int status = 0;
    for (int i = 0; i < 30 && !status && !s->identity.stable; i++) {
        nanosleep(&(struct timespec){ .tv_nsec = 100000000 }, NULL);
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "read", s->volume, "interrupted");
        status = identify(s, 0);
    }
    return status;
}

static cache_key key_of(const char text[33])
{
    cache_key key;
    memcpy(key.text, text, sizeof key.text);
    return key;
}

/* Derives the key from the content of the files, or from their state if they are large. */
static int find_content_key(search *s, cache_key *key)
{
    bool read = s->identity.bytes <= max_content_bytes;
    int status = read ? identify(s, max_content_bytes) : wait_until_stable(s);
    if (status == 0)
        *key = key_of(*s->identity.content ? s->identity.content : s->identity.state);
    return status;
}

static int find_key(search *s)
{
    int status = identify(s, 0);
    const cache_key state = key_of(s->identity.state);
    if (status < 0 ||
        (s->identity.stable && cache_folder_recall(&s->v->folder, &state, &s->v->key)))
        return status;
    status = find_content_key(s, &s->v->key);
    if (status == 0 && s->identity.stable) {
        const cache_key read = key_of(s->identity.state);
        cache_folder_remember(&s->v->folder, &read, &s->v->key);
    }
    return status;
}

/* Checks that the files have not changed since their key was found. */
static int check_unchanged(search *s)
{
    const triptych_identity before = s->identity;
    cache_key key = s->v->key;
    int status = identify(s, 0);
    bool same = status == 0 && !strcmp(before.state, s->identity.state);
    if (same && !before.stable)
        status = find_content_key(s, &key);
    if (status == 0 && (!same || strcmp(key.text, s->v->key.text)))
        return trip_fail(
            TRIP_ERROR, "read", s->volume,
            "changed while it was read; run the command again when the file is complete");
    return status;
}

/* Returns true also if the index does not fit the memory: drawing reports that failure. */
static bool opens(const search *s)
{
    struct stat st;
    trip_budget *budget;
    uint64_t memory_bytes = s->options.memory_bytes;
    if (trip_budget_create(&budget, memory_bytes) < 0)
        return true;
    bool fits = fstatat(s->v->hold, INDEX_NAME, &st, AT_SYMLINK_NOFOLLOW) < 0 ||
                (uint64_t)st.st_size <= trip_budget_left_bytes(budget);
    trip_budget_destroy(budget);
    bool opened =
        !fits ||
        triptych_open(s->t, s->v->path, &(triptych_resources){ .memory_bytes = memory_bytes }) == 0;
    triptych_close(s->t);
    return opened;
}

/* Takes the data set from the cache if it exists and can be opened. Removes a damaged one. */
static bool take(search *s)
{
    cached_volume *v = s->v;
    v->hold = cache_folder_hold(&v->folder, &v->key);
    if (v->hold < 0)
        return false;
    if (opens(s))
        return true;
    trip_warn(s->volume, "its data set in the cache is damaged and will be made again");
    close(v->hold);
    v->hold = -1;
    cache_folder_remove(&v->folder, &v->key);
    return false;
}

static int brick(search *s)
{
    cached_volume *v = s->v;
    double begin = trip_now_seconds();
    int status = triptych_brick(s->t, s->volume, v->path, &s->options, NULL);
    if (status == 0 && (status = check_unchanged(s)) < 0)
        cache_folder_remove(&v->folder, &v->key);
    if (status < 0)
        return status;
    v->seconds = trip_now_seconds() - begin;
    v->hold = cache_folder_hold(&v->folder, &v->key);
    return cache_folder_shrink(&v->folder, v->folder.limit_bytes);
}

/* Bricks the volume under a lock. Other processes that wait for the lock then find the data set. */
static int make(search *s)
{
    cached_volume *v = s->v;
    trip_progress progress = trip_progress_start();
    int lock = cache_folder_lock(&v->folder, &v->key, on_wait, &progress);
    trip_progress_end(&progress);
    if (lock < 0)
        return lock;
    int status = take(s) ? 0 : brick(s);
    cache_folder_unlock(&v->folder, &v->key, lock);
    return status;
}

/* Returns 1 if the cache holds the data set, else 0. */
static int find(search *s)
{
    cached_volume *v = s->v;
    int status = find_key(s);
    if (status == 0 && !(v->path = cache_folder_path(&v->folder, &v->key)))
        status = TRIP_ERROR;
    s->options.max_bytes = v->folder.limit_bytes;
    return status == 0 ? take(s) : status;
}

static int open_volume(search *s, bool making)
{
    cached_volume *v = s->v;
    *v = (cached_volume){ .hold = -1 };
    int status = cache_folder_open(&v->folder, true);
    if (status == 0)
        status = find(s);
    return status == 0 && making ? make(s) : status;
}

int cached_volume_find(cached_volume *v, triptych *t, const char *volume,
                       const triptych_brick_options *options)
{
    search s = { .v = v, .t = t, .volume = volume, .options = *options };
    int status = open_volume(&s, false);
    if (status == 0)
        cached_volume_close(v);
    return status;
}

int cached_volume_open(cached_volume *v, triptych *t, const char *volume,
                       const triptych_brick_options *options)
{
    search s = { .v = v, .t = t, .volume = volume, .options = *options };
    int status = open_volume(&s, true);
    return status > 0 ? 0 : status;
}

void cached_volume_close(cached_volume *v)
{
    if (!v->path && !v->folder.path)
        return;
    if (v->hold >= 0)
        close(v->hold);
    cache_folder_close(&v->folder);
    free(v->path);
    *v = (cached_volume){ .hold = -1 };
}

void cached_volume_check(cached_volume *v, triptych *t, const char *volume)
{
    triptych_end(t);
    int status = triptych_open(t, v->path, NULL);
    if (status == 0)
        status = triptych_verify(t);
    triptych_close(t);
    if (status == TRIP_ERROR && !trip_interrupted()) {
        close(v->hold);
        v->hold = -1;
        cache_folder_remove(&v->folder, &v->key);
        trip_warn(volume, "its data set in the cache was damaged and has been removed; the same "
                          "command makes it again");
    }
}
