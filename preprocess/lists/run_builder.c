#include "run_builder.h"

#include <string.h>

#include "clones.h"
#include "format.h"
#include "normal.h"
#include "report.h"

/* Arrays have one entry for each position in the tile, valid if a piece has a splat there. The
 * first piece stays in its own order until a second piece comes. Most runs have only one piece,
 * which is in list order already. */
struct trip_run_builder {
    trip_piece_format format;
    trip_budget *budget;
    bool started;         /* a piece was added */
    uint32_t first_count; /* splats of the first piece while there is no other, else 0 */
    uint16_t first_positions[TRIP_TILE_MAX_SPLATS];
    uint64_t bits[TRIP_TILE_MAX_WORDS];
    uint16_t positions[TRIP_TILE_MAX_SPLATS];
    uint16_t uv[TRIP_TILE_MAX_SPLATS]; /* u and v of a position, one byte each */
    uint32_t values[TRIP_TILE_MAX_SPLATS];
    uint32_t normals[TRIP_TILE_MAX_SPLATS]; /* or deviations */
    float magnitudes[TRIP_TILE_MAX_SPLATS];
    uint32_t voxel_records[TRIP_TILE_MAX_SPLATS];
    uint32_t normal_records[TRIP_TILE_MAX_SPLATS];
};

/* Whether records of normals or deviations belong to the voxels. */
static bool has_beside(const trip_run_builder *b)
{
    return b->format.normals || b->format.deviations;
}

int trip_run_builder_create(trip_run_builder **out, const trip_piece_format *f, trip_budget *budget)
{
    trip_run_builder *b = *out = trip_budget_take(budget, sizeof *b);
    if (!b)
        return trip_fail(TRIP_ERROR, "brick", "merge",
                         "needs more memory than --memory allows: raise --memory");
    b->format = *f;
    b->budget = budget;
    for (unsigned v = 0; v < 1u << f->tile_log2; v++)
        for (unsigned u = 0; u < 1u << f->tile_log2; u++)
            b->uv[trip_morton(u, v)] = (uint16_t)(u | v << 8);
    return 0;
}

void trip_run_builder_destroy(trip_run_builder *b)
{
    if (b)
        trip_budget_release(b->budget, b, sizeof *b);
}

static void add_first(trip_run_builder *b, const trip_piece *p)
{
    const unsigned char *base = (const unsigned char *)p;
    trip_piece_parts parts = trip_piece_get_parts(&b->format, p);
    const uint16_t *codes = (const void *)(base + parts.values);
    b->first_count = trip_piece_positions(p, &b->format, b->first_positions);
    for (uint32_t i = 0; i < b->first_count; i++)
        b->voxel_records[i] = codes[i];
    for (uint32_t i = 0; parts.deviations && i < b->first_count; i++)
        b->normal_records[i] = base[parts.deviations + i];
    if (parts.normals)
        memcpy(b->normal_records, base + parts.normals, b->first_count * sizeof *b->normal_records);
}

/* Moves the splats of the first piece to their positions in the tile. */
static void scatter_first(trip_run_builder *b)
{
    for (uint32_t i = 0; i < b->first_count; i++) {
        unsigned position = b->first_positions[i];
        b->bits[position / 64] |= UINT64_C(1) << (position % 64);
        b->values[position] = b->voxel_records[i];
    }
    for (uint32_t i = 0; has_beside(b) && i < b->first_count; i++)
        b->normals[b->first_positions[i]] = b->normal_records[i];
    b->first_count = 0;
}

static void scatter_values(trip_run_builder *b, const void *from, uint32_t splats)
{
    const uint16_t *codes = from;
    const uint32_t *floats = from;
    if (b->format.quantised)
        for (uint32_t i = 0; i < splats; i++)
            b->values[b->positions[i]] = codes[i];
    else
        for (uint32_t i = 0; i < splats; i++)
            b->values[b->positions[i]] = floats[i];
}

static void scatter_piece(trip_run_builder *b, const trip_piece *p)
{
    const unsigned char *base = (const unsigned char *)p;
    trip_piece_parts parts = trip_piece_get_parts(&b->format, p);
    uint32_t splats = trip_piece_positions(p, &b->format, b->positions);
    for (uint32_t i = 0; i < splats; i++)
        b->bits[b->positions[i] / 64] |= UINT64_C(1) << (b->positions[i] % 64);
    scatter_values(b, base + parts.values, splats);
    for (uint32_t i = 0; parts.deviations && i < splats; i++)
        b->normals[b->positions[i]] = base[parts.deviations + i];
    const uint32_t *normals = (const void *)(base + parts.normals);
    if (parts.normals)
        for (uint32_t i = 0; i < splats; i++)
            b->normals[b->positions[i]] = normals[i];
    const float *magnitudes = (const void *)(base + parts.magnitudes);
    if (parts.magnitudes)
        for (uint32_t i = 0; i < splats; i++)
            b->magnitudes[b->positions[i]] = magnitudes[i];
}

TRIP_ALSO_V3 void trip_run_builder_add(trip_run_builder *b, const trip_piece *p)
{
    if (!b->started && b->format.quantised) {
        add_first(b, p);
    } else {
        scatter_first(b);
        scatter_piece(b, p);
    }
    b->started = true;
}

static uint32_t take_positions(trip_run_builder *b)
{
    uint32_t n = 0;
    for (unsigned w = 0; w < trip_tile_words(&b->format); w++) {
        n += trip_word_positions(b->bits[w], w, b->positions + n);
        b->bits[w] = 0;
    }
    return n;
}

static uint32_t code_of(const trip_run_builder *b, const trip_quantiser *q, unsigned position)
{
    float value;
    if (b->format.quantised)
        return b->values[position];
    memcpy(&value, &b->values[position], sizeof value);
    return trip_quantise(q, value);
}

static uint32_t normal_of(const trip_run_builder *b, const trip_quantiser *q, unsigned position)
{
    if (b->format.quantised)
        return b->normals[position];
    double gradient[3];
    trip_direction_unpack(b->normals[position], gradient);
    for (int a = 0; a < 3; a++)
        gradient[a] *= (double)b->magnitudes[position];
    return trip_normal_pack(gradient,
                            q->gradient_full * (q->gradient_unit > 0 ? q->gradient_unit : 1));
}

static uint32_t take_first(trip_run_builder *b)
{
    uint32_t splats = b->first_count;
    for (uint32_t i = 0; i < splats; i++)
        b->voxel_records[i] = b->uv[b->first_positions[i]] | b->voxel_records[i] << 16;
    b->first_count = 0;
    return splats;
}

static uint32_t take_scattered(trip_run_builder *b, const trip_quantiser *q)
{
    uint32_t splats = take_positions(b);
    for (uint32_t i = 0; i < splats; i++) {
        unsigned position = b->positions[i];
        b->voxel_records[i] = b->uv[position] | code_of(b, q, position) << 16;
    }
    for (uint32_t i = 0; has_beside(b) && i < splats; i++)
        b->normal_records[i] = normal_of(b, q, b->positions[i]);
    return splats;
}

TRIP_ALSO_V3 uint32_t trip_run_builder_take(trip_run_builder *b, const trip_quantiser *q,
                                            const uint32_t **voxels, const uint32_t **beside)
{
    b->started = false;
    *voxels = b->voxel_records;
    *beside = has_beside(b) ? b->normal_records : NULL;
    return b->first_count ? take_first(b) : take_scattered(b, q);
}
