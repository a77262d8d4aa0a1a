/* Transfer functions with segments (sheet.h) that need no table. Over all codes of the data set,
 * extinction is a polynomial of degree three of the code, and colours are linear. The integrals of
 * trip_segment_of() over the codes from a to b are then a few products. With
 *
 *     x = scale code + offset,  in [0, 1] for visible codes,
 *     k(x) = k0 + k1 x + k2 x^2 + k3 x^3,  and 0 below x = 0,   q(x) = q0 + q1 x,
 *
 * let x_a and x_b be the x of the ends, raised to 0 if below it. Let m be their mean and d their
 * difference. Then
 *
 *     K  = k(m) + (k2 + 3 k3 m) d^2 / 12                is the mean of k between them,
 *     x' = m + (k'(m) d^2 / 12 + k3 d^4 / 80) / K       is the mean x, weighted by k,
 *     extinction = K (x_b - x_a) / (the same difference without the bound 0),
 *     colour     = q(x').
 *
 * These formulas are exact for such k and q.
 *
 * If opacity is linear in the value, o = c x, then extinction is
 *
 *     -ln(1 - o) = o + o^2 / 2 + o^3 / 3 + ...
 *
 * A cubic approximates this up to an opacity of 0.2 per unit. Constant and linear extinction have a
 * closed form at any opacity. Ramps that begin or end within the codes have one too.
 *
 * Accuracy: at every code, extinction k is within E (k + 1 / D) and colours are within E. Here E is
 * TRIP_CLOSED_FORM_ERROR, and D is at least the length of the longest ray in the volume. In front
 * of any point, the optical depth is then within E (t + 1) of the exact value t. An opacity is off
 * by at most E exp(-t). A colour is off by at most 5 E, which is 0.16/255: E for the colours in its
 * mean, and 4 E for their weights, k exp(-t) along the ray. */
#ifndef TRIP_CLOSED_FORM_H
#define TRIP_CLOSED_FORM_H

#include <stdbool.h>

#include "transfer_function.h"

#define TRIP_CLOSED_FORM_ERROR (1.0 / 8192)

typedef struct trip_closed_form {
    double scale, offset;
    double k[4]; /* per world unit */
    double q0[3], q1[3];
    bool ramp;     /* some codes lie below x = 0, and k0 is 0 */
    bool coloured; /* q1 is not 0 */
} trip_closed_form;

/* The reason why a transfer function has no closed form. */
typedef enum trip_closed_form_fault {
    TRIP_CLOSED_FORM_FOUND,
    TRIP_CLOSED_FORM_ENDS, /* neither the minimum nor the maximum code is visible, or there are no
                              codes */
    TRIP_CLOSED_FORM_EXTINCTION, /* extinction is not such a polynomial */
    TRIP_CLOSED_FORM_COLOUR,     /* colour is not linear */
    TRIP_CLOSED_FORM_NEAREST,    /* not tried: the nearest value has one code a segment */
    TRIP_CLOSED_FORM_EFFECTS,    /* not tried: frames with effects use tables */
    TRIP_CLOSED_FORM_BLURRED,    /* not tried: blurred functions are tables (blurred_function.h) */
} trip_closed_form_fault;

/* Finds the closed form over the codes from `min` to `max` of a table of 65536 entries. `longest`
 * is D, in world units. A few codes suffice to reject most transfer functions. */
trip_closed_form_fault trip_closed_form_find(trip_closed_form *form, const trip_tf_entry *table,
                                             unsigned min, unsigned max, double longest);

#endif
