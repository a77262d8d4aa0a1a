#include "cache_folder.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <time.h>
#include <unistd.h>

#include "budget.h"
#include "report.h"

enum { KEY_LENGTH = sizeof(cache_key) - 1, NAME_BYTES = 96 };
static const uint64_t min_limit = UINT64_C(4) << 30;

/* Suffixes of files that a killed process may leave, besides its lock. */
static const char *const leftovers[] = { ".trip.partial", ".trip.spill", ".trip.replaced",
                                         ".gone" };
static const char choices_suffix[] = ".quality";
enum { LEFTOVERS = sizeof leftovers / sizeof leftovers[0] };

static const char *file_name(const cache_key *key, const char *suffix, char name[NAME_BYTES])
{
    snprintf(name, NAME_BYTES, "%s%s", key->text, suffix);
    return name;
}

/* Stores the 32 digits of a name in *key and returns the rest, or NULL if the name is no cache
 * entry. */
static const char *parse_name(const char *name, cache_key *key)
{
    if (strspn(name, "0123456789abcdef") != KEY_LENGTH)
        return NULL;
    memcpy(key->text, name, KEY_LENGTH);
    key->text[KEY_LENGTH] = 0;
    return name + KEY_LENGTH;
}

cache_key cache_key_of(const char *source, const char *kept)
{
    cache_key key;
    snprintf(key.text, sizeof key.text, "%.*s%.*s", CACHE_SOURCE_DIGITS, source,
             KEY_LENGTH - CACHE_SOURCE_DIGITS, kept);
    return key;
}

bool cache_key_has_source(const cache_key *key, const cache_source *source)
{
    return !memcmp(key->text, source->text, CACHE_SOURCE_DIGITS);
}

static int find_path(char **path)
{
    const char *cache = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    int length = -1;
    if (cache && cache[0] == '/') /* the XDG specification ignores relative paths */
        length = asprintf(path, "%s/triptych", cache);
    else if (home && home[0] == '/')
        length = asprintf(path, "%s/.cache/triptych", home);
    else {
        *path = NULL;
        return trip_fail(TRIP_ERROR, "cache", "HOME",
                         "is not set, so the cache has no folder; set XDG_CACHE_HOME to a folder, "
                         "or use `triptych brick`");
    }
    if (length >= 0)
        return 0;
    *path = NULL;
    return trip_fail(TRIP_ERROR, "cache", "", "out of memory");
}

static int fail_to_write(const char *path, const char *stage)
{
    return trip_fail(
        TRIP_ERROR, "cache", path,
        "cannot be %s: %s; set XDG_CACHE_HOME to a writable folder, or use `triptych brick`", stage,
        strerror(errno));
}

/* Creates the folder and, if necessary, its parent: a new account may lack ~/.cache. */
static int make_folder(char *path)
{
    char *slash = strrchr(path, '/');
    *slash = 0;
    int made = slash == path ? 0 : mkdir(path, 0700);
    *slash = '/';
    if (made < 0 && errno != EEXIST && errno != EROFS)
        return fail_to_write(path, "made");
    return mkdir(path, 0700) < 0 && errno != EEXIST ? fail_to_write(path, "made") : 0;
}

/* Refuses a folder that another user can write, because that user could replace the data. */
static int check_folder(const cache_folder *c)
{
    struct stat st;
    if (fstat(c->fd, &st) < 0)
        return trip_fail_errno("cache", c->path, "cannot get the status");
    if (st.st_uid != geteuid())
        return trip_fail(TRIP_ERROR, "cache", c->path,
                         "belongs to another user; set XDG_CACHE_HOME to a folder of your own");
    if (st.st_mode & (S_IWGRP | S_IWOTH))
        return trip_fail(
            TRIP_ERROR, "cache", c->path,
            "is writable by other users; restrict it with `chmod 700`, or set XDG_CACHE_HOME");
    return 0;
}

static int find_limit(cache_folder *c)
{
    const char *text = getenv("TRIPTYCH_CACHE_SIZE");
    struct statvfs v;
    if (text && *text) {
        if (trip_parse_bytes(text, &c->limit_bytes) && c->limit_bytes > 0)
            return 0;
        return trip_fail(TRIP_USAGE, "usage", "TRIPTYCH_CACHE_SIZE",
                         "\"%s\" is not a size like 512M or 20G", text);
    }
    uint64_t disk = fstatvfs(c->fd, &v) == 0 ? (uint64_t)v.f_blocks * v.f_frsize : 0;
    c->limit_bytes = disk / 10 > min_limit ? disk / 10 : min_limit;
    return 0;
}

/* Replaces the path of a link by the path of its folder. */
static int follow_link(cache_folder *c)
{
    struct stat st;
    if (lstat(c->path, &st) < 0 || !S_ISLNK(st.st_mode))
        return 0;
    char *target = realpath(c->path, NULL);
    if (target && stat(target, &st) == 0 && !S_ISDIR(st.st_mode)) {
        free(target);
        target = NULL;
        errno = ENOTDIR;
    }
    if (!target)
        return trip_fail(TRIP_ERROR, "cache", c->path,
                         "is a link that leads to no folder: %s; make that folder, or remove the "
                         "link",
                         strerror(errno));
    free(c->path);
    c->path = target;
    return 0;
}

static int fail_to_open(const cache_folder *c)
{
    struct stat st;
    const int error = errno;
    if (lstat(c->path, &st) == 0 && !S_ISDIR(st.st_mode))
        return trip_fail(TRIP_ERROR, "cache", c->path,
                         "is no folder; remove it, or set XDG_CACHE_HOME to another folder");
    errno = error;
    return fail_to_write(c->path, "opened");
}

int cache_folder_open(cache_folder *c, bool make)
{
    *c = (cache_folder){ .fd = -1 };
    int status = find_path(&c->path);
    if (status == 0)
        status = follow_link(c);
    if (status == 0 && make)
        status = make_folder(c->path);
    if (status < 0)
        return status;
    c->fd = open(c->path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (c->fd < 0 && !make && errno == ENOENT)
        return 0;
    if (c->fd < 0)
        return fail_to_open(c);
    status = check_folder(c);
    return status == 0 ? find_limit(c) : status;
}

void cache_folder_close(cache_folder *c)
{
    if (c->fd >= 0)
        close(c->fd);
    free(c->path);
    *c = (cache_folder){ .fd = -1 };
}

char *cache_folder_path(const cache_folder *c, const cache_key *key)
{
    char *path;
    if (asprintf(&path, "%s/%s.trip", c->path, key->text) >= 0)
        return path;
    trip_fail(TRIP_ERROR, "cache", c->path, "out of memory");
    return NULL;
}

static int open_folder(const cache_folder *c, const char *name)
{
    return openat(c->fd, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
}

/* A shared lock on the cache's folder keeps cache_folder_remove() out between opening a data set's
 * folder and locking it. */
int cache_folder_hold(const cache_folder *c, const cache_key *key)
{
    char name[NAME_BYTES];
    flock(c->fd, LOCK_SH);
    int fd = open_folder(c, file_name(key, ".trip", name));
    if (fd >= 0)
        flock(fd, LOCK_SH | LOCK_NB);
    flock(c->fd, LOCK_UN);
    return fd;
}

/* Removes a data set's folder and its files. Subfolders are never entered; they and their parent
 * remain. */
static bool remove_folder(const cache_folder *c, const char *name)
{
    int fd = open_folder(c, name);
    DIR *folder = fd < 0 ? NULL : fdopendir(fd);
    if (!folder) {
        if (fd >= 0)
            close(fd);
        return unlinkat(c->fd, name, 0) == 0;
    }
    for (struct dirent *e; (e = readdir(folder));)
        if (strcmp(e->d_name, ".") && strcmp(e->d_name, ".."))
            unlinkat(fd, e->d_name, 0);
    closedir(folder);
    return unlinkat(c->fd, name, AT_REMOVEDIR) == 0;
}

bool cache_folder_recall(const cache_folder *c, const cache_key *state, cache_source *source)
{
    char name[NAME_BYTES], target[NAME_BYTES];
    ssize_t n = readlinkat(c->fd, file_name(state, ".link", name), target, sizeof target - 1);
    if (n != CACHE_SOURCE_DIGITS)
        return false;
    target[n] = 0;
    memcpy(source->text, target, sizeof source->text);
    return strspn(target, "0123456789abcdef") == CACHE_SOURCE_DIGITS;
}

/* The rename is atomic: another process sees either the old link or the new one. */
void cache_folder_remember(const cache_folder *c, const cache_key *state,
                           const cache_source *source)
{
    char name[NAME_BYTES], made[NAME_BYTES];
    snprintf(made, sizeof made, "%s.%ld.link", state->text, (long)getpid());
    unlinkat(c->fd, made, 0);
    if (symlinkat(source->text, c->fd, made) == 0 &&
        renameat(c->fd, made, c->fd, file_name(state, ".link", name)) < 0)
        unlinkat(c->fd, made, 0);
}

static bool is_named(const cache_folder *c, int fd, const char *name)
{
    struct stat a, b;
    return fstat(fd, &a) == 0 && fstatat(c->fd, name, &b, AT_SYMLINK_NOFOLLOW) == 0 &&
           a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

/* Removes a link, socket or empty folder from the place of a file. */
static bool remove_obstacle(const cache_folder *c, const char *name)
{
    return unlinkat(c->fd, name, 0) == 0 || unlinkat(c->fd, name, AT_REMOVEDIR) == 0;
}

/* Returns -1 if another process holds the lock (errno is EWOULDBLOCK) or if opening failed. */
static int try_lock(const cache_folder *c, const cache_key *key)
{
    char name[NAME_BYTES];
    file_name(key, ".lock", name);
    for (;;) {
        int fd = openat(c->fd, name, O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK, 0600);
        if (fd < 0 && (errno == ELOOP || errno == EISDIR || errno == ENXIO) &&
            remove_obstacle(c, name))
            continue;
        if (fd < 0 || (flock(fd, LOCK_EX | LOCK_NB) < 0 && errno == EWOULDBLOCK)) {
            int saved_errno = errno;
            if (fd >= 0)
                close(fd);
            errno = fd < 0 && saved_errno == EWOULDBLOCK ? EIO : saved_errno;
            return -1;
        }
        if (is_named(c, fd, name))
            return fd;
        close(fd); /* the holder finished and removed the file after it was opened here */
    }
}

static int fail_to_lock(const cache_folder *c, const cache_key *key)
{
    char name[NAME_BYTES], path[PATH_MAX];
    snprintf(path, sizeof path, "%s/%s", c->path, file_name(key, ".lock", name));
    return fail_to_write(path, "made");
}

int cache_folder_lock(const cache_folder *c, const cache_key *key, void (*waiting)(void *user),
                      void *user)
{
    for (;;) {
        int fd = try_lock(c, key);
        if (fd >= 0)
            return fd;
        if (errno != EWOULDBLOCK)
            return fail_to_lock(c, key);
        waiting(user);
        nanosleep(&(struct timespec){ .tv_nsec = 50000000 }, NULL);
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "cache", "", "interrupted");
    }
}

void cache_folder_unlock(const cache_folder *c, const cache_key *key, int fd)
{
    char name[NAME_BYTES];
    unlinkat(c->fd, file_name(key, ".lock", name), 0);
    close(fd);
}

typedef enum removal { REMOVED, USED, LOCKED, STUCK } removal;

/* Removes a data set. The caller has its lock, so no process makes it. */
static removal remove_locked(const cache_folder *c, const cache_key *key)
{
    char name[NAME_BYTES], gone[NAME_BYTES];
    file_name(key, ".trip", name);
    file_name(key, ".gone", gone);
    flock(c->fd, LOCK_EX);
    int fd = open_folder(c, name);
    bool unused = fd < 0 || flock(fd, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
    bool renamed = unused && renameat(c->fd, name, c->fd, gone) == 0;
    flock(c->fd, LOCK_UN);
    bool removed = renamed && remove_folder(c, gone);
    if (fd >= 0)
        close(fd);
    return removed ? REMOVED : unused ? STUCK : USED;
}

static removal remove_unlocked(const cache_folder *c, const cache_key *key)
{
    int lock = try_lock(c, key);
    if (lock < 0)
        return errno == EWOULDBLOCK ? LOCKED : STUCK;
    removal result = remove_locked(c, key);
    cache_folder_unlock(c, key, lock);
    return result;
}

bool cache_folder_remove(const cache_folder *c, const cache_key *key, bool locked)
{
    return (locked ? remove_locked(c, key) : remove_unlocked(c, key)) == REMOVED;
}

int cache_folder_make_room(const cache_folder *c, const cache_key *key)
{
    char name[NAME_BYTES];
    struct stat st;
    const size_t places = LEFTOVERS + 1;
    for (size_t i = 0; i < places; i++) {
        file_name(key, i ? leftovers[i - 1] : ".trip", name);
        if (fstatat(c->fd, name, &st, AT_SYMLINK_NOFOLLOW) == 0 && !S_ISDIR(st.st_mode))
            unlinkat(c->fd, name, 0);
    }
    if (fstatat(c->fd, file_name(key, ".trip", name), &st, AT_SYMLINK_NOFOLLOW) < 0)
        return 0;
    return trip_fail(TRIP_ERROR, "cache", c->path,
                     "its folder %s obstructs a new data set and cannot be removed; remove that "
                     "folder",
                     name);
}

static uint64_t folder_bytes(int fd)
{
    uint64_t bytes = 0;
    struct stat st;
    int copy = openat(fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *folder = copy < 0 ? NULL : fdopendir(copy);
    for (struct dirent *e; folder && (e = readdir(folder));)
        if (fstatat(fd, e->d_name, &st, AT_SYMLINK_NOFOLLOW) == 0 && S_ISREG(st.st_mode))
            bytes += (uint64_t)st.st_size;
    if (folder)
        closedir(folder);
    else if (copy >= 0)
        close(copy);
    return bytes;
}

static int fill_entry(const cache_folder *c, const char *name, cache_entry *e)
{
    struct stat st;
    int fd = open_folder(c, name);
    if (fd < 0 || fstat(fd, &st) < 0) {
        if (fd >= 0)
            close(fd);
        return -1;
    }
    e->bytes = folder_bytes(fd);
    e->used_ns = (int64_t)st.st_mtim.tv_sec * 1000000000 + st.st_mtim.tv_nsec;
    close(fd);
    return 0;
}

static int by_use(const void *a, const void *b)
{
    const cache_entry *x = a, *y = b;
    return x->used_ns != y->used_ns ? x->used_ns < y->used_ns ? -1 : 1
                                    : strcmp(x->key.text, y->key.text);
}

/* Calls visit() with the key and the suffix of every name that may be a cache entry. */
static int visit_names(const cache_folder *c,
                       int (*visit)(const cache_folder *c, const char *name, const cache_key *key,
                                    const char *rest, void *user),
                       void *user)
{
    int copy = openat(c->fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC), status = 0;
    DIR *folder = copy < 0 ? NULL : fdopendir(copy);
    if (!folder) {
        status = trip_fail_errno("cache", c->path, "cannot list");
        if (copy >= 0)
            close(copy);
        return status;
    }
    cache_key key;
    for (struct dirent *e; status == 0 && (e = readdir(folder));) {
        const char *rest = parse_name(e->d_name, &key);
        status = rest ? visit(c, e->d_name, &key, rest, user) : 0;
    }
    closedir(folder);
    return status;
}

typedef struct listing {
    cache_entry *entries;
    size_t count;
} listing;

static int list_entry(const cache_folder *c, const char *name, const cache_key *key,
                      const char *rest, void *user)
{
    listing *l = user;
    cache_entry entry = { .key = *key };
    if (strcmp(rest, ".trip") || fill_entry(c, name, &entry) < 0)
        return 0;
    cache_entry *entries = reallocarray(l->entries, l->count + 1, sizeof *entries);
    if (!entries)
        return trip_fail(TRIP_ERROR, "cache", c->path, "out of memory");
    l->entries = entries;
    entries[l->count++] = entry;
    return 0;
}

int cache_folder_list(const cache_folder *c, cache_entry **out, size_t *count)
{
    listing l = { 0 };
    int status = visit_names(c, list_entry, &l);
    if (status == 0 && l.count)
        qsort(l.entries, l.count, sizeof *l.entries, by_use);
    if (status < 0)
        free(l.entries);
    *out = status < 0 ? NULL : l.entries;
    *count = status < 0 ? 0 : l.count;
    return status;
}

char *cache_folder_choices(void)
{
    cache_folder c;
    trip_held_report held;
    char *path = NULL;
    trip_report_hold(&held);
    if (cache_folder_open(&c, true) == 0)
        path = strdup(c.path);
    trip_report_release(&held);
    cache_folder_close(&c);
    return path;
}

typedef struct counting {
    size_t count;
    uint64_t bytes;
} counting;

static int count_choices(const cache_folder *c, const char *name, const cache_key *key,
                         const char *rest, void *user)
{
    counting *all = user;
    struct stat st;
    (void)key;
    if (strcmp(rest, choices_suffix) || fstatat(c->fd, name, &st, AT_SYMLINK_NOFOLLOW) < 0)
        return 0;
    all->count++;
    all->bytes += (uint64_t)st.st_size;
    return 0;
}

int cache_folder_count_choices(const cache_folder *c, size_t *count, uint64_t *bytes)
{
    counting all = { 0 };
    int status = visit_names(c, count_choices, &all);
    *count = all.count;
    *bytes = all.bytes;
    return status;
}

typedef struct cleaning {
    const listing *kept; /* the data sets that remain */
    bool choices;        /* removes choices */
    cache_left *left;
} cleaning;

static bool has_data_set(const listing *l, const cache_source *source)
{
    bool found = false;
    for (size_t i = 0; i < l->count; i++)
        found = found || cache_key_has_source(&l->entries[i].key, source);
    return found;
}

/* Removes the leftovers of killed processes and links to data sets that no longer exist. Counts the
 * data sets that other processes make. */
static int clean_name(const cache_folder *c, const char *name, const cache_key *key,
                      const char *rest, void *user)
{
    const cleaning *cl = user;
    cache_source source;
    if (!strcmp(rest, ".link")) {
        if (!cache_folder_recall(c, key, &source) || !has_data_set(cl->kept, &source))
            unlinkat(c->fd, name, 0);
        return 0;
    }
    if (!strcmp(rest, choices_suffix)) {
        if (cl->choices)
            remove_obstacle(c, name);
        return 0;
    }
    size_t length = strlen(rest);
    if (length > 5 && !strcmp(rest + length - 5, ".link"))
        unlinkat(c->fd, name, 0);
    bool is_lock = !strcmp(rest, ".lock"), leftover = is_lock;
    for (int i = 0; i < LEFTOVERS; i++)
        leftover = leftover || !strcmp(rest, leftovers[i]);
    int lock = leftover ? try_lock(c, key) : -1;
    if (lock < 0) {
        cl->left->making += is_lock && errno == EWOULDBLOCK;
        return 0;
    }
    if (!is_lock)
        remove_folder(c, name);
    cache_folder_unlock(c, key, lock);
    return 0;
}

static int clean(const cache_folder *c, bool choices, cache_left *left)
{
    listing kept = { 0 };
    int status = cache_folder_list(c, &kept.entries, &kept.count);
    if (status == 0)
        status = visit_names(c, clean_name, &(cleaning){ &kept, choices, left });
    free(kept.entries);
    return status;
}

int cache_folder_shrink(const cache_folder *c, uint64_t bytes, cache_left *out)
{
    cache_entry *entries;
    cache_left left = { 0 };
    size_t count;
    uint64_t total = 0;
    int status = cache_folder_list(c, &entries, &count);
    for (size_t i = 0; i < count; i++)
        total += entries[i].bytes;
    for (size_t i = 0; i < count && (total > bytes || bytes == 0); i++) {
        const removal result = remove_unlocked(c, &entries[i].key);
        total -= result == REMOVED ? entries[i].bytes : 0;
        left.used += result == USED;
        left.stuck += result == STUCK;
    }
    free(entries);
    if (status == 0)
        status = clean(c, bytes == 0, &left);
    if (out)
        *out = left;
    return status;
}
