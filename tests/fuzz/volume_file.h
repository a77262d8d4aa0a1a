/* Reads a complete volume file as brick does, for the fuzzers of volume files and of slices. */
#ifndef FUZZ_VOLUME_FILE_H
#define FUZZ_VOLUME_FILE_H

#include "fuzz.h"

#include "volume.h"

#include <stdio.h>
#include <unistd.h>

/* Decodes a corner of the portion with its neighbours. */
static void fuzz_decode(const trip_volume *v, const trip_volume_portion *b)
{
    float values[6 * 6 * 6];
    uint8_t active[6 * 6 * 6];
    int64_t lo[3], size[3];
    for (int a = 0; a < 3; a++) {
        lo[a] = b->origin[a] - 1;
        size[a] = (b->size[a] < 4 ? b->size[a] : 4) + 2;
    }
    (void)trip_portion_decode(v, b, lo, size, values, active);
}

static void fuzz_read_through(trip_volume *v)
{
    enum { MAX_BLOCKS = 64 };
    const trip_volume_info *info = trip_volume_get_info(v);
    trip_volume_portion b;
    for (int i = 0; i < MAX_BLOCKS && trip_volume_next(v, 1, &b) == 1; i++) {
        for (int a = 0; a < 3; a++) {
            FUZZ_PROMISE(info->dims[a] >= 1 && b.size[a] >= 1);
            FUZZ_PROMISE(b.origin[a] >= 0 && b.origin[a] <= info->dims[a] - b.size[a]);
        }
        fuzz_decode(v, &b);
        trip_portion_release(v, &b);
    }
}

/* Reads the bytes as a file with this extension. Checks that all memory returns to the budget. */
static void fuzz_volume_file(const uint8_t *data, size_t size, const char *extension)
{
    enum { MEMORY_BYTES = 64 << 20 };
    char path[64];
    trip_volume *v;
    trip_budget *budget;
    snprintf(path, sizeof path, "/dev/shm/fuzz-%d.%s", (int)getpid(), extension);
    FILE *f = fopen(path, "wb");
    FUZZ_PROMISE(f && fwrite(data, 1, size, f) == size && fclose(f) == 0);
    FUZZ_PROMISE(trip_budget_create(&budget, MEMORY_BYTES) == 0);
    if (trip_volume_open(&v, path, NULL, budget) == 0) {
        fuzz_read_through(v);
        trip_volume_close(v);
    }
    FUZZ_PROMISE(trip_budget_left_bytes(budget) == MEMORY_BYTES);
    trip_budget_destroy(budget);
    unlink(path);
}

#endif
