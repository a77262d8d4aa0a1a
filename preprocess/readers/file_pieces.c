#include "file_pieces.h"

#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "read_at.h"
#include "report.h"

enum { THREADS = 4, PIECE_BYTES = 512 << 10, ALIGNMENT_BYTES = 4096 };

struct trip_file_pieces {
    int fd, direct_fd;
    uint64_t file_bytes;
    unsigned char *map;    /* mapping of the file for mincore(); its bytes are not accessed */
    unsigned char *memory; /* room for one piece per thread */
    bool failed;           /* a read failed; later ones are refused */
};

/* A read in progress. */
typedef struct job {
    const trip_file_pieces *file;
    uint64_t begin, end, first; /* first: aligned start of the pieces */
    uint64_t pieces;
    unsigned char *to;
    trip_scope *scope;         /* scope of the calling thread */
    atomic_uint_fast64_t next; /* number of the next piece to read */
    atomic_uint threads;       /* threads started, each with its piece of memory */
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

/* Returns whether the page cache holds all of [from, to), at most one piece. */
static bool is_cached(const trip_file_pieces *p, uint64_t from, uint64_t to)
{
    unsigned char cached[PIECE_BYTES / ALIGNMENT_BYTES + 1];
    uint64_t page = (uint64_t)sysconf(_SC_PAGESIZE), first = from & ~(page - 1);
    size_t pages = (size_t)((to - first + page - 1) / page);
    if (page < ALIGNMENT_BYTES || mincore(p->map + first, (size_t)(to - first), cached) != 0)
        return false;
    for (size_t i = 0; i < pages; i++)
        if (!(cached[i] & 1))
            return false;
    return true;
}

static bool read_piece(const job *j, uint64_t index, unsigned char *memory)
{
    uint64_t at = j->first + index * PIECE_BYTES, past = at + PIECE_BYTES;
    uint64_t from = at > j->begin ? at : j->begin, to = past < j->end ? past : j->end;
    unsigned char *goal = j->to + (from - j->begin);
    size_t wanted = (size_t)(to - from);
    if (is_cached(j->file, from, to))
        return trip_read_at(j->file->fd, goal, wanted, wanted, from) == (ssize_t)wanted;
    size_t whole = (size_t)(to - at + ALIGNMENT_BYTES - 1) & ~((size_t)ALIGNMENT_BYTES - 1);
    if (trip_read_at(j->file->direct_fd, memory, whole, (size_t)(to - at), at) < (ssize_t)(to - at))
        return false;
    memcpy(goal, memory + (from - at), wanted);
    return true;
}

static void *read_pieces(void *user)
{
    job *j = user;
    unsigned char *memory =
        j->file->memory + (size_t)PIECE_BYTES * atomic_fetch_add(&j->threads, 1);
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
    if (p->failed || bytes == 0 || j.end > p->file_bytes)
        return bytes == 0;
    j.pieces = (j.end - j.first + PIECE_BYTES - 1) / PIECE_BYTES;
    /* The calling thread is one of the readers. */
    while (started + 1 < THREADS && started + 1 < j.pieces &&
           pthread_create(&threads[started], NULL, read_pieces, &j) == 0)
        started++;
    read_pieces(&j);
    for (unsigned i = 0; i < started; i++)
        pthread_join(threads[i], NULL);
    p->failed = atomic_load(&j.failed);
    return !p->failed;
}
