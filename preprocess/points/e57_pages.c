#include "e57_pages.h"

#include <fcntl.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "byte_stream.h"
#include "little_endian.h"
#include "read_at.h"
#include "report.h"

enum {
    HEADER_BYTES = 48,
    CHECKSUM_BYTES = 4,
    PAGE_MIN = 128,
    PAGE_MAX = 1 << 20,
    HELD_BYTES = 1 << 17, /* pages in memory */
};

struct trip_e57_pages {
    const char *path;
    int fd;
    uint64_t file_bytes, page_bytes, text_at, text_bytes;
    uint64_t held_first, held_count; /* pages in memory */
    unsigned char *held;
    uint32_t table[8][256];
};

/* Fills the tables of CRC-32C (Castagnoli): table[k] is the remainder of a byte before k zeros. */
static void fill_tables(trip_e57_pages *p)
{
    const uint32_t polynomial = 0x82f63b78;
    for (uint32_t i = 0; i < 256; i++) {
        uint32_t r = i;
        for (int bit = 0; bit < 8; bit++)
            r = r >> 1 ^ (r & 1 ? polynomial : 0);
        p->table[0][i] = r;
    }
    for (int k = 1; k < 8; k++)
        for (uint32_t i = 0; i < 256; i++)
            p->table[k][i] = p->table[k - 1][i] >> 8 ^ p->table[0][p->table[k - 1][i] & 255];
}

static uint32_t checksum(const trip_e57_pages *p, const unsigned char *bytes, size_t count)
{
    uint32_t r = UINT32_MAX;
    for (; count >= 8; bytes += 8, count -= 8) {
        const uint32_t low = r ^ trip_le_u32(bytes), high = trip_le_u32(bytes + 4);
        r = 0;
        for (int k = 0; k < 4; k++)
            r ^= p->table[7 - k][low >> 8 * k & 255] ^ p->table[3 - k][high >> 8 * k & 255];
    }
    for (; count > 0; bytes++, count--)
        r = r >> 8 ^ p->table[0][(r ^ *bytes) & 255];
    return ~r;
}

/* A page ends in its checksum, with the most significant byte first. */
static bool page_is_sound(const trip_e57_pages *p, const unsigned char *page)
{
    const size_t bytes = p->page_bytes - CHECKSUM_BYTES;
    return checksum(p, page, bytes) == __builtin_bswap32(trip_le_u32(page + bytes));
}

/* Brings a page and those after it into memory. */
static int hold(trip_e57_pages *p, uint64_t page)
{
    const uint64_t pages = p->file_bytes / p->page_bytes;
    uint64_t count = HELD_BYTES / p->page_bytes ? HELD_BYTES / p->page_bytes : 1;
    const uint64_t first = page / count * count;
    if (page >= pages)
        return trip_fail(TRIP_ERROR, "read", p->path, "ends early; is it truncated?");
    count = count < pages - first ? count : pages - first;
    p->held_count = 0;
    const size_t bytes = count * p->page_bytes;
    if (trip_read_at(p->fd, p->held, bytes, bytes, first * p->page_bytes) != (ssize_t)bytes)
        return trip_fail_errno("read", p->path, "cannot read");
    for (uint64_t i = 0; i < count; i++)
        if (!page_is_sound(p, p->held + i * p->page_bytes))
            return trip_fail(TRIP_ERROR, "read", p->path,
                             "page %" PRIu64 " has a wrong checksum; the file is damaged",
                             first + i);
    p->held_first = first;
    p->held_count = count;
    return 0;
}

static int read_header(trip_e57_pages *p)
{
    unsigned char h[HEADER_BYTES];
    if (p->file_bytes < HEADER_BYTES || trip_read_at(p->fd, h, sizeof h, sizeof h, 0) != sizeof h)
        return trip_fail(TRIP_ERROR, "read", p->path, "ends in its header; is it truncated?");
    const uint32_t major = trip_le_u32(h + 8);
    const uint64_t bytes = trip_le_u64(h + 16);
    p->page_bytes = trip_le_u64(h + 40);
    if (major != 1)
        return trip_fail(TRIP_ERROR, "read", p->path,
                         "has version %" PRIu32 " of E57; version 1 is read", major);
    if (p->page_bytes < PAGE_MIN || p->page_bytes > PAGE_MAX || p->page_bytes % 4 != 0)
        return trip_fail(TRIP_ERROR, "read", p->path,
                         "states pages of %" PRIu64 " bytes; is its header damaged?",
                         p->page_bytes);
    if (bytes > p->file_bytes)
        return trip_fail(TRIP_ERROR, "read", p->path,
                         "states %" PRIu64 " bytes, but has %" PRIu64 "; is it truncated?", bytes,
                         p->file_bytes);
    p->text_at = trip_e57_pages_logical(p, trip_le_u64(h + 24));
    p->text_bytes = trip_le_u64(h + 32);
    p->held = malloc(p->page_bytes > HELD_BYTES ? p->page_bytes : HELD_BYTES);
    return p->held ? 0 : trip_fail(TRIP_ERROR, "read", p->path, "out of memory");
}

int trip_e57_pages_open(trip_e57_pages **out, const char *path)
{
    trip_e57_pages *p = *out = calloc(1, sizeof *p);
    if (!p)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    p->path = path;
    p->fd = -1;
    fill_tables(p);
    int status = trip_file_size(path, &p->file_bytes);
    if (status < 0)
        return status;
    p->fd = open(path, O_RDONLY | O_CLOEXEC);
    return p->fd < 0 ? trip_fail_errno("read", path, "cannot open") : read_header(p);
}

void trip_e57_pages_close(trip_e57_pages *p)
{
    if (!p)
        return;
    if (p->fd >= 0)
        close(p->fd);
    free(p->held);
    free(p);
}

uint64_t trip_e57_pages_text_at(const trip_e57_pages *p)
{
    return p->text_at;
}

uint64_t trip_e57_pages_text_bytes(const trip_e57_pages *p)
{
    return p->text_bytes;
}

uint64_t trip_e57_pages_logical(const trip_e57_pages *p, uint64_t physical)
{
    const uint64_t within = physical % p->page_bytes, most = p->page_bytes - CHECKSUM_BYTES;
    return physical / p->page_bytes * most + (within < most ? within : most);
}

uint64_t trip_e57_pages_bytes(const trip_e57_pages *p)
{
    return p->file_bytes / p->page_bytes * (p->page_bytes - CHECKSUM_BYTES);
}

int trip_e57_pages_read(trip_e57_pages *p, void *to, size_t bytes, uint64_t logical)
{
    const uint64_t most = p->page_bytes - CHECKSUM_BYTES;
    unsigned char *out = to;
    while (bytes > 0) {
        const uint64_t page = logical / most, within = logical % most;
        if (page < p->held_first || page >= p->held_first + p->held_count) {
            const int status = hold(p, page);
            if (status < 0)
                return status;
        }
        const size_t part = bytes < most - within ? bytes : (size_t)(most - within);
        memcpy(out, p->held + (page - p->held_first) * p->page_bytes + within, part);
        out += part;
        logical += part;
        bytes -= part;
    }
    return 0;
}
