/* Codes of sheets. Sheets and sample planes store integer codes. If a data set uses few of the
 * 65536 codes, a power of two stretches them. So rounding changes a value by at most 1/32768 of the
 * range of values. Samples that use every fourth code (TRIP_CPU_ENTRIES) change by at most 1/16384.
 * Pure functions. */
#ifndef TRIP_CPU_SHEETS_CODES_H
#define TRIP_CPU_SHEETS_CODES_H

#include <stdint.h>

/* Code c of the data set becomes (c - first) 2^shift, below 65536. */
typedef struct trip_cpu_codes {
    uint16_t first;
    unsigned shift;
} trip_cpu_codes;

/* Returns the stretch for frames with codes in [min, max]. min > max stands for no codes. */
trip_cpu_codes trip_cpu_codes_of(unsigned min, unsigned max);

static inline uint16_t trip_cpu_code(trip_cpu_codes c, uint16_t code)
{
    return (uint16_t)((uint32_t)(uint16_t)(code - c.first) << c.shift);
}

#endif
