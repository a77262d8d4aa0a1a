/* One read of some pages of a plane file into a slot: made by the reader, carried out and checked
 * on an engine's thread, which then calls `done`. Faults are noted here and reported by the reader
 * when their turn comes, so that the message does not depend on timing. */
#ifndef TRIP_REQUEST_H
#define TRIP_REQUEST_H

#include <stdatomic.h>
#include <stdbool.h>

#include "cache.h"

/* A plane file being read. */
typedef struct trip_source {
    int fd;
    int direct_fd;                /* the same file with O_DIRECT; -1 where that is refused */
    _Atomic bool *direct_refused; /* set by the first engine thread that finds out: relaxed */
    uint64_t file_bytes;
    unsigned page_log2;
    const uint64_t *checksums; /* of the file's pages */
    trip_cache *cache;         /* or NULL */
    uint32_t first_page;       /* of the file, in the cache */
    long (*fault)(void *user, void *data, uint64_t offset, size_t bytes, long result);
    void *fault_user;
} trip_source;

typedef enum trip_request_fault {
    TRIP_REQUEST_OK,
    TRIP_REQUEST_ERRNO,
    TRIP_REQUEST_SHORT,    /* the file ends at fault_at */
    TRIP_REQUEST_CHECKSUM, /* of the page at fault_at */
} trip_request_fault;

typedef struct trip_request {
    const trip_source *source;
    unsigned char *data; /* room for whole pages */
    uint64_t offset;     /* of a page */
    size_t bytes;        /* whole pages, but not beyond the file's end */
    void (*done)(struct trip_request *q);
    void *owner;
    const trip_list *list;
    int plane;
    bool cached;               /* all its pages are in the cache and are copied from there */
    bool keep;                 /* pages that the cache has made room for are stored there */
    struct trip_request *next; /* the engine's */
    _Atomic bool given;        /* the engine's: set (release) when it goes to the kernel */
    _Atomic bool given_up;     /* set by the reader (relaxed): it ends before its next read */
    /* Result; the reader's again after `done`. */
    bool direct;
    size_t done_bytes;
    unsigned reads;
    trip_request_fault fault;
    uint64_t fault_at;
    int fault_errno;
} trip_request;

/* The next read that the request needs. */
typedef struct trip_read {
    int fd;
    void *data;
    uint64_t offset;
    size_t bytes;
} trip_read;

void trip_request_start(trip_request *q);
trip_read trip_request_read(const trip_request *q);
/* Takes the result of that read, a count or -errno. True when another is needed; false when the
 * request is over: then it has been checked and `done` called, and it belongs to the reader. */
bool trip_request_step(trip_request *q, long result);
/* Carries out the rest of the request on this thread: all of it where it is cached. One that was
 * given up is over at once, and nothing may be made of its result. */
void trip_request_run(trip_request *q);

#endif
