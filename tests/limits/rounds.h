/* How much of what is random a test tries: TRIP_LIMITS_ROUNDS times as much as by default, and
 * under sanitizers a quarter. */
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
