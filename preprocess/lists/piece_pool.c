#include "piece_pool.h"

#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "report.h"

enum { RADIX_BITS = 11, RADIX = 1 << RADIX_BITS, MIN_CHUNK_BYTES = 128 << 10 };

/* Links are 32-bit offsets in units of 8 bytes, counted from 1. */
#define MAX_POOL_BYTES ((uint64_t)8 * (UINT32_MAX - 1))

size_t trip_chunk_bytes(const trip_piece_format *f)
{
    size_t bytes = f->halo ? MIN_CHUNK_BYTES : 2 * MIN_CHUNK_BYTES; /* a halo doubles the lists */
    while (bytes < 4 * trip_piece_max_bytes(f))
        bytes *= 2;
    return bytes;
}

static unsigned bits_for(uint64_t count)
{
    unsigned bits = 0;
    while (bits < 64 && count > UINT64_C(1) << bits)
        bits++;
    return bits;
}

static void count_key_bits(trip_piece_pool *pool, const int64_t dims[3])
{
    for (int a = 0; a < 3; a++) {
        unsigned sheets = bits_for((uint64_t)dims[a]);
        unsigned tiles = 2 * bits_for((uint64_t)(dims[a] >> pool->formats[0].tile_log2) + 1);
        pool->sheet_bits = sheets > pool->sheet_bits ? sheets : pool->sheet_bits;
        pool->tile_bits = tiles > pool->tile_bits ? tiles : pool->tile_bits;
    }
}

int trip_piece_pool_create(trip_piece_pool *pool, const trip_piece_format *f, const int64_t dims[3],
                           uint64_t bytes, trip_budget *budget)
{
    *pool = (trip_piece_pool){ .budget = budget,
                               .chunk_bytes = trip_chunk_bytes(f),
                               .free = trip_chain_empty() };
    for (unsigned list = 0; list < TRIP_MAX_LISTS; list++)
        pool->formats[list] = trip_piece_format_of(f, list);
    count_key_bits(pool, dims);
    pool->chunk_count = (bytes < MAX_POOL_BYTES ? bytes : MAX_POOL_BYTES) / pool->chunk_bytes;
    pool->memory = trip_budget_take(budget, pool->chunk_count * pool->chunk_bytes);
    pool->chunks = calloc(pool->chunk_count, sizeof *pool->chunks);
    if (!pool->memory || !pool->chunks)
        return trip_fail(TRIP_ERROR, "brick", "lists",
                         "the system refuses the memory that --memory allows: lower --memory");
    /* The pool fills memory once, from the front, so huge pages gain nothing. */
    madvise(pool->memory, pool->chunk_count * pool->chunk_bytes, MADV_NOHUGEPAGE);
    for (size_t i = pool->chunk_count; i-- > 0;)
        trip_chain_push(pool, &pool->free, (uint32_t)i);
    return 0;
}

void trip_piece_pool_destroy(trip_piece_pool *pool)
{
    if (pool->budget)
        trip_budget_release(pool->budget, pool->memory, pool->chunk_count * pool->chunk_bytes);
    free(pool->chunks);
    *pool = (trip_piece_pool){ 0 };
}

void trip_chain_push(trip_piece_pool *pool, trip_chain *c, uint32_t chunk)
{
    pool->chunks[chunk].next = c->first;
    c->first = chunk;
    c->chunks++;
}

uint32_t trip_chain_pop(trip_piece_pool *pool, trip_chain *c)
{
    uint32_t chunk = c->first;
    c->first = pool->chunks[chunk].next;
    c->chunks--;
    return chunk;
}

void trip_chain_free(trip_piece_pool *pool, trip_chain *c)
{
    while (c->first != TRIP_NO_CHUNK)
        trip_chain_push(pool, &pool->free, trip_chain_pop(pool, c));
}

static trip_piece *piece_at(const trip_piece_pool *pool, uint32_t link)
{
    return (trip_piece *)(void *)(pool->memory + ((uint64_t)link - 1) * 8);
}

static uint32_t link_of(const trip_piece_pool *pool, const unsigned char *piece)
{
    return (uint32_t)((uint64_t)(piece - pool->memory) / 8 + 1);
}

/* Linked lists of pieces, one for each digit. Link 0 ends a list. */
typedef struct buckets {
    uint32_t first[RADIX], last[RADIX];
} buckets;

static void put(const trip_piece_pool *pool, buckets *to, uint32_t link, unsigned shift)
{
    trip_piece *p = piece_at(pool, link);
    uint64_t sheet = p->key >> TRIP_TILE_MORTON_BITS;
    uint64_t tile = p->key & ((UINT64_C(1) << TRIP_TILE_MORTON_BITS) - 1);
    uint64_t digit = ((sheet << pool->tile_bits | tile) >> shift) & (RADIX - 1);
    p->next = 0;
    if (to->first[digit])
        piece_at(pool, to->last[digit])->next = link;
    else
        to->first[digit] = link;
    to->last[digit] = link;
}

static uint32_t join(const trip_piece_pool *pool, const buckets *from)
{
    uint32_t first = 0, last = 0;
    for (unsigned d = 0; d < RADIX; d++) {
        if (!from->first[d])
            continue;
        if (last)
            piece_at(pool, last)->next = from->first[d];
        else
            first = from->first[d];
        last = from->last[d];
    }
    return first;
}

/* Links the pieces of a chain by ascending key and returns the first. Uses a radix sort, lowest
 * digit first. */
static uint32_t sort_chain(const trip_piece_pool *pool, unsigned list, const trip_chain *c)
{
    buckets now = { 0 };
    for (uint32_t i = c->first; i != TRIP_NO_CHUNK; i = pool->chunks[i].next) {
        const unsigned char *at = trip_chunk_memory(pool, i);
        const unsigned char *end = at + pool->chunks[i].used_bytes;
        while (at < end) {
            put(pool, &now, link_of(pool, at), 0);
            at += trip_piece_get_parts(&pool->formats[list], (const void *)at).bytes;
        }
    }
    uint32_t first = join(pool, &now);
    for (unsigned shift = RADIX_BITS; shift < pool->tile_bits + pool->sheet_bits;
         shift += RADIX_BITS) {
        memset(&now, 0, sizeof now);
        for (uint32_t link = first, next; link; link = next) {
            next = piece_at(pool, link)->next;
            put(pool, &now, link, shift);
        }
        first = join(pool, &now);
    }
    return first;
}

static int advance(trip_piece_source *source)
{
    const trip_pool_source *s = (const trip_pool_source *)source;
    source->piece = source->piece->next ? piece_at(s->pool, source->piece->next) : NULL;
    return 0;
}

trip_pool_source trip_pool_source_make(const trip_piece_pool *pool, unsigned list,
                                       const trip_chain *c)
{
    uint32_t first = sort_chain(pool, list, c);
    return (trip_pool_source){ { first ? piece_at(pool, first) : NULL, advance }, pool };
}
