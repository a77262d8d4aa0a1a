/* How much of what is random a test tries: TRIP_LIMITS_ROUNDS times as much as by default. */
#ifndef ROUNDS_H
#define ROUNDS_H

#include <stdlib.h>

static inline int limits_rounds(int count)
{
    const char *text = getenv("TRIP_LIMITS_ROUNDS");
    int rounds = text ? atoi(text) : 1;
    return count * (rounds > 0 ? rounds : 1);
}

#endif
