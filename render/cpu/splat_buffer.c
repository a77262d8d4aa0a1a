#include "cpu/splat_buffer.h"

#include <string.h>

#include "cpu/layout.h"
#include "report.h"

/* ORDERS_PER_SPLAT is the average room for a splat's positions in the panes' orders. A chunk that
 * needs more room stays unsorted. */
enum { ORDERS_PER_SPLAT = 12, SPLATS_PER_BUCKET = 4, SMALLEST_CHUNK = 64 };

/* Number of positions that put() writes at a time. */
enum { AT_A_TIME = 16 };

/* Lays out the arrays in `memory` and returns the number of bytes. NULL only counts. */
static size_t lay_out(trip_cpu_buffer *f, char *memory)
{
    size_t at = 0;
    f->splats = trip_cpu_take_array(memory, &at, (size_t)f->capacity * sizeof *f->splats);
    f->order = trip_cpu_take_array(memory, &at, (size_t)f->order_capacity * sizeof *f->order);
    f->buckets = trip_cpu_take_array(memory, &at, (size_t)f->bucket_capacity * sizeof *f->buckets);
    f->chunks = trip_cpu_take_array(memory, &at, (size_t)f->chunk_capacity * sizeof *f->chunks);
    f->unsorted = trip_cpu_take_array(memory, &at, (size_t)f->chunk_capacity * sizeof *f->unsorted);
    return at;
}

int trip_cpu_buffer_create(trip_cpu_buffer *f, uint32_t capacity, trip_budget *budget)
{
    f->capacity = capacity;
    f->order_capacity = capacity * ORDERS_PER_SPLAT;
    f->bucket_capacity = capacity / SPLATS_PER_BUCKET;
    f->chunk_capacity = capacity / SMALLEST_CHUNK;
    f->bytes = lay_out(f, NULL);
    char *memory = trip_budget_take(budget, f->bytes);
    if (!memory) {
        f->bytes = 0;
        return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                         "splat buffers do not fit the memory given; raise --memory");
    }
    lay_out(f, memory);
    return 0;
}

static size_t depth_bytes(const trip_cpu_buffer *f)
{
    return (size_t)f->capacity * sizeof *f->depths;
}

void trip_cpu_buffer_destroy(trip_cpu_buffer *f, trip_budget *budget)
{
    trip_budget_release(budget, f->splats, f->bytes);
    trip_budget_release(budget, f->pane_lists, f->pane_list_bytes);
    trip_budget_release(budget, f->depths, depth_bytes(f));
}

static int fit_pane_lists(trip_cpu_buffer *f, uint32_t panes, trip_budget *budget)
{
    if (panes <= f->pane_capacity)
        return 0;
    trip_budget_release(budget, f->pane_lists, f->pane_list_bytes);
    f->pane_capacity = 0;
    f->pane_list_bytes = panes * sizeof *f->pane_lists;
    f->pane_lists = trip_budget_take(budget, f->pane_list_bytes);
    if (!f->pane_lists) {
        f->pane_list_bytes = 0;
        return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                         "the image's panes do not fit the memory given; raise --memory or draw a "
                         "smaller image");
    }
    f->pane_capacity = panes;
    return 0;
}

int trip_cpu_buffer_fit(trip_cpu_buffer *f, uint32_t panes, bool depths, trip_budget *budget)
{
    if (depths && !f->depths)
        f->depths = trip_budget_take(budget, depth_bytes(f));
    if (depths && !f->depths)
        return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                         "depths of %u splats do not fit the memory given; raise --memory",
                         f->capacity);
    return fit_pane_lists(f, panes, budget);
}

void trip_cpu_buffer_empty(trip_cpu_buffer *f)
{
    f->chunk_count = f->unsorted_count = 0;
    atomic_store_explicit(&f->splats_used, 0, memory_order_relaxed);
    atomic_store_explicit(&f->orders_used, 0, memory_order_relaxed);
    atomic_store_explicit(&f->buckets_used, 0, memory_order_relaxed);
}

trip_cpu_chunk *trip_cpu_buffer_reserve(trip_cpu_buffer *f)
{
    if (f->chunk_count == f->chunk_capacity || (f->one_by_one && f->chunk_count == 1))
        return NULL;
    trip_cpu_chunk *chunk = &f->chunks[f->chunk_count++];
    *chunk = (trip_cpu_chunk){ 0 };
    return chunk;
}

bool trip_cpu_buffer_claim(trip_cpu_buffer *f, trip_cpu_chunk *chunk, uint32_t splats)
{
    uint64_t first = atomic_fetch_add_explicit(&f->splats_used, splats + 1, memory_order_relaxed);
    chunk->splat = (uint32_t)first;
    chunk->full = first + splats + 1 > f->capacity;
    return !chunk->full;
}

uint32_t trip_cpu_buffer_cut(trip_cpu_buffer *f)
{
    uint32_t first = 0;
    while (first < f->chunk_count && !f->chunks[first].full)
        first++;
    f->one_by_one = first == 0 && f->chunk_count > 0;
    f->chunk_count = first;
    if (first == 0)
        trip_cpu_buffer_empty(f);
    return first;
}

/* Finds the series of a chunk's splats. A counting sort passes over its input twice, to count and
 * to place. Both passes go over the series, so memory is read only once for the many splats. Splats
 * come in the order of squares of voxels, so a series has five to ten splats. */
static uint32_t find_series(const trip_cpu_splat *splats, uint32_t n, trip_cpu_series *series)
{
    uint32_t found = 0, before = splats[0].panes;
    series[0] = (trip_cpu_series){ before, 1 };
    for (uint32_t i = 1; i < n; i++) {
        uint32_t panes = splats[i].panes;
        found += (panes != before) | (panes & TRIP_CPU_PANES_MORE) / TRIP_CPU_PANES_MORE;
        before = panes;
        series[found] = (trip_cpu_series){ panes, (uint16_t)(i + 1) };
    }
    return found + 1;
}

typedef struct span {
    uint32_t first, last; /* range of counted panes, inclusive */
    uint64_t positions;
} span;

/* The panes of a splat with TRIP_CPU_PANES_MORE. */
typedef struct reach {
    uint32_t first, across, down;
} reach;

static reach reach_of(const trip_cpu_splat *s)
{
    return (reach){ s->panes & TRIP_CPU_PANES_FIRST,
                    s->x1 / TRIP_CPU_PANE - s->x0 / TRIP_CPU_PANE + 1,
                    s->y1 / TRIP_CPU_PANE - s->y0 / TRIP_CPU_PANE + 1 };
}

static void count_wide(const trip_cpu_splat *splat, uint32_t across, uint32_t *counts, span *s)
{
    reach r = reach_of(splat);
    for (uint32_t y = 0; y < r.down; y++)
        for (uint32_t x = 0; x < r.across; x++)
            counts[r.first + y * across + x]++;
    uint32_t last = r.first + (r.down - 1) * across + r.across - 1;
    s->last = last > s->last ? last : s->last;
    s->positions += (uint64_t)r.across * r.down;
}

/* right_of() and below_of() return 1 if the splat also lies in the pane to the right, or below. */
static uint32_t right_of(uint32_t panes)
{
    return panes >> TRIP_CPU_PANES_RIGHT_SHIFT & 1;
}

static uint32_t below_of(uint32_t panes)
{
    return panes >> TRIP_CPU_PANES_BELOW_SHIFT & 1;
}

/* Counts the splats of each pane. Few splats lie in more than 2 x 2 panes. So four counts without a
 * branch are faster than a loop with an unpredictable length. */
static span count(const trip_cpu_splat *splats, const trip_cpu_series *series, uint32_t n,
                  uint32_t across, uint32_t *counts)
{
    span s = { UINT32_MAX, 0, 0 };
    uint32_t positions = 0, last = 0, from = 0;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t panes = series[i].panes, first = panes & TRIP_CPU_PANES_FIRST;
        uint32_t right = right_of(panes), below = below_of(panes), here = series[i].end - from;
        s.first = first < s.first ? first : s.first;
        last = first > last ? first : last;
        if (panes & TRIP_CPU_PANES_MORE) {
            count_wide(&splats[from], across, counts, &s);
        } else {
            uint32_t *c = counts + first;
            c[0] += here;
            c[1] += here * right;
            c[across] += here * below;
            c[across + 1] += here * (right & below);
            positions += here * (right + 1) * (below + 1);
        }
        from = series[i].end;
    }
    last += across + 1;
    s.last = last > s.last ? last : s.last;
    s.positions += positions;
    return s;
}

static void place_wide(const trip_cpu_splat *splat, uint32_t across, uint32_t *next,
                       uint16_t *order, uint16_t index)
{
    reach r = reach_of(splat);
    for (uint32_t y = 0; y < r.down; y++)
        for (uint32_t x = 0; x < r.across; x++)
            order[next[r.first + y * across + x]++] = index;
}

/* Consecutive splat numbers, in vectors of a size that all target processors support. */
typedef uint16_t eight __attribute__((vector_size(AT_A_TIME / 2 * sizeof(uint16_t))));
typedef struct positions {
    eight low, high;
} positions;

static inline positions positions_from(uint32_t first)
{
    const eight ahead = { 0, 1, 2, 3, 4, 5, 6, 7 };
    const eight low = ahead + (uint16_t)first;
    return (positions){ low, low + AT_A_TIME / 2 };
}

/* Writes `count` splat numbers from `first` on to a pane's next positions. May overwrite positions
 * behind them. */
static inline void put(uint16_t *order, uint32_t *next, positions first, uint32_t count)
{
    memcpy(order + *next, &first.low, sizeof first.low);
    memcpy(order + *next + AT_A_TIME / 2, &first.high, sizeof first.high);
    *next += count;
}

/* Writes the splat numbers to the next positions of all panes of the series. */
static inline void put_all(uint16_t *order, uint32_t *next, uint32_t across, uint32_t panes,
                           positions first, uint32_t count)
{
    uint32_t *c = next + (panes & TRIP_CPU_PANES_FIRST);
    uint32_t right = right_of(panes), below = below_of(panes);
    put(order, c, first, count);
    if (right)
        put(order, c + 1, first, count);
    if (below)
        put(order, c + across, first, count);
    if (right & below)
        put(order, c + across + 1, first, count);
}

/* Places all splats. `next` holds the next position of each pane. */
static void position(const trip_cpu_splat *splats, const trip_cpu_series *series, uint32_t n,
                     uint32_t across, uint32_t *next, uint16_t *order)
{
    uint32_t from = 0;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t panes = series[i].panes, end = series[i].end;
        if (panes & TRIP_CPU_PANES_MORE) {
            place_wide(&splats[from], across, next, order, (uint16_t)from);
            from = end;
            continue;
        }
        for (; end - from > AT_A_TIME; from += AT_A_TIME)
            put_all(order, next, across, panes, positions_from(from), AT_A_TIME);
        put_all(order, next, across, panes, positions_from(from), end - from);
        from = end;
    }
}

/* Turns counts into first positions and makes a bucket for each pane with splats. Each bucket has
 * spare room at its end for the excess that put() writes. */
static uint32_t make_buckets(trip_cpu_buffer *f, const trip_cpu_chunk *chunk, const span *s,
                             uint32_t position_at, uint32_t *counts)
{
    uint32_t made = chunk->first_bucket;
    for (uint32_t t = s->first; t <= s->last; t++) {
        uint32_t n = counts[t];
        if (n == 0)
            continue;
        f->buckets[made++] = (trip_cpu_bucket){
            .pane = t,
            .chunk = (uint32_t)(chunk - f->chunks),
            .first = position_at,
            .count = n,
        };
        counts[t] = position_at;
        position_at += n + AT_A_TIME;
    }
    return made - chunk->first_bucket;
}

static uint32_t occupied(const uint32_t *counts, const span *s)
{
    uint32_t n = 0;
    for (uint32_t t = s->first; t <= s->last; t++)
        n += counts[t] != 0;
    return n;
}

void trip_cpu_sort_chunk(trip_cpu_buffer *f, trip_cpu_chunk *chunk, trip_cpu_grid grid,
                         trip_cpu_sorting *sorting)
{
    const trip_cpu_splat *splats = f->splats + chunk->splat;
    uint32_t *counts = sorting->counts;
    if (chunk->splats == 0)
        return;
    uint32_t n = find_series(splats, chunk->splats, sorting->series);
    span s = count(splats, sorting->series, n, grid.across, counts);
    uint32_t buckets = occupied(counts, &s);
    uint64_t room = s.positions + buckets * AT_A_TIME;
    uint64_t bucket = atomic_fetch_add_explicit(&f->buckets_used, buckets, memory_order_relaxed);
    uint64_t at = atomic_fetch_add_explicit(&f->orders_used, room, memory_order_relaxed);
    chunk->unsorted = bucket + buckets > f->bucket_capacity || at + room > f->order_capacity;
    if (!chunk->unsorted) {
        chunk->first_bucket = (uint32_t)bucket;
        chunk->buckets = make_buckets(f, chunk, &s, (uint32_t)at, counts);
        position(splats, sorting->series, n, grid.across, counts, f->order);
    }
    memset(counts + s.first, 0, (s.last - s.first + 1) * sizeof *counts);
}

static void append(trip_cpu_buffer *f, uint32_t bucket)
{
    trip_cpu_pane_list *list = &f->pane_lists[f->buckets[bucket].pane];
    f->buckets[bucket].next = TRIP_CPU_NONE;
    if (list->head == TRIP_CPU_NONE)
        list->head = bucket;
    else
        f->buckets[list->tail].next = bucket;
    list->tail = bucket;
    list->splats += f->buckets[bucket].count;
}

void trip_cpu_link_pane_lists(trip_cpu_buffer *f, const trip_cpu_mask *mask)
{
    uint32_t panes = mask->grid.across * mask->grid.down;
    for (uint32_t t = 0; t < panes; t++)
        f->pane_lists[t] = (trip_cpu_pane_list){ TRIP_CPU_NONE, TRIP_CPU_NONE, 0 };
    for (uint32_t c = 0; c < f->chunk_count; c++) {
        const trip_cpu_chunk *chunk = &f->chunks[c];
        if (chunk->unsorted)
            f->unsorted[f->unsorted_count++] = c;
        for (uint32_t i = 0; i < chunk->buckets; i++) {
            uint32_t bucket = chunk->first_bucket + i;
            if (!trip_cpu_pane_is_terminated(mask, f->buckets[bucket].pane))
                append(f, bucket);
        }
    }
    for (uint32_t i = 0; i < f->unsorted_count; i++)
        for (uint32_t t = 0; t < panes; t++)
            f->pane_lists[t].splats += f->chunks[f->unsorted[i]].splats;
}

void trip_cpu_pane_list_each(const trip_cpu_buffer *f, uint32_t pane,
                             void (*take)(void *user, const trip_cpu_chunk *chunk,
                                          const trip_cpu_splat *splats, const uint16_t *order,
                                          uint32_t count),
                             void *user)
{
    uint32_t bucket = f->pane_lists[pane].head, unsorted = 0;
    while (bucket != TRIP_CPU_NONE || unsorted < f->unsorted_count) {
        const trip_cpu_bucket *s = bucket == TRIP_CPU_NONE ? NULL : &f->buckets[bucket];
        if (unsorted < f->unsorted_count && (!s || f->unsorted[unsorted] < s->chunk)) {
            const trip_cpu_chunk *chunk = &f->chunks[f->unsorted[unsorted++]];
            take(user, chunk, f->splats + chunk->splat, NULL, chunk->splats);
        } else {
            const trip_cpu_chunk *chunk = &f->chunks[s->chunk];
            take(user, chunk, f->splats + chunk->splat, f->order + s->first, s->count);
            bucket = s->next;
        }
    }
}
