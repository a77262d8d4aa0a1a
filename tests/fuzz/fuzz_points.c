/* Fuzzes complete files of points, in every format. All values that are read must be finite and in
 * their ranges, and every pass must give as many points. The first byte chooses the file extension.
 * The pages of E57 get valid checksums. */
#include "fuzz.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "point_file.h"

static const char *const extensions[] = { "ply", "las", "pcd", "pts", "ptx", "xyz", "e57", "vdb" };

static void check(const trip_point *p, const trip_point_info *info)
{
    double length = 0;
    for (int a = 0; a < 3; a++) {
        FUZZ_PROMISE(isfinite(p->position[a]));
        FUZZ_PROMISE(p->colour[a] >= 0 && p->colour[a] <= 1);
        length += (double)p->normal[a] * (double)p->normal[a];
    }
    FUZZ_PROMISE(length == 0 || fabs(length - 1) < 1e-5);
    FUZZ_PROMISE(isfinite(p->radius) && p->radius >= 0);
    FUZZ_PROMISE(isfinite(p->intensity) && isfinite(p->gps_time));
    FUZZ_PROMISE(info->scan_count == 0 || p->scan < info->scan_count);
}

/* Reads up to a bound of points. Returns their number. */
static size_t read_through(trip_point_file *f)
{
    enum { ROOM = 100, MOST = 20000 };
    trip_point batch[ROOM];
    size_t got = 1, sum = 0;
    while (got > 0 && sum < MOST && trip_point_file_read(f, batch, ROOM, &got) == 0) {
        for (size_t i = 0; i < got; i++)
            check(&batch[i], trip_point_file_info(f));
        sum += got;
    }
    return sum;
}

/* CRC-32C, bit by bit. */
static uint32_t checksum(const uint8_t *bytes, size_t count)
{
    uint32_t r = UINT32_MAX;
    for (size_t i = 0; i < count; i++) {
        r ^= bytes[i];
        for (int bit = 0; bit < 8; bit++)
            r = r >> 1 ^ (r & 1 ? 0x82f63b78 : 0);
    }
    return ~r;
}

/* Writes the checksum at the end of each page of E57, in the order of the standard. */
static void sign_pages(uint8_t *file, size_t size)
{
    uint64_t page = 0;
    if (size < 48 || memcmp(file, "ASTM-E57", 8) != 0)
        return;
    for (int i = 0; i < 8; i++)
        page |= (uint64_t)file[40 + i] << 8 * i;
    for (size_t at = 0; page > 4 && page <= size - at; at += page) {
        const uint32_t sum = checksum(file + at, page - 4);
        for (int i = 0; i < 4; i++)
            file[at + page - 4 + (size_t)i] = (uint8_t)(sum >> (24 - 8 * i));
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char path[64];
    trip_point_file *file;
    if (size < 1)
        return 0;
    snprintf(path, sizeof path, "/dev/shm/fuzz-%d.%s", (int)getpid(),
             extensions[data[0] % (sizeof extensions / sizeof *extensions)]);
    uint8_t *bytes = malloc(size);
    FILE *f = fopen(path, "wb");
    FUZZ_PROMISE(f && bytes);
    memcpy(bytes, data + 1, size - 1);
    sign_pages(bytes, size - 1);
    FUZZ_PROMISE(fwrite(bytes, 1, size - 1, f) == size - 1 && fclose(f) == 0);
    free(bytes);
    if (trip_point_file_open(path, &file) == 0) {
        const size_t count = read_through(file);
        if (trip_point_file_rewind(file) == 0)
            FUZZ_PROMISE(read_through(file) == count);
        trip_point_file_close(file);
    }
    unlink(path);
    return 0;
}
