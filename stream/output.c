#include "output.h"

#include "report.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <xxhash.h>

static int fail_write(const trip_output *o, uint64_t offset)
{
    if (errno == ENOSPC || errno == EDQUOT)
        return trip_fail(TRIP_ERROR, "write", o->path,
                         "no space left on the disk after %llu bytes: free some or write elsewhere",
                         (unsigned long long)offset);
    return trip_fail_errno("write", o->path, "cannot write");
}

static int write_all(trip_output *o, uint64_t offset, const void *data, size_t bytes)
{
    const unsigned char *p = data;
    while (bytes > 0) {
        ssize_t n = pwrite(o->fd, p, bytes, (off_t)offset);
        if (n < 0 && errno == EINTR)
            continue;
        if (n == 0)
            errno = ENOSPC;
        if (n <= 0)
            return fail_write(o, offset);
        p += n;
        offset += (uint64_t)n;
        bytes -= (size_t)n;
    }
    return TRIP_OK;
}

static int allocate(trip_output *o, const char *folder, const char *name, size_t buffer_bytes,
                    uint64_t skip_bytes, trip_budget *budget)
{
    *o = (trip_output){ .fd = -1, .budget = budget, .bytes = skip_bytes };
    if (asprintf(&o->path, "%s/%s", folder, name) < 0) {
        o->path = NULL;
        return trip_fail(TRIP_ERROR, "write", name, "out of memory");
    }
    o->buffer = trip_budget_take(budget, buffer_bytes);
    o->buffer_bytes = buffer_bytes;
    if (!o->buffer)
        return trip_fail(TRIP_ERROR, "write", o->path,
                         "no memory for a buffer of %zu bytes: give more with --memory",
                         buffer_bytes);
    o->fd = open(o->path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    return o->fd < 0 ? trip_fail_errno("write", o->path, "cannot create") : TRIP_OK;
}

int trip_output_create(trip_output *o, const char *folder, const char *name, size_t buffer_bytes,
                       uint64_t skip_bytes, trip_budget *budget)
{
    int status = allocate(o, folder, name, buffer_bytes, skip_bytes, budget);
    if (status < 0)
        trip_output_close(o);
    return status;
}

int trip_output_create_unnamed(trip_output *o, const char *folder, const char *name,
                               size_t buffer_bytes, trip_budget *budget)
{
    int status = trip_output_create(o, folder, name, buffer_bytes, 0, budget);
    if (status == TRIP_OK && unlink(o->path) < 0) {
        status = trip_fail_errno("write", o->path, "cannot unlink");
        trip_output_close(o);
    }
    return status;
}

/* Checksums of the buffered pages, the last one possibly short. */
static int append_checksums(trip_output *o)
{
    for (size_t at = 0; at < o->used_bytes; at += o->page_bytes) {
        size_t left = o->used_bytes - at;
        uint64_t sum = XXH64(o->buffer + at, left < o->page_bytes ? left : o->page_bytes, 0);
        int status = trip_output_append(o->checksums, &sum, sizeof sum);
        if (status < 0)
            return status;
    }
    return TRIP_OK;
}

int trip_output_flush(trip_output *o)
{
    uint64_t offset = o->bytes - o->used_bytes;
    int status = o->page_bytes ? append_checksums(o) : TRIP_OK;
    if (status == TRIP_OK)
        status = write_all(o, offset, o->buffer, o->used_bytes);
    if (status < 0)
        return status;
    /* Starts the disk now, so that the last sync is short and dirty pages do not pile up. Advice:
     * a file system that does not know it does no harm. */
    sync_file_range(o->fd, (off_t)offset, (off_t)o->used_bytes, SYNC_FILE_RANGE_WRITE);
    o->used_bytes = 0;
    return TRIP_OK;
}

int trip_output_append(trip_output *o, const void *data, size_t bytes)
{
    const unsigned char *p = data;
    while (bytes > 0) {
        size_t room = o->buffer_bytes - o->used_bytes;
        size_t n = bytes < room ? bytes : room;
        memcpy(o->buffer + o->used_bytes, p, n);
        o->used_bytes += n;
        o->bytes += n;
        p += n;
        bytes -= n;
        int status = o->used_bytes == o->buffer_bytes ? trip_output_flush(o) : TRIP_OK;
        if (status < 0)
            return status;
    }
    return TRIP_OK;
}

int trip_output_read(const trip_output *o, uint64_t offset, void *data, size_t bytes)
{
    unsigned char *p = data;
    while (bytes > 0) {
        ssize_t n = pread(o->fd, p, bytes, (off_t)offset);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0) {
            errno = n == 0 ? EIO : errno;
            return trip_fail_errno("write", o->path, "cannot read back");
        }
        p += n;
        offset += (uint64_t)n;
        bytes -= (size_t)n;
    }
    return TRIP_OK;
}

int trip_output_append_output(trip_output *o, trip_output *from)
{
    unsigned char block[16384];
    int status = trip_output_flush(from);
    for (uint64_t at = 0; status == TRIP_OK && at < from->bytes;) {
        size_t n = from->bytes - at < sizeof block ? (size_t)(from->bytes - at) : sizeof block;
        status = trip_output_read(from, at, block, n);
        if (status == TRIP_OK)
            status = trip_output_append(o, block, n);
        at += n;
    }
    return status;
}

int trip_output_align(trip_output *o, size_t alignment)
{
    static const unsigned char zeros[64];
    return trip_output_append(o, zeros, (alignment - o->bytes % alignment) % alignment);
}

int trip_output_patch(trip_output *o, uint64_t offset, const void *data, size_t bytes)
{
    return write_all(o, offset, data, bytes);
}

int trip_output_sync(trip_output *o)
{
    int status = trip_output_flush(o);
    if (status == TRIP_OK && fsync(o->fd) < 0)
        status = errno == ENOSPC || errno == EDQUOT ? fail_write(o, o->bytes)
                                                    : trip_fail_errno("write", o->path, "sync");
    return status;
}

void trip_output_close(trip_output *o)
{
    if (o->path && o->fd >= 0)
        close(o->fd);
    if (o->budget)
        trip_budget_release(o->budget, o->buffer, o->buffer_bytes);
    free(o->path);
    *o = (trip_output){ .fd = -1 };
}
