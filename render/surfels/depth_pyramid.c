#include "depth_pyramid.h"

#include <math.h>
#include <string.h>

static int blocks_along(int size, int level)
{
    const int bits = TRIP_PYRAMID_BITS * (level + 1);
    return (size + (1 << bits) - 1) >> bits;
}

static size_t bytes_of(const trip_depth_pyramid *p)
{
    return p->blocks * sizeof(float) + (size_t)p->columns[0] * (size_t)p->rows[0];
}

bool trip_depth_pyramid_begin(trip_depth_pyramid *p, int width, int height, trip_budget *budget)
{
    *p = (trip_depth_pyramid){ .width = width, .height = height };
    do {
        const int level = p->levels++;
        p->columns[level] = blocks_along(width, level);
        p->rows[level] = blocks_along(height, level);
        p->blocks += (size_t)p->columns[level] * (size_t)p->rows[level];
    } while (p->levels < TRIP_PYRAMID_LEVELS &&
             (p->columns[p->levels - 1] > 1 || p->rows[p->levels - 1] > 1));
    float *at = trip_budget_take(budget, bytes_of(p));
    if (!at)
        return false;
    for (size_t i = 0; i < p->blocks; i++)
        at[i] = INFINITY;
    for (int level = 0; level < p->levels; level++) {
        p->greatest[level] = at;
        at += (size_t)p->columns[level] * (size_t)p->rows[level];
    }
    p->changed = (uint8_t *)at;
    return true;
}

void trip_depth_pyramid_end(trip_depth_pyramid *p, trip_budget *budget)
{
    if (p->changed)
        trip_budget_release(budget, p->greatest[0], bytes_of(p));
    p->changed = NULL;
}

/* ---- refreshing ---- */

typedef struct refreshing {
    trip_depth_pyramid *p;
    const uint32_t *depths;
} refreshing;

static float greatest_of(const refreshing *r, int column, int row)
{
    const trip_depth_pyramid *p = r->p;
    const int left = column << TRIP_PYRAMID_BITS, top = row << TRIP_PYRAMID_BITS;
    const int side = 1 << TRIP_PYRAMID_BITS;
    uint32_t most = 0; /* bits of positive floats are in their order */
    for (int y = top; y < top + side && y < p->height; y++)
        for (int x = left; x < left + side && x < p->width; x++) {
            const uint32_t depth = r->depths[(size_t)y * (size_t)p->width + (size_t)x];
            most = depth > most ? depth : most;
        }
    float depth;
    memcpy(&depth, &most, sizeof depth);
    return depth;
}

static void refresh_row(void *context, unsigned row)
{
    const refreshing *r = context;
    const size_t first = (size_t)row * (size_t)r->p->columns[0];
    for (int column = 0; column < r->p->columns[0]; column++) {
        const size_t at = first + (size_t)column;
        if (!r->p->changed[at])
            continue;
        r->p->changed[at] = 0;
        r->p->greatest[0][at] = greatest_of(r, column, (int)row);
    }
}

static void refresh_level(trip_depth_pyramid *p, int level)
{
    const int columns = p->columns[level], below = p->columns[level - 1];
    const int side = 1 << TRIP_PYRAMID_BITS;
    for (int row = 0; row < p->rows[level]; row++)
        for (int column = 0; column < columns; column++) {
            float most = 0;
            for (int y = row * side; y < (row + 1) * side && y < p->rows[level - 1]; y++)
                for (int x = column * side; x < (column + 1) * side && x < below; x++)
                    most =
                        fmaxf(most, p->greatest[level - 1][(size_t)y * (size_t)below + (size_t)x]);
            p->greatest[level][(size_t)row * (size_t)columns + (size_t)column] = most;
        }
}

void trip_depth_pyramid_refresh_above(trip_depth_pyramid *p)
{
    for (int level = 1; level < p->levels; level++)
        refresh_level(p, level);
}

void trip_depth_pyramid_refresh(trip_depth_pyramid *p, const uint32_t *depths,
                                const trip_task_runner *runner)
{
    refreshing r = { p, depths };
    trip_run_tasks(runner, refresh_row, &r, (unsigned)p->rows[0]);
    trip_depth_pyramid_refresh_above(p);
}

/* ---- queries ---- */

static int at_least(int a, int b)
{
    return a > b ? a : b;
}

static int at_most(int a, int b)
{
    return a < b ? a : b;
}

/* Looks at the blocks of a level, and inside those that are not before the depth. */
static bool is_before(const trip_depth_pyramid *p, int level, int left, int top, int right,
                      int bottom, float depth)
{
    const int bits = TRIP_PYRAMID_BITS * (level + 1), side = 1 << bits;
    for (int row = top >> bits; row <= bottom >> bits; row++)
        for (int column = left >> bits; column <= right >> bits; column++) {
            const size_t at = (size_t)row * (size_t)p->columns[level] + (size_t)column;
            if (p->greatest[level][at] < depth)
                continue;
            const int x = column << bits, y = row << bits;
            if (!level ||
                !is_before(p, level - 1, at_least(left, x), at_least(top, y),
                           at_most(right, x + side - 1), at_most(bottom, y + side - 1), depth))
                return false;
        }
    return true;
}

bool trip_depth_pyramid_is_before(const trip_depth_pyramid *p, int left, int top, int right,
                                  int bottom, float depth)
{
    const int wide = at_least(right - left, bottom - top);
    int level = 0;
    while (level + 1 < p->levels && wide >> (TRIP_PYRAMID_BITS * (level + 2)))
        level++;
    return is_before(p, level, left, top, right, bottom, depth);
}
