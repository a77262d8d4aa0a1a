// The gradients of a sheet's voxels, by differences of codes (render/sheet.h). In: the sheet's codes
// and those of the sheets below and above it. Out: codes per index along the list, u and v. Mirrors
// difference() in render/reference_sheets.c.
#include "shared.h"

layout(local_size_x = TRIP_GL_SQUARE_GROUP, local_size_y = TRIP_GL_SQUARE_GROUP) in;
layout(binding = TRIP_GL_SHEET_CODES) uniform sampler2DArray codes;
layout(rgba16f, binding = TRIP_GL_IMAGE) writeonly uniform image2D gradients;
layout(location = TRIP_GL_SHEET) uniform ivec3 layers; // of the sheet, below, above; -1: there is none
layout(location = TRIP_GL_SHEET_SIZE) uniform ivec3 size; // width, height, the first row

// Below 0: there is none.
float code_at(ivec2 place, int layer)
{
    if (layer < 0 || any(lessThan(place, ivec2(0))) || any(greaterThanEqual(place, size.xy)))
        return -1.0;
    return texelFetch(codes, ivec3(place, layer), 0).r;
}

float difference(float before, float here, float after)
{
    if (before >= 0.0 && after >= 0.0)
        return 0.5 * (after - before);
    return after >= 0.0 ? after - here : before >= 0.0 ? here - before : 0.0;
}

void main()
{
    ivec2 p = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, size.z), u = ivec2(1, 0), v = ivec2(0, 1);
    float here = code_at(p, layers.x);
    if (here < 0.0)
        return;
    vec3 g = vec3(difference(code_at(p, layers.y), here, code_at(p, layers.z)),
                  difference(code_at(p - u, layers.x), here, code_at(p + u, layers.x)),
                  difference(code_at(p - v, layers.x), here, code_at(p + v, layers.x)));
    // Within what 16 bits hold.
    imageStore(gradients, p, vec4(clamp(g, -65504.0, 65504.0), 0.0));
}
