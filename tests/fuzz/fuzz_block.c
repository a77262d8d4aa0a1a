/* Fuzzes blocks of the voxel plane. The input gives the fields of a run and its brick, and a block.
 *
 * A block that passes the checks decodes to records inside the brick, in Morton order. Packing
 * these records again gives the same bytes if codes have one byte, and otherwise no more bytes. */
#include "fuzz.h"

#include "block.h"

#include <string.h>

typedef struct input {
    uint8_t tile_log2, code_bytes, u_min, u_max, v_min, v_max;
    uint16_t records, words, code_min, code_max;
} input;

static uint32_t voxels[TRIP_RUN_RECORDS_MAX], part[TRIP_RUN_RECORDS_MAX];
static uint64_t again[TRIP_BLOCK_WORDS_MAX];

static void check_records(const trip_block *b, const trip_file_brick *brick)
{
    trip_block_voxels(b, 0, b->count, voxels);
    for (uint32_t i = 0; i < b->count; i++) {
        unsigned u = trip_voxel_u(voxels[i]), v = trip_voxel_v(voxels[i]);
        unsigned code = trip_voxel_code(voxels[i]);
        FUZZ_PROMISE(u >= brick->u_min && u <= brick->u_max);
        FUZZ_PROMISE(v >= brick->v_min && v <= brick->v_max);
        FUZZ_PROMISE(code >= brick->code_min && code <= brick->code_max);
        if (i > 0)
            FUZZ_PROMISE(trip_morton(trip_voxel_u(voxels[i - 1]), trip_voxel_v(voxels[i - 1])) <
                         trip_morton(u, v));
    }
    uint32_t first = b->count / 3;
    trip_block_voxels(b, first, b->count - first, part);
    FUZZ_PROMISE(!memcmp(part, voxels + first, (b->count - first) * sizeof *part));
}

static void check_packed(const trip_block_form *form, const trip_block *b, const uint64_t *words,
                         uint32_t count)
{
    if (!trip_block_is_padded(b))
        return;
    const uint32_t packed = trip_block_pack(form, voxels, b->count, again);
    FUZZ_PROMISE(packed > 0 && packed <= count);
    if (form->code_bytes == 1)
        FUZZ_PROMISE(packed == count && !memcmp(again, words, count * sizeof *words));
    const trip_block smaller = trip_block_make(form, b->count, packed, again, NULL);
    trip_block_voxels(&smaller, 0, b->count, part);
    FUZZ_PROMISE(!memcmp(part, voxels, b->count * sizeof *part));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input in;
    if (size < sizeof in)
        return 0;
    memcpy(&in, data, sizeof in);
    const unsigned code_bytes = 1 + in.code_bytes % 2;
    const trip_block_form form = { .tile_log2 = 4 + in.tile_log2 % 4,
                                   .code_bytes = code_bytes,
                                   .steps = code_bytes == 2 && in.code_bytes / 2 % 2 };
    const uint8_t edge = (uint8_t)((1u << form.tile_log2) - 1);
    const trip_file_brick brick = { .code_min = in.code_min,
                                    .code_max = in.code_max,
                                    .u_min = in.u_min & edge,
                                    .u_max = in.u_max & edge,
                                    .v_min = in.v_min & edge,
                                    .v_max = in.v_max & edge };
    if (!trip_block_words_fit(&form, in.records, in.words) ||
        size - sizeof in < in.words * sizeof(uint64_t))
        return 0;
    uint64_t *words = malloc(in.words * sizeof *words);
    memcpy(words, data + sizeof in, in.words * sizeof *words);
    const trip_block b = trip_block_make(&form, in.records, in.words, words, NULL);
    if (!trip_block_check(&b, &brick)) {
        check_records(&b, &brick);
        check_packed(&form, &b, words, in.words);
    }
    free(words);
    return 0;
}
