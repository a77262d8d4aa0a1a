#include "source.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include <xxhash.h>

#include "report.h"
#include "volume_coordinates.h"
#include "volume_reader.h"

#define PIECE_BYTES ((size_t)1 << 20)
/* FAT has the coarsest file times, with steps of two seconds. */
static const int64_t stable_ns = INT64_C(2000000000);

static int fail_memory(const char *path)
{
    return trip_fail(TRIP_ERROR, "read", path, "out of memory for its list of files");
}

static int64_t nanoseconds(struct timespec t)
{
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

/* Adds a file. Missing files and files that are not regular count as empty; the reader will report
 * them. */
static int add_file(void *user, const char *path)
{
    trip_source *s = user;
    struct stat st = { 0 };
    trip_source_file *files = reallocarray(s->files, s->count + 1, sizeof *files);
    if (!files)
        return fail_memory(path);
    s->files = files;
    if (stat(path, &st) != 0 || !S_ISREG(st.st_mode))
        memset(&st, 0, sizeof st);
    files[s->count] = (trip_source_file){ .path = strdup(path),
                                          .inode = st.st_ino,
                                          .bytes = (uint64_t)st.st_size,
                                          .modified_ns = nanoseconds(st.st_mtim),
                                          .changed_ns = nanoseconds(st.st_ctim) };
    if (!files[s->count].path)
        return fail_memory(path);
    s->bytes += files[s->count++].bytes;
    return 0;
}

int trip_source_add(trip_source *s, const char *path)
{
    return add_file(s, path);
}

int trip_source_find(trip_source *s, const char *path, const trip_volume_params *params)
{
    const trip_volume_reader *reader;
    *s = (trip_source){ 0 };
    int status = trip_volume_choose_reader(&reader, path, params);
    if (status == 0) {
        s->format = reader->format;
        status = reader->list ? reader->list(path, add_file, s) : add_file(s, path);
    }
    if (status == 0 && params->coordinates)
        status = trip_volume_list_coordinates(params->coordinates, add_file, s);
    if (status < 0)
        trip_source_free(s);
    return status;
}

void trip_source_free(trip_source *s)
{
    for (size_t i = 0; i < s->count; i++)
        free(s->files[i].path);
    free(s->files);
    *s = (trip_source){ 0 };
}

bool trip_source_is_stable(const trip_source *s)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    for (size_t i = 0; i < s->count; i++)
        if (s->files[i].changed_ns > nanoseconds(now) - stable_ns)
            return false;
    return true;
}

static const char *base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static int begin(XXH3_state_t **hash, const trip_source *s, const char *text)
{
    *hash = XXH3_createState();
    if (!*hash || XXH3_128bits_reset(*hash) != XXH_OK)
        return fail_memory(s->count ? s->files[0].path : s->format);
    XXH3_128bits_update(*hash, s->format, strlen(s->format) + 1);
    XXH3_128bits_update(*hash, text, strlen(text) + 1);
    XXH3_128bits_update(*hash, &s->count, sizeof s->count);
    return 0;
}

static trip_digest digest_of(XXH128_hash_t h)
{
    trip_digest out;
    snprintf(out.text, sizeof out.text, "%016llx%016llx", (unsigned long long)h.high64,
             (unsigned long long)h.low64);
    return out;
}

static void end(XXH3_state_t *hash, trip_digest *out)
{
    *out = digest_of(XXH3_128bits_digest(hash));
    XXH3_freeState(hash);
}

trip_digest trip_source_digest_text(const char *text)
{
    return digest_of(XXH3_128bits(text, strlen(text)));
}

static void add_state(XXH3_state_t *hash, const trip_source_file *f)
{
    char *position = realpath(f->path, NULL);
    const char *name = position ? position : f->path;
    const uint64_t numbers[] = { f->inode, f->bytes, (uint64_t)f->modified_ns,
                                 (uint64_t)f->changed_ns };
    XXH3_128bits_update(hash, name, strlen(name) + 1);
    XXH3_128bits_update(hash, base_name(f->path), strlen(base_name(f->path)) + 1);
    XXH3_128bits_update(hash, numbers, sizeof numbers);
    free(position);
}

int trip_source_digest_state(const trip_source *s, const char *text, trip_digest *out)
{
    XXH3_state_t *hash;
    int status = begin(&hash, s, text);
    for (size_t i = 0; i < s->count && status == 0; i++)
        add_state(hash, &s->files[i]);
    if (hash)
        end(hash, out);
    return status;
}

/* Adds a name as far as readers use it. Names of raw files give size and type, and names in stacks
 * give the order. */
static void add_name(XXH3_state_t *hash, const trip_source *s, const trip_source_file *f)
{
    bool matters = !strcmp(s->format, "raw") || !strcmp(s->format, "images");
    const char *name = matters ? base_name(f->path) : "";
    XXH3_128bits_update(hash, name, strlen(name) + 1);
    XXH3_128bits_update(hash, &f->bytes, sizeof f->bytes);
}

typedef struct reading {
    XXH3_state_t *hash;
    unsigned char *piece;
    uint64_t done, total;
    void (*progress)(void *user, uint64_t done, uint64_t total);
    void *user;
} reading;

/* Adds as many bytes as the file had when it was found. */
static int add_bytes(reading *r, const trip_source_file *f, int fd)
{
    for (uint64_t at = 0; at < f->bytes;) {
        size_t want = f->bytes - at < PIECE_BYTES ? (size_t)(f->bytes - at) : PIECE_BYTES;
        ssize_t n = pread(fd, r->piece, want, (off_t)at);
        if (n < 0 && errno == EINTR && !trip_interrupted())
            continue;
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "read", "", "interrupted");
        if (n < 0)
            return trip_fail_errno("read", f->path, "cannot read");
        if (n == 0)
            return trip_fail(TRIP_ERROR, "read", f->path, "became shorter during reading");
        XXH3_128bits_update(r->hash, r->piece, (size_t)n);
        at += (uint64_t)n;
        r->done += (uint64_t)n;
        if (r->progress)
            r->progress(r->user, r->done, r->total);
    }
    return 0;
}

static int add_content(reading *r, const trip_source_file *f)
{
    if (f->bytes == 0)
        return 0;
    int fd = open(f->path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0)
        return trip_fail_errno("read", f->path, "cannot open");
    posix_fadvise(fd, 0, 0, POSIX_FADV_SEQUENTIAL);
    int status = add_bytes(r, f, fd);
    close(fd);
    return status;
}

int trip_source_digest_content(const trip_source *s, const char *text, trip_digest *out,
                               void (*progress)(void *user, uint64_t done, uint64_t total),
                               void *user)
{
    reading r = {
        .piece = malloc(PIECE_BYTES), .total = s->bytes, .progress = progress, .user = user
    };
    int status = r.piece ? begin(&r.hash, s, text) : fail_memory(s->files[0].path);
    for (size_t i = 0; i < s->count && status == 0; i++) {
        add_name(r.hash, s, &s->files[i]);
        status = add_content(&r, &s->files[i]);
    }
    if (r.hash)
        end(r.hash, out);
    free(r.piece);
    return status;
}
