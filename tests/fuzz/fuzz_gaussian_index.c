/* Fuzzes index.trip of Gaussian scenes. The input gets valid checksums and sizes, so that the
 * fuzzer reaches the code behind these checks. The bricks of an accepted index must follow one
 * another, and their records must decode to finite values. */
#include "fuzz.h"

#include "gaussian_check.h"
#include "gaussian_code.h"

#include <math.h>
#include <string.h>
#include <xxhash.h>

static unsigned char *seal(const uint8_t *data, size_t size)
{
    unsigned char *index = malloc(size);
    memcpy(index, data, size);
    trip_file_gaussian_header *h = (trip_file_gaussian_header *)(void *)index;
    memcpy(h->magic, TRIP_GAUSSIAN_MAGIC, sizeof h->magic);
    h->version = TRIP_GAUSSIAN_VERSION;
    h->header_bytes = TRIP_GAUSSIAN_HEADER_BYTES;
    h->index_bytes = size;
    h->tables_checksum = XXH64(index + sizeof *h, size - sizeof *h, 0);
    h->header_checksum = 0;
    h->header_checksum = XXH64(h, sizeof *h, 0);
    return index;
}

static void decode(const trip_file_gaussian_brick *b, int degree)
{
    unsigned char record[TRIP_GAUSSIAN_RECORD_BYTES], harmonics[45];
    for (int byte = 0; byte < 256; byte += 15) {
        trip_gaussian g;
        memset(record, byte, sizeof record);
        memset(harmonics, byte, sizeof harmonics);
        trip_gaussian_decode(b, record, harmonics, degree, &g);
        for (int a = 0; a < 3; a++) {
            FUZZ_PROMISE(g.centre[a] >= b->centre_lo[a] && g.centre[a] <= b->centre_hi[a]);
            FUZZ_PROMISE(isfinite(g.deviations[a]) && g.deviations[a] >= 0);
            for (int k = 0; k < TRIP_SH_MAX; k++)
                FUZZ_PROMISE(isfinite(g.sh[k][a]));
        }
        float length = 0;
        for (int i = 0; i < 4; i++)
            length += g.rotation[i] * g.rotation[i];
        FUZZ_PROMISE(fabsf(length - 1) < 1e-5f);
        FUZZ_PROMISE(g.opacity >= 0 && g.opacity <= 1);
    }
}

static void walk(const trip_file_gaussian_header *h, const unsigned char *index)
{
    for (int a = 0; a < 3; a++) {
        const trip_file_gaussian_brick *b = (const void *)(index + h->bricks_offset[a]);
        uint64_t next = 0;
        for (uint64_t i = 0; i < h->brick_count[a]; i++, b++) {
            FUZZ_PROMISE(b->first_record == next);
            next += b->records;
            decode(b, (int)h->degree);
        }
        FUZZ_PROMISE(next == h->records);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < TRIP_GAUSSIAN_HEADER_BYTES)
        return 0;
    unsigned char *index = seal(data, size);
    trip_file_gaussian_header header;
    memcpy(&header, index, sizeof header);
    if (trip_gaussian_check_header(&header, size, "fuzz") == TRIP_OK &&
        trip_gaussian_check_tables(index, &header, "fuzz") == TRIP_OK)
        walk(&header, index);
    free(index);
    return 0;
}
