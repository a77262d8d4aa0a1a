// Computes colour and extinction of a segment between two codes. Extinction is per voxel length.
// In: two codes and the sums of the transfer function. Out: colour and extinction.
// Mirrors trip_segment_of() in render/classification/segments.c. All terms of a sum have the same sign, and
// differences of the integrals between whole codes are exact. With CLOSED it mirrors
// render/classification/closed_form.h. With BEYOND the codes may lie beyond the ends of the function,
// where it is constant.
#include "shared.h"

#if defined(EXACT) || defined(WIDE)
#define BEYOND
#define segment_between segment_within
#endif
#ifdef CLOSED

layout(std430, binding = TRIP_GL_SUMS) readonly buffer trip_gl_closed_form
{
    vec4 x, k, q0, q1; // layout of trip_gl_closed
} form;

float position_of(float code)
{
#if defined(WIDE) || defined(EXACT)
    code = clamp(code, 0.0, 65535.0);
#endif
    return code * form.x.x + form.x.y;
}

vec4 segment_between(float a, float b, float unit)
{
    float from = position_of(a), to = position_of(b), x = max(from, 0.0), y = max(to, 0.0);
    float m = 0.5 * (x + y), dd = (y - x) * (y - x) / 12.0;
    vec4 k = form.k;
    float extinction = ((k.w * m + k.z) * m + k.y) * m + k.x + (3.0 * k.w * m + k.z) * dd;
    float slope = (3.0 * k.w * m + 2.0 * k.z) * m + k.y + 1.8 * k.w * dd;
    float at = m + dd * slope / max(extinction, 1e-20);
    if (form.x.z > 0.0 && min(from, to) < 0.0)
        extinction *= (y - x) / (to == from ? 1.0 : to - from);
    return vec4(form.q0.rgb + at * form.q1.rgb, extinction);
}

#else

// The layout of trip_gl_sum.
struct code_sums {
    uvec4 low, high;
    vec4 entry;
};
layout(std430, binding = TRIP_GL_SUMS) readonly buffer trip_gl_sums { code_sums sums[]; };

// Returns extinction times colour, and extinction, per voxel length.
vec4 products(vec4 entry)
{
    return vec4(entry.rgb * entry.a, entry.a);
}

// Returns the means of products() from t0 to t1 between a code and the next. Simpson's rule is
// exact here.
vec4 means_within(int code, float t0, float t1)
{
    vec4 a = sums[code].entry, b = sums[code + 1].entry;
    return (products(mix(a, b, t0)) + 4.0 * products(mix(a, b, 0.5 * (t0 + t1))) + products(mix(a, b, t1))) / 6.0;
}

vec4 colour_of(vec4 means)
{
    return vec4(means.rgb / means.a, means.a);
}

// Returns the integral between two codes, in the unit of the sums.
vec4 integral_between(int from, int to)
{
    uvec4 borrow, low = usubBorrow(sums[to].low, sums[from].low, borrow);
    uvec4 high = sums[to].high - sums[from].high - borrow;
    return vec4(high) * 4294967296.0 + vec4(low);
}

// The codes may have any order. The colour is undefined if the extinction is 0.
vec4 segment_between(float a, float b, float unit)
{
    float from = clamp(min(a, b), 0.0, 65535.0), to = clamp(max(a, b), 0.0, 65535.0);
    int first = min(int(from), 65534), last = min(int(to), 65534);
    float f = from - float(first), g = to - float(last);
    if (first == last)
        return colour_of(means_within(first, f, g));
    vec4 sum = means_within(first, f, 1.0) * (1.0 - f) + means_within(last, 0.0, g) * g;
    if (last > first + 1)
        sum += integral_between(first + 1, last) * unit;
    return colour_of(sum / (to - from));
}

#endif

#ifdef BEYOND
#undef segment_between

vec4 weighed(vec4 colour, float weight)
{
    float k = colour.a * weight;
    return k > 0.0 ? vec4(colour.rgb * k, k) : vec4(0.0);
}

vec4 segment_between(float a, float b, float unit)
{
    float low = min(a, b), high = max(a, b);
    if ((low >= 0.0 && high <= 65535.0) || low == high)
        return segment_within(a, b, unit);
    float from = clamp(low, 0.0, 65535.0), to = clamp(high, 0.0, 65535.0), share = 1.0 / (high - low);
    float below = max(0.0, min(high, 0.0) - low), above = max(0.0, high - max(low, 65535.0));
    vec4 sum = weighed(segment_within(from, to, unit), (to - from) * share) +
               weighed(segment_within(0.0, 0.0, unit), below * share) +
               weighed(segment_within(65535.0, 65535.0, unit), above * share);
    return vec4(sum.rgb / max(sum.a, 1e-30), sum.a);
}
#endif
