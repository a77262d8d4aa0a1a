#include "cpu/sheets/codes.h"

trip_cpu_codes trip_cpu_codes_of(unsigned min, unsigned max)
{
    trip_cpu_codes c = { .first = 0 };
    if (min > max)
        return c;
    c.first = (uint16_t)min;
    while ((max - min) << (c.shift + 1) <= UINT16_MAX && c.shift < 15)
        c.shift++;
    if (c.shift == 0)
        c.first = 0;
    return c;
}
