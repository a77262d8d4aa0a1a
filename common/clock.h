/* The clock for durations and deadlines, CLOCK_MONOTONIC. */
#ifndef TRIP_CLOCK_H
#define TRIP_CLOCK_H

#include <stdint.h>
#include <time.h>

static inline uint64_t trip_now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

static inline double trip_now_ms(void)
{
    return (double)trip_now_ns() * 1e-6;
}

static inline double trip_now_seconds(void)
{
    return (double)trip_now_ns() * 1e-9;
}

#endif
