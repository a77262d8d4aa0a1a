#include "plain_disk.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <sys/stat.h>
#include <unistd.h>

#include "clock.h"
#include "report.h"

/* The transfers of one file, shared by the threads. */
typedef struct job {
    int fd;
    bool write, look;
    uint64_t transfers;
    atomic_uint_fast64_t next;
    atomic_uint_fast64_t bytes;
    atomic_int error;  /* errno of the first failure */
    trip_scope *scope; /* scope of the caller */
    unsigned char *memory;
    atomic_uint taken; /* number of memory parts in use, one for each thread */
    atomic_uint seen;  /* sum of the bytes looked at, so that the compiler keeps the loads */
} job;

static ssize_t move_transfer(const job *j, unsigned char *transfer, uint64_t i)
{
    off_t offset = (off_t)(i * PLAIN_DISK_TRANSFER_BYTES);
    ssize_t n = j->write ? pwrite(j->fd, transfer, PLAIN_DISK_TRANSFER_BYTES, offset)
                         : pread(j->fd, transfer, PLAIN_DISK_TRANSFER_BYTES, offset);
    if (j->write && n >= 0 && n < PLAIN_DISK_TRANSFER_BYTES) {
        errno = ENOSPC;
        return -1;
    }
    return n;
}

static unsigned look_at(const unsigned char *transfer, size_t bytes)
{
    enum { LINE = 64 };
    unsigned seen = 0;
    for (size_t i = 0; i < bytes; i += LINE)
        seen += transfer[i];
    return seen;
}

static void *move_transfers(void *argument)
{
    job *j = argument;
    unsigned char *transfer =
        j->memory + (size_t)PLAIN_DISK_TRANSFER_BYTES * atomic_fetch_add(&j->taken, 1);
    uint64_t i;
    trip_scope_enter(j->scope);
    while (!trip_interrupted() && (i = atomic_fetch_add(&j->next, 1)) < j->transfers &&
           !atomic_load(&j->error)) {
        ssize_t n = move_transfer(j, transfer, i);
        if (n < 0)
            atomic_store(&j->error, errno);
        else
            atomic_fetch_add(&j->bytes, (uint64_t)n);
        if (j->look && n > 0)
            atomic_fetch_add(&j->seen, look_at(transfer, (size_t)n));
    }
    return NULL;
}

/* Runs the threads. Returns 0 or an errno. */
static int share_out(job *j)
{
    pthread_t threads[PLAIN_DISK_THREADS];
    int started = 0, error = 0;
    for (; started < PLAIN_DISK_THREADS && !error; started += !error)
        error = pthread_create(&threads[started], NULL, move_transfers, j);
    for (int i = 0; i < started; i++)
        pthread_join(threads[i], NULL);
    return error ? error : atomic_load(&j->error);
}

/* Transfers `bytes` of an open file, then closes it. */
static int move_file(plain_disk *d, int fd, bool write, uint64_t bytes, const char *path,
                     void *memory)
{
    job j = { .fd = fd,
              .write = write,
              .look = d->look && !write,
              .transfers = (bytes + PLAIN_DISK_TRANSFER_BYTES - 1) / PLAIN_DISK_TRANSFER_BYTES,
              .scope = trip_scope_current(),
              .memory = memory };
    double begin = trip_now_seconds();
    int error = share_out(&j);
    if (!error && write && !trip_interrupted() && fsync(fd) < 0)
        error = errno;
    d->seconds += trip_now_seconds() - begin;
    d->bytes += atomic_load(&j.bytes);
    close(fd);
    if (trip_interrupted())
        return trip_fail(TRIP_INTERRUPTED, write ? "write" : "read", path, "interrupted");
    errno = error;
    return error ? trip_fail_errno(write ? "write" : "read", path, NULL) : 0;
}

/* Opens a file with O_DIRECT, or without it if the file system refuses it. */
static int open_file(plain_disk *d, const char *path, int flags)
{
    int fd = open(path, flags | O_CLOEXEC | O_DIRECT, 0600);
    d->direct = fd >= 0;
    return fd < 0 && errno == EINVAL ? open(path, flags | O_CLOEXEC, 0600) : fd;
}

int plain_disk_read(plain_disk *d, const char *path, void *memory)
{
    struct stat file;
    int fd = open_file(d, path, O_RDONLY);
    if (fd < 0)
        return trip_fail_errno("read", path, "cannot open");
    if (fstat(fd, &file) == 0)
        return move_file(d, fd, false, (uint64_t)file.st_size, path, memory);
    int status = trip_fail_errno("read", path, NULL);
    close(fd);
    return status;
}

int plain_disk_write(plain_disk *d, const char *folder, uint64_t bytes, void *memory)
{
    int fd = open_file(d, folder, O_TMPFILE | O_WRONLY);
    if (fd < 0)
        return trip_fail_errno("write", folder, "cannot create an unnamed file");
    return move_file(d, fd, true, bytes, folder, memory);
}

void plain_disk_forget(const char *path)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0)
        return;
    fsync(fd); /* the kernel drops clean pages only */
    posix_fadvise(fd, 0, 0, POSIX_FADV_DONTNEED);
    close(fd);
}
