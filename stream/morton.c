#include "format.h"

/* Moves bit n of x to bit 2n, with zeros in between. */
static uint64_t dilate(uint32_t x)
{
    uint64_t b = x;
    b = (b | b << 16) & UINT64_C(0x0000ffff0000ffff);
    b = (b | b << 8) & UINT64_C(0x00ff00ff00ff00ff);
    b = (b | b << 4) & UINT64_C(0x0f0f0f0f0f0f0f0f);
    b = (b | b << 2) & UINT64_C(0x3333333333333333);
    return (b | b << 1) & UINT64_C(0x5555555555555555);
}

uint64_t trip_morton(uint32_t u, uint32_t v)
{
    return dilate(u) | dilate(v) << 1;
}

uint32_t trip_morton_even(uint64_t code)
{
    uint64_t b = code & UINT64_C(0x5555555555555555);
    b = (b | b >> 1) & UINT64_C(0x3333333333333333);
    b = (b | b >> 2) & UINT64_C(0x0f0f0f0f0f0f0f0f);
    b = (b | b >> 4) & UINT64_C(0x00ff00ff00ff00ff);
    b = (b | b >> 8) & UINT64_C(0x0000ffff0000ffff);
    return (uint32_t)(b | b >> 16);
}
