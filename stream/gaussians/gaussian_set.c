#include "gaussian_set.h"

#include "dataset.h"
#include "gaussian_check.h"
#include "gaussian_code.h"
#include "read_at.h"
#include "report.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

enum { WHERE_BYTES = 4096 };

const char *trip_gaussian_plane_name(const trip_file_gaussian_header *h, int axis, unsigned plane,
                                     char *name)
{
    if (plane && h->flags & TRIP_GAUSSIAN_PALETTE)
        snprintf(name, 32, "%c.palette", "xyz"[axis]);
    else if (plane)
        snprintf(name, 32, "%c.harmonics%u", "xyz"[axis], plane);
    else
        snprintf(name, 32, "%c.gaussians", "xyz"[axis]);
    return name;
}

static const char *set_where(const trip_gaussian_set *s, const char *name, char *where)
{
    snprintf(where, WHERE_BYTES, "%s/%s", s->path, name);
    return where;
}

bool trip_gaussian_set_is(const char *path)
{
    char name[WHERE_BYTES], magic[8] = { 0 };
    snprintf(name, sizeof name, "%s/" TRIP_INDEX_NAME, path);
    const int fd = open(name, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    const bool is = fd >= 0 && trip_read_at(fd, magic, sizeof magic, sizeof magic, 0) == 8 &&
                    memcmp(magic, TRIP_GAUSSIAN_MAGIC, sizeof magic) == 0;
    if (fd >= 0)
        close(fd);
    return is;
}

/* Opens a regular file of the data set. Never waits, as opening a pipe would. */
static int open_file(const trip_gaussian_set *s, int folder, const char *name, int *fd,
                     uint64_t *bytes)
{
    char where[WHERE_BYTES];
    struct stat st;
    set_where(s, name, where);
    *fd = openat(folder, name, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (*fd < 0 && errno == ENOENT)
        return trip_fail(TRIP_ERROR, "open", where,
                         "the file is missing, so this is not a data set; make one with "
                         "`triptych brick`");
    if (*fd < 0 || fstat(*fd, &st) < 0)
        return trip_fail_errno("open", where, "cannot open");
    if (!S_ISREG(st.st_mode))
        return trip_fail(TRIP_ERROR, "open", where, "not a regular file");
    *bytes = (uint64_t)st.st_size;
    return TRIP_OK;
}

static int read_at(int fd, const char *where, uint64_t offset, void *data, size_t bytes)
{
    const ssize_t n = trip_read_at(fd, data, bytes, bytes, offset);
    if (n < 0)
        return trip_fail_errno("open", where, "cannot read");
    if ((size_t)n < bytes)
        return trip_fail(TRIP_ERROR, "open", where, "ends early, at byte %llu",
                         (unsigned long long)(offset + (uint64_t)n));
    return TRIP_OK;
}

static int read_index(trip_gaussian_set *s, int fd, uint64_t file_bytes)
{
    char where[WHERE_BYTES];
    set_where(s, TRIP_INDEX_NAME, where);
    if (file_bytes < sizeof s->header)
        return trip_fail(TRIP_ERROR, "open", where, "%llu bytes, shorter than its header of %zu",
                         (unsigned long long)file_bytes, sizeof s->header);
    int status = read_at(fd, where, 0, &s->header, sizeof s->header);
    if (status == TRIP_OK)
        status = trip_gaussian_check_header(&s->header, file_bytes, where);
    if (status < 0)
        return status;
    s->memory = trip_budget_take(s->budget, file_bytes + 1); /* zeroed, so the text ends */
    if (!s->memory)
        return trip_fail(TRIP_ERROR, "open", where,
                         "no memory for the index of %llu bytes; raise --memory",
                         (unsigned long long)file_bytes);
    s->memory_bytes = file_bytes + 1;
    status = read_at(fd, where, 0, s->memory, file_bytes);
    return status == TRIP_OK ? trip_gaussian_check_tables(s->memory, &s->header, where) : status;
}

static int open_plane(trip_gaussian_set *s, int folder, int axis, unsigned plane)
{
    char name[32], where[WHERE_BYTES];
    uint64_t bytes = 0;
    const uint64_t wanted = s->header.list_records * trip_gaussian_plane_bytes(&s->header, plane);
    trip_gaussian_plane_name(&s->header, axis, plane, name);
    const int status = open_file(s, folder, name, &s->lists[axis].fd[plane], &bytes);
    if (status < 0)
        return status;
    s->bytes += bytes;
    return bytes == wanted ? TRIP_OK
                           : trip_fail(TRIP_ERROR, "open", set_where(s, name, where),
                                       "%llu bytes instead of %llu", (unsigned long long)bytes,
                                       (unsigned long long)wanted);
}

static int open_files(trip_gaussian_set *s, int folder)
{
    int fd;
    int status = open_file(s, folder, TRIP_INDEX_NAME, &fd, &s->bytes);
    if (status == TRIP_OK)
        status = read_index(s, fd, s->bytes);
    if (fd >= 0)
        close(fd);
    if (status < 0)
        return status;
    unsigned char *index = s->memory;
    s->text = (char *)index + s->header.text_offset;
    s->nodes = (const void *)(index + s->header.nodes_offset);
    if (s->header.palette_count)
        s->palette = index + s->header.palette_offset;
    const unsigned planes = trip_gaussian_plane_count(&s->header, (int)s->header.degree);
    for (int a = 0; a < 3; a++) {
        s->lists[a].bricks = (const void *)(index + s->header.bricks_offset[a]);
        s->lists[a].brick_count = s->header.brick_count[a];
        for (unsigned plane = 0; plane < planes && status == TRIP_OK; plane++)
            status = open_plane(s, folder, a, plane);
    }
    return status;
}

static void find_finest(trip_gaussian_set *s)
{
    for (int a = 0; a < 3; a++) {
        s->finest_lo[a] = INFINITY;
        s->finest_hi[a] = -INFINITY;
    }
    for (uint64_t n = 0; n < s->header.node_count; n++) {
        const trip_file_gaussian_node *node = &s->nodes[n];
        const trip_file_gaussian_brick *b = s->lists[0].bricks + node->first_brick[0];
        for (uint64_t i = 0; i < node->brick_count[0] && node->nodes == 1; i++)
            for (int a = 0; a < 3; a++) {
                s->finest_lo[a] = fmin(s->finest_lo[a], b[i].reach_lo[a]);
                s->finest_hi[a] = fmax(s->finest_hi[a], b[i].reach_hi[a]);
            }
    }
}

int trip_gaussian_set_open(trip_gaussian_set **out, const char *path, trip_budget *budget)
{
    trip_gaussian_set *s = calloc(1, sizeof *s);
    *out = NULL;
    if (!s || !(s->path = strdup(path))) {
        free(s);
        return trip_fail(TRIP_ERROR, "open", path, "out of memory");
    }
    s->budget = budget;
    for (int a = 0; a < 3; a++)
        for (unsigned plane = 0; plane < TRIP_GAUSSIAN_PLANES; plane++)
            s->lists[a].fd[plane] = -1;
    const int folder = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    const int status = folder < 0 ? trip_fail_errno("open", path, "cannot open the data set")
                                  : open_files(s, folder);
    if (folder >= 0)
        close(folder);
    if (status < 0) {
        trip_gaussian_set_close(s);
        return status;
    }
    find_finest(s);
    *out = s;
    return status;
}

void trip_gaussian_set_close(trip_gaussian_set *s)
{
    if (!s)
        return;
    for (int a = 0; a < 3; a++)
        for (unsigned plane = 0; plane < TRIP_GAUSSIAN_PLANES; plane++)
            if (s->lists[a].fd[plane] >= 0)
                close(s->lists[a].fd[plane]);
    if (s->memory)
        trip_budget_release(s->budget, s->memory, s->memory_bytes);
    free(s->path);
    free(s);
}

int trip_gaussian_set_read(const trip_gaussian_set *s, int axis, uint64_t brick, unsigned plane,
                           void *to)
{
    char name[32], where[WHERE_BYTES];
    const trip_file_gaussian_brick *b = &s->lists[axis].bricks[brick];
    const size_t record = trip_gaussian_plane_bytes(&s->header, plane), bytes = b->records * record;
    const uint64_t offset = b->first_record * record;
    const ssize_t n = trip_read_at(s->lists[axis].fd[plane], to, bytes, bytes, offset);
    if (n == (ssize_t)bytes && XXH64(to, bytes, 0) == b->checksums[plane])
        return TRIP_OK;
    set_where(s, trip_gaussian_plane_name(&s->header, axis, plane, name), where);
    if (n < 0)
        return trip_fail_errno("read", where, "cannot read");
    if (n < (ssize_t)bytes)
        return trip_fail(TRIP_ERROR, "read", where, "ends early, at byte %llu",
                         (unsigned long long)(offset + (uint64_t)n));
    return trip_fail(TRIP_ERROR, "read", where,
                     "the brick of bytes %llu to %llu is damaged (checksum); make the data set "
                     "again with `triptych brick`",
                     (unsigned long long)offset, (unsigned long long)(offset + bytes - 1));
}

/* Returns why the records of a brick cannot be right, or NULL. */
static const char *fault_of_records(const trip_gaussian_set *s, const trip_file_gaussian_brick *b,
                                    const unsigned char *records, int axis)
{
    for (uint32_t i = 0; i < b->records; i++) {
        const unsigned char *r = records + (size_t)i * TRIP_GAUSSIAN_RECORD_BYTES;
        const char *fault = trip_gaussian_record_fault(b, &s->header, r);
        if (fault)
            return fault;
        if (i && trip_gaussian_centre_code(r, axis) <
                     trip_gaussian_centre_code(r - TRIP_GAUSSIAN_RECORD_BYTES, axis))
            return "the records of a brick are not in order";
    }
    return NULL;
}

/* Returns whether the palette has all entries that the records name. */
static bool are_entries(const trip_gaussian_set *s, const unsigned char *records, uint32_t count)
{
    bool all = true;
    for (uint32_t i = 0; i < count; i++)
        all &= trip_gaussian_entry_number(records + 2 * i) < s->header.palette_count;
    return all;
}

static int verify_brick(const trip_gaussian_set *s, int axis, uint64_t brick, unsigned char *room)
{
    char name[32], where[WHERE_BYTES];
    const trip_file_gaussian_brick *b = &s->lists[axis].bricks[brick];
    int status = TRIP_OK;
    unsigned plane = trip_gaussian_plane_count(&s->header, (int)s->header.degree) - 1;
    for (; plane > 0 && status == TRIP_OK; plane--) {
        status = trip_gaussian_set_read(s, axis, brick, plane, room);
        if (status == TRIP_OK && s->palette && !are_entries(s, room, b->records))
            return trip_fail(
                TRIP_ERROR, "read",
                set_where(s, trip_gaussian_plane_name(&s->header, axis, 1, name), where),
                "byte %llu: a record has a number above those of the palette",
                (unsigned long long)(2 * b->first_record));
    }
    if (status == TRIP_OK)
        status = trip_gaussian_set_read(s, axis, brick, 0, room);
    const char *fault = status == TRIP_OK ? fault_of_records(s, b, room, axis) : NULL;
    return fault
               ? trip_fail(TRIP_ERROR, "read",
                           set_where(s, trip_gaussian_plane_name(&s->header, axis, 0, name), where),
                           "byte %llu: %s",
                           (unsigned long long)(b->first_record * TRIP_GAUSSIAN_RECORD_BYTES),
                           fault)
               : status;
}

int trip_gaussian_set_verify(const trip_gaussian_set *s, trip_budget *budget)
{
    const size_t bytes = (size_t)TRIP_GAUSSIAN_BRICK_RECORDS_MAX * TRIP_GAUSSIAN_RECORD_BYTES;
    unsigned char *room = trip_budget_take(budget, bytes);
    int status = room ? TRIP_OK
                      : trip_fail(TRIP_ERROR, "read", s->path,
                                  "no memory for a brick of %zu bytes; raise --memory", bytes);
    for (int a = 0; a < 3; a++)
        for (uint64_t i = 0; i < s->lists[a].brick_count && status == TRIP_OK; i++)
            status = trip_interrupted()
                         ? trip_fail(TRIP_INTERRUPTED, "read", s->path, "interrupted")
                         : verify_brick(s, a, i, room);
    if (room)
        trip_budget_release(budget, room, bytes);
    return status;
}
