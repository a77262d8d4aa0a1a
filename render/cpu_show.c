#include "cpu_show.h"

/* The fewest voxels whose region is worth a look, which costs about as much as so many splats. */
enum { FEWEST = 16 };

/* Squares of a tile, 32 x 32 at most, in Morton order; those of a region follow one another. */
enum { REGION_SQUARES = 64, TILE_SQUARES = 1024 };

/* What is found so far. */
typedef struct showing {
    const trip_cpu_asking *asking;
    const uint32_t *voxels; /* the span's */
    bool reversed;
    const trip_cpu_span *all;
    trip_cpu_span *shown;
    uint32_t count, from; /* from: voxels shown from there on are not written yet */
} showing;

static void show_until(showing *s, uint32_t end)
{
    if (end > s->from)
        s->shown[s->count++] = trip_cpu_span_part(s->all, s->reversed, s->from, end - s->from);
}

/* The number of the square that the voxel at a place in draw order lies in: in draw order too. */
static uint32_t square_of(const showing *s, uint32_t at)
{
    static const uint16_t spread[32] = { 0,   1,   4,   5,   16,  17,  20,  21,  64,  65,  68,
                                         69,  80,  81,  84,  85,  256, 257, 260, 261, 272, 273,
                                         276, 277, 320, 321, 324, 325, 336, 337, 340, 341 };
    uint32_t voxel = s->voxels[s->reversed ? s->all->count - 1 - at : at];
    uint32_t u = trip_voxel_u(voxel) / TRIP_CPU_SQUARE, v = trip_voxel_v(voxel) / TRIP_CPU_SQUARE;
    uint32_t square = spread[u] | (uint32_t)spread[v] << 1;
    return s->reversed ? TILE_SQUARES - 1 - square : square;
}

/* The first place after `at` whose square is `square` or a later one. */
static uint32_t find_square(const showing *s, uint32_t at, uint32_t square)
{
    uint32_t before = at, found = s->all->count, look = found - 1;
    while (found - before > 1) {
        if (square_of(s, look) < square)
            before = look;
        else
            found = look;
        look = (before + found) / 2;
    }
    return found;
}

static uint64_t reversed_bits(uint64_t bits)
{
    uint64_t out = 0;
    for (int i = 0; i < 64; i++)
        out |= (bits >> i & 1) << (63 - i);
    return out;
}

/* Which squares of a region may show, in draw order. */
static uint64_t look_at(const showing *s, uint32_t region)
{
    const trip_cpu_asking *a = s->asking;
    const trip_run *run = s->all->run;
    uint32_t number = s->reversed ? TILE_SQUARES / REGION_SQUARES - 1 - region : region;
    uint32_t u = (number & 1) | (number >> 1 & 2), v = (number >> 1 & 1) | (number >> 2 & 2);
    trip_cpu_region where;
    trip_cpu_cover cover =
        trip_cpu_region_make(a->view, run->u + (int)u * TRIP_CPU_REGION,
                             run->v + (int)v * TRIP_CPU_REGION, run->sheet, &where);
    if (cover != TRIP_CPU_SHOWN)
        return cover == TRIP_CPU_HIDDEN ? 0 : UINT64_MAX;
    uint64_t shown = a->kernels->squares(a->view, &where, a->mask->tiles, a->lanes);
    return s->reversed ? reversed_bits(shown) : shown;
}

/* Leaves out what lies in hidden squares, region by region. */
static void look_at_regions(showing *s)
{
    uint64_t bits = 0;
    uint32_t region = UINT32_MAX;
    for (uint32_t at = 0; at < s->all->count;) {
        uint32_t square = square_of(s, at), in = square % REGION_SQUARES;
        if (square / REGION_SQUARES != region) {
            region = square / REGION_SQUARES;
            bits = look_at(s, region);
        }
        bool open = bits >> in & 1;
        uint64_t other = (open ? ~bits : bits) >> in;
        uint32_t alike = other ? (uint32_t)__builtin_ctzll(other) : REGION_SQUARES;
        if (alike > REGION_SQUARES - in)
            alike = REGION_SQUARES - in;
        uint32_t end = find_square(s, at, square + alike);
        if (!open) {
            show_until(s, at);
            s->from = end;
        }
        at = end;
    }
}

uint32_t trip_cpu_show(const trip_cpu_asking *asking, const trip_cpu_span *span,
                       trip_cpu_span *shown)
{
    const trip_run *run = span->run;
    trip_cpu_cover cover = TRIP_CPU_SHOWN;
    if (asking->view->front_to_back) {
        trip_cpu_box box = trip_cpu_brick_box(asking->view, run->brick, run->sheet, run->sheet);
        cover = trip_cpu_box_cover(asking->view, asking->mask, &box);
    }
    if (cover == TRIP_CPU_HIDDEN)
        return 0;
    showing s = { .asking = asking,
                  .voxels = asking->batch->voxels + span->first,
                  .reversed = asking->batch->selection->descending,
                  .all = span,
                  .shown = shown };
    if (cover == TRIP_CPU_PARTLY && span->count >= FEWEST)
        look_at_regions(&s);
    show_until(&s, span->count);
    return s.count;
}
