/* Fuzzes NRRD headers. The fields of an accepted header must be within the bounds that the reader
 * relies on. */
#include "fuzz.h"

#include "anatomy.h"
#include "nrrd_header.h"

#include <string.h>

static void check(const trip_nrrd_header *h, size_t size)
{
    int64_t values;
    FUZZ_PROMISE(h->dims[0] >= 1 && h->dims[1] >= 1 && h->dims[2] >= 1);
    FUZZ_PROMISE(!__builtin_mul_overflow(h->dims[0], h->dims[1], &values) &&
                 !__builtin_mul_overflow(values, h->dims[2], &values));
    FUZZ_PROMISE(!h->space[0] || trip_anatomy_known(h->space));
    FUZZ_PROMISE((unsigned)h->type < TRIP_SCALARS);
    FUZZ_PROMISE(h->line_skip >= 0 && h->byte_skip >= -1);
    FUZZ_PROMISE(h->byte_skip >= 0 || h->encoding == TRIP_BYTES_PLAIN);
    FUZZ_PROMISE(h->file_count <= 65536 && h->header_bytes <= size);
    for (size_t i = 0; i < h->file_count; i++)
        FUZZ_PROMISE(h->files[i] && h->files[i][0]);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    trip_nrrd_header h;
    if (size > TRIP_NRRD_HEADER_BYTES_MAX)
        return 0;
    char *text = malloc(size + 1);
    FUZZ_PROMISE(text);
    memcpy(text, data, size);
    if (trip_nrrd_header_parse(&h, "fuzz", text, size, size % 2) == 0) {
        check(&h, size);
        trip_nrrd_header_free(&h);
    }
    free(text);
    return 0;
}
