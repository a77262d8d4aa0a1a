/* The emission-absorption integral along a ray, front to back, piece by piece:
 *     colour        = integral of c(t) k(t) T(t) dt,   T(t) = exp(-integral of k before t)
 *     transmittance = T at the end
 * with extinction k and colour c. A piece is halved until Simpson's rule over its halves is within
 * the piece's share of the tolerance: half of that goes by length, half by the opacity that the
 * piece adds in the picture. How close it is is estimated by the greater of two differences: in
 * colour and transmittance together, from the rule over all of the piece; and of what it adds where
 * colours are 1, from the opacity, which that is. Where the integrand is smooth it is fifteen times
 * closer than these, elsewhere it is taken for no closer; and it is corrected by a fifteenth of the
 * first. What is behind a transmittance of half the tolerance is left out. So the errors of all
 * pieces add up to at most half the tolerance, and with what is left out to the tolerance
 * (tests/render/test_quadrature.c: wherever extinction or colour breaks). */
#ifndef TRIP_QUADRATURE_H
#define TRIP_QUADRATURE_H

#include <stdbool.h>

typedef struct trip_ray_sample {
    double extinction; /* per unit of t */
    double rgb[3];     /* of what is there, not multiplied by it */
    unsigned form;     /* the same where both are a smooth function of t; 0: not known to be */
} trip_ray_sample;

typedef void (*trip_ray_sampler)(void *user, double t, trip_ray_sample *out);

typedef struct trip_ray_sum {
    double tolerance, length; /* of the ray that pieces are of */
    double rgb[3], transmittance;
} trip_ray_sum;

static inline trip_ray_sum trip_ray_sum_begin(double tolerance, double length)
{
    return (trip_ray_sum){ .tolerance = tolerance, .length = length, .transmittance = 1 };
}

/* Nothing more needs to be added. */
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

/* Adds the piece between two ends, which lies behind all before. */
void trip_ray_sum_add(trip_ray_sum *s, const trip_ray_end *from, const trip_ray_end *to,
                      trip_ray_sampler sampler, void *user);

#endif
