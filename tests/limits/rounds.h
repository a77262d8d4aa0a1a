/* Returns the number of random rounds of a test. The environment variable TRIP_LIMITS_ROUNDS
 * multiplies the default. Sanitizer builds run a quarter of the rounds. */
#ifndef ROUNDS_H
#define ROUNDS_H

#include <stdlib.h>

#include "sanitizers.h"

static inline int limits_rounds(int count)
{
    const char *text = getenv("TRIP_LIMITS_ROUNDS");
    int rounds = text ? atoi(text) : 1;
    return (TEST_BY_TURNS ? (count + 3) / 4 : count) * (rounds > 0 ? rounds : 1);
}

#endif
