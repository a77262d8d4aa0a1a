/* Memory for pieces, in chunks that each hold pieces of one list one after the other. The pool does
 * not lock: its owner does, or hands whole chains of chunks from thread to thread. */
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
    trip_piece_format formats[TRIP_MOST_LISTS]; /* of the pieces of each list */
    trip_budget *budget;
    unsigned tile_bits, sheet_bits; /* that keys make use of */
    size_t chunk_bytes, chunk_count;
    unsigned char *memory;
    trip_chunk *chunks;
    trip_chain free;
} trip_piece_pool;

/* Bytes of a chunk: several of the longest pieces fit. */
size_t trip_chunk_bytes(const trip_piece_format *f);

/* Takes as many whole chunks as `bytes` has room for, all free. */
int trip_piece_pool_create(trip_piece_pool *pool, const trip_piece_format *f, const int64_t dims[3],
                           uint64_t bytes, trip_budget *budget);
void trip_piece_pool_destroy(trip_piece_pool *pool);

void trip_chain_push(trip_piece_pool *pool, trip_chain *c, uint32_t chunk);
/* The chain must not be empty. */
uint32_t trip_chain_pop(trip_piece_pool *pool, trip_chain *c);
/* Empties the chain into the free one. */
void trip_chain_free(trip_piece_pool *pool, trip_chain *c);

static inline unsigned char *trip_chunk_memory(const trip_piece_pool *pool, uint32_t chunk)
{
    return pool->memory + chunk * pool->chunk_bytes;
}

/* The pieces of a list's chain by ascending key; they stay where they are. */
typedef struct trip_pool_source {
    trip_piece_source source; /* first */
    const trip_piece_pool *pool;
} trip_pool_source;

/* The chain must not change while the source is used. */
trip_pool_source trip_pool_source_make(const trip_piece_pool *pool, unsigned list,
                                       const trip_chain *c);

#endif
