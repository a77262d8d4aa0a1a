// One splat of the batch by its draw position: its place from the eye (list axes), code and normal.
// Mirrors trip_run in stream/selection.h and the records in stream/format.h. With INDEXED the batch
// names places in the list's order of one vertex array (x, y, z, code in 16 bits each) instead.
#include "real.glsl"

layout(std430, binding = TRIP_GL_RUNS) readonly buffer trip_gl_runs { trip_gl_run runs[]; };
layout(std430, binding = TRIP_GL_RUN_OF) readonly buffer trip_gl_run_of { uint run_of[]; };
layout(std430, binding = TRIP_GL_NORMALS) readonly buffer trip_gl_normals { uint normals[]; };
#ifdef INDEXED
layout(std430, binding = TRIP_GL_VERTICES) readonly buffer trip_gl_vertices { uvec2 vertices[]; };
layout(std430, binding = TRIP_GL_ORDER) readonly buffer trip_gl_order { uint order[]; };
#else
layout(std430, binding = TRIP_GL_VOXELS) readonly buffer trip_gl_voxels { uint voxels[]; };
#endif

struct record {
    real3 from_eye; // list axes
    real3 place;    // to_x . c, to_y . c in pixels from the image's centre, forward . c
    uint code, normal;
};

// Offset of a splat from its run's origin.
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
real3 offset_of(uint at, out uint code)
{
    uint voxel = voxels[at];
    code = voxel >> 16;
    return real3(0.0, voxel & 255u, voxel >> 8 & 255u);
}
#endif

record fetch_record(uint position)
{
    record r;
    trip_gl_run run = runs[run_of[position]];
    uint at = uint(run.first + run.step * int(position));
#ifdef INDEXED
    at = order[at];
#endif
    real3 offset = offset_of(at, r.code);
    // In this order: base + offset cancels almost exactly near the eye.
    r.from_eye = (real3(run.base) + offset) + real3(run.base_low);
#ifdef TRIP_DOUBLE
    r.place = real3(dot(to_x.xyz, r.from_eye), dot(to_y.xyz, r.from_eye),
                    dot(forward.xyz, r.from_eye));
#ifdef PARALLEL
    r.place.xy -= screen.xy;
#endif
#else
    r.place = run.place + vec3(dot(to_x.xyz, offset), dot(to_y.xyz, offset),
                               dot(forward.xyz, offset));
#endif
#ifdef SHADED
    r.normal = normals[at];
#else
    r.normal = 0u;
#endif
    return r;
}
