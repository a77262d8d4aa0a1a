// Counts the projected and the drawn splats of a batch, as trip_list_stats defines them. Uses
// double precision like the reference renderer, and one invocation for each splat. Runs only in
// frames that count.
// In: the batch's storage blocks and draw positions. Out: the counters of the list.
// Mirrors the counting in render/reference/reference.c.
#include "fetch.glsl"
#include "project.glsl"
#include "weight.glsl"

layout(local_size_x = TRIP_GL_COUNT_GROUP) in;
layout(location = TRIP_GL_PIECE) uniform uvec3 piece; // first draw position, their number, list index
layout(location = TRIP_GL_WAY) uniform int way; // ray direction of the pass

// For each list: low and high half of "projected", then of "drawn".
layout(std430, binding = TRIP_GL_COUNTS) buffer trip_gl_counts { uint counts[]; };

void count(int which)
{
    uint at = piece.z * 4u + uint(which) * 2u;
    if (atomicAdd(counts[at], 1u) == 0xffffffffu)
        atomicAdd(counts[at + 1u], 1u);
}

bool touches(splat s, ivec2 pixel)
{
    real2 p = real2(pixel) + 0.5 - screen.xy, q = p - s.centre;
    real m = s.conic.x * q.x * q.x + 2.0 * s.conic.y * q.x * q.y + s.conic.z * q.y * q.y;
#ifndef PARALLEL
    real ray2 = own_ray2(p);
    real3 at = real3(1.0, p);
    if (s.near)
        m = dot(s.a, at) * dot(s.a, at) + dot(s.b, at) * dot(s.b, at);
#ifdef AFFINE
    m *= s.near ? s.ray2 / ray2 : 1.0;
#else
    m *= s.ray2 / ray2;
#endif
    bool front = !s.near || dot(s.along, at) > -sqrt(kernel.y * ray2);
#else
    bool front = !s.near || dot(s.along, real3(1.0, p)) > -sqrt(kernel.y);
#endif
    int axis = int(weight.z);
    return front && m <= kernel.y && weight_of(p + screen.xy, axis) > 0.0 && goes(p + screen.xy, axis, way);
}

bool drawn(splat s)
{
    ivec4 pixels = covered_pixels(s);
    if (any(greaterThan(pixels.xy, pixels.zw)))
        return false;
    ivec2 nearest = ivec2(clamp(s.centre + screen.xy, real2(0.0), screen.zw));
    if (touches(s, clamp(nearest, pixels.xy, pixels.zw)))
        return true;
    for (int y = pixels.y; y <= pixels.w; y++)
        for (int x = pixels.x; x <= pixels.z; x++)
            if (touches(s, ivec2(x, y)))
                return true;
    return false;
}

void main()
{
    if (gl_GlobalInvocationID.x >= piece.y)
        return;
    record r = fetch_record(piece.x + gl_GlobalInvocationID.x);
    splat s;
#ifdef UNEVEN
    use_width(r.width);
#endif
    if (!project(r.from_eye, r.position, s) || !may_reach(r.from_eye, s.radius))
        return;
    count(0);
    if (drawn(s))
        count(1);
}
