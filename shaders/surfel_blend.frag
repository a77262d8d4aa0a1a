// Adds a visible surfel to the sums of the pixels with a depth within its tolerance.
// Mirrors blend() and blend_at() in render/surfels/surfels_cpu.c.
#include "surfel.glsl"

layout(binding = TRIP_GL_SURFEL_DEPTHS) uniform usampler2D depths;

layout(location = 0) flat in vec4 place;
layout(location = 1) flat in vec4 slope;
layout(location = 2) flat in vec4 blend;
layout(location = 3) flat in vec4 disc;
layout(location = 4) flat in vec3 rgb;

layout(location = 0) out vec4 colour; // weight times r, g and b; weight
layout(location = 1) out vec2 rest;   // weight times tolerance; coverage

float coverage(vec2 d)
{
    float u = disc.x * (d.x - disc.y * d.y), v = disc.z * d.y, q = u * u + v * v;
    float steepness = length(vec2(disc.x * u, disc.z * v - disc.x * disc.y * u));
    float inside = steepness > 0.0 ? (sqrt(q * RIM) - q) / steepness : sqrt(RIM) / disc.x;
    return clamp(inside, 0.0, 1.0);
}

void main()
{
    vec2 d = gl_FragCoord.xy - place.xy;
    float q = radius2(blend, d), z = depth_at(place, slope, d), tolerance = slope.w;
    float depth = uintBitsToFloat(texelFetch(depths, ivec2(gl_FragCoord.xy), 0).x);
    if (!(q < REACH && abs(z - depth) <= tolerance))
        discard;
    float left = 1.0 - q / REACH, weight = blend.w * left * left * left * left;
    colour = vec4(weight * rgb, weight);
    rest = vec2(weight * tolerance, radius2(disc, d) <= RIM ? coverage(d) : 0.0);
}
