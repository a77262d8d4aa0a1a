/* Memory for pieces, in chunks of equal size. A chunk holds pieces of one list, one after the
 * other. The pool has no lock: its owner locks it, or passes whole chains of chunks between
 * threads. */
#ifndef TRIP_PIECE_POOL_H
#define TRIP_PIECE_POOL_H

#include "merge.h"

#define TRIP_NO_CHUNK UINT32_MAX

typedef struct trip_chunk {
    uint32_t next; /* next chunk of the same chain */
    uint32_t used_bytes;
} trip_chunk;

typedef struct trip_chain {
    uint32_t first; /* TRIP_NO_CHUNK if empty */
    uint32_t chunks;
} trip_chain;

static inline trip_chain trip_chain_empty(void)
{
    return (trip_chain){ .first = TRIP_NO_CHUNK };
}

typedef struct trip_piece_pool {
    trip_piece_format formats[TRIP_MAX_LISTS]; /* one for each list */
    trip_budget *budget;
    unsigned tile_bits, sheet_bits; /* significant bits of keys */
    size_t chunk_bytes, chunk_count;
    unsigned char *memory;
    trip_chunk *chunks;
    trip_chain free;
} trip_piece_pool;

/* Returns the size of a chunk, which has room for at least four of the longest pieces. */
size_t trip_chunk_bytes(const trip_piece_format *f);

/* Allocates as many chunks as fit into `bytes`. All are free at first. */
int trip_piece_pool_create(trip_piece_pool *pool, const trip_piece_format *f, const int64_t dims[3],
                           uint64_t bytes, trip_budget *budget);
void trip_piece_pool_destroy(trip_piece_pool *pool);

void trip_chain_push(trip_piece_pool *pool, trip_chain *c, uint32_t chunk);
/* The chain must not be empty. */
uint32_t trip_chain_pop(trip_piece_pool *pool, trip_chain *c);
/* Moves all chunks of the chain to the free chain. */
void trip_chain_free(trip_piece_pool *pool, trip_chain *c);

static inline unsigned char *trip_chunk_memory(const trip_piece_pool *pool, uint32_t chunk)
{
    return pool->memory + chunk * pool->chunk_bytes;
}

/* The pieces of a chain by ascending key, as a source for trip_merge(). */
typedef struct trip_pool_source {
    trip_piece_source source; /* must be the first member */
    const trip_piece_pool *pool;
} trip_pool_source;

/* Sorts the pieces in place by linking them. The chain must not change while the source is in use.
 */
trip_pool_source trip_pool_source_make(const trip_piece_pool *pool, unsigned list,
                                       const trip_chain *c);

#endif
