/* Exponentials of a vector with the accuracy that footprints need. Included by table_tmpl.h after
 * simd_tmpl.h. */
#ifndef TRIP_CPU_EXP_H
#define TRIP_CPU_EXP_H

#include "cpu/kernels/kernels.h"
#include "cpu/kernels/simd_tmpl.h"

/* Returns 2^(y / TRIP_CPU_EXP_UNIT - 127) with a relative error of at most 7.5e-5, for y in [0, 254
 * TRIP_CPU_EXP_UNIT]. The integer part becomes the float's exponent; a cubic gives the mantissa. */
INLINE vf exp2_biased(vf y)
{
    vi i = v_truncate(y);
    vf m = v_from_bits(vi_low_or(i, 0x7fffff, 0x3f800000));
    vf p = v_fma(v_set(0.0780245233f), m, v_set(-0.00800641098f));
    p = v_fma(p, m, v_set(0.477772789f));
    p = v_fma(p, m, v_set(0.452134318f));
    return v_from_bits(i & 0x7f800000) * p;
}

/* Returns exp2_biased(y) - edge with one rounding, so that the result is 0 if edge is
 * exp2_biased(y). */
INLINE vf exp2_biased_less(vf y, vf edge)
{
    vi i = v_truncate(y);
    vf m = v_from_bits(vi_low_or(i, 0x7fffff, 0x3f800000));
    vf p = v_fma(v_set(0.0780245233f), m, v_set(-0.00800641098f));
    p = v_fma(p, m, v_set(0.477772789f));
    p = v_fma(p, m, v_set(0.452134318f));
    return v_fms(v_from_bits(i & 0x7f800000), p, edge);
}

/* Returns exp(-x) for x >= 0 with a relative error of at most 1.1e-4. It is exact at 0, so that the
 * faint rims of many splats do not add up to an error. */
INLINE vf exp_minus(vf x)
{
    const float unit = (float)(1.44269504088896340736 * TRIP_CPU_EXP_UNIT);
    vf y = v_fnma(x, v_set(unit), v_set((float)(127 * TRIP_CPU_EXP_UNIT)));
    vi i = v_truncate(v_max(y, v_set(0)));
    vf m = v_from_bits(vi_low_or(i, 0x7fffff, 0x3f800000));
    vf p = v_fma(v_set(0.0782679702f), m, v_set(-0.0084962282f));
    p = v_fma(p, m, v_set(0.477612893f));
    p = v_fma(p, m, v_set(0.452615365f));
    return v_from_bits(i & 0x7f800000) * p;
}

/* Returns (1 - exp(-x)) / x with a relative error of at most 8e-5, for 0 <= x <= 0.4. */
INLINE vf thin_ratio(vf x)
{
    vf p = v_fma(v_set(0.143569535f), x, v_set(-0.496570851f));
    return v_fma(p, x, v_set(0.999921664f));
}

#endif
