// A splat's colour and opacity at a pixel. In: the footprint, flat. Out: premultiplied colour, for
// blending in list order, and with DEPTH the distance likewise (render/layer.h). Mirrors
// trip_splat_radius2() and the opacity in render/splat.h; beyond the cut-off nothing is added.
#include "real.glsl"

layout(location = TRIP_GL_ROW) uniform int row; // of the image, in which fragments' row 0 lies

layout(location = 0) flat in vec4 footprint;
layout(location = 1) flat in vec4 colour;
layout(location = 2) flat in float shear;
layout(location = TRIP_GL_OUT_COLOUR) out vec4 fragment;
#ifdef DEPTH
layout(location = 3) flat in float centre_depth;
layout(location = TRIP_GL_OUT_DEPTH) out vec4 fragment_depth; // its opacity is what is blended by
#endif

// 1 - exp(-x) without the cancellation at small x.
float opacity(float x)
{
    return x < 1e-3 ? x * (1.0 - x * (0.5 - x * (1.0 / 6.0))) : 1.0 - exp(-x);
}

void main()
{
    vec2 p = gl_FragCoord.xy + vec2(0.0, row) - screen.xy, q = p - footprint.xy;
    float m = q.x * (footprint.z * q.x + shear * q.y) + footprint.w * q.y * q.y;
    float stretch = 1.0;
#if defined(ANISOTROPIC)
    vec4 terms = vec4(1.0, p, p.x * p.x);
    vec2 more = p.y * p;
    float inverse_ray2 = 1.0 / (dot(ray2_a, terms) + dot(ray2_b.xy, more));
    m *= inverse_ray2;
    stretch = sqrt((dot(world2_a, terms) + dot(world2_b.xy, more)) * inverse_ray2);
#elif !defined(PARALLEL)
    m /= 1.0 + ray2_a.w * dot(p, p);
#endif
    float falloff = max(exp(-0.5 * m) - edge.x, 0.0);
    float alpha = opacity(colour.a * stretch * falloff);
    fragment = vec4(colour.rgb * alpha, alpha);
#ifdef DEPTH
    fragment_depth = vec4(centre_depth * alpha, 0.0, 0.0, alpha);
#endif
}
