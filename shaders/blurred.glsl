// Computes colour and extinction of a segment by the transfer function blurred by a deviation.
// Extinction is per voxel length.
// In: two codes, a deviation code, the rows of the blurred function, and segments.glsl for row 0.
// Out: colour and extinction.
// Mirrors trip_blurred_segment_of() in render/classification/blurred_function.c.
#include "segments.glsl"

#ifdef BLURRED

struct blurred_row {
    uint first;
    float per_code, unit, power;
};
// The layout of trip_gl_blurred_entry.
struct blurred_entry {
    uvec4 low, high;
    vec4 entry;
};
layout(std430, binding = TRIP_GL_BLURRED_SUMS) readonly buffer trip_gl_blurred_sums
{
    vec4 voxel_world; // x: world units per voxel length
    blurred_row rows_of_deviations[TRIP_GL_BLURRED_ROWS];
    blurred_entry blurred[];
};

// Returns an entry's number from code 0 to 65535, and the part of the way to the next one.
vec4 row_between(uint at, float part)
{
    return mix(blurred[at].entry, blurred[at + 1u].entry, part);
}

vec4 row_at(blurred_row row, float code)
{
    float at = code * row.per_code;
    return row_between(row.first + uint(at), fract(at)) * voxel_world.x;
}

// Returns the mean of a row from one code to another within the table.
vec4 row_within(blurred_row row, float from, float to)
{
    float x = from * row.per_code, y = to * row.per_code;
    float f = fract(x), g = fract(y);
    uint first = row.first + uint(x), last = row.first + uint(y);
    if (first == last)
        return row_between(first, 0.5 * (f + g)) * voxel_world.x;
    vec4 sum = row_between(first, 0.5 * (1.0 + f)) * (1.0 - f) + row_between(last, 0.5 * g) * g;
    sum *= voxel_world.x;
    if (last > first + 1u) {
        uvec4 borrow, low = usubBorrow(blurred[last].low, blurred[first + 1u].low, borrow);
        uvec4 high = blurred[last].high - blurred[first + 1u].high - borrow;
        sum += (vec4(high) * 4294967296.0 + vec4(low)) * row.unit;
    }
    return sum / (y - x);
}

// Returns the means of extinction times colour, and of extinction. Beyond the ends of the table,
// rows are constant.
vec4 row_means(blurred_row row, float low, float high)
{
    float from = clamp(low, 0.0, 65535.0), to = clamp(high, 0.0, 65535.0);
    vec4 means = from < to ? row_within(row, from, to) : row_at(row, from);
    if ((low >= 0.0 && high <= 65535.0) || low == high)
        return means;
    float below = max(0.0, min(high, 0.0) - low), above = max(0.0, high - max(low, 65535.0));
    return (means * (to - from) + row_at(row, 0.0) * below + row_at(row, 65535.0) * above) / (high - low);
}

// `deviation` is a deviation code divided by 255. The colour is undefined if the extinction is 0.
vec4 blurred_between(float a, float b, float deviation, float unit)
{
    float d = deviation, low = min(a, b), high = max(a, b);
    float beyond = sqrt(d) * float(TRIP_GL_BLURRED_ROWS - 1 + TRIP_GL_BLURRED_BEFORE) - float(TRIP_GL_BLURRED_BEFORE);
    int number = clamp(int(beyond), 0, TRIP_GL_BLURRED_ROWS - 2);
    blurred_row behind = rows_of_deviations[number + 1];
    float before = rows_of_deviations[number].power;
    float share = clamp((d * d * (d * d) - before) / (behind.power - before), 0.0, 1.0);
    vec4 means;
    if (number == 0) {
        vec4 plain = segment_between(a, b, unit);
        if (share == 0.0)
            return plain;
        means = plain.a > 0.0 ? vec4(plain.rgb * plain.a, plain.a) : vec4(0.0);
    } else {
        means = row_means(rows_of_deviations[number], low, high);
    }
    if (share > 0.0)
        means = mix(means, row_means(behind, low, high), share);
    return vec4(means.rgb / means.a, min(means.a, 1e25));
}

#endif
