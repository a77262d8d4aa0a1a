#include "cached_volume.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "clock.h"
#include "fastest.h"
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
    const cached_wish *wish;
    const char *checksum;       /* the wanted one, or NULL */
    triptych_identity identity; /* of the files when the source was found */
    cache_source source;
    bool damaged; /* a damaged data set was removed */
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
                     "--series, --time, --channel, --allow-gaps, --fill, --color, --k, "
                     "--outliers, --radius, --uncertainty and --hyperlines apply to files only");
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

static cache_source source_of(const char *digits)
{
    cache_source source;
    snprintf(source.text, sizeof source.text, "%.*s", CACHE_SOURCE_DIGITS, digits);
    return source;
}

static cache_key state_of(const search *s)
{
    return cache_key_of(s->identity.state, s->identity.state + CACHE_SOURCE_DIGITS);
}

/* Derives the source from the content of the files, or from their state if they are large. */
static int find_content(search *s, cache_source *source)
{
    bool read = s->identity.bytes <= max_content_bytes;
    int status = read ? identify(s, max_content_bytes) : wait_until_stable(s);
    if (status == 0)
        *source = source_of(*s->identity.content ? s->identity.content : s->identity.state);
    return status;
}

static int find_source(search *s)
{
    int status = identify(s, 0);
    cache_key state = state_of(s);
    if (status < 0 ||
        (s->identity.stable && cache_folder_recall(&s->v->folder, &state, &s->source)))
        return status;
    status = find_content(s, &s->source);
    state = state_of(s);
    if (status == 0 && s->identity.stable)
        cache_folder_remember(&s->v->folder, &state, &s->source);
    return status;
}

/* Checks that the files have not changed since their source was found. */
static int check_unchanged(search *s)
{
    const triptych_identity before = s->identity;
    cache_source source = s->source;
    int status = identify(s, 0);
    bool same = status == 0 && !strcmp(before.state, s->identity.state);
    if (same && !before.stable)
        status = find_content(s, &source);
    if (status == 0 && (!same || strcmp(source.text, s->source.text)))
        return trip_fail(
            TRIP_ERROR, "read", s->volume,
            "changed while it was read; run the command again when the file is complete");
    return status;
}

static bool has_checksum(const search *s)
{
    char checksum[ACCURACY_CHECKSUM_BYTES];
    triptych_info info;
    if (!s->checksum)
        return true;
    if (triptych_get_info(s->t, &info) < 0)
        return false;
    accuracy_checksum_text(info.checksum, checksum);
    return !strcmp(checksum, s->checksum);
}

/* Returns whether the open data set keeps all wanted values. */
static bool holds(const search *s)
{
    triptych_brick_options needed = s->options;
    needed.keep_all = needed.keep_all && !s->wish->shown;
    return triptych_holds(s->t, &needed, s->wish->shown) > 0;
}

static void let_go(cached_volume *v)
{
    if (v->hold >= 0)
        close(v->hold);
    free(v->path);
    v->hold = -1;
    v->path = NULL;
}

static int aim_at(cached_volume *v, const cache_key *key)
{
    v->key = *key;
    v->path = cache_folder_path(&v->folder, key);
    return v->path ? 0 : TRIP_ERROR;
}

typedef enum offer { SERVES, SERVES_NOT, DAMAGED } offer;

/* Tells a damaged data set from one that needs more memory. */
static offer examine_unopened(const search *s, bool own)
{
    int status = triptych_open(s->t, s->v->path, NULL);
    triptych_close(s->t);
    return status < 0 && !trip_interrupted() ? DAMAGED : own ? SERVES : SERVES_NOT;
}

/* Examines the data set at v->path. If its own options were wanted, it serves also if it does not
 * fit the memory: drawing reports that failure. */
static offer examine(const search *s, bool own)
{
    const triptych_resources resources = { .memory_bytes = s->options.memory_bytes };
    library_hush(s->t, true);
    int status = triptych_open(s->t, s->v->path, &resources);
    const bool serves = status == 0 && has_checksum(s) && (own || holds(s));
    triptych_close(s->t);
    const offer found = status < 0 ? examine_unopened(s, own) : serves ? SERVES : SERVES_NOT;
    library_hush(s->t, false);
    return found;
}

/* Returns the key of the data set that is made if none serves. */
static cache_key own_key(const search *s)
{
    return cache_key_of(s->source.text, s->identity.kept);
}

/* Takes a data set of the source if it serves. Removes a damaged one. Returns 1, 0 or a failure. */
static int take(search *s, const cache_key *key, bool locked)
{
    cached_volume *v = s->v;
    const cache_key wanted = own_key(s);
    const bool own = !strcmp(key->text, wanted.text);
    int status = aim_at(v, key);
    if (status == 0)
        v->hold = cache_folder_hold(&v->folder, key);
    const offer found = v->hold >= 0 ? examine(s, own) : SERVES_NOT;
    if (found == SERVES) {
        futimens(v->hold, NULL); /* the time of the last use */
        v->wider = !own;
        return 1;
    }
    let_go(v);
    if (found == DAMAGED)
        cache_folder_remove(&v->folder, key, locked && own);
    s->damaged = s->damaged || found == DAMAGED;
    return status;
}

static int by_size(const void *a, const void *b)
{
    const cache_entry *x = a, *y = b;
    return (x->bytes > y->bytes) - (x->bytes < y->bytes);
}

/* Takes the smallest data set that serves. Returns 1, 0 or a failure. */
static int take_smallest(search *s, bool locked)
{
    cache_entry *entries;
    size_t count;
    int status = cache_folder_list(&s->v->folder, &entries, &count);
    if (status == 0 && count)
        qsort(entries, count, sizeof *entries, by_size);
    for (size_t i = 0; i < count && status == 0; i++)
        if (cache_key_has_source(&entries[i].key, &s->source))
            status = take(s, &entries[i].key, locked);
    free(entries);
    if (status == 0 && s->checksum) { /* the caller reports that the checksum differs */
        const cache_key own = own_key(s);
        const char *checksum = s->checksum;
        s->checksum = NULL;
        status = take(s, &own, locked);
        s->checksum = checksum;
    }
    if (status == 0 && s->damaged)
        trip_warn(s->volume, "its data set in the cache is damaged and will be made again");
    s->damaged = false;
    return status;
}

/* The lock of v->key is held. */
static int brick(search *s)
{
    cached_volume *v = s->v;
    double begin = trip_now_seconds();
    int status = cache_folder_make_room(&v->folder, &v->key);
    if (status == 0)
        status = triptych_is_gaussians(s->t, s->volume)
                     ? triptych_brick_gaussians(s->t, s->volume, v->path, &s->options, NULL)
                     : triptych_brick(s->t, s->volume, v->path, &s->options, NULL);
    if (status == 0 && (status = check_unchanged(s)) < 0)
        cache_folder_remove(&v->folder, &v->key, true);
    if (status < 0)
        return status;
    v->seconds = trip_now_seconds() - begin;
    v->hold = cache_folder_hold(&v->folder, &v->key);
    return cache_folder_shrink(&v->folder, v->folder.limit_bytes, NULL);
}

/* Bricks the volume under a lock. Other processes that wait for the lock then find the data set. */
static int make(search *s)
{
    cached_volume *v = s->v;
    const cache_key key = own_key(s);
    trip_progress progress = trip_progress_start();
    int lock = cache_folder_lock(&v->folder, &key, on_wait, &progress);
    trip_progress_end(&progress);
    if (lock < 0)
        return lock;
    int status = take_smallest(s, true);
    if (status == 0)
        status = aim_at(v, &key);
    if (status == 0)
        status = brick(s);
    cache_folder_unlock(&v->folder, &key, lock);
    return status;
}

static int open_volume(search *s, bool making)
{
    cached_volume *v = s->v;
    *v = (cached_volume){ .hold = -1 };
    const int kind = triptych_is_gaussians(s->t, s->volume);
    int status = kind == 3 ? library_check_cloud_options(&s->options)
                 : kind    ? library_check_scene_options(&s->options)
                           : 0;
    if (status == 0)
        status = cache_folder_open(&v->folder, true);
    if (status == 0)
        status = find_source(s);
    s->checksum = s->wish->checksum && *s->wish->checksum ? s->wish->checksum : NULL;
    s->options.max_bytes = v->folder.limit_bytes;
    if (status == 0)
        status = take_smallest(s, false);
    return status == 0 && making ? make(s) : status;
}

int cached_volume_find(cached_volume *v, triptych *t, const char *volume, const cached_wish *wish)
{
    search s = { .v = v, .t = t, .volume = volume, .wish = wish, .options = wish->options };
    int status = open_volume(&s, false);
    if (status == 0)
        cached_volume_close(v);
    return status;
}

int cached_volume_open(cached_volume *v, triptych *t, const char *volume, const cached_wish *wish)
{
    search s = { .v = v, .t = t, .volume = volume, .wish = wish, .options = wish->options };
    int status = open_volume(&s, true);
    return status > 0 ? 0 : status;
}

void cached_volume_close(cached_volume *v)
{
    if (!v->path && !v->folder.path)
        return;
    let_go(v);
    cache_folder_close(&v->folder);
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
        cache_folder_remove(&v->folder, &v->key, false);
        trip_warn(volume, "its data set in the cache was damaged and has been removed; the same "
                          "command makes it again");
    }
}
