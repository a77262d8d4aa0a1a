/* The voxels of coarse levels. Each one combines 2 x 2 x 2 voxels of the level below. Pure
 * functions. */
#ifndef TRIP_COARSE_H
#define TRIP_COARSE_H

#include <stdbool.h>
#include <stdint.h>

/* Shares are in units of 1 / 65535. */
enum { TRIP_COARSE_ALL = 65535 };

/* A voxel of any level: its position and its value for interpolation. */
typedef struct trip_coarse_value {
    uint8_t u, v;   /* position in its square of the sheet, along x and y */
    uint16_t known; /* share of its level 0 voxels with a value: kept or halo */
    uint16_t value; /* mean code of the voxels with a value */
    /* For a voxel that covers kept and dropped voxels of level 0: the minimum turned code
     * (trip_coarse_turned()) of the dropped ones. Neighbours without a value take it. Otherwise
     * TRIP_COARSE_NONE_KEPT or TRIP_COARSE_ALL_KEPT. */
    uint16_t around;
    float variance; /* of the codes of its level 0 voxels with a value */
} trip_coarse_value;

enum {
    TRIP_COARSE_NONE_KEPT = UINT16_MAX,
    TRIP_COARSE_ALL_KEPT = UINT16_MAX - 1, /* all voxels with a value were kept */
};

/* The data of a coarse voxel's splat. */
typedef struct trip_coarse_mean {
    uint16_t kept;     /* share of its level 0 voxels that were kept */
    uint16_t mean;     /* mean code of the kept voxels */
    uint16_t cover[3]; /* by axis: share of its columns with kept voxels */
    uint32_t normal;   /* packed mean gradient of the kept voxels */
} trip_coarse_mean;

/* Reverses codes if dropped values lie above kept ones, so that the least visible value has the
 * minimum code. */
static inline uint16_t trip_coarse_turned(uint16_t code, bool round)
{
    return round ? (uint16_t)(UINT16_MAX - code) : code;
}

/* A sum for codes with a table. It has no mean of codes. */
typedef union trip_coarse_uneven {
    double values; /* knots: sum of values times shares */
    struct {       /* ids: the candidate for the majority */
        uint32_t votes, id;
    };
} trip_coarse_uneven;

/* Adds a share of an id. The candidate left at the end has the majority, if any id has. */
static inline void trip_coarse_vote(trip_coarse_uneven *s, uint32_t share, uint16_t id)
{
    if (s->id == id) {
        s->votes += share;
    } else if (share > s->votes) {
        s->votes = share - s->votes;
        s->id = id;
    } else {
        s->votes -= share;
    }
}

/* Sums over the voxels of one coarse voxel. Zero-initialise it. */
typedef struct trip_coarse_value_sum {
    /* Sums of codes and of their squares, times known shares. Sums of codes are whole. */
    uint64_t codes;
    double squares;
    trip_coarse_uneven uneven;
    uint32_t known;
    uint16_t below; /* UINT16_MAX minus `around` of dropped voxels; 0 if there are none */
    bool kept;
} trip_coarse_value_sum;

static inline void trip_coarse_value_add_around(trip_coarse_value_sum *s, uint16_t around)
{
    const uint16_t below = (uint16_t)(UINT16_MAX - around);
    s->below = below > s->below ? below : s->below;
}

/* Adds a voxel of the level below. */
static inline void trip_coarse_value_add(trip_coarse_value_sum *s, const trip_coarse_value *value,
                                         bool round)
{
    const bool kept = value->around != TRIP_COARSE_NONE_KEPT;
    s->codes += (uint64_t)value->known * value->value;
    s->squares += value->known * ((double)value->value * value->value + (double)value->variance);
    s->known += value->known;
    s->kept |= kept;
    trip_coarse_value_add_around(s, kept ? value->around : trip_coarse_turned(value->value, round));
}

/* Adds several level 0 voxels at once, by the sums of their codes and of the squares. */
static inline void trip_coarse_value_add_whole(trip_coarse_value_sum *s, uint32_t count,
                                               uint32_t codes, uint64_t squares, bool kept)
{
    s->codes += (uint64_t)codes * TRIP_COARSE_ALL;
    s->squares += (double)squares * TRIP_COARSE_ALL;
    s->known += count * TRIP_COARSE_ALL;
    s->kept |= kept;
}

/* Computes all members but `u` and `v`. The sum must not be empty. With a table of
 * codes, the caller sets `value` instead. */
void trip_coarse_value_get(const trip_coarse_value_sum *s, trip_coarse_value *out);

/* Counts the codes of one coarse voxel of labels, since a mean of labels is another label.
 * Zero-initialise it. */
typedef struct trip_coarse_votes {
    uint16_t codes[8];
    uint32_t counts[8];
    unsigned used;
} trip_coarse_votes;

/* Adds a code that `count` of the voxels of level 0 have, in any unit. */
void trip_coarse_votes_add(trip_coarse_votes *v, uint16_t code, uint32_t count);
/* Returns the most frequent code, and of equally frequent ones the greatest. */
uint16_t trip_coarse_votes_get(const trip_coarse_votes *v);

/* Sums for the means of one coarse voxel. Call trip_coarse_mean_clear() before adding voxels. */
typedef struct trip_coarse_mean_sum {
    trip_coarse_uneven uneven;
    float kept, mean;
    float gradient[3], steep; /* sum of gradients times their lengths; sum of the lengths */
    uint8_t open[3][4];       /* by axis and column: share without kept voxels, in 1 / 255 */
} trip_coarse_mean_sum;

void trip_coarse_mean_clear(trip_coarse_mean_sum *s);

/* Adds a voxel. Bits 0 to 2 of `odd` are the parity of its coordinates. `gradient` may be NULL.
 * Normals can lose their sign (normal.h), so gradients are turned to agree. */
void trip_coarse_mean_add(trip_coarse_mean_sum *s, const trip_coarse_mean *mean, unsigned odd,
                          const double gradient[3]);

/* Adds a kept voxel of level 0. */
void trip_coarse_mean_add_whole(trip_coarse_mean_sum *s, uint16_t code, unsigned odd,
                                const double gradient[3]);

/* Computes the mean, without the normal. With a table of codes, the caller sets `mean` instead. */
void trip_coarse_mean_get(const trip_coarse_mean_sum *s, trip_coarse_mean *out);

/* Returns the mean gradient of the kept voxels, weighted by length. */
void trip_coarse_mean_gradient(const trip_coarse_mean_sum *s, double gradient[3]);

#endif
