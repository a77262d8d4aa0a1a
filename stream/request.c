#include "request.h"

#include <errno.h>
#include <sys/types.h>
#include <unistd.h>
#include <xxhash.h>

enum { DIRECT_ALIGNMENT_BYTES = 4096 };

void trip_request_start(trip_request *q)
{
    q->direct = q->source->direct_fd >= 0 &&
                !atomic_load_explicit(q->source->direct_refused, memory_order_relaxed);
    q->done_bytes = 0;
    q->reads = 0;
    q->fault = TRIP_REQUEST_OK;
}

/* A direct read takes whole blocks: at the file's end it asks for more than there is. */
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

static void check_pages(trip_request *q)
{
    size_t page = (size_t)1 << q->source->page_log2;
    const uint64_t *sum = q->source->checksums + (q->offset >> q->source->page_log2);
    for (size_t at = 0; at < q->bytes; at += page, sum++) {
        size_t left = q->bytes - at;
        if (XXH64(q->data + at, left < page ? left : page, 0) != *sum) {
            fail(q, TRIP_REQUEST_CHECKSUM, q->offset + at, 0);
            return;
        }
    }
}

/* Whether the read can be tried again. A file system or memory that takes no direct reads says so
 * at the first one. */
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
    /* The rest may not be aligned any more. */
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
        trip_read read = trip_request_read(q);
        ssize_t n = pread(read.fd, read.data, read.bytes, (off_t)read.offset);
        result = n < 0 ? -errno : n;
    } while (trip_request_step(q, result));
}
