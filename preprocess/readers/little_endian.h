/* Takes little-endian numbers from bytes. */
#ifndef TRIP_LITTLE_ENDIAN_H
#define TRIP_LITTLE_ENDIAN_H

#include <stdint.h>
#include <string.h>

static inline uint16_t trip_le_u16(const unsigned char *p)
{
    return (uint16_t)(p[0] | p[1] << 8);
}

static inline uint32_t trip_le_u32(const unsigned char *p)
{
    return p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static inline uint64_t trip_le_u64(const unsigned char *p)
{
    return trip_le_u32(p) | (uint64_t)trip_le_u32(p + 4) << 32;
}

static inline float trip_le_float(const unsigned char *p)
{
    const uint32_t bits = trip_le_u32(p);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Returns the value of a float of 16 bits (IEEE 754 binary16). */
static inline float trip_le_half(const unsigned char *p)
{
    const uint16_t half = trip_le_u16(p);
    const int exponent = half >> 10 & 31, mantissa = half & 1023;
    const double sign = half >> 15 ? -1 : 1;
    if (exponent == 31)
        return (float)(mantissa ? __builtin_nan("") : sign * __builtin_inf());
    if (exponent == 0)
        return (float)(sign * mantissa * 0x1p-24);
    return (float)(sign * __builtin_ldexp(mantissa + 1024, exponent - 25));
}

#endif
