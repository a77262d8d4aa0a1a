#include "quadrature.h"

#include "scope.h"

#include <math.h>

/* After MAX_HALVINGS a piece is too short to matter. Pieces with POLLED_HALVINGS are rare, so only
 * these check for interruption. */
enum { MAX_HALVINGS = 40, POLLED_HALVINGS = 12 };

/* Halving a piece brings Simpson's rule this much closer to the integral of a smooth function. */
#define CLOSER 15.0

/* The light of a piece: the colour it adds, and the opacity. `white` is the result of the rule for
 * colour 1, which would equal the opacity if the rule were exact. */
typedef struct part {
    double rgb[3], white, depth;
    double opacity; /* 1 - exp(-depth), exact to the last bits for small depths too */
} part;

typedef struct piece {
    const trip_ray_end *from, *to;
    trip_ray_end middle;
    part whole; /* by Simpson's rule */
} piece;

/* Returns 1 - exp(-depth), or 0 for negative depths, since a piece cannot add light. Most pieces
 * have small depths. For them it sums the series; the omitted terms are below the last bit. */
static double opacity_of(double depth)
{
    if (depth > 1.0 / 16)
        return 1 - exp(-depth);
    if (depth <= 0)
        return 0;
    double x = -depth, sum = 1;
    for (int i = 9; i >= 2; i--)
        sum = 1 + x * (1.0 / i) * sum;
    return depth * sum;
}

/* Sets a part by Simpson's rule. The depths at the middle and the end are integrals of the parabola
 * through the three extinctions. */
static void set_simpson(part *p, double length, const trip_ray_sample *a, const trip_ray_sample *m,
                        const trip_ray_sample *b)
{
    const double sixth = length * (1.0 / 6);
    double half = 0.25 * sixth * (5 * a->extinction + 8 * m->extinction - b->extinction);
    p->depth = sixth * (a->extinction + 4 * m->extinction + b->extinction);
    p->opacity = opacity_of(p->depth);
    double wa = sixth * a->extinction;
    double wm = sixth * 4 * m->extinction * (1 - opacity_of(half));
    double wb = sixth * b->extinction * (1 - p->opacity);
    p->white = wa + wm + wb;
    for (int i = 0; i < 3; i++)
        p->rgb[i] = wa * a->rgb[i] + wm * m->rgb[i] + wb * b->rgb[i];
}

static void set_both(part *p, const part *front, const part *back)
{
    const double through = 1 - front->opacity;
    p->depth = front->depth + back->depth;
    p->opacity = front->opacity + through * back->opacity;
    p->white = front->white + through * back->white;
    for (int i = 0; i < 3; i++)
        p->rgb[i] = front->rgb[i] + through * back->rgb[i];
}

static double distance(const part *a, const part *b)
{
    double max = 0;
    for (int i = 0; i < 3; i++) {
        double apart = fabs(a->rgb[i] - b->rgb[i]);
        max = apart > max ? apart : max;
    }
    return max + fabs(a->opacity - b->opacity);
}

/* Returns the extrapolation of both results, for a smooth integrand. */
static double correct(double whole, double finer)
{
    return finer + (finer - whole) * (1 / CLOSER);
}

static void append(trip_ray_sum *s, const part *whole, const part *finer)
{
    double depth = correct(whole->depth, finer->depth);
    for (int i = 0; i < 3; i++)
        s->rgb[i] += s->transmittance * correct(whole->rgb[i], finer->rgb[i]);
    s->transmittance *= 1 - opacity_of(depth);
}

static void set_piece(piece *p, const trip_ray_end *from, const trip_ray_end *to,
                      trip_ray_sampler sampler, void *user)
{
    p->from = from;
    p->to = to;
    p->middle.t = 0.5 * (from->t + to->t);
    sampler(user, p->middle.t, &p->middle.sample);
    set_simpson(&p->whole, to->t - from->t, &from->sample, &p->middle.sample, &to->sample);
}

/* Returns the form that all samples of a piece share, or 0. */
static unsigned form_of(const piece *p)
{
    unsigned form = p->middle.sample.form;
    return p->from->sample.form == form && p->to->sample.form == form ? form : 0;
}

static bool is_smooth(const piece *first, const piece *last)
{
    return form_of(first) && form_of(first) == form_of(last);
}

/* Whether the error is within the piece's share of the tolerance. `smooth` says that the finer
 * result is closer than the difference. */
static bool is_close(const trip_ray_sum *s, const piece *p, const part *finer, bool smooth)
{
    double apart = distance(&p->whole, finer), white = fabs(finer->white - finer->opacity);
    double error = (white > apart ? white : apart) * (smooth ? 1 / CLOSER : 1);
    double length_share = (p->to->t - p->from->t) / s->length;
    double opacity_share = s->transmittance * finer->opacity;
    return !(s->transmittance * error > s->tolerance / 4 * (length_share + opacity_share));
}

/* Adds a piece, halving it as needed, the nearer half first. Ends early if the work is interrupted.
 * A comparison with NaN counts as close, because halving cannot help there. */
static void add(trip_ray_sum *s, const piece *p, int halvings, trip_ray_sampler sampler, void *user)
{
    piece first, last;
    part finer;
    if (trip_ray_sum_is_over(s) || (halvings >= POLLED_HALVINGS && trip_interrupted()))
        return;
    set_piece(&first, p->from, &p->middle, sampler, user);
    set_piece(&last, &p->middle, p->to, sampler, user);
    set_both(&finer, &first.whole, &last.whole);
    if (halvings == MAX_HALVINGS || is_close(s, p, &finer, is_smooth(&first, &last))) {
        append(s, &p->whole, &finer);
        return;
    }
    add(s, &first, halvings + 1, sampler, user);
    add(s, &last, halvings + 1, sampler, user);
}

void trip_ray_sum_add(trip_ray_sum *s, const trip_ray_end *from, const trip_ray_end *to,
                      trip_ray_sampler sampler, void *user)
{
    piece p;
    if (!(from->t < to->t) || trip_ray_sum_is_over(s))
        return;
    set_piece(&p, from, to, sampler, user);
    add(s, &p, 0, sampler, user);
}
