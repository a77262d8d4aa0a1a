/* Fuzzes index.trip of Gaussian scenes. The input gets valid checksums and sizes, so that the
 * fuzzer reaches the code behind these checks. The bricks of an accepted index must follow one
 * another, and their records must decode to finite values. Their cones must have an axis of unit
 * length. At each level of detail, the nodes that are drawn share out each Gaussian of the scene.
 */
#include "fuzz.h"

#include "gaussian_check.h"
#include "gaussian_code.h"
#include "gaussian_stream.h"

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

/* All entries of the palette decode to finite coefficients. */
static void decode_entries(const trip_file_gaussian_header *h, const unsigned char *index)
{
    const unsigned bytes = trip_gaussian_entry_bytes((int)h->degree);
    for (uint64_t i = 0; i < h->palette_count; i++) {
        float sh[TRIP_SH_MAX][3] = { { 0 } };
        trip_gaussian_decode_entry(index + h->palette_offset + i * bytes, (int)h->degree, sh);
        for (int k = 0; k < TRIP_SH_MAX; k++)
            for (int c = 0; c < 3; c++)
                FUZZ_PROMISE(isfinite(sh[k][c]));
    }
}

static void check_cone(const trip_file_gaussian_brick *b)
{
    const float *a = b->cone_axis, length2 = a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
    FUZZ_PROMISE(b->cone_cosine >= 0 && b->cone_cosine <= 1);
    FUZZ_PROMISE(b->cone_cosine > 0 ? fabsf(length2 - 1) < 1e-4f : length2 == 0);
}

static void walk(const trip_file_gaussian_header *h, const unsigned char *index)
{
    for (int a = 0; a < 3; a++) {
        const trip_file_gaussian_brick *b = (const void *)(index + h->bricks_offset[a]);
        uint64_t next = 0;
        for (uint64_t i = 0; i < h->brick_count[a]; i++, b++) {
            FUZZ_PROMISE(b->first_record == next);
            next += b->records;
            check_cone(b);
            decode(b, h->palette_count ? 0 : (int)h->degree);
        }
        FUZZ_PROMISE(next == h->list_records);
    }
}

/* Walks the drawn nodes, and checks the sum of the shares in each node without others inside. */
static void walk_levels(const trip_file_gaussian_header *h, const unsigned char *index)
{
    const trip_gaussian_set set = { .header = *h,
                                    .nodes = (const void *)(index + h->nodes_offset) };
    double *sums = malloc(h->node_count * sizeof *sums);
    for (double px = 0; px < 4; px = 2 * px + 0.01) {
        const trip_gaussian_lod lod = { .voxel_px = px, .eye = { 0, 0, px }, .px = 1 };
        trip_gaussian_walk w = { 0 };
        memset(sums, 0, h->node_count * sizeof *sums);
        while (trip_gaussian_walk_next(&set, &lod, &w))
            for (uint64_t i = w.node; i < w.node + set.nodes[w.node].nodes; i++)
                sums[i] += w.share;
        for (uint64_t i = 0; i < h->node_count; i++)
            FUZZ_PROMISE(set.nodes[i].nodes > 1 || fabs(sums[i] - 1) < 1e-12);
    }
    free(sums);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < TRIP_GAUSSIAN_HEADER_BYTES)
        return 0;
    unsigned char *index = seal(data, size);
    trip_file_gaussian_header header;
    memcpy(&header, index, sizeof header);
    if (trip_gaussian_check_header(&header, size, "fuzz") == TRIP_OK &&
        trip_gaussian_check_tables(index, &header, "fuzz") == TRIP_OK) {
        walk(&header, index);
        walk_levels(&header, index);
        decode_entries(&header, index);
    }
    free(index);
    return 0;
}
