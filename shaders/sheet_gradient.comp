// Computes the gradients of a sheet's voxels by differences of codes (render/sheet.h).
// In: the codes of the sheet and of the sheets below and above it. Out: codes per index along the
// list, u and v; with UNEVEN, codes per unit of position.
// Mirrors difference() in render/reference/reference_sheets.c.
#include "shared.h"
#include "no_code.glsl"

layout(local_size_x = TRIP_GL_SQUARE_GROUP, local_size_y = TRIP_GL_SQUARE_GROUP) in;
layout(binding = TRIP_GL_SHEET_CODES) uniform sampler2DArray codes;
layout(rgba16f, binding = TRIP_GL_IMAGE) writeonly uniform image2D gradients;
layout(location = TRIP_GL_SHEET) uniform ivec3 layers; // of the sheet, below, above; -1 if missing
layout(location = TRIP_GL_SHEET_SIZE) uniform ivec3 size; // width, height, first row
#ifdef UNEVEN
// Distances to the sheets below and above, and positions of voxels along u, then along v: whole
// part and rest.
layout(location = TRIP_GL_SHEET_APART) uniform vec2 sheets_apart;
layout(std430, binding = TRIP_GL_POSITIONS) readonly buffer trip_gl_positions
{
    vec2 positions[];
};
#endif

#ifdef EXACT
// Gradients are stored times this number.
layout(location = TRIP_GL_SHEET_SCALE) uniform float scale;
#endif

// Returns the code, or a number below NO_CODE if there is no voxel.
float code_at(ivec2 position, int layer)
{
    if (layer < 0 || any(lessThan(position, ivec2(0))) || any(greaterThanEqual(position, size.xy)))
        return TRIP_GL_MISSING;
    return texelFetch(codes, ivec3(position, layer), 0).r;
}

// Returns the distances from voxel i to its neighbours on both sides. `count` entries of
// positions[] start at `first`.
vec2 voxels_apart(int first, int i, int count)
{
#ifdef UNEVEN
    vec2 here = positions[first + i];
    vec2 before = here - positions[first + max(i - 1, 0)], after = positions[first + min(i + 1, count - 1)] - here;
    return vec2(before.x + before.y, after.x + after.y);
#else
    return vec2(1.0);
#endif
}

float difference(float before, float here, float after, vec2 apart)
{
    if (before >= NO_CODE && after >= NO_CODE)
        return (after - before) / (apart.x + apart.y);
    return after >= NO_CODE ? (after - here) / apart.y : before >= NO_CODE ? (here - before) / apart.x : 0.0;
}

void main()
{
    ivec2 p = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, size.z), u = ivec2(1, 0), v = ivec2(0, 1);
    float here = code_at(p, layers.x);
    if (here < NO_CODE)
        return;
#ifndef UNEVEN
    const vec2 sheets_apart = vec2(1.0);
#endif
    vec2 u_apart = voxels_apart(0, p.x, size.x), v_apart = voxels_apart(size.x, p.y, size.y);
    vec3 g = vec3(difference(code_at(p, layers.y), here, code_at(p, layers.z), sheets_apart),
                  difference(code_at(p - u, layers.x), here, code_at(p + u, layers.x), u_apart),
                  difference(code_at(p - v, layers.x), here, code_at(p + v, layers.x), v_apart));
    // The range of 16-bit floats.
#ifdef EXACT
    g *= scale;
    g *= min(1.0, 65504.0 / max(max(abs(g.x), abs(g.y)), max(abs(g.z), 1.0)));
#endif
    imageStore(gradients, p, vec4(clamp(g, -65504.0, 65504.0), 0.0));
}
