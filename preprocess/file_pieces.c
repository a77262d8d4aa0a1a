#include "file_pieces.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "report.h"

enum { THREADS = 4, PIECE_BYTES = 512 << 10, ALIGNMENT_BYTES = 4096 };

struct trip_file_pieces {
    int fd, direct_fd;
    uint64_t file_bytes;
    unsigned char *map;    /* never looked into: asks what the system holds */
    unsigned char *memory; /* a piece for every thread */
    bool useless;          /* direct reads are refused after all */
};

/* One read. */
typedef struct job {
    const trip_file_pieces *file;
    uint64_t begin, end, first; /* first: where pieces start, aligned */
    uint64_t pieces;
    unsigned char *to;
    trip_scope *scope;         /* of who wants it */
    atomic_uint_fast64_t next; /* piece */
    atomic_uint seats;         /* threads that have their piece of memory */
    atomic_bool failed;
} job;

static bool is_same_file(int a, int b)
{
    struct stat x, y;
    return fstat(a, &x) == 0 && fstat(b, &y) == 0 && x.st_dev == y.st_dev && x.st_ino == y.st_ino;
}

trip_file_pieces *trip_file_pieces_create(const char *path, int fd, uint64_t file_bytes)
{
    trip_file_pieces *p = calloc(1, sizeof *p);
    if (!p)
        return NULL;
    p->fd = fd;
    p->file_bytes = file_bytes;
    p->direct_fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_DIRECT);
    p->memory = aligned_alloc(ALIGNMENT_BYTES, (size_t)THREADS * PIECE_BYTES);
    p->map = file_bytes > 0 ? mmap(NULL, file_bytes, PROT_READ, MAP_SHARED, fd, 0) : MAP_FAILED;
    if (p->direct_fd >= 0 && p->memory && p->map != MAP_FAILED && is_same_file(fd, p->direct_fd))
        return p;
    trip_file_pieces_destroy(p);
    return NULL;
}

void trip_file_pieces_destroy(trip_file_pieces *p)
{
    if (!p)
        return;
    if (p->map != MAP_FAILED)
        munmap(p->map, p->file_bytes);
    if (p->direct_fd >= 0)
        close(p->direct_fd);
    free(p->memory);
    free(p);
}

/* Whether the system holds all of [from, to), which is no longer than a piece. */
static bool is_held(const trip_file_pieces *p, uint64_t from, uint64_t to)
{
    unsigned char held[PIECE_BYTES / ALIGNMENT_BYTES + 1];
    uint64_t page = (uint64_t)sysconf(_SC_PAGESIZE), first = from & ~(page - 1);
    size_t pages = (size_t)((to - first + page - 1) / page);
    if (page < ALIGNMENT_BYTES || mincore(p->map + first, (size_t)(to - first), held) != 0)
        return false;
    for (size_t i = 0; i < pages; i++)
        if (!(held[i] & 1))
            return false;
    return true;
}

/* At least `least` bytes, of `bytes` that may reach beyond the end of the file. */
static bool read_whole(int fd, unsigned char *to, uint64_t offset, size_t bytes, size_t least)
{
    size_t done = 0;
    while (done < least) {
        ssize_t n = pread(fd, to + done, bytes - done, (off_t)(offset + done));
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return false;
        done += (size_t)n;
    }
    return true;
}

static bool read_piece(const job *j, uint64_t index, unsigned char *memory)
{
    uint64_t at = j->first + index * PIECE_BYTES, past = at + PIECE_BYTES;
    uint64_t from = at > j->begin ? at : j->begin, to = past < j->end ? past : j->end;
    unsigned char *goal = j->to + (from - j->begin);
    size_t wanted = (size_t)(to - from);
    if (is_held(j->file, from, to))
        return read_whole(j->file->fd, goal, from, wanted, wanted);
    size_t whole = (size_t)(to - at + ALIGNMENT_BYTES - 1) & ~((size_t)ALIGNMENT_BYTES - 1);
    if (!read_whole(j->file->direct_fd, memory, at, whole, (size_t)(to - at)))
        return false;
    memcpy(goal, memory + (from - at), wanted);
    return true;
}

static void *read_pieces(void *user)
{
    job *j = user;
    unsigned char *memory = j->file->memory + (size_t)PIECE_BYTES * atomic_fetch_add(&j->seats, 1);
    uint64_t index;
    trip_scope_enter(j->scope);
    while ((index = atomic_fetch_add(&j->next, 1)) < j->pieces && !atomic_load(&j->failed))
        if (trip_interrupted() || !read_piece(j, index, memory))
            atomic_store(&j->failed, true);
    return NULL;
}

bool trip_file_pieces_read(trip_file_pieces *p, uint64_t offset, void *to, size_t bytes)
{
    pthread_t threads[THREADS];
    unsigned started = 0;
    job j = { .file = p,
              .begin = offset,
              .end = offset + bytes,
              .scope = trip_scope_current(),
              .first = offset & ~((uint64_t)ALIGNMENT_BYTES - 1),
              .to = to };
    if (p->useless || bytes == 0 || j.end > p->file_bytes)
        return bytes == 0;
    j.pieces = (j.end - j.first + PIECE_BYTES - 1) / PIECE_BYTES;
    /* The calling thread is one of them. */
    while (started + 1 < THREADS && started + 1 < j.pieces &&
           pthread_create(&threads[started], NULL, read_pieces, &j) == 0)
        started++;
    read_pieces(&j);
    for (unsigned i = 0; i < started; i++)
        pthread_join(threads[i], NULL);
    p->useless = atomic_load(&j.failed);
    return !p->useless;
}
