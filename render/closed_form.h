/* Transfer functions whose segments (sheet.h) need no table: over all codes that a data set holds,
 * extinction is a polynomial of the code, of degree three, and colours are linear, so that the
 * integrals of trip_segment_of() over the codes from a to b are a few products. With
 *     x = scale code + offset,  in [0, 1] where the function shows,
 *     k(x) = k0 + k1 x + k2 x^2 + k3 x^3,  and 0 below x = 0,   q(x) = q0 + q1 x,
 * x_a and x_b of the ends, but no less than 0, m their mean and d their difference,
 *     K = k(m) + (k2 + 3 k3 m) d^2 / 12                      the mean of k between them,
 *     x' = m + (k'(m) d^2 / 12 + k3 d^4 / 80) / K            where the mean of what is seen lies,
 *     extinction = K (x_b - x_a) / (what that is without the bound of 0),  colour = q(x'),
 * which is exact for such k and q. A function that is linear in the value has opacity o = c x, and
 * extinction -ln(1 - o) = o + o^2 / 2 + o^3 / 3 + ..., which a cubic is near enough to up to an
 * opacity of 0.2 per unit; constant extinction, and extinction that is linear in the value, it is
 * at any. A ramp that begins within the codes, or ends there, is one too (below x = 0).
 *
 * Near enough is, at every code, an extinction k within E (k + 1 / D) and colours within E,
 * E = TRIP_CLOSED_FORM_ERROR and D at least as long as a ray in the volume. So all that lies in
 * front of a place has an optical depth within E (t + 1) of its own, t, an opacity is off by E at
 * most (that times exp(-t)), and a colour by 5 E, 0.16/255: E for the colours that it is a mean of,
 * and 4 E for the weights of these, which are k exp(-t) over the ray. */
#ifndef TRIP_CLOSED_FORM_H
#define TRIP_CLOSED_FORM_H

#include <stdbool.h>

#include "transfer_function.h"

#define TRIP_CLOSED_FORM_ERROR (1.0 / 8192)

typedef struct trip_closed_form {
    double scale, offset;
    double k[4]; /* per world unit */
    double q0[3], q1[3];
    bool ramp;     /* some codes lie below x = 0, and k0 is 0; else none does */
    bool coloured; /* q1 is not 0 */
} trip_closed_form;

/* What keeps a function from having one. */
typedef enum trip_closed_form_fault {
    TRIP_CLOSED_FORM_FOUND,
    TRIP_CLOSED_FORM_ENDS, /* neither the least code shows nor the greatest, or there is none */
    TRIP_CLOSED_FORM_EXTINCTION, /* is no such polynomial */
    TRIP_CLOSED_FORM_COLOUR,     /* is not linear */
    TRIP_CLOSED_FORM_EFFECTS, /* not asked: frames with effects, which take far more, look it up */
} trip_closed_form_fault;

/* Of the codes from `least` to `most` of a table of 65536; `longest` is D, world units. Most
 * functions that have none are told by a few codes of the table. */
trip_closed_form_fault trip_closed_form_find(trip_closed_form *form, const trip_tf_entry *table,
                                             unsigned min, unsigned max, double longest);

#endif
