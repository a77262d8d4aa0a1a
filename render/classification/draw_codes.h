/* The codes that a frame interpolates. Interpolation needs even codes: the mean of two codes must
 * stand for the mean of their values. If the codes of a data set are even, draw codes are the
 * stored codes. Otherwise a map converts each stored code to a draw code. The draw codes then cover
 * the values between which the transfer function changes, and a margin around them.
 *
 * Beyond the range of draw codes the function is constant. The CPU renderer has codes of 16 bits.
 * So its map squeezes values there, and half of the margin, into the outer half of the margin's
 * codes. Gradients keep their directions. A surface moves only in cells that have squeezed values.
 * If a cell has values beyond both ends, its surface lies in the middle. The range therefore covers
 * all typical values, unless the function changes within a small part of them. The reference, the
 * integral and gl use exact codes beyond the range.
 *
 * Plain values and pure functions. */
#ifndef TRIP_DRAW_CODES_H
#define TRIP_DRAW_CODES_H

#include "code_set.h"
#include "codes.h"
#include "transfer_function.h"

/* The number of draw codes between the two nearest points of the function, and the maximum number
 * in the whole part in which it changes. The fewer codes the part has, the more widths of it lie
 * within the range. Draw codes are never finer than the stored codes of the part. */
#define TRIP_DRAW_PART_MIN 64.0
#define TRIP_DRAW_PART_MAX 1024.0

/* How many times coarser draw codes are if the range would lack a part of the typical values. */
#define TRIP_DRAW_COARSER 2.0

/* The number of draw codes in the part if typical values lie beyond one of its ends only. Surfaces
 * then move by less than a hundredth of a voxel, and thin matter at the other end needs fine codes.
 */
#define TRIP_DRAW_PART_FINE 512.0

typedef struct trip_draw_codes {
    double lo, hi; /* values of draw codes 0 and 65535 */
    /* The draw code of each of 65536 stored codes. NULL means that draw codes are stored codes. */
    const uint16_t *of_stored;
    trip_codes stored; /* the codes of the data set */
} trip_draw_codes;

/* Returns draw codes that are the stored codes: for even codes, and for frames that do not
 * interpolate. */
trip_draw_codes trip_draw_codes_as_stored(const trip_codes *stored);
/* Chooses the range for a function in data units and fills `map`, which must outlive the result.
 * If the codes are even, returns trip_draw_codes_as_stored() and leaves `map` alone. `typical` has
 * the typical range of the data set (format.h). */
trip_draw_codes trip_draw_codes_for(const trip_tf *tf, const trip_codes *stored,
                                    const double typical[2], uint16_t map[TRIP_CODES]);

static inline unsigned trip_draw_code(const trip_draw_codes *d, unsigned stored)
{
    return d->of_stored ? d->of_stored[stored] : stored;
}

/* Returns the draw codes of the stored codes from `min` to `max`. */
static inline trip_code_range trip_draw_codes_range(const trip_draw_codes *d, unsigned min,
                                                    unsigned max)
{
    return (trip_code_range){ (uint16_t)trip_draw_code(d, min), (uint16_t)trip_draw_code(d, max) };
}

/* Returns the code of a stored code before rounding and clamping. It may lie far outside of [0,
 * 65535]. */
double trip_draw_code_exact(const trip_draw_codes *d, unsigned stored);

/* Returns the deviation code of a draw code, from the deviation code d of its stored code
 * (deviation.h). It grows by the draw codes per stored code there, and is at most 255. */
double trip_draw_deviation(const trip_draw_codes *d, unsigned stored, unsigned deviation);

static inline double trip_draw_value_per_code(const trip_draw_codes *d)
{
    return (d->hi - d->lo) / (TRIP_CODES - 1);
}

/* Returns the width of the smallest interval outside of which the function is constant. */
double trip_draw_codes_changing(const trip_tf *tf);

/* Fills the table of a function: entry c belongs to the value of stored code c, or of draw code c.
 * `voxel_world` is the length of one voxel. The two tables are equal if draw codes are stored
 * codes. */
void trip_draw_codes_stored_table(const trip_draw_codes *d, const trip_tf *tf, double voxel_world,
                                  trip_tf_entry table[TRIP_CODES]);
void trip_draw_codes_table(const trip_draw_codes *d, const trip_tf *tf, double voxel_world,
                           trip_tf_entry table[TRIP_CODES]);

/* A part of a function that draw codes are too coarse for. */
typedef struct trip_draw_loss {
    double lo, hi;      /* the values between which the function changes */
    double codes;       /* number of draw codes between them */
    double first, last; /* the values between which the whole function changes */
} trip_draw_loss;

/* Finds a part between two neighbouring points with a visible change, fewer than 16 draw codes, and
 * at least 4 times as many stored codes. Returns false if there is none. */
bool trip_draw_codes_loss(const trip_draw_codes *d, const trip_tf *tf, trip_draw_loss *out);

#endif
