#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include "disk_time.h"

#include <fcntl.h>
#include <libgen.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "clock.h"

/* Bytes written in a trial, and bytes and number of the parts read. */
#define WRITE_BYTES ((size_t)32 << 20)
#define PART_BYTES ((size_t)4 << 20)
enum { PARTS = 4, PROBES = 64, PAGE = 4096 };

double trip_disk_time_read(const trip_read_cost *c)
{
    const double again = c->bytes > c->cache_bytes ? (double)c->bytes : 0;
    const double read = (double)c->uncached_bytes + (c->passes - 1) * again;
    return fmax(c->compute_seconds, read * c->seconds_per_byte);
}

/* Returns whether the page at an offset is in the page cache; -1 if unknown. */
static int is_cached(int fd, off_t offset)
{
    unsigned char there = 0;
    void *page = mmap(NULL, PAGE, PROT_READ, MAP_SHARED, fd, offset);
    if (page == MAP_FAILED)
        return -1;
    const int status = mincore(page, PAGE, &there);
    munmap(page, PAGE);
    return status == 0 ? there & 1 : -1;
}

uint64_t trip_disk_time_uncached(const char *path)
{
    struct stat st;
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    int missing = 0;
    if (fd < 0 || fstat(fd, &st) != 0 || !S_ISREG(st.st_mode))
        st.st_size = 0;
    for (int i = 0; i < PROBES && st.st_size > 0; i++)
        missing += is_cached(fd, st.st_size / PROBES * i / PAGE * PAGE) == 0;
    if (fd >= 0)
        close(fd);
    return (uint64_t)((double)st.st_size * missing / PROBES);
}

/* Reads parts of a file in equal distances. Returns the seconds per byte. */
static double read_parts(int fd, off_t bytes, void *memory)
{
    const double begin = trip_now_seconds();
    double done = 0;
    for (int i = 0; i < PARTS; i++) {
        const ssize_t n = pread(fd, memory, PART_BYTES, bytes / PARTS * i / PAGE * PAGE);
        done += n > 0 ? (double)n : 0;
    }
    return done > 0 ? (trip_now_seconds() - begin) / done : 0;
}

double trip_disk_time_reading(const char *path)
{
    struct stat st;
    void *memory = aligned_alloc(PAGE, PART_BYTES);
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_DIRECT);
    double seconds = 0;
    if (memory && fd >= 0 && fstat(fd, &st) == 0 && S_ISREG(st.st_mode))
        seconds = read_parts(fd, st.st_size, memory);
    if (fd >= 0)
        close(fd);
    free(memory);
    return seconds;
}

double trip_disk_time_writing(const char *path)
{
    char *copy = strdup(path);
    void *data = aligned_alloc(PAGE, WRITE_BYTES);
    double seconds = 1e-9;
    const int fd =
        copy ? open(dirname(copy), O_TMPFILE | O_WRONLY | O_CLOEXEC | O_DIRECT, 0600) : -1;
    if (fd >= 0 && data) {
        memset(data, 1, WRITE_BYTES);
        const double begin = trip_now_seconds();
        if (write(fd, data, WRITE_BYTES) == (ssize_t)WRITE_BYTES)
            seconds = (trip_now_seconds() - begin) / (double)WRITE_BYTES;
    }
    if (fd >= 0)
        close(fd);
    free(data);
    free(copy);
    return seconds;
}
