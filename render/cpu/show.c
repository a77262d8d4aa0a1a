#include "cpu/show.h"

/* The fewest voxels whose region is worth a look, which costs about as much as so many splats. */
enum { FEWEST = 16 };

/* Squares of the largest tile, whose voxels have 8 bits for u and v. They are numbered in Morton
 * order, and those of a region follow one another. */
enum { TILE_SQUARES = (256 / TRIP_CPU_SQUARE) * (256 / TRIP_CPU_SQUARE) };

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

/* By its place in draw order. */
static uint32_t voxel_at(const showing *s, uint32_t at)
{
    return s->voxels[s->reversed ? s->all->count - 1 - at : at];
}

/* The number of the square that a voxel lies in: in draw order too. */
static uint32_t square_of(const showing *s, uint32_t at)
{
    uint32_t voxel = voxel_at(s, at);
    uint32_t square = (uint32_t)trip_morton(trip_voxel_u(voxel) / TRIP_CPU_SQUARE,
                                            trip_voxel_v(voxel) / TRIP_CPU_SQUARE);
    return s->reversed ? TILE_SQUARES - 1 - square : square;
}

/* The first place after `at`, which is in `square`, whose square is `end` or a later one: no
 * farther than full squares reach, and there where they are full. */
static uint32_t find_end(const showing *s, uint32_t at, uint32_t square, uint32_t end)
{
    uint32_t most = (end - square) * TRIP_CPU_SQUARE * TRIP_CPU_SQUARE, left = s->all->count - at;
    uint32_t before = at, found = at + (most < left ? most : left), look = found - 1;
    while (found - before > 1) {
        if (square_of(s, look) < end)
            before = look;
        else
            found = look;
        look = (before + found) / 2;
    }
    return found;
}

static uint64_t reversed_bits(uint64_t bits)
{
    bits = (bits >> 1 & UINT64_C(0x5555555555555555)) | (bits & UINT64_C(0x5555555555555555)) << 1;
    bits = (bits >> 2 & UINT64_C(0x3333333333333333)) | (bits & UINT64_C(0x3333333333333333)) << 2;
    bits = (bits >> 4 & UINT64_C(0x0f0f0f0f0f0f0f0f)) | (bits & UINT64_C(0x0f0f0f0f0f0f0f0f)) << 4;
    return __builtin_bswap64(bits);
}

/* Which squares of the region that a voxel lies in may show, in draw order. */
static uint64_t look_at(const showing *s, uint32_t at)
{
    const trip_cpu_asking *a = s->asking;
    const trip_run *run = s->all->run;
    uint32_t voxel = voxel_at(s, at), within = TRIP_CPU_REGION - 1;
    int u = run->u + (int)(trip_voxel_u(voxel) & ~within);
    int v = run->v + (int)(trip_voxel_v(voxel) & ~within);
    trip_cpu_region where;
    trip_cpu_cover cover = trip_cpu_region_make(a->view, u, v, run->sheet, &where);
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
        uint32_t square = square_of(s, at), in = square % TRIP_CPU_REGION_SQUARES;
        if (square / TRIP_CPU_REGION_SQUARES != region) {
            region = square / TRIP_CPU_REGION_SQUARES;
            bits = look_at(s, at);
        }
        bool open = bits >> in & 1;
        uint64_t other = (open ? ~bits : bits) >> in;
        uint32_t alike = other ? (uint32_t)__builtin_ctzll(other) : TRIP_CPU_REGION_SQUARES;
        if (alike > TRIP_CPU_REGION_SQUARES - in)
            alike = TRIP_CPU_REGION_SQUARES - in;
        uint32_t end = find_end(s, at, square, square + alike);
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
                  .voxels = asking->voxels + span->first,
                  .reversed = asking->reversed,
                  .all = span,
                  .shown = shown };
    if (cover == TRIP_CPU_PARTLY && span->count >= FEWEST)
        look_at_regions(&s);
    show_until(&s, span->count);
    return s.count;
}
