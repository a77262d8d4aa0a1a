/* Memory for pieces, in chunks of equal size; a chunk holds pieces of one list, one after the
 * other. The pool does not lock: its owner does, or passes whole chains of chunks between threads.
 */
#ifndef TRIP_PIECE_POOL_H
#define TRIP_PIECE_POOL_H

#include "merge.h"

#define TRIP_NO_CHUNK UINT32_MAX

typedef struct trip_chunk {
    uint32_t next; /* in the chain that the chunk is in */
    uint32_t used_bytes;
} trip_chunk;

typedef struct trip_chain {
    uint32_t first; /* TRIP_NO_CHUNK when empty */
    uint32_t chunks;
} trip_chain;

static inline trip_chain trip_chain_empty(void)
{
    return (trip_chain){ .first = TRIP_NO_CHUNK };
}

typedef struct trip_piece_pool {
    trip_piece_format formats[TRIP_MAX_LISTS]; /* of the pieces of each list */
    trip_budget *budget;
    unsigned tile_bits, sheet_bits; /* significant ones in keys */
    size_t chunk_bytes, chunk_count;
    unsigned char *memory;
    trip_chunk *chunks;
    trip_chain free;
} trip_piece_pool;

/* Bytes of a chunk, in which at least four of the longest pieces fit. */
size_t trip_chunk_bytes(const trip_piece_format *f);

/* Allocates as many chunks as fit into `bytes`; all are free at first. */
int trip_piece_pool_create(trip_piece_pool *pool, const trip_piece_format *f, const int64_t dims[3],
                           uint64_t bytes, trip_budget *budget);
void trip_piece_pool_destroy(trip_piece_pool *pool);

void trip_chain_push(trip_piece_pool *pool, trip_chain *c, uint32_t chunk);
/* The chain must not be empty. */
uint32_t trip_chain_pop(trip_piece_pool *pool, trip_chain *c);
/* Moves all chunks of the chain to the free ones. */
void trip_chain_free(trip_piece_pool *pool, trip_chain *c);

static inline unsigned char *trip_chunk_memory(const trip_piece_pool *pool, uint32_t chunk)
{
    return pool->memory + chunk * pool->chunk_bytes;
}

/* The pieces of a chain by ascending key, as a source for trip_merge(). */
typedef struct trip_pool_source {
    trip_piece_source source; /* the first member: what trip_merge() takes */
    const trip_piece_pool *pool;
} trip_pool_source;

/* Sorts the pieces by linking them where they are. The chain must not change while the source is
 * used. */
trip_pool_source trip_pool_source_make(const trip_piece_pool *pool, unsigned list,
                                       const trip_chain *c);

#endif
