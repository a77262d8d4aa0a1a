#include "polynomial.h"

#include <math.h>
#include <stdbool.h>

/* Maximum number of halvings. Closer roots are ignored: between them the polynomial is flat. */
enum { MAX_HALVINGS = 20 };

static trip_polynomial derivative(const trip_polynomial *p)
{
    trip_polynomial d = { .degree = p->degree > 0 ? p->degree - 1 : 0 };
    for (int i = 1; i <= p->degree; i++)
        d.c[i - 1] = i * p->c[i];
    return d;
}

/* Newton's method. A step out of the remaining interval is replaced by halving it. */
double trip_polynomial_find(const trip_polynomial *p, double value, double from, double to)
{
    const trip_polynomial slope = derivative(p);
    double low = trip_polynomial_at(p, from), high = trip_polynomial_at(p, to);
    double rise = high - low, sign = rise < 0 ? -1 : 1;
    double x = rise != 0 ? from + (to - from) * (value - low) / rise : from;
    for (int i = 0; i < 60 && to - from > 1e-15; i++) {
        if (!(x > from && x < to))
            x = 0.5 * (from + to);
        double above = sign * (trip_polynomial_at(p, x) - value);
        if (above < 0)
            from = x;
        else
            to = x;
        double step = above / (sign * trip_polynomial_at(&slope, x));
        if (fabs(step) < 1e-13)
            break;
        x -= step;
    }
    return fmin(to, fmax(from, x));
}

/* Coefficients over [0, 1] in Bernstein's basis. They change sign at least as often as the
 * polynomial does in [0, 1]. */
typedef struct bernstein {
    int degree;
    double b[TRIP_POLYNOMIAL_DEGREE + 1];
} bernstein;

static bernstein to_bernstein(const trip_polynomial *p)
{
    bernstein out = { .degree = p->degree };
    double over = 1; /* first c[i] / binomial(degree, i), then sums of differences */
    for (int i = 0; i <= p->degree; i++) {
        out.b[i] = p->c[i] / over;
        over = over * (p->degree - i) / (i + 1);
    }
    for (int k = 1; k <= p->degree; k++)
        for (int i = p->degree; i >= k; i--)
            out.b[i] += out.b[i - 1];
    return out;
}

/* Counts sign changes. Coefficients up to `zero` are rounding errors and count as 0. */
static int sign_changes(const bernstein *p, double zero)
{
    int changes = 0;
    double last = 0;
    for (int i = 0; i <= p->degree; i++) {
        if (fabs(p->b[i]) <= zero)
            continue;
        changes += last * p->b[i] < 0;
        last = p->b[i] < 0 ? -1 : 1;
    }
    return changes;
}

/* Splits the interval in two by de Casteljau's construction. */
static void halve(const bernstein *p, bernstein *first, bernstein *last)
{
    *last = *p;
    first->degree = p->degree;
    for (int k = 0; k <= p->degree; k++) {
        first->b[k] = last->b[0];
        for (int i = 0; i < p->degree - k; i++)
            last->b[i] = 0.5 * (last->b[i] + last->b[i + 1]);
    }
}

typedef struct roots {
    const trip_polynomial *of;
    double zero;
    double *at;
    int count;
} roots;

static void add_root(roots *r, double at)
{
    if (at > 0 && at < 1 && r->count < TRIP_POLYNOMIAL_DEGREE)
        r->at[r->count++] = at;
}

/* Finds the roots in an interval. A single change of sign is a single root. The search leaves out
 * the very ends, which may be another root. */
static void find_roots(roots *r, const bernstein *p, double from, double to, int halvings)
{
    int changes = sign_changes(p, r->zero);
    double margin = 1e-9 * (to - from), middle = 0.5 * (from + to);
    if (changes == 1)
        add_root(r, trip_polynomial_find(r->of, 0, from + margin, to - margin));
    if (changes < 2 || halvings == MAX_HALVINGS)
        return;
    bernstein first, last;
    halve(p, &first, &last);
    find_roots(r, &first, from, middle, halvings + 1);
    if (fabs(last.b[0]) <= r->zero)
        add_root(r, middle);
    find_roots(r, &last, middle, to, halvings + 1);
}

int trip_polynomial_turns(const trip_polynomial *p, double turns[TRIP_POLYNOMIAL_DEGREE])
{
    const trip_polynomial slope = derivative(p);
    const bernstein b = to_bernstein(&slope);
    roots r = { .of = &slope, .at = turns };
    for (int i = 0; i <= b.degree; i++)
        r.zero = fmax(r.zero, 1e-14 * fabs(b.b[i]));
    find_roots(&r, &b, 0, 1, 0);
    return r.count;
}
