/* Polynomials over [0, 1], by the coefficients of their powers, the constant first. */
#ifndef TRIP_POLYNOMIAL_H
#define TRIP_POLYNOMIAL_H

enum { TRIP_POLYNOMIAL_DEGREE = 9 }; /* at most */

typedef struct trip_polynomial {
    int degree;
    double c[TRIP_POLYNOMIAL_DEGREE + 1];
} trip_polynomial;

static inline double trip_polynomial_at(const trip_polynomial *p, double x)
{
    double sum = p->c[p->degree];
    for (int i = p->degree - 1; i >= 0; i--)
        sum = sum * x + p->c[i];
    return sum;
}

/* Where it turns from rising to falling or back, in (0, 1), ascending; returns how many. */
int trip_polynomial_turns(const trip_polynomial *p, double turns[TRIP_POLYNOMIAL_DEGREE]);

/* Where it is `value`, between two places between which it only rises or only falls, and at one of
 * which it is at most that, at the other at least. */
double trip_polynomial_find(const trip_polynomial *p, double value, double from, double to);

#endif
