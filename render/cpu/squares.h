/* Walks over the squares of a run's block, and selects a run's part of a chunk. Plain values
 * without an owner; any thread may use its own. Blocks come from a batch, so they are already
 * checked. */
#ifndef TRIP_CPU_SQUARES_H
#define TRIP_CPU_SQUARES_H

#include "block.h"
#include "reader.h"

/* A walk over the present squares of a block, in draw order. */
typedef struct trip_cpu_walk {
    const trip_block *block;
    bool reversed;
    unsigned word;
    uint64_t rest; /* remaining bits of the word */
    uint32_t left; /* remaining squares */
    /* The current square. */
    unsigned number; /* Morton number in the tile */
    uint64_t mask;
    uint32_t first, count; /* range of records in the run */
} trip_cpu_walk;

static inline trip_cpu_walk trip_cpu_walk_begin(const trip_block *b, bool reversed)
{
    unsigned word = reversed ? b->present_words - 1 : 0;
    return (trip_cpu_walk){ .block = b,
                            .reversed = reversed,
                            .word = word,
                            .rest = b->present[word],
                            .left = b->squares,
                            .first = reversed ? b->count : 0 };
}

/* Moves to the next square. Returns false at the end. */
static inline bool trip_cpu_walk_next(trip_cpu_walk *w)
{
    const trip_block *b = w->block;
    if (w->left == 0)
        return false;
    while (w->rest == 0)
        w->rest = b->present[w->reversed ? --w->word : ++w->word];
    unsigned bit =
        (unsigned)(w->reversed ? 63 - __builtin_clzll(w->rest) : __builtin_ctzll(w->rest));
    w->rest &= ~(UINT64_C(1) << bit);
    w->number = 64 * w->word + bit;
    w->left--;
    w->mask = b->masks[w->reversed ? w->left : b->squares - 1 - w->left];
    uint32_t before = w->count;
    w->count = trip_bits_set(w->mask);
    w->first = w->reversed ? w->first - w->count : w->first + before;
    return true;
}

/* Return a square's position in its tile, in squares, from its Morton number. */
static inline int trip_cpu_square_u(unsigned number)
{
    return (int)trip_morton_even(number);
}

static inline int trip_cpu_square_v(unsigned number)
{
    return trip_cpu_square_u(number >> 1);
}

/* The part of a run that is in a chunk. `squares` has one bit for each square, by Morton number. */
typedef struct trip_cpu_part {
    const trip_run *run;
    trip_block block;
    uint64_t squares[TRIP_BLOCK_PRESENT_MAX];
    uint32_t voxels;
} trip_cpu_part;

static inline bool trip_cpu_part_has(const trip_cpu_part *p, unsigned square)
{
    return p->squares[square / 64] >> square % 64 & 1;
}

/* Makes the part with the squares of a run after the first `skip`, in draw order, up to `max`
 * voxels. */
void trip_cpu_part_make(trip_cpu_part *part, const trip_run *run, const trip_block *block,
                        bool reversed, uint32_t skip, uint32_t max);

#endif
