#include "orientation_symmetry.h"

#include <math.h>

/* Scans of heads and a teapot score 0.93 to 0.97 across their axis of symmetry, and up to 0.88
 * across the others. Volumes without symmetry, such as an engine, a chest, clouds and vessels, stay
 * below 0.88. Simulations of atoms score alike across two axes. */
static const double strong = 0.9, max_of_others = 0.9, times_weaker = 2;

/* Adds, for each position of the mirror plane, the products of bins and their mirror images.
 * Position c maps bin i to bin c - i. */
static void add_row(trip_occupancy_row r, uint64_t *sums)
{
    uint64_t w[TRIP_OCCUPANCY_EDGE];
    for (int i = 0; i < r.bins; i++)
        w[i] = r.first[(size_t)i * r.step];
    for (int i = 0; i < r.bins; i++) {
        if (w[i] == 0)
            continue;
        for (int j = 0; j < r.bins; j++)
            sums[i + j] += w[i] * w[j];
    }
}

/* A sum has at most 2^18 products of 32 bits, so 64 bits suffice. */
double trip_orientation_symmetry_score(const trip_occupancy *o, int axis)
{
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const size_t count = (size_t)o->dims[0] * (size_t)o->dims[1] * (size_t)o->dims[2];
    uint64_t sums[2 * TRIP_OCCUPANCY_EDGE] = { 0 }, max = 0, squares = 0;
    for (int b = 0; b < o->dims[v]; b++)
        for (int a = 0; a < o->dims[u]; a++)
            add_row(trip_occupancy_along(o, axis, a, b), sums);
    for (int c = 0; c < 2 * TRIP_OCCUPANCY_EDGE; c++)
        max = sums[c] > max ? sums[c] : max;
    for (size_t i = 0; i < count; i++)
        squares += (uint64_t)o->weights[i] * o->weights[i];
    return squares > 0 ? (double)max / (double)squares : 0;
}

int trip_orientation_symmetry_axis(const double scores[3])
{
    int best = 0;
    double other = 0;
    for (int a = 1; a < 3; a++)
        best = scores[a] > scores[best] ? a : best;
    for (int a = 0; a < 3; a++)
        other = a != best ? fmax(other, scores[a]) : other;
    bool found = scores[best] >= strong && other <= max_of_others &&
                 1 - other >= times_weaker * (1 - scores[best]);
    return found ? best : -1;
}
