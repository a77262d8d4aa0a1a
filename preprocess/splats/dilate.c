#include "dilate.h"

/* Dilates a row along x. */
static void dilate_row(const uint8_t *restrict from, uint8_t *restrict to, int64_t count)
{
    if (count == 1) {
        to[0] = from[0];
        return;
    }
    to[0] = from[0] | from[1];
    for (int64_t i = 1; i < count - 1; i++)
        to[i] = from[i - 1] | from[i] | from[i + 1];
    to[count - 1] = from[count - 2] | from[count - 1];
}

/* Dilates `count` consecutive groups of `length` flags by the groups before and after each: rows in
 * a slice, or slices in a box. */
static void dilate_groups(const uint8_t *restrict from, uint8_t *restrict to, int64_t length,
                          int64_t count)
{
    for (int64_t r = 0; r < count; r++) {
        const uint8_t *at = from + r * length;
        const uint8_t *before = r > 0 ? at - length : at;
        const uint8_t *after = r < count - 1 ? at + length : at;
        for (int64_t i = 0; i < length; i++)
            to[r * length + i] = before[i] | at[i] | after[i];
    }
}

void trip_dilate(const uint8_t *flags, uint8_t *out, uint8_t *scratch, const int64_t size[3])
{
    const int64_t slice = size[0] * size[1];
    for (int64_t row = 0; row < size[1] * size[2]; row++)
        dilate_row(flags + row * size[0], out + row * size[0], size[0]);
    for (int64_t z = 0; z < size[2]; z++)
        dilate_groups(out + z * slice, scratch + z * slice, size[0], size[1]);
    dilate_groups(scratch, out, slice, size[2]);
}
