/* Collects the changes of each pixel between consecutive pictures, and subtracts its motion. */
#include "bench_popping.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const bench_popping_setting bench_popping_settings[BENCH_POPPING_SETTINGS] = {
    { "merge, h 0", "0", TRIPTYCH_METHOD_MERGE, 0 },
    { "merge, h 0.5", "0.5", TRIPTYCH_METHOD_MERGE, 0.5 },
    { "merge, h 0.85", "0.85", TRIPTYCH_METHOD_MERGE, 0.85 },
    { "merge, h 0.95", "0.95", TRIPTYCH_METHOD_MERGE, 0.95 },
    { "merge, h 0.99", "0.99", TRIPTYCH_METHOD_MERGE, 0.99 },
    { "clip", "clip", TRIPTYCH_METHOD_CLIP, 0 },
    { "axis", "axis", TRIPTYCH_METHOD_AXIS, 0 },
    { "image", "image", TRIPTYCH_METHOD_IMAGE, 0 },
};

enum { STEPS = BENCH_POPPING_STEPS };

size_t bench_popping_bytes(size_t pixels)
{
    const bench_popping_changes *p = NULL;
    return pixels * (4 * sizeof *p->before + sizeof *p->changes + sizeof *p->sorted);
}

bool bench_popping_begin(bench_popping_changes *p, trip_budget *budget, size_t pixels)
{
    *p = (bench_popping_changes){ .budget = budget, .pixels = pixels };
    p->changes = trip_budget_take(budget, bench_popping_bytes(pixels));
    if (!p->changes)
        return false;
    p->before = (float *)(p->changes + pixels);
    p->sorted = p->before + 4 * pixels;
    return true;
}

void bench_popping_end(bench_popping_changes *p)
{
    if (p->changes)
        trip_budget_release(p->budget, p->changes, bench_popping_bytes(p->pixels));
    *p = (bench_popping_changes){ 0 };
}

static int ascending(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Returns the maximum change over the components. */
static float change_of(const float a[4], const float b[4])
{
    float max = 0;
    for (int c = 0; c < 4; c++)
        max = fmaxf(max, fabsf(a[c] - b[c]));
    return max;
}

void bench_popping_add(bench_popping_changes *p, int step, const float *rgba)
{
    for (size_t i = 0; i < p->pixels && step > 0; i++)
        p->changes[i][step - 1] = change_of(&rgba[4 * i], &p->before[4 * i]);
    memcpy(p->before, rgba, 4 * p->pixels * sizeof *p->before);
}

/* Subtracts the motion from the changes, and moves the pixels that change to the front. Returns
 * their number; *mean is the mean motion. */
static size_t take_motion(bench_popping_changes *p, double *mean)
{
    size_t kept = 0;
    double sum = 0;
    for (size_t n = 0; n < p->pixels; n++) {
        float sorted[STEPS];
        memcpy(sorted, p->changes[n], sizeof sorted);
        qsort(sorted, STEPS, sizeof *sorted, ascending);
        if (!(sorted[STEPS - 1] > 0))
            continue;
        float motion = sorted[STEPS / 2];
        for (int i = 0; i < STEPS; i++)
            p->changes[kept][i] = fmaxf(0, p->changes[n][i] - motion);
        sum += (double)motion;
        kept++;
    }
    *mean = kept ? sum / (double)kept : 0;
    return kept;
}

void bench_popping_find(bench_popping_changes *p, const bench_popping_setting *of,
                        bench_popping_row *f)
{
    *f = (bench_popping_row){ .label = of->label, .has_h = of->method == TRIPTYCH_METHOD_MERGE };
    size_t count = take_motion(p, &f->motion);
    f->motion *= 255;
    for (int i = 0; i < STEPS && count > 0; i++) {
        double sum = 0;
        for (size_t n = 0; n < count; n++)
            sum += (double)(p->sorted[n] = p->changes[n][i]);
        qsort(p->sorted, count, sizeof *p->sorted, ascending);
        f->mean = fmax(f->mean, 255 * sum / (double)count);
        f->max = fmax(f->max, 255 * (double)p->sorted[count - 1]);
        f->percentile_99 = fmax(f->percentile_99, 255 * (double)p->sorted[(count - 1) * 99 / 100]);
    }
}
