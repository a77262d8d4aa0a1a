#include "cache.h"

#include "report.h"

#include <assert.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum {
    SEARCH_MAX = 8, /* entries examined to find one to evict */
    UNUSED_PASSES =
        12, /* two frames of three lists with two sides; entries unused for longer may be evicted */
};

typedef struct entry {
    uint32_t page;                     /* page and passes: reader's thread only */
    uint32_t reserved_pass, last_pass; /* last_pass: no later pass has a request for the page */
    const void *filler;                /* set before its request is submitted */
    _Atomic bool valid;                /* release when stored, acquire when found */
} entry;

struct trip_cache {
    trip_budget *budget;
    uint32_t (*first_page)[TRIP_PLANES]; /* by list */
    unsigned list_count;
    unsigned page_log2;
    uint32_t page_count, entry_count, used, hand, pass;
    uint32_t frame_pass; /* last pass of the frames before this one */
    uint32_t ended_pass; /* requests of this pass and all earlier passes are over */
    /* Index of a page's entry plus 1, or 0 if it has none. The reader's thread writes it (release);
     * engine threads read it (acquire). */
    _Atomic uint32_t *entry_of;
    entry *entries;
    unsigned char *memory;
};

static uint64_t plane_pages(const trip_dataset *d, const trip_list *list, int plane)
{
    return trip_page_count(list->plane_bytes[plane], d->header.page_log2);
}

uint64_t trip_cache_full_bytes(const trip_dataset *d, unsigned planes)
{
    uint64_t pages = 0;
    for (unsigned i = 0; i < d->list_count; i++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            pages += planes >> plane & 1 ? plane_pages(d, &d->lists[i], plane) : 0;
    return pages << d->header.page_log2;
}

static size_t memory_bytes(const trip_cache *c)
{
    return (size_t)c->entry_count << c->page_log2;
}

/* Numbers the pages of the planes to read. */
static void number_pages(trip_cache *c, const trip_dataset *d, unsigned planes)
{
    uint64_t first = 0;
    for (unsigned i = 0; i < d->list_count; i++)
        for (int plane = 0; plane < TRIP_PLANES; plane++) {
            c->first_page[i][plane] = (uint32_t)first;
            first += planes >> plane & 1 ? plane_pages(d, &d->lists[i], plane) : 0;
        }
}

int trip_cache_create(trip_cache **out, const trip_dataset *d, unsigned planes, size_t bytes,
                      trip_budget *budget)
{
    *out = NULL;
    uint64_t pages = trip_cache_full_bytes(d, planes) >> d->header.page_log2;
    uint64_t entries = bytes >> d->header.page_log2;
    trip_cache *c = calloc(1, sizeof *c);
    if (!c)
        return trip_fail(TRIP_ERROR, "read", d->path, "out of memory");
    c->budget = budget;
    c->list_count = d->list_count;
    c->first_page = trip_budget_take(budget, c->list_count * sizeof *c->first_page);
    if (c->first_page)
        number_pages(c, d, planes);
    c->page_log2 = d->header.page_log2;
    c->page_count = (uint32_t)(pages < UINT32_MAX ? pages : 0);
    c->entry_count = (uint32_t)(entries < pages ? entries : pages);
    c->entry_of = trip_budget_take(budget, c->page_count * sizeof *c->entry_of);
    c->entries = trip_budget_take(budget, c->entry_count * sizeof *c->entries);
    c->memory = trip_budget_take(budget, memory_bytes(c));
    if (pages < UINT32_MAX && c->first_page && c->entry_of && c->entries && c->memory) {
        *out = c;
        return TRIP_OK;
    }
    trip_cache_destroy(c);
    return trip_fail(TRIP_ERROR, "read", d->path,
                     "no memory for a cache of %zu bytes; raise --memory", bytes);
}

void trip_cache_destroy(trip_cache *c)
{
    if (!c)
        return;
    trip_budget_release(c->budget, c->first_page, c->list_count * sizeof *c->first_page);
    trip_budget_release(c->budget, c->entry_of, c->page_count * sizeof *c->entry_of);
    trip_budget_release(c->budget, c->entries, c->entry_count * sizeof *c->entries);
    trip_budget_release(c->budget, c->memory, memory_bytes(c));
    free(c);
}

uint32_t trip_cache_page(const trip_cache *c, unsigned list, int plane, uint64_t offset)
{
    return c->first_page[list][plane] + (uint32_t)(offset >> c->page_log2);
}

static unsigned char *memory_of(const trip_cache *c, uint32_t position)
{
    return c->memory + ((size_t)(position - 1) << c->page_log2);
}

/* Whether every page has its own entry. */
static bool holds_all(const trip_cache *c)
{
    return c->entry_count == c->page_count;
}

const unsigned char *trip_cache_bytes(const trip_cache *c, unsigned list, int plane,
                                      uint64_t offset)
{
    assert(holds_all(c));
    return memory_of(c, c->first_page[list][plane] + 1) + offset;
}

void trip_cache_begin_frame(trip_cache *c)
{
    c->frame_pass = c->pass;
}

uint32_t trip_cache_begin_pass(trip_cache *c)
{
    return ++c->pass;
}

void trip_cache_end_passes(trip_cache *c, uint32_t first_pass)
{
    c->ended_pass = first_pass <= c->frame_pass ? first_pass - 1 : c->frame_pass;
}

bool trip_cache_find(trip_cache *c, uint32_t page)
{
    uint32_t position = atomic_load_explicit(&c->entry_of[page], memory_order_acquire);
    if (position == 0)
        return false;
    entry *e = &c->entries[position - 1];
    if (e->reserved_pass > c->frame_pass || !atomic_load_explicit(&e->valid, memory_order_acquire))
        return false;
    e->last_pass = c->pass;
    return true;
}

/* Returns the page's own entry. Returns NULL if a running request may still store the page. */
static entry *own_entry(trip_cache *c, entry *e)
{
    bool under_way = e->last_pass > c->ended_pass;
    e->last_pass = c->pass;
    return under_way ? NULL : e;
}

static bool may_go(const trip_cache *c, const entry *e)
{
    return c->pass - e->last_pass > UNUSED_PASSES && e->last_pass <= c->ended_pass;
}

/* Returns an entry for the page: its own, an empty one, or one that may be evicted. */
static entry *find_room(trip_cache *c, uint32_t page)
{
    uint32_t position = atomic_load_explicit(&c->entry_of[page], memory_order_relaxed);
    if (position)
        return own_entry(c, &c->entries[position - 1]);
    if (holds_all(c))
        return &c->entries[page];
    if (c->used < c->entry_count)
        return &c->entries[c->used++];
    for (int i = 0; i < SEARCH_MAX && c->entry_count > 0; i++) {
        entry *e = &c->entries[c->hand];
        c->hand = (c->hand + 1) % c->entry_count;
        if (may_go(c, e)) {
            atomic_store_explicit(&c->entry_of[e->page], 0, memory_order_relaxed);
            return e;
        }
    }
    return NULL;
}

void trip_cache_reserve(trip_cache *c, uint32_t page, const void *filler)
{
    entry *e = find_room(c, page);
    if (!e)
        return;
    e->page = page;
    e->reserved_pass = e->last_pass = c->pass;
    e->filler = filler;
    atomic_store_explicit(&e->valid, false, memory_order_relaxed);
    atomic_store_explicit(&c->entry_of[page], (uint32_t)(e - c->entries) + 1, memory_order_release);
}

const void *trip_cache_get(const trip_cache *c, uint32_t page)
{
    return memory_of(c, atomic_load_explicit(&c->entry_of[page], memory_order_acquire));
}

void trip_cache_store(trip_cache *c, uint32_t page, const void *filler, const void *data,
                      size_t bytes)
{
    uint32_t position = atomic_load_explicit(&c->entry_of[page], memory_order_acquire);
    entry *e = position ? &c->entries[position - 1] : NULL;
    if (!e || e->filler != filler || atomic_load_explicit(&e->valid, memory_order_relaxed))
        return;
    memcpy(memory_of(c, position), data, bytes);
    atomic_store_explicit(&e->valid, true, memory_order_release);
}
