/* Polynomials over [0, 1], by the coefficients of their powers, the constant first. Pure functions.
 */
#ifndef TRIP_POLYNOMIAL_H
#define TRIP_POLYNOMIAL_H

enum { TRIP_POLYNOMIAL_DEGREE = 9 }; /* maximum */

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

/* Finds the points in (0, 1) where the polynomial turns from rising to falling or back, ascending.
 * Returns their number. */
int trip_polynomial_turns(const trip_polynomial *p, double turns[TRIP_POLYNOMIAL_DEGREE]);

/* Returns the point between `from` and `to` where the polynomial equals `value`. It must rise or
 * fall throughout, and `value` must lie between its values at the two ends. */
double trip_polynomial_find(const trip_polynomial *p, double value, double from, double to);

#endif
