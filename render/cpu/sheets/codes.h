/* Codes as sheets hold them. Sheets and slices hold whole codes; where a data set uses few of the
 * 65536 there are, they are stretched by a power of two, so that rounding them takes no more than
 * 1/32768 of the values there are; samples, every fourth code (TRIP_CPU_ENTRIES), 1/16384. */
#ifndef TRIP_CPU_SHEETS_CODES_H
#define TRIP_CPU_SHEETS_CODES_H

#include <stdint.h>

/* A code c of the data set is (c - first) 2^shift, below 65536. */
typedef struct trip_cpu_codes {
    uint16_t first;
    unsigned shift;
} trip_cpu_codes;

/* Of frames whose values have codes between these; least > most: they have none. */
trip_cpu_codes trip_cpu_codes_of(unsigned min, unsigned max);

static inline uint16_t trip_cpu_code(trip_cpu_codes c, uint16_t code)
{
    return (uint16_t)((uint32_t)(uint16_t)(code - c.first) << c.shift);
}

#endif
