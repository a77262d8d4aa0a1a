/* One read of some pages of a plane file into a slot. The reader creates it. A thread of the engine
 * carries it out, checks the pages, and calls `done`. Faults are stored here. The reader reports
 * them in draw order, so that messages do not depend on timing. */
#ifndef TRIP_REQUEST_H
#define TRIP_REQUEST_H

#include <stdatomic.h>
#include <stdbool.h>

#include "cache.h"

/* A plane file to read. */
typedef struct trip_source {
    int fd;
    int direct_fd;                /* the same file with O_DIRECT, or -1 */
    _Atomic bool *direct_refused; /* set by the first engine thread that is refused (relaxed) */
    uint64_t file_bytes;
    unsigned page_log2;
    const uint64_t *checksums; /* of the file's pages */
    trip_cache *cache;         /* may be NULL */
    uint32_t first_page;       /* index of the file's first page in the cache */
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
    size_t bytes;        /* whole pages, but not beyond the end of the file */
    void (*done)(struct trip_request *q);
    void *owner;
    const trip_list *list;
    int plane;
    bool cached;               /* all pages are copied from the cache */
    bool keep;                 /* stores pages for which the cache has reserved room */
    struct trip_request *next; /* used by the engine */
    _Atomic bool given;        /* used by the engine: set (release) when the kernel gets it */
    _Atomic bool given_up; /* set by the reader (relaxed): the request ends before its next read */
    /* The result, which belongs to the reader after `done`. */
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
/* Takes the read's result, a count or -errno. Returns true if another read is needed. Returns
 * false if the request is over: it has been checked, `done` was called, and it belongs to the
 * reader. */
bool trip_request_step(trip_request *q, long result);
/* Carries out the rest of the request on this thread, or all of a cached request. A request that
 * was given up ends at once, and its result is invalid. */
void trip_request_run(trip_request *q);

#endif
