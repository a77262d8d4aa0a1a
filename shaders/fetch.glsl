// Fetches one splat of the batch by its draw position.
// In: the storage blocks of the batch, with blocks and normals as in the files. Out: position
// relative to the eye (list axes), code and normal.
// Mirrors stream/block.h. With INDEXED a run refers to the order array of its list, which holds
// indices into one array of vertices (x, y, z and code, 16 bits each). With RESIDENT too, a run refers
// to the vertices of its axis. With UNEVEN a table gives the positions of voxels (coordinates.h).
#include "real.glsl"
#include "effects.glsl"

layout(std430, binding = TRIP_GL_RUNS) readonly buffer trip_gl_runs { trip_gl_run runs[]; };
layout(std430, binding = TRIP_GL_RUN_OF) readonly buffer trip_gl_run_of { uint run_of[]; };
layout(std430, binding = TRIP_GL_NORMALS) readonly buffer trip_gl_normals { uint normals[]; };
#ifdef INDEXED
layout(std430, binding = TRIP_GL_VERTICES) readonly buffer trip_gl_vertices { uvec2 vertices[]; };
#ifndef RESIDENT
layout(std430, binding = TRIP_GL_ORDER) readonly buffer trip_gl_order { uint order[]; };
#endif
#else
layout(std430, binding = TRIP_GL_VOXELS) readonly buffer trip_gl_voxels { uint voxels[]; };
layout(std430, binding = TRIP_GL_SQUARES) readonly buffer trip_gl_squares { trip_gl_square squares[]; };
#endif

#ifdef UNEVEN
// Entry 3 i + a belongs to voxel i along axis a of the data. It holds the position and the width,
// each as the sum of two floats.
#ifdef INDEXED
#define VOXEL_POSITIONS TRIP_GL_VOXEL_POSITIONS_INDEXED
#else
#define VOXEL_POSITIONS TRIP_GL_VOXEL_POSITIONS
#endif
layout(std430, binding = VOXEL_POSITIONS) readonly buffer trip_gl_voxel_positions { vec4 voxel_positions[]; };
#endif

struct record {
    real3 from_eye; // list axes
    real3 position;    // to_x . c and to_y . c in pixels from the image's centre, forward . c
    uint code, normal;
#ifdef UNEVEN
    real3 width;    // list axes
#endif
#ifdef PLACED
    vec3 voxel; // position in the list's grid, list axes
#endif
};

// Returns the offset of a splat from its run's origin, in voxels.
#ifdef INDEXED
real3 offset_of(uint at, out uint code)
{
    uvec2 vertex = vertices[at];
    uint p[3] = uint[3](vertex.x & 0xffffu, vertex.x >> 16, vertex.y & 0xffffu);
    int axis = int(weight.z);
    code = vertex.y >> 16;
    return real3(p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]);
}
#else
// Returns the index of set bit number k of a mask.
uint find_bit(uint low, uint high, uint k)
{
    uint below = uint(bitCount(low)), word = low, at = 0u;
    if (k >= below) {
        k -= below;
        word = high;
        at = 32u;
    }
    for (uint width = 16u; width > 0u; width >>= 1) {
        uint here = uint(bitCount(word & ((1u << width) - 1u)));
        if (k >= here) {
            k -= here;
            word >>= width;
            at += width;
        }
    }
    return at;
}

#include "code.glsl"

// Extracts the even bits of a Morton number within a square.
uint even_bits(uint n)
{
    return (n & 1u) | (n >> 1 & 2u) | (n >> 2 & 4u);
}

real3 offset_of(trip_gl_square square, uint k, out uint code)
{
    uint position = find_bit(square.mask_low, square.mask_high, k);
    code = code_at(square.codes, square.min_width, k) * uint(edge.y);
    return real3(0.0, (square.corner & 0xffffu) + even_bits(position),
                 (square.corner >> 16) + even_bits(position >> 1));
}
#endif

#if defined(SHADED) || defined(FLATTENED)
#define HAS_NORMALS
uint normal_at(uint at)
{
#ifdef COMPACT
    uint shift = (at & 3u) * 8u, word = normals[at >> 2] >> shift;
    if (shift > 8u)
        word |= normals[(at >> 2) + 1u] << (32u - shift);
    return word & 0xffffffu;
#else
    return normals[at >> 2];
#endif
}
#endif

#ifdef UNEVEN
// Returns the difference in position between a voxel and the voxel at an offset from it along one
// of the data's axes, and the width of the second voxel.
real2 position_along(int axis, int origin, int offset)
{
    vec4 from = voxel_positions[3 * origin + axis], to = voxel_positions[3 * (origin + offset) + axis];
    return real2((real(to.x) - real(from.x)) + (real(to.y) - real(from.y)), real(to.z) + real(to.w));
}

// Returns the difference in position along the list's axes, and sets the width of the second voxel.
// There is no loop, because NVIDIA's linker (580.159) cannot write a component of a dvec3 by a
// variable index.
real3 position_offset(ivec3 origin, ivec3 offset, out real3 width)
{
    int axis = int(weight.z);
    real2 x = position_along(axis, origin.x, offset.x);
    real2 u = position_along((axis + 1) % 3, origin.y, offset.y);
    real2 v = position_along((axis + 2) % 3, origin.z, offset.z);
    width = real3(x.y, u.y, v.y);
    return real3(x.x, u.x, v.x);
}
#endif

record fetch_record(uint position)
{
    record r;
#ifdef INDEXED
    trip_gl_run run = runs[run_of[position]];
#ifdef RESIDENT
    uint at = uint(run.first + run.step * int(position));
#else
    uint at = order[uint(run.first + run.step * int(position))];
#endif
    real3 offset = offset_of(at, r.code);
    const ivec3 origin = ivec3(0);
#else
    uint entry = run_of[position], k = entry & 63u;
    trip_gl_square square = squares[entry >> 6];
    trip_gl_run run = runs[square.run];
    real3 offset = offset_of(square, k, r.code);
    ivec3 origin = ivec3(run.unused, run.first, run.step);
#endif
#ifdef UNEVEN
    offset = position_offset(origin, ivec3(offset), r.width);
#endif
    // This order keeps precision: base + offset cancels almost exactly near the eye.
    r.from_eye = (real3(run.base) + offset) + real3(run.base_low);
#ifdef PLACED
    // The eye's position cancels almost exactly, however far it is.
    precise vec3 corner = (run.base + eye_high.xyz) + (run.base_low + eye_low.xyz);
    r.voxel = corner + offset;
#endif
#ifdef TRIP_DOUBLE
    r.position = real3(dot(to_x.xyz, r.from_eye), dot(to_y.xyz, r.from_eye),
                    dot(forward.xyz, r.from_eye));
#ifdef PARALLEL
    r.position.xy -= screen.xy;
#endif
#else
    r.position = run.position + vec3(dot(to_x.xyz, offset), dot(to_y.xyz, offset),
                               dot(forward.xyz, offset));
#ifdef FIXED
    // Sprites keep their size at the eye. The depth of a splat near the eye must not contain
    // rounding errors of the run's depth. A splat at the eye must have depth 0.
    if (dot(r.from_eye, r.from_eye) < dot(offset, offset))
        r.position = vec3(dot(to_x.xyz, r.from_eye), dot(to_y.xyz, r.from_eye),
                       dot(forward.xyz, r.from_eye));
#endif
#endif
#if defined(HAS_NORMALS) && defined(INDEXED)
    r.normal = normals[at];
#elif defined(HAS_NORMALS) && defined(COMPACT)
    r.normal = normal_at(square.normals + 3u * k);
#elif defined(HAS_NORMALS)
    r.normal = normal_at(square.normals + 4u * k);
#else
    r.normal = 0u;
#endif
    return r;
}
