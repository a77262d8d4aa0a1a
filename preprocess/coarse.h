/* The voxels of coarse levels, each made of the 2 x 2 x 2 of the level below. Pure functions. */
#ifndef TRIP_COARSE_H
#define TRIP_COARSE_H

#include <stdbool.h>
#include <stdint.h>

/* Parts and shares are in 65535ths. */
enum { TRIP_COARSE_ALL = 65535 };

/* A voxel of any level: where it is, and what is interpolated. */
typedef struct trip_coarse_value {
    uint8_t u, v;   /* in its square of the sheet, along x and y */
    uint16_t known; /* the part of its voxels of level 0 that have a value: kept ones and halo */
    uint16_t value; /* their mean code */
    /* Where some of its voxels were kept, the least code of those that were not, turned round
     * (trip_coarse_turned()), for voxels beside it that have no value; or one of these. */
    uint16_t around;
} trip_coarse_value;

enum {
    TRIP_COARSE_NONE_KEPT = UINT16_MAX,
    TRIP_COARSE_ALL_KEPT = UINT16_MAX - 1, /* of those known */
};

/* What its splat needs. */
typedef struct trip_coarse_mean {
    uint16_t kept;     /* the part of its voxels of level 0 that were kept; 0: none */
    uint16_t mean;     /* code of those */
    uint16_t cover[3]; /* of its columns along an axis, those with kept voxels */
    uint32_t normal;   /* packed: of those kept, see below */
} trip_coarse_mean;

/* Codes are turned round where what is not kept lies above what is, so that what shows least has
 * the least. */
static inline uint16_t trip_coarse_turned(uint16_t code, bool round)
{
    return round ? (uint16_t)(UINT16_MAX - code) : code;
}

/* Sums over the voxels of one coarse voxel; all zero before the first. */
typedef struct trip_coarse_value_sum {
    uint64_t value;
    uint32_t known;
    uint16_t below; /* how far `around` lies below UINT16_MAX, of what was not kept; 0: nothing */
    bool kept;
} trip_coarse_value_sum;

static inline void trip_coarse_value_add_around(trip_coarse_value_sum *s, uint16_t around)
{
    const uint16_t below = (uint16_t)(UINT16_MAX - around);
    s->below = below > s->below ? below : s->below;
}

/* A voxel of the level below. */
static inline void trip_coarse_value_add(trip_coarse_value_sum *s, const trip_coarse_value *value,
                                         bool round)
{
    const bool kept = value->around != TRIP_COARSE_NONE_KEPT;
    s->known += value->known;
    s->value += (uint64_t)value->known * value->value;
    s->kept |= kept;
    trip_coarse_value_add_around(s, kept ? value->around : trip_coarse_turned(value->value, round));
}

/* Some voxels of level 0 at once: the sum of their codes. */
static inline void trip_coarse_value_add_whole(trip_coarse_value_sum *s, uint32_t count,
                                               uint32_t codes, bool kept)
{
    s->known += count * TRIP_COARSE_ALL;
    s->value += (uint64_t)codes * TRIP_COARSE_ALL;
    s->kept |= kept;
}

/* All but `u` and `v`, of a sum of some. */
void trip_coarse_value_get(const trip_coarse_value_sum *s, trip_coarse_value *out);

/* The same of means; cleared before the first. */
typedef struct trip_coarse_mean_sum {
    float kept, mean;
    float gradient[3], steep; /* each times its length; sum of the lengths */
    uint8_t open[3][4]; /* of the columns along an axis, in 255ths, the part without kept voxels */
} trip_coarse_mean_sum;

void trip_coarse_mean_clear(trip_coarse_mean_sum *s);

/* Adds a voxel whose coordinates are odd as the bits 0 to 2 of `odd` say; `gradient` NULL: without
 * one. The sign of gradients may be lost (normal.h): they are turned to point the same way. */
void trip_coarse_mean_add(trip_coarse_mean_sum *s, const trip_coarse_mean *mean, unsigned odd,
                          const double gradient[3]);

/* The same of a voxel of level 0 that was kept. */
void trip_coarse_mean_add_whole(trip_coarse_mean_sum *s, uint16_t code, unsigned odd,
                                const double gradient[3]);

/* Without the normal. */
void trip_coarse_mean_get(const trip_coarse_mean_sum *s, trip_coarse_mean *out);

/* The mean gradient of what was kept, each counted by its length. */
void trip_coarse_mean_gradient(const trip_coarse_mean_sum *s, double gradient[3]);

#endif
