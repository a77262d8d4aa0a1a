// Lowers the depths of the pixels that a disc covers. They are bits of floats, in their order.
// Mirrors lower_depths() in render/surfels/surfels_cpu.c.
#include "surfel.glsl"

layout(binding = TRIP_GL_SURFEL_IMAGE_DEPTHS, r32ui) restrict uniform uimage2D depths;

layout(location = 0) flat in vec4 place;
layout(location = 1) flat in vec4 slope;
layout(location = 2) flat in vec4 disc;

void main()
{
    vec2 d = gl_FragCoord.xy - place.xy;
    if (radius2(disc, d) <= RIM)
        imageAtomicMin(depths, ivec2(gl_FragCoord.xy), floatBitsToUint(depth_at(place, slope, d)));
}
