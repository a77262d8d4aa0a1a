#include "output.h"

#include "read_at.h"
#include "report.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <xxhash.h>

static int fail_write(const trip_output *o, uint64_t offset, int error)
{
    if (o->failed && atomic_exchange_explicit(o->failed, true, memory_order_relaxed))
        return TRIP_ERROR;
    if (error == ENOSPC || error == EDQUOT)
        return trip_fail(TRIP_ERROR, "write", o->path,
                         "no space left on the disk after %llu bytes; free some or write elsewhere",
                         (unsigned long long)offset);
    errno = error;
    return trip_fail_errno("write", o->path, "cannot write");
}

static size_t memory_bytes(const trip_output *o)
{
    return o->flusher ? 2 * o->buffer_bytes : o->buffer_bytes;
}

static unsigned char *filling(const trip_output *o)
{
    return o->buffer + o->filling * o->buffer_bytes;
}

static int create_named(trip_output *o)
{
    o->fd = open(o->path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (o->fd < 0)
        return trip_fail_errno("write", o->path, "cannot create");
    if (o->flusher)
        fcntl(o->fd, F_SETFL, O_DIRECT); /* if refused, writes go through the page cache */
    return TRIP_OK;
}

static int create_unnamed(trip_output *o)
{
    o->fd = mkostemp(o->path, O_CLOEXEC);
    if (o->fd < 0)
        return fail_write(o, 0, errno);
    return unlink(o->path) < 0 ? trip_fail_errno("write", o->path, "cannot unlink") : TRIP_OK;
}

static int open_output(trip_output *o, const trip_output_params *p)
{
    if (asprintf(&o->path, "%s/%s", p->folder, p->name) < 0) {
        o->path = NULL;
        return trip_fail(TRIP_ERROR, "write", p->name, "out of memory");
    }
    o->buffer = trip_budget_take(o->budget, memory_bytes(o));
    if (!o->buffer)
        return trip_fail(TRIP_ERROR, "write", o->path,
                         "no memory for a buffer of %zu bytes; raise --memory", memory_bytes(o));
    return p->unnamed ? TRIP_OK : create_named(o);
}

int trip_output_create(trip_output *o, const trip_output_params *params, trip_budget *budget)
{
    *o = (trip_output){ .fd = -1,
                        .budget = budget,
                        .buffer_bytes = params->buffer_bytes,
                        .flusher = params->flusher,
                        .failed = params->failed,
                        .bytes = params->skip_bytes,
                        .page_bytes = params->page_bytes,
                        .checksums = params->checksums };
    int status = open_output(o, params);
    if (status < 0)
        trip_output_close(o);
    return status;
}

/* Appends the checksums of the buffered pages. The last page may be short. */
static int append_checksums(trip_output *o)
{
    for (size_t at = 0; at < o->used_bytes; at += o->page_bytes) {
        size_t left = o->used_bytes - at;
        uint64_t sum = XXH64(filling(o) + at, left < o->page_bytes ? left : o->page_bytes, 0);
        int status = trip_output_append(o->checksums, &sum, sizeof sum);
        if (status < 0)
            return status;
    }
    return TRIP_OK;
}

/* Waits for the flusher's job. */
static int wait_written(trip_output *o)
{
    int error = o->flusher ? trip_flusher_wait(o->flusher, &o->job) : 0;
    return error ? fail_write(o, o->job.offset, error) : TRIP_OK;
}

/* Passes the full buffer to the flusher, and switches to the other buffer. */
static int send_buffer(trip_output *o)
{
    int status = o->page_bytes ? append_checksums(o) : TRIP_OK;
    if (status == TRIP_OK)
        status = wait_written(o);
    if (status < 0)
        return status;
    o->job = (trip_flush_job){
        .fd = o->fd, .data = filling(o), .bytes = o->used_bytes, .offset = o->bytes - o->used_bytes
    };
    trip_flusher_submit(o->flusher, &o->job);
    o->filling ^= 1;
    o->used_bytes = 0;
    return TRIP_OK;
}

/* Unnamed files do not exist from the start. */
static bool has_file(const trip_output *o)
{
    return o->fd >= 0;
}

/* The remaining bytes may not be whole sectors, so they go through the page cache. */
int trip_output_flush(trip_output *o)
{
    uint64_t offset = o->bytes - o->used_bytes;
    if (!has_file(o) && o->used_bytes < o->buffer_bytes)
        return TRIP_OK;
    int status = has_file(o) ? TRIP_OK : create_unnamed(o);
    if (status == TRIP_OK && o->page_bytes)
        status = append_checksums(o);
    if (status == TRIP_OK)
        status = wait_written(o);
    if (status < 0)
        return status;
    if (o->flusher)
        fcntl(o->fd, F_SETFL, 0);
    int error = trip_flusher_write(o->fd, filling(o), o->used_bytes, offset);
    if (error)
        return fail_write(o, offset, error);
    o->used_bytes = 0;
    return TRIP_OK;
}

int trip_output_reserve(trip_output *o, uint64_t bytes)
{
    const int status = has_file(o) ? TRIP_OK : create_unnamed(o);
    if (status == TRIP_OK)
        o->bytes = bytes;
    return status;
}

int trip_output_append(trip_output *o, const void *data, size_t bytes)
{
    const unsigned char *p = data;
    while (bytes > 0) {
        size_t room = o->buffer_bytes - o->used_bytes;
        size_t n = bytes < room ? bytes : room;
        memcpy(filling(o) + o->used_bytes, p, n);
        o->used_bytes += n;
        o->bytes += n;
        p += n;
        bytes -= n;
        int status = TRIP_OK;
        if (o->used_bytes == o->buffer_bytes)
            status = o->flusher ? send_buffer(o) : trip_output_flush(o);
        if (status < 0)
            return status;
    }
    return TRIP_OK;
}

static int fail_read(const trip_output *o, int error)
{
    errno = error;
    return trip_fail_errno("write", o->path, "cannot read back");
}

static int read_file(const trip_output *o, uint64_t offset, void *data, size_t bytes)
{
    const ssize_t n = trip_read_at(o->fd, data, bytes, bytes, offset);
    if (n < 0 || (size_t)n < bytes)
        return fail_read(o, n < 0 ? errno : EIO);
    return TRIP_OK;
}

int trip_output_read(const trip_output *o, uint64_t offset, void *data, size_t bytes)
{
    if (has_file(o))
        return read_file(o, offset, data, bytes);
    if (offset > o->used_bytes || bytes > o->used_bytes - offset)
        return fail_read(o, EIO);
    memcpy(data, o->buffer + offset, bytes);
    return TRIP_OK;
}

void trip_output_announce_read(const trip_output *o, uint64_t offset, uint64_t bytes)
{
    if (has_file(o) && bytes)
        posix_fadvise(o->fd, (off_t)offset, (off_t)bytes, POSIX_FADV_WILLNEED);
}

int trip_output_append_output(trip_output *o, trip_output *from)
{
    unsigned char part[16384];
    int status = trip_output_flush(from);
    for (uint64_t at = 0; status == TRIP_OK && at < from->bytes;) {
        size_t n = from->bytes - at < sizeof part ? (size_t)(from->bytes - at) : sizeof part;
        status = trip_output_read(from, at, part, n);
        if (status == TRIP_OK)
            status = trip_output_append(o, part, n);
        at += n;
    }
    return status;
}

int trip_output_align(trip_output *o, size_t alignment)
{
    static const unsigned char zeros[64];
    return trip_output_append(o, zeros, (alignment - o->bytes % alignment) % alignment);
}

int trip_output_patch(const trip_output *o, uint64_t offset, const void *data, size_t bytes)
{
    int error = trip_flusher_write(o->fd, data, bytes, offset);
    return error ? fail_write(o, offset, error) : TRIP_OK;
}

int trip_output_start_sync(trip_output *o)
{
    int status = trip_output_flush(o);
    if (status == TRIP_OK) {
        o->job = (trip_flush_job){ .fd = o->fd, .offset = o->bytes };
        trip_flusher_submit(o->flusher, &o->job);
    }
    return status;
}

int trip_output_sync(trip_output *o)
{
    if (o->flusher)
        return wait_written(o);
    int status = trip_output_flush(o);
    if (status == TRIP_OK && fsync(o->fd) < 0)
        return fail_write(o, o->bytes, errno);
    return status;
}

void trip_output_close(trip_output *o)
{
    if (o->flusher && o->fd >= 0)
        trip_flusher_wait(o->flusher, &o->job);
    if (o->path && o->fd >= 0)
        close(o->fd);
    if (o->budget)
        trip_budget_release(o->budget, o->buffer, memory_bytes(o));
    free(o->path);
    *o = (trip_output){ .fd = -1 };
}
