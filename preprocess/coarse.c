#include "coarse.h"

#include <math.h>
#include <string.h>

void trip_coarse_sum_clear(trip_coarse_sum *s)
{
    memset(s, 0, sizeof *s);
    memset(s->open, 255, sizeof s->open);
}

/* Voxels of a column cover one another as if by chance, which is exact where one covers all. */
static void cover_column(uint8_t *open, unsigned cover)
{
    *open = (uint8_t)(((unsigned)*open * (TRIP_COARSE_ALL - cover) + TRIP_COARSE_ALL / 2) /
                      TRIP_COARSE_ALL);
}

/* Gradients count by their length: of a solid the surface is seen, whose voxels have them, not the
 * inside. */
static void add_gradient(trip_coarse_sum *s, double part, const double gradient[3])
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

/* Of a voxel whose coordinates are odd as the bits of the index say, its column along each axis. */
static const uint8_t columns[8][3] = { { 0, 0, 0 }, { 0, 2, 1 }, { 1, 0, 2 }, { 1, 2, 3 },
                                       { 2, 1, 0 }, { 2, 3, 1 }, { 3, 1, 2 }, { 3, 3, 3 } };

void trip_coarse_sum_add_whole(trip_coarse_sum *s, uint16_t code, bool kept, unsigned odd,
                               const double gradient[3])
{
    s->known += TRIP_COARSE_ALL;
    s->value += (float)TRIP_COARSE_ALL * code;
    if (!kept)
        return;
    s->kept += TRIP_COARSE_ALL;
    s->mean += (float)TRIP_COARSE_ALL * code;
    for (int a = 0; a < 3; a++)
        s->open[a][columns[odd][a]] = 0;
    if (gradient)
        add_gradient(s, TRIP_COARSE_ALL, gradient);
}

void trip_coarse_sum_add(trip_coarse_sum *s, const trip_coarse_voxel *voxel, unsigned odd,
                         const double gradient[3])
{
    s->known += voxel->known;
    s->value += (float)voxel->known * voxel->value;
    if (voxel->kept == 0)
        return;
    s->kept += voxel->kept;
    s->mean += (float)voxel->kept * voxel->mean;
    for (int a = 0; a < 3; a++)
        cover_column(&s->open[a][columns[odd][a]], voxel->cover[a]);
    if (gradient)
        add_gradient(s, voxel->kept, gradient);
}

/* As rint() of what is from 0 to 2^51, which many processors have no instruction for. */
static double nearest(double x)
{
    const double whole = 0x1p52;
    return x + whole - whole;
}

/* Of a sum over eight; what there is does not become nothing. */
static uint16_t eighth(float sum)
{
    double part = nearest((double)sum / 8);
    return (uint16_t)(sum > 0 && part < 1 ? 1 : part);
}

static uint16_t mean_of(float sum, float weight)
{
    double mean = weight > 0 ? nearest((double)sum / (double)weight) : 0;
    return (uint16_t)(mean < 65535 ? mean : 65535);
}

bool trip_coarse_sum_get(const trip_coarse_sum *s, trip_coarse_voxel *out)
{
    *out = (trip_coarse_voxel){ .kept = eighth(s->kept),
                                .known = eighth(s->known),
                                .mean = mean_of(s->mean, s->kept),
                                .value = mean_of(s->value, s->known) };
    for (int a = 0; a < 3 && out->kept > 0; a++) {
        unsigned open = 0;
        for (int column = 0; column < 4; column++)
            open += s->open[a][column];
        unsigned cover = (4 * 255 - open) * TRIP_COARSE_ALL / (4 * 255);
        out->cover[a] = (uint16_t)(cover < out->kept ? out->kept : cover);
    }
    return s->known > 0;
}

void trip_coarse_sum_gradient(const trip_coarse_sum *s, double gradient[3])
{
    for (int a = 0; a < 3; a++)
        gradient[a] = s->steep > 0 ? (double)s->gradient[a] / (double)s->steep : 0;
}
