#include "coarse.h"

#include <math.h>
#include <string.h>

/* Divides a sum over eight; a positive sum stays positive. */
static uint16_t eighth(uint32_t sum)
{
    const uint32_t part = (sum + 4) / 8;
    return (uint16_t)(sum > 0 && part == 0 ? 1 : part);
}

/* Returns the variance of the codes: the mean of the variances plus the variance of the means. */
static float variance_of(const trip_coarse_value_sum *s)
{
    const double known = s->known, codes = (double)s->codes;
    const double variance = (s->squares * known - codes * codes) / (known * known);
    return (float)(variance > 0 ? variance : 0);
}

void trip_coarse_value_get(const trip_coarse_value_sum *s, trip_coarse_value *out)
{
    out->known = eighth(s->known);
    out->value = (uint16_t)((s->codes + s->known / 2) / s->known);
    out->variance = variance_of(s);
    out->around = s->below > UINT16_MAX - TRIP_COARSE_ALL_KEPT ? (uint16_t)(UINT16_MAX - s->below)
                                                               : TRIP_COARSE_ALL_KEPT;
    if (!s->kept)
        out->around = TRIP_COARSE_NONE_KEPT;
}

void trip_coarse_votes_add(trip_coarse_votes *v, uint16_t code, uint32_t count)
{
    unsigned i = 0;
    while (i < v->used && v->codes[i] != code)
        i++;
    if (i == v->used) { /* a coarse voxel has at most eight voxels */
        v->codes[i] = code;
        v->counts[v->used++] = 0;
    }
    v->counts[i] += count;
}

uint16_t trip_coarse_votes_get(const trip_coarse_votes *v)
{
    unsigned best = 0;
    for (unsigned i = 1; i < v->used; i++)
        if (v->counts[i] > v->counts[best] ||
            (v->counts[i] == v->counts[best] && v->codes[i] > v->codes[best]))
            best = i;
    return v->codes[best];
}

void trip_coarse_mean_clear(trip_coarse_mean_sum *s)
{
    memset(s, 0, sizeof *s);
    memset(s->open, 255, sizeof s->open);
}

/* Assumes that voxels of a column overlap at random. This is exact if one covers everything. */
static void cover_column(uint8_t *open, unsigned cover)
{
    *open = (uint8_t)(((unsigned)*open * (TRIP_COARSE_ALL - cover) + TRIP_COARSE_ALL / 2) /
                      TRIP_COARSE_ALL);
}

/* Weights gradients by their length, because the surface of a solid is visible and has gradients,
 * and the inside is not. */
static void add_gradient(trip_coarse_mean_sum *s, double part, const double gradient[3])
{
    double along = 0, length2 = 0;
    for (int a = 0; a < 3; a++) {
        along += (double)s->gradient[a] * gradient[a];
        length2 += gradient[a] * gradient[a];
    }
    const double weight = part * sqrt(length2);
    s->steep += (float)weight;
    for (int a = 0; a < 3; a++)
        s->gradient[a] += (float)(copysign(weight, along) * gradient[a]);
}

/* Column along each axis, by the parity bits of a voxel's coordinates. */
static const uint8_t columns[8][3] = { { 0, 0, 0 }, { 0, 2, 1 }, { 1, 0, 2 }, { 1, 2, 3 },
                                       { 2, 1, 0 }, { 2, 3, 1 }, { 3, 1, 2 }, { 3, 3, 3 } };

void trip_coarse_mean_add_whole(trip_coarse_mean_sum *s, uint16_t code, unsigned odd,
                                const double gradient[3])
{
    s->kept += TRIP_COARSE_ALL;
    s->mean += (float)TRIP_COARSE_ALL * code;
    for (int a = 0; a < 3; a++)
        s->open[a][columns[odd][a]] = 0;
    if (gradient)
        add_gradient(s, TRIP_COARSE_ALL, gradient);
}

void trip_coarse_mean_add(trip_coarse_mean_sum *s, const trip_coarse_mean *mean, unsigned odd,
                          const double gradient[3])
{
    if (mean->kept == 0)
        return;
    s->kept += mean->kept;
    s->mean += (float)mean->kept * mean->mean;
    for (int a = 0; a < 3; a++)
        cover_column(&s->open[a][columns[odd][a]], mean->cover[a]);
    if (gradient)
        add_gradient(s, mean->kept, gradient);
}

/* Equals rint() for 0 to 2^51; many processors lack an instruction for it. */
static double nearest(double x)
{
    const double whole = 0x1p52;
    return x + whole - whole;
}

static uint16_t mean_of(float sum, float weight)
{
    double mean = weight > 0 ? nearest((double)sum / (double)weight) : 0;
    return (uint16_t)(mean < 65535 ? mean : 65535);
}

void trip_coarse_mean_get(const trip_coarse_mean_sum *s, trip_coarse_mean *out)
{
    *out =
        (trip_coarse_mean){ .kept = eighth((uint32_t)s->kept), .mean = mean_of(s->mean, s->kept) };
    for (int a = 0; a < 3 && out->kept > 0; a++) {
        unsigned open = 0;
        for (int column = 0; column < 4; column++)
            open += s->open[a][column];
        unsigned cover = (4 * 255 - open) * TRIP_COARSE_ALL / (4 * 255);
        out->cover[a] = (uint16_t)(cover < out->kept ? out->kept : cover);
    }
}

void trip_coarse_mean_gradient(const trip_coarse_mean_sum *s, double gradient[3])
{
    for (int a = 0; a < 3; a++)
        gradient[a] = s->steep > 0 ? (double)s->gradient[a] / (double)s->steep : 0;
}
