#include "gaussian_piece.h"

#include <math.h>
#include <string.h>

#include "gaussian.h"
#include "report.h"

/* Precision of a brick's centres: the box has 2^21 codes along an axis. A splat is large enough
 * for a box of 2^15 times its class. */
#define BOX_CLASSES 32768.0
/* A gap that divides a brick is at least this part of its box. */
#define GAP_PART 0.25

static double centre_of(const unsigned char *splat, int axis)
{
    return ((const trip_gaussian *)(const void *)splat)->centre[axis];
}

/* Returns whether a box is too long along an axis for precise codes, and has a wide gap. Sets
 * *from to the first coordinate behind the gap. */
static bool find_gap(int size_class, const unsigned char **splats, unsigned count, int axis,
                     const trip_piece_room *room, double *from)
{
    double lo = INFINITY, hi = -INFINITY, widest = 0;
    for (unsigned i = 0; i < count; i++) {
        const double at = centre_of(splats[i], axis);
        lo = at < lo ? at : lo;
        hi = at > hi ? at : hi;
    }
    if (!(hi - lo > BOX_CLASSES * ldexp(1, 2 * size_class)))
        return false;
    for (unsigned i = 0; i < count; i++)
        room->keys[i] = (trip_key){ trip_key_of(centre_of(splats[i], axis)), i };
    trip_key_sort(room->keys, room->scratch, count);
    for (unsigned i = 1; i < count; i++) {
        const double at = centre_of(splats[room->keys[i].number], axis);
        const double gap = at - centre_of(splats[room->keys[i - 1].number], axis);
        if (gap > widest)
            widest = gap, *from = at;
    }
    return widest > GAP_PART * (hi - lo);
}

/* Moves the splats behind a gap to the end and keeps the order. Returns the number before it. */
static unsigned divide(const unsigned char **splats, unsigned count, int axis, double from,
                       const unsigned char **others)
{
    unsigned left = 0, right = 0;
    for (unsigned i = 0; i < count; i++)
        if (centre_of(splats[i], axis) < from)
            splats[left++] = splats[i];
        else
            others[right++] = splats[i];
    memcpy(splats + left, others, right * sizeof *splats);
    return left;
}

bool trip_piece_has_gap(const trip_gaussian_piece *p, const unsigned char **splats,
                        const trip_piece_room *room)
{
    double from;
    for (int axis = 0; axis < 3; axis++)
        if (find_gap(p->size_class, splats, p->count, axis, room, &from))
            return true;
    return false;
}

int trip_piece_write_divided(trip_gaussian_writer *w, const trip_gaussian_piece *p,
                             const unsigned char **splats, const trip_piece_room *room,
                             unsigned char *codes)
{
    double from = 0;
    for (int axis = 0; axis < 3; axis++)
        if (find_gap(p->size_class, splats, p->count, axis, room, &from)) {
            trip_gaussian_piece left = *p, right = *p;
            left.count = divide(splats, p->count, axis, from, room->others);
            right.count = p->count - left.count;
            const int status = trip_piece_write_divided(w, &left, splats, room, codes);
            return status == TRIP_OK
                       ? trip_piece_write_divided(w, &right, splats + left.count, room, codes)
                       : status;
        }
    trip_file_gaussian_brick brick;
    trip_gaussian_writer_encode(w, p->size_class, splats, p->count, &brick, codes);
    return trip_gaussian_writer_append(w, p->axis, p->node, &brick, codes);
}
