#include "orientation.h"

#include <math.h>

#include "report.h"

static trip_orientation look_at(const trip_occupancy *o)
{
    double scores[3], shares[6];
    for (int axis = 0; axis < 3; axis++)
        scores[axis] = trip_orientation_symmetry_score(o, axis);
    for (int side = 0; side < 6; side++)
        shares[side] = trip_orientation_base_share(o, side);
    return (trip_orientation){ trip_orientation_symmetry_axis(scores),
                               trip_orientation_base_side(shares) };
}

int trip_orientation_find(trip_orientation *u, trip_writer *w, const trip_occupancy_params *params,
                          trip_budget *budget)
{
    trip_occupancy *o = trip_budget_take(budget, sizeof *o);
    if (!o)
        return trip_fail(TRIP_ERROR, "brick", "orientation",
                         "guessing it takes 3 MiB of memory: raise --memory");
    int status = trip_occupancy_read(o, w, params, budget);
    if (status == 0)
        *u = look_at(o);
    trip_budget_release(budget, o, sizeof *o);
    return status;
}

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

/* A cloud, a statue, a teapot and a human head score 0.72 to 0.84 on their base, and 0.14 to 0.36
 * on the next best side. Other volumes score below 0.6, or alike on two sides, such as an engine
 * and a chest. */
static const double level = 0.6, times_others = 2;

enum { PARTS_OF_EXTENT = 10, OBJECT = UINT16_MAX / 4 }; /* minimum weight of a bin of the object */

/* Finds the object's first and last bin of a row. Returns false if the row has none. */
static bool find_ends(trip_occupancy_row row, int *first, int *last)
{
    *first = row.bins;
    *last = -1;
    for (int i = 0; i < row.bins; i++) {
        if (row.first[(size_t)i * row.step] < OBJECT)
            continue;
        *first = *first < i ? *first : i;
        *last = i;
    }
    return *last >= 0;
}

double trip_orientation_base_share(const trip_occupancy *o, int side)
{
    const int axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
    int at_first[TRIP_OCCUPANCY_EDGE] = { 0 }, at_last[TRIP_OCCUPANCY_EDGE] = { 0 };
    int rows = 0, lo = TRIP_OCCUPANCY_EDGE, hi = -1, first, last, near = 0;
    for (int b = 0; b < o->dims[v]; b++)
        for (int a = 0; a < o->dims[u]; a++) {
            if (!find_ends(trip_occupancy_along(o, axis, a, b), &first, &last))
                continue;
            at_first[first]++;
            at_last[last]++;
            rows++;
            lo = lo < first ? lo : first;
            hi = hi > last ? hi : last;
        }
    for (int i = 0; i <= hi - lo && i * PARTS_OF_EXTENT < hi - lo + 1; i++)
        near += side % 2 ? at_last[hi - i] : at_first[lo + i];
    return rows > 0 ? (double)near / rows : 0;
}

int trip_orientation_base_side(const double shares[6])
{
    int best = 0;
    double other = 0;
    for (int s = 1; s < 6; s++)
        best = shares[s] > shares[best] ? s : best;
    for (int s = 0; s < 6; s++)
        other = s != best ? fmax(other, shares[s]) : other;
    return shares[best] >= level && shares[best] >= times_others * other ? best : -1;
}

const char *trip_orientation_base_name(int side)
{
    static const char *const names[] = { "-x", "+x", "-y", "+y", "-z", "+z" };
    return names[side];
}
