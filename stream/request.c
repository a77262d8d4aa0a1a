#include "request.h"

#include <errno.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>
#include <xxhash.h>

enum { DIRECT_ALIGNMENT_BYTES = 4096 };

void trip_request_start(trip_request *q)
{
    q->direct = q->source->direct_fd >= 0 &&
                !atomic_load_explicit(q->source->direct_refused, memory_order_relaxed);
    atomic_store_explicit(&q->given, false, memory_order_relaxed);
    atomic_store_explicit(&q->given_up, false, memory_order_relaxed);
    q->done_bytes = 0;
    q->reads = 0;
    q->fault = TRIP_REQUEST_OK;
}

/* A direct read has whole sectors, and may reach beyond the end of the file. */
trip_read trip_request_read(const trip_request *q)
{
    size_t bytes = q->bytes - q->done_bytes;
    if (q->direct)
        bytes = (bytes + DIRECT_ALIGNMENT_BYTES - 1) & ~(size_t)(DIRECT_ALIGNMENT_BYTES - 1);
    return (trip_read){ .fd = q->direct ? q->source->direct_fd : q->source->fd,
                        .data = q->data + q->done_bytes,
                        .offset = q->offset + q->done_bytes,
                        .bytes = bytes };
}

static void fail(trip_request *q, trip_request_fault fault, uint64_t at, int number)
{
    q->fault = fault;
    q->fault_at = at;
    q->fault_errno = number;
}

/* Checks the pages, and stores the pages for which the cache has reserved room. */
static void check_pages(trip_request *q)
{
    const trip_source *s = q->source;
    size_t page_bytes = (size_t)1 << s->page_log2;
    uint64_t page = q->offset >> s->page_log2;
    for (size_t at = 0; at < q->bytes; at += page_bytes, page++) {
        size_t left = q->bytes - at, bytes = left < page_bytes ? left : page_bytes;
        if (XXH64(q->data + at, bytes, 0) != s->checksums[page]) {
            fail(q, TRIP_REQUEST_CHECKSUM, q->offset + at, 0);
            return;
        }
        if (q->keep)
            trip_cache_store(s->cache, s->first_page + (uint32_t)page, q, q->data + at, bytes);
    }
}

static void copy_pages(trip_request *q)
{
    const trip_source *s = q->source;
    size_t page_bytes = (size_t)1 << s->page_log2;
    uint32_t page = s->first_page + (uint32_t)(q->offset >> s->page_log2);
    for (size_t at = 0; at < q->bytes; at += page_bytes, page++) {
        size_t left = q->bytes - at;
        memcpy(q->data + at, trip_cache_get(s->cache, page), left < page_bytes ? left : page_bytes);
    }
    q->done_bytes = q->bytes;
    q->done(q);
}

/* Whether the read can be tried again. The first direct read fails if the file system or the memory
 * does not support it. */
static bool take_error(trip_request *q, int number)
{
    if (number == EINTR || number == EAGAIN)
        return true;
    if (q->direct && (number == EINVAL || number == EFAULT || number == EOPNOTSUPP)) {
        atomic_store_explicit(q->source->direct_refused, true, memory_order_relaxed);
        q->direct = false;
        return true;
    }
    fail(q, TRIP_REQUEST_ERRNO, q->offset + q->done_bytes, number);
    return false;
}

static bool take_bytes(trip_request *q, size_t bytes)
{
    size_t left = q->bytes - q->done_bytes;
    q->done_bytes += bytes < left ? bytes : left;
    if (q->done_bytes == q->bytes) {
        check_pages(q);
        return false;
    }
    if (bytes == 0)
        fail(q, TRIP_REQUEST_SHORT, q->offset + q->done_bytes, 0);
    /* The rest may no longer be aligned. */
    q->direct = false;
    return bytes > 0;
}

bool trip_request_step(trip_request *q, long result)
{
    const trip_source *s = q->source;
    if (s->fault) {
        trip_read read = trip_request_read(q);
        result = s->fault(s->fault_user, read.data, read.offset, read.bytes, result);
    }
    q->reads++;
    bool more = result < 0 ? take_error(q, (int)-result) : take_bytes(q, (size_t)result);
    if (!more)
        q->done(q);
    return more;
}

void trip_request_run(trip_request *q)
{
    long result;
    do {
        if (atomic_load_explicit(&q->given_up, memory_order_relaxed)) {
            q->done(q);
            return;
        }
        if (q->cached) {
            copy_pages(q);
            return;
        }
        trip_read read = trip_request_read(q);
        ssize_t n = pread(read.fd, read.data, read.bytes, (off_t)read.offset);
        result = n < 0 ? -errno : n;
    } while (trip_request_step(q, result));
}
