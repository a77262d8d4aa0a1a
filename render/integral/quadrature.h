/* The emission-absorption integral along a ray, front to back, piece by piece:
 *
 *     colour        = integral of c(t) k(t) T(t) dt,   T(t) = exp(-integral of k before t)
 *     transmittance = T at the end
 *
 * with extinction k and colour c.
 *
 * Subdivision
 * -----------
 * A piece is halved until Simpson's rule over its halves is within the piece's share of the
 * tolerance. Half of the tolerance is shared by length. The other half is shared by the opacity
 * that the piece adds to the picture.
 *
 * Error estimate
 * --------------
 * The error estimate is the maximum of two differences:
 * - between the rule over the halves and over the whole piece, in colour and transmittance
 *   together;
 * - between the opacity and the colour that the piece adds if all colours are 1. Exact
 *   integrals would be equal.
 *
 * If the integrand is smooth, the error is fifteen times smaller than the estimate. Otherwise it
 * counts in full. The result is corrected by a fifteenth of the first difference.
 *
 * Bound
 * -----
 * Everything behind a transmittance of half the tolerance is left out. The errors of all pieces add
 * up to at most half the tolerance. So the whole error is at most the tolerance.
 * tests/render/test_quadrature.c checks this wherever extinction or colour breaks. */
#ifndef TRIP_QUADRATURE_H
#define TRIP_QUADRATURE_H

#include <stdbool.h>

typedef struct trip_ray_sample {
    double extinction; /* per unit of t */
    double rgb[3];     /* not multiplied by extinction */
    /* Equal for two samples if both components are a smooth function of t between them. 0 if
     * unknown. */
    unsigned form;
} trip_ray_sample;

typedef void (*trip_ray_sampler)(void *user, double t, trip_ray_sample *out);

typedef struct trip_ray_sum {
    double tolerance, length; /* of the whole ray */
    double rgb[3], transmittance;
} trip_ray_sum;

static inline trip_ray_sum trip_ray_sum_begin(double tolerance, double length)
{
    return (trip_ray_sum){ .tolerance = tolerance, .length = length, .transmittance = 1 };
}

/* Whether further pieces may be left out. */
static inline bool trip_ray_sum_is_over(const trip_ray_sum *s)
{
    return s->transmittance <= s->tolerance / 2;
}

typedef struct trip_ray_end {
    double t;
    trip_ray_sample sample;
} trip_ray_end;

static inline trip_ray_end trip_ray_end_at(double t, trip_ray_sampler sampler, void *user)
{
    trip_ray_end end = { .t = t };
    sampler(user, t, &end.sample);
    return end;
}

/* Adds the piece between two ends. It must lie behind all earlier pieces. */
void trip_ray_sum_add(trip_ray_sum *s, const trip_ray_end *from, const trip_ray_end *to,
                      trip_ray_sampler sampler, void *user);

#endif
