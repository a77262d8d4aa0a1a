/* A palette of spherical harmonics: at most 65536 sets of the coefficients of degree 1 and above. A
 * tree divides a sample of the coefficients where they vary most, until each part is one entry or
 * there are enough parts. An entry is the mean of its part (vector quantisation). The palette
 * depends on the sample alone. One thread. */
#ifndef TRIP_HARMONICS_PALETTE_H
#define TRIP_HARMONICS_PALETTE_H

#include <stdbool.h>

#include "budget.h"
#include "gaussian.h"

enum {
    TRIP_PALETTE_SAMPLE_MAX = 1 << 17,
    TRIP_PALETTE_TESTED = 16, /* one of so many vectors of a large sample only tests the palette */
};

typedef struct trip_palette_node {
    double value;             /* lesser coefficients go to the left */
    int32_t left, right;      /* a child below 0 is the entry ~child */
    int32_t number, reserved; /* of the coefficient */
} trip_palette_node;

typedef struct trip_palette {
    int degree;
    unsigned char *entries; /* trip_gaussian_encode_entry() */
    uint64_t count;
    trip_palette_node *nodes; /* the first is the root; none if there is one entry */
    uint64_t node_count;
    /* Mean error of colours, of 1: the root of the mean square over all directions. It is measured
     * with vectors that the palette was not made from, or with all if it has one entry for each. */
    double error;
    uint64_t room; /* entries */
    trip_budget *budget;
} trip_palette;

/* Returns the number of coefficients of degree 1 to `degree`. */
static inline unsigned trip_palette_size(int degree)
{
    return 3 * (unsigned)(trip_sh_count(degree) - 1);
}

/* Makes the palette of `count` vectors of trip_palette_size() numbers each, with at most `most`
 * entries. Returns false if the budget is too small. */
bool trip_palette_build(trip_palette *p, const float *vectors, uint64_t count, int degree,
                        uint64_t most, trip_budget *budget);
/* Returns the number of the entry for the coefficients of a Gaussian. */
unsigned trip_palette_find(const trip_palette *p, const float sh[TRIP_SH_MAX][3]);
void trip_palette_free(trip_palette *p);

#endif
