#include "cpu_bin.h"

#include <string.h>

#include "report.h"

/* A segment holds at least so many splats on average, a chunk at least so many voxels; where they
 * hold fewer, a flush comes early. Any one chunk fits an empty buffer. */
enum { SPLATS_PER_SEGMENT = 8, SMALLEST_CHUNK = 64 };

static void *part(char *memory, size_t *at, size_t bytes)
{
    void *p = memory ? memory + *at : NULL;
    *at += (bytes + 63) & ~(size_t)63;
    return p;
}

/* Lays the arrays out in `memory`, or only counts when it is NULL. */
static size_t lay_out(trip_cpu_flush *f, char *memory)
{
    size_t at = 0;
    f->splats = part(memory, &at, ((size_t)f->capacity + f->spare) * sizeof *f->splats);
    f->segments = part(memory, &at, (size_t)f->segment_capacity * sizeof *f->segments);
    f->chunks = part(memory, &at, (size_t)f->chunk_capacity * sizeof *f->chunks);
    f->wide_chunks = part(memory, &at, (size_t)f->chunk_capacity * sizeof *f->wide_chunks);
    return at;
}

int trip_cpu_flush_create(trip_cpu_flush *f, uint32_t capacity, uint32_t spare, trip_budget *budget)
{
    f->capacity = capacity;
    f->spare = spare;
    f->segment_capacity = capacity / SPLATS_PER_SEGMENT;
    if (f->segment_capacity < TRIP_CPU_CHUNK_SPLATS)
        f->segment_capacity = TRIP_CPU_CHUNK_SPLATS;
    f->chunk_capacity = capacity / SMALLEST_CHUNK;
    f->bytes = lay_out(f, NULL);
    char *memory = trip_budget_take(budget, f->bytes);
    if (!memory) {
        f->bytes = 0;
        return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                         "its buffers do not fit the memory given; raise --memory");
    }
    lay_out(f, memory);
    return 0;
}

void trip_cpu_flush_destroy(trip_cpu_flush *f, trip_budget *budget)
{
    trip_budget_release(budget, f->splats, f->bytes);
    trip_budget_release(budget, f->shares, f->share_bytes);
}

int trip_cpu_flush_fit(trip_cpu_flush *f, uint32_t tiles, trip_budget *budget)
{
    if (tiles <= f->tile_capacity)
        return 0;
    trip_budget_release(budget, f->shares, f->share_bytes);
    f->tile_capacity = 0;
    f->share_bytes = tiles * sizeof *f->shares;
    f->shares = trip_budget_take(budget, f->share_bytes);
    if (!f->shares) {
        f->share_bytes = 0;
        return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                         "the image's tiles do not fit the memory given; raise --memory or draw a "
                         "smaller image");
    }
    f->tile_capacity = tiles;
    return 0;
}

void trip_cpu_flush_empty(trip_cpu_flush *f)
{
    f->chunk_count = f->wide_chunk_count = f->wide_splats = 0;
    atomic_store_explicit(&f->splats_used, 0, memory_order_relaxed);
    atomic_store_explicit(&f->segments_used, 0, memory_order_relaxed);
}

trip_cpu_chunk *trip_cpu_flush_reserve(trip_cpu_flush *f, uint32_t voxels)
{
    if (f->chunk_count == f->chunk_capacity)
        return NULL;
    trip_cpu_chunk *chunk = &f->chunks[f->chunk_count++];
    *chunk = (trip_cpu_chunk){ .voxels = voxels };
    return chunk;
}

/* Of the tiles that are open and have splats. */
typedef struct extent {
    uint32_t first, last; /* of all that have splats, inclusive */
    uint32_t splats, segments;
} extent;

/* Closed tiles' splats are forgotten. */
static extent measure(trip_cpu_basket *b, uint32_t tiles, const _Atomic uint8_t *closed)
{
    extent e = { tiles, 0, 0, 0 };
    for (uint32_t i = 0; i < b->count; i++) {
        uint32_t t = b->tiles[i];
        e.first = t < e.first ? t : e.first;
        e.last = t > e.last ? t : e.last;
    }
    for (uint32_t t = e.first; t <= e.last; t++) {
        if (b->counts[t] && atomic_load_explicit(&closed[t], memory_order_relaxed))
            b->counts[t] = 0;
        e.splats += b->counts[t];
        e.segments += b->counts[t] != 0;
    }
    return e;
}

/* Turns counts into the place of each tile's first splat, or TRIP_CPU_NONE, and makes a segment of
 * every tile that has some. */
static void make_segments(trip_cpu_flush *f, trip_cpu_chunk *chunk, const extent *e, uint32_t place,
                          uint32_t tiles, uint32_t *counts)
{
    trip_cpu_segment *made = f->segments + chunk->first_segment;
    for (uint32_t t = e->first; t <= e->last; t++) {
        uint32_t n = counts[t];
        counts[t] = n ? place : TRIP_CPU_NONE;
        if (n == 0)
            continue;
        if (t == tiles) {
            chunk->wide = place;
            chunk->wide_count = n;
        } else {
            *made++ = (trip_cpu_segment){
                .tile = t,
                .chunk = (uint32_t)(chunk - f->chunks),
                .first = place,
                .count = n,
            };
            chunk->segments++;
        }
        place += n;
    }
}

static void copy(trip_cpu_splat *to, const trip_cpu_basket *b)
{
    for (uint32_t i = 0; i < b->count; i++) {
        uint32_t first = b->counts[b->tiles[i]];
        if (first != TRIP_CPU_NONE)
            to[first + b->ranks[i]] = b->splats[i];
    }
}

static uint16_t less(uint16_t a, uint16_t b)
{
    return a < b ? a : b;
}

static uint16_t more(uint16_t a, uint16_t b)
{
    return a > b ? a : b;
}

static void bound_wide(const trip_cpu_flush *f, trip_cpu_chunk *chunk)
{
    chunk->wide_x0 = chunk->wide_y0 = UINT16_MAX;
    for (uint32_t i = 0; i < chunk->wide_count; i++) {
        const trip_cpu_splat *s = &f->splats[chunk->wide + i];
        chunk->wide_x0 = less(chunk->wide_x0, s->x0);
        chunk->wide_y0 = less(chunk->wide_y0, s->y0);
        chunk->wide_x1 = more(chunk->wide_x1, s->x1);
        chunk->wide_y1 = more(chunk->wide_y1, s->y1);
    }
}

void trip_cpu_sort(trip_cpu_flush *f, trip_cpu_chunk *chunk, trip_cpu_grid grid,
                   const _Atomic uint8_t *closed, trip_cpu_basket *basket)
{
    uint32_t tiles = grid.across * grid.down;
    if (basket->count == 0)
        return;
    extent e = measure(basket, tiles, closed);
    uint64_t segment =
        atomic_fetch_add_explicit(&f->segments_used, e.segments, memory_order_relaxed);
    uint64_t place = atomic_fetch_add_explicit(&f->splats_used, e.splats, memory_order_relaxed);
    chunk->full = segment + e.segments > f->segment_capacity || place + e.splats > f->capacity;
    if (!chunk->full) {
        chunk->first_segment = (uint32_t)segment;
        make_segments(f, chunk, &e, (uint32_t)place, tiles, basket->counts);
        copy(f->splats, basket);
        bound_wide(f, chunk);
    }
    memset(basket->counts + e.first, 0, (e.last - e.first + 1) * sizeof *basket->counts);
}

uint32_t trip_cpu_flush_cut(trip_cpu_flush *f)
{
    uint32_t first = 0;
    while (first < f->chunk_count && !f->chunks[first].full)
        first++;
    f->chunk_count = first;
    return first;
}

static void append(trip_cpu_flush *f, uint32_t segment)
{
    trip_cpu_share *share = &f->shares[f->segments[segment].tile];
    f->segments[segment].next = TRIP_CPU_NONE;
    if (share->head == TRIP_CPU_NONE)
        share->head = segment;
    else
        f->segments[share->tail].next = segment;
    share->tail = segment;
    share->splats += f->segments[segment].count;
}

void trip_cpu_link(trip_cpu_flush *f, trip_cpu_grid grid)
{
    for (uint32_t t = 0; t < grid.across * grid.down; t++)
        f->shares[t] = (trip_cpu_share){ TRIP_CPU_NONE, TRIP_CPU_NONE, 0 };
    for (uint32_t c = 0; c < f->chunk_count; c++) {
        const trip_cpu_chunk *chunk = &f->chunks[c];
        for (uint32_t i = 0; i < chunk->segments; i++)
            append(f, chunk->first_segment + i);
        if (chunk->wide_count)
            f->wide_chunks[f->wide_chunk_count++] = c;
    }
}

/* A chunk's splats of one tile between its wide ones, by their sequence. */
static void interleave(const trip_cpu_flush *f, const trip_cpu_chunk *chunk, uint32_t first,
                       uint32_t count, const trip_cpu_taker *taker)
{
    uint32_t end = first + count;
    for (uint32_t w = chunk->wide; w < chunk->wide + chunk->wide_count; w++) {
        uint32_t until = first;
        while (until < end && f->splats[until].sequence < f->splats[w].sequence)
            until++;
        if (until > first)
            taker->take(taker->user, first, until - first);
        taker->take_wide(taker->user, w);
        first = until;
    }
    if (first < end)
        taker->take(taker->user, first, end - first);
}

/* The first splats of a segment, on their way from the cache of whoever projected them. */
static void fetch(const trip_cpu_flush *f, const trip_cpu_segment *s)
{
    if (s->next == TRIP_CPU_NONE)
        return;
    const trip_cpu_segment *next = &f->segments[s->next];
    for (uint32_t i = 0; i < next->count && i < 16; i++)
        __builtin_prefetch(&f->splats[next->first + i]);
}

void trip_cpu_share_each(const trip_cpu_flush *f, uint32_t tile, int x, int y,
                         const trip_cpu_taker *taker)
{
    uint32_t segment = f->shares[tile].head, wide = 0;
    while (segment != TRIP_CPU_NONE || wide < f->wide_chunk_count) {
        const trip_cpu_segment *s = segment == TRIP_CPU_NONE ? NULL : &f->segments[segment];
        uint32_t w = wide < f->wide_chunk_count ? f->wide_chunks[wide] : TRIP_CPU_NONE;
        uint32_t chunk = s && s->chunk < w ? s->chunk : w;
        bool mine = s && s->chunk == chunk;
        if (mine)
            fetch(f, s);
        uint32_t first = mine ? s->first : 0, count = mine ? s->count : 0;
        if (chunk == w && trip_cpu_wide_meets(&f->chunks[chunk], x, y))
            interleave(f, &f->chunks[chunk], first, count, taker);
        else if (count)
            taker->take(taker->user, first, count);
        wide += chunk == w;
        segment = mine ? s->next : segment;
    }
}
