#include "quadrature.h"

#include <math.h>

/* After so many halvings a piece is too short to matter. */
enum { MOST_HALVINGS = 40 };

/* What a piece does to light: what it adds in front, and how much it lets through. */
typedef struct part {
    double rgb[3], depth;
} part;

typedef struct piece {
    double from, to;
    trip_ray_sample ends[2], middle;
    part whole; /* by Simpson's rule */
    int halvings;
} piece;

/* Depths at the middle and the end are those of the parabola through the three extinctions. */
static part simpson(double length, const trip_ray_sample *a, const trip_ray_sample *m,
                    const trip_ray_sample *b)
{
    double half = length * (5 * a->extinction + 8 * m->extinction - b->extinction) / 24;
    part p = { .depth = length * (a->extinction + 4 * m->extinction + b->extinction) / 6 };
    double wa = length / 6 * a->extinction;
    double wm = length / 6 * 4 * m->extinction * exp(-fmax(0, half));
    double wb = length / 6 * b->extinction * exp(-p.depth);
    for (int i = 0; i < 3; i++)
        p.rgb[i] = wa * a->rgb[i] + wm * m->rgb[i] + wb * b->rgb[i];
    return p;
}

static part behind(const part *front, const part *back)
{
    part p = { .depth = front->depth + back->depth };
    double through = exp(-front->depth);
    for (int i = 0; i < 3; i++)
        p.rgb[i] = front->rgb[i] + through * back->rgb[i];
    return p;
}

static double distance(const part *a, const part *b)
{
    double most = 0;
    for (int i = 0; i < 3; i++)
        most = fmax(most, fabs(a->rgb[i] - b->rgb[i]));
    return most + fabs(exp(-a->depth) - exp(-b->depth));
}

static void append(trip_ray_sum *s, const part *p)
{
    for (int i = 0; i < 3; i++)
        s->rgb[i] += s->transmittance * p->rgb[i];
    s->transmittance *= exp(-p->depth);
}

static piece make_piece(double from, double to, const trip_ray_sample *a, const trip_ray_sample *m,
                        const trip_ray_sample *b, int halvings)
{
    return (piece){ from, to, { *a, *b }, *m, simpson(to - from, a, m, b), halvings };
}

static void halve(const piece *p, trip_ray_sampler sampler, void *user, piece halves[2])
{
    double middle = 0.5 * (p->from + p->to);
    trip_ray_sample at[2];
    sampler(user, 0.5 * (p->from + middle), &at[0]);
    sampler(user, 0.5 * (middle + p->to), &at[1]);
    halves[0] = make_piece(p->from, middle, &p->ends[0], &at[0], &p->middle, p->halvings + 1);
    halves[1] = make_piece(middle, p->to, &p->middle, &at[1], &p->ends[1], p->halvings + 1);
}

static bool is_close(const trip_ray_sum *s, const piece *p, const part *finer)
{
    double length_share = (p->to - p->from) / s->length;
    double opacity_share = s->transmittance * -expm1(-finer->depth);
    return s->transmittance * distance(&p->whole, finer) <=
           s->tolerance / 4 * (length_share + opacity_share);
}

/* The nearer half first, so that what is added is behind all before. */
static void add(trip_ray_sum *s, const piece *p, trip_ray_sampler sampler, void *user)
{
    piece halves[2];
    if (trip_ray_sum_is_over(s))
        return;
    halve(p, sampler, user, halves);
    part finer = behind(&halves[0].whole, &halves[1].whole);
    if (p->halvings == MOST_HALVINGS || is_close(s, p, &finer)) {
        append(s, &finer);
        return;
    }
    add(s, &halves[0], sampler, user);
    add(s, &halves[1], sampler, user);
}

void trip_ray_sum_add(trip_ray_sum *s, double from, double to, trip_ray_sampler sampler, void *user)
{
    trip_ray_sample a, m, b;
    if (!(from < to) || trip_ray_sum_is_over(s))
        return;
    sampler(user, from, &a);
    sampler(user, 0.5 * (from + to), &m);
    sampler(user, to, &b);
    piece p = make_piece(from, to, &a, &m, &b, 0);
    add(s, &p, sampler, user);
}
