// Computes a splat's colour and opacity at a pixel. Beyond the cut-off they are 0.
// In: the footprint, flat. Out: premultiplied colour for blending in list order, and with DEPTH the
// distance, also premultiplied (render/layer.h). With SUMS optical depth replaces opacity and is
// added up.
// Mirrors trip_splat_radius2() and the opacity in render/splat.h.
#include "rays.glsl"
#include "opacity.glsl"

layout(location = TRIP_GL_ROW) uniform int row; // row of the image at row 0 of the fragments

layout(location = 0) flat in vec4 footprint;
layout(location = 1) flat in vec4 colour;
layout(location = 2) flat in float shear;
layout(location = TRIP_GL_OUT_COLOUR) out vec4 fragment;
#ifdef DEPTH
layout(location = 3) flat in float centre_depth;
layout(location = TRIP_GL_OUT_DEPTH) out vec4 fragment_depth; // blending uses the opacity in its fourth component
#endif

#ifdef OWN_RAYS
layout(location = 7) flat in vec3 width; // own_width of rays.glsl
#endif

#ifdef NEAR
layout(location = 4) flat in mat3 forms; // as in splat.vert

// Returns front(p) of render/splat.h from s(p). The error function follows Abramowitz and Stegun
// 1964, 7.1.26, within 1.5e-7.
float front_of(float s)
{
    float end = sqrt(kernel.y), x = min(abs(s), end) * 0.70710678, t = 1.0 / (1.0 + 0.3275911 * x);
    float sum = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))));
    float half_share = (1.0 - sum * exp(-x * x)) * edge.z;
    return abs(s) >= end ? (s > 0.0 ? 1.0 : 0.0) : 0.5 + (s < 0.0 ? -half_share : half_share);
}
#endif

void main()
{
#ifdef OWN_RAYS
    own_width = width;
#endif
    vec2 p = gl_FragCoord.xy + vec2(0.0, row) - screen.xy, q = p - footprint.xy;
    float m = q.x * (footprint.z * q.x + shear * q.y) + footprint.w * q.y * q.y;
    float stretch = 1.0;
#ifdef AFFINE
    // Only near splats use the stretch of the pixel's ray; see below.
#elif defined(ANISOTROPIC)
    float inverse_ray2 = 1.0 / own_ray2(p);
    m *= inverse_ray2;
    stretch = sqrt(world_ray2(p) * inverse_ray2);
#elif !defined(PARALLEL) && !defined(NEAR)
    m /= 1.0 + ray2_a.w * dot(p, p);
#endif
    float front = 1.0;
#ifdef NEAR
    vec3 at = vec3(1.0, p) * forms;
#ifdef PARALLEL
    front = front_of(at.z);
#else
    float inverse = 1.0 / own_ray2(p);
#ifdef AFFINE
    if (footprint.z <= 0.0) // not affine
#endif
    {
        m = dot(at.xy, at.xy) * inverse;
        front = front_of(at.z * sqrt(inverse));
#if defined(AFFINE) && defined(ANISOTROPIC)
        stretch = sqrt(world_ray2(p) * inverse);
#endif
    }
#endif
#endif
    float falloff = max(exp(-0.5 * m) - edge.x, 0.0);
#ifdef SUMS
    float alpha = min(colour.a, 1e25) * stretch * front * falloff; // sums fit a float
#else
    float alpha = opacity(colour.a * stretch * front * falloff);
#endif
    fragment = vec4(colour.rgb * alpha, alpha);
#ifdef DEPTH
    fragment_depth = vec4(centre_depth * alpha, 0.0, 0.0, alpha);
#endif
}
