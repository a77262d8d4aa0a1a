#include "cached_volume.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "dataset.h"
#include "identity.h"
#include "progress.h"
#include "report.h"

/* Files are read for their content up to this, which takes about a second. */
static const uint64_t most_content_bytes = UINT64_C(1) << 30;

/* While a volume is looked for and bricked. */
typedef struct search {
    cached_volume *v;
    trip_brick_params params;
    trip_source source;
    bool settled; /* before its content was read: so its times tell every later change */
    char *options;
    trip_digest state;
    trip_progress progress;
} search;

static double now_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static bool has_index(const char *folder)
{
    struct stat st;
    char *path;
    if (asprintf(&path, "%s/" TRIP_INDEX_NAME, folder) < 0)
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

static void on_brick_progress(void *user, const char *stage, uint64_t done, uint64_t total)
{
    search *s = user;
    trip_progress_show(&s->progress, stage, done, total,
                       strcmp(stage, "merge") ? "voxels" : "splats");
}

static void on_content_progress(void *user, uint64_t done, uint64_t total)
{
    search *s = user;
    trip_progress_show(&s->progress, "look", done, total, "bytes");
}

static void on_wait(void *user)
{
    search *s = user;
    trip_progress_show(&s->progress, "wait", 0, 1, "");
}

/* Of large files only the times tell a change, so they must be able to. A clock that is wrong is
 * not waited for. */
static int wait_until_settled(const trip_source *source)
{
    for (int i = 0; i < 30 && !trip_source_is_settled(source); i++) {
        nanosleep(&(struct timespec){ .tv_nsec = 100000000 }, NULL);
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "read", "", "interrupted");
    }
    return 0;
}

/* The options and the program's version: another one may make another data set of the same volume.
 */
static int describe(search *s)
{
    char *options;
    int status = trip_brick_options_text(&s->params, &options);
    if (status < 0)
        return status;
    int length = asprintf(&s->options, "%s" TRIP_VERSION "\n", options);
    free(options);
    if (length >= 0)
        return 0;
    s->options = NULL;
    return trip_fail(TRIP_ERROR, "cache", s->params.input, "out of memory");
}

static int find_content_key(search *s, trip_digest *key)
{
    if (s->source.bytes <= most_content_bytes)
        return trip_source_digest_content(&s->source, s->options, key, on_content_progress, s);
    *key = s->state;
    return wait_until_settled(&s->source);
}

static int find_key(search *s)
{
    int status = trip_source_find(&s->source, s->params.input, &s->params.volume);
    if (status == 0)
        status = describe(s);
    if (status == 0)
        status = trip_source_digest_state(&s->source, s->options, &s->state);
    s->settled = status == 0 && trip_source_is_settled(&s->source);
    if (status < 0 || (s->settled && cache_folder_recall(&s->v->folder, &s->state, &s->v->key)))
        return status;
    status = find_content_key(s, &s->v->key);
    if (status == 0 && s->settled)
        cache_folder_remember(&s->v->folder, &s->state, &s->v->key);
    return status;
}

/* Whether the files are still those that the key is of. */
static int check_unchanged(search *s)
{
    trip_source now = { 0 };
    trip_digest key = s->v->key;
    int status = trip_source_find(&now, s->params.input, &s->params.volume);
    bool same = status == 0 && trip_source_equal(&s->source, &now);
    trip_source_free(&now);
    if (same && !s->settled)
        status = find_content_key(s, &key);
    if (status == 0 && (!same || strcmp(key.text, s->v->key.text)))
        return trip_fail(TRIP_ERROR, "read", s->params.input,
                         "changed while it was read: draw it again when it is complete");
    return status;
}

/* Where the memory given does not suffice, drawing says so. */
static bool opens(const cached_volume *v, uint64_t memory_bytes)
{
    struct stat st;
    trip_budget *budget;
    trip_dataset *data = NULL;
    if (trip_budget_create(&budget, memory_bytes) < 0)
        return true;
    bool fits = fstatat(v->hold, TRIP_INDEX_NAME, &st, AT_SYMLINK_NOFOLLOW) < 0 ||
                (uint64_t)st.st_size <= trip_budget_left_bytes(budget);
    bool opened = !fits || trip_dataset_open(&data, v->path, budget) == 0;
    trip_dataset_close(data);
    trip_budget_destroy(budget);
    return opened;
}

/* True when there is a data set that can be opened; a damaged one is removed. */
static bool take(search *s)
{
    cached_volume *v = s->v;
    v->hold = cache_folder_hold(&v->folder, &v->key);
    if (v->hold < 0)
        return false;
    if (opens(v, s->params.memory_bytes))
        return true;
    trip_warn(s->params.input, "its data set in the cache is damaged and is made anew");
    close(v->hold);
    v->hold = -1;
    cache_folder_remove(&v->folder, &v->key);
    return false;
}

static int brick(search *s)
{
    cached_volume *v = s->v;
    trip_brick_summary summary;
    double begin = now_seconds();
    int status = trip_brick(&s->params, &summary);
    if (status == 0 && (status = check_unchanged(s)) < 0)
        cache_folder_remove(&v->folder, &v->key);
    if (status < 0)
        return status;
    v->seconds = now_seconds() - begin;
    v->hold = cache_folder_hold(&v->folder, &v->key);
    return cache_folder_shrink(&v->folder, v->folder.limit_bytes);
}

/* Only one process bricks it; the others find it when they get the lock. */
static int make(search *s)
{
    cached_volume *v = s->v;
    int lock = cache_folder_lock(&v->folder, &v->key, on_wait, s);
    if (lock < 0)
        return lock;
    int status = take(s) ? 0 : brick(s);
    cache_folder_unlock(&v->folder, &v->key, lock);
    return status;
}

/* 1: it is there. */
static int find(search *s)
{
    cached_volume *v = s->v;
    int status = find_key(s);
    if (status == 0 && !(v->path = cache_folder_path(&v->folder, &v->key)))
        status = TRIP_ERROR;
    s->params.output = v->path;
    s->params.most_bytes = v->folder.limit_bytes;
    return status == 0 ? take(s) : status;
}

static int open_volume(cached_volume *v, const trip_brick_params *wanted, bool making)
{
    search s = { .v = v, .params = *wanted, .progress = trip_progress_start(false) };
    s.params.progress = on_brick_progress;
    s.params.progress_user = &s;
    *v = (cached_volume){ .hold = -1 };
    int status = cache_folder_open(&v->folder, true);
    if (status == 0)
        status = find(&s);
    if (status == 0 && making)
        status = make(&s);
    trip_progress_end(&s.progress);
    trip_source_free(&s.source);
    free(s.options);
    return status;
}

int cached_volume_find(cached_volume *v, const trip_brick_params *wanted)
{
    int status = open_volume(v, wanted, false);
    if (status == 0)
        cached_volume_close(v);
    return status;
}

int cached_volume_open(cached_volume *v, const trip_brick_params *wanted)
{
    int status = open_volume(v, wanted, true);
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

void cached_volume_check(cached_volume *v, const char *input)
{
    trip_dataset *data = NULL;
    trip_budget *budget = NULL;
    int status = trip_budget_create(&budget, 0);
    if (status == 0)
        status = trip_dataset_open(&data, v->path, budget);
    if (status == 0)
        status = trip_dataset_verify(data, budget);
    trip_dataset_close(data);
    if (budget)
        trip_budget_destroy(budget);
    if (status == TRIP_ERROR && !trip_interrupted()) {
        close(v->hold);
        v->hold = -1;
        cache_folder_remove(&v->folder, &v->key);
        trip_warn(input, "its data set in the cache is damaged and is removed: the same command "
                         "makes it anew");
    }
}
