// Computes the light and emission at a position, from the lattices of render/light/light_grid.h as
// textures. Positions are in the index space of level 0, directions in world space. SHADOWS,
// OCCLUSION, EMISSION and CUED select the effects; LIT is set if SHADOWS or OCCLUSION is.
// In: lattices and constants. Out: colours.
// Mirrors trip_effects_colour() in render/light/effects.c.
#include "shared.h"

#if defined(SHADOWS) || defined(OCCLUSION)
#define LIT
#endif
#if defined(LIT) || defined(EMISSION) || defined(CUED)
#define PLACED

layout(std140, binding = TRIP_GL_EFFECTS) uniform trip_gl_effects
{
    TRIP_GL_EFFECTS_FIELDS(vec4)
};

// Returns the position in index space of level 0 for a position in the list's grid (list axes).
vec3 position_of(vec3 voxel)
{
    vec4 v = vec4(voxel, 1.0);
    return vec3(dot(index_0, v), dot(index_1, v), dot(index_2, v));
}

#ifdef CUED
// Fades a colour into the background with distance.
vec3 cued(vec3 colour, vec3 position)
{
    return mix(colour, faded.rgb, faded.w * clamp(dot(cue, vec4(position, 1.0)), 0.0, 1.0));
}
#endif

// Interpolates linearly between nodes. Texture filters lack the precision of float.
float lattice_at(sampler3D lattice, vec3 node)
{
    ivec3 last = textureSize(lattice, 0) - 1;
    node = clamp(node, vec3(0.0), vec3(last));
    ivec3 cell = clamp(ivec3(node), ivec3(0), last - 1);
    vec3 part = node - vec3(cell);
    vec4 below = vec4(texelFetch(lattice, cell, 0).r, texelFetch(lattice, cell + ivec3(1, 0, 0), 0).r,
                      texelFetch(lattice, cell + ivec3(0, 1, 0), 0).r,
                      texelFetch(lattice, cell + ivec3(1, 1, 0), 0).r);
    vec4 above = vec4(texelFetch(lattice, cell + ivec3(0, 0, 1), 0).r,
                      texelFetch(lattice, cell + ivec3(1, 0, 1), 0).r,
                      texelFetch(lattice, cell + ivec3(0, 1, 1), 0).r,
                      texelFetch(lattice, cell + ivec3(1, 1, 1), 0).r);
    vec4 between = mix(below, above, part.z);
    vec2 along = mix(between.xy, between.zw, part.y);
    return mix(along.x, along.y, part.x);
}
#endif

#if defined(LIT) || defined(SHADED)
// The light on a surface; strength is 0 without a surface.
struct surface {
    float strength, diffuse;
    float gloss; // brightness of the highlight
    vec3 normal;
};
#endif

#ifdef LIT
// Returns `share` of the bias in the direction of a unit vector.
vec3 aside(vec3 unit, float share)
{
    return vec3(dot(aside_0.xyz, unit), dot(aside_1.xyz, unit), dot(aside_2.xyz, unit)) * share;
}
#endif

#ifdef SHADOWS
layout(binding = TRIP_GL_LIGHT_REACHED) uniform sampler3D light_reached;

// Returns the share of light that arrives. The lookup is shifted towards the light, but not beyond
// it.
float reached_at(vec3 position, float strength, vec3 towards_light)
{
    vec3 at = position + aside(towards_light, strength);
    vec3 end = vec3(aside_0.w, aside_1.w, aside_2.w);
    if (phase.w > 0.0)
        at = clamp(at, min(position, end), max(position, end));
    return lattice_at(light_reached, at * per_voxel.x);
}

float phase_of(vec3 towards_light, vec3 eye)
{
    float d = phase.y + phase.z * dot(towards_light, eye);
    return phase.x / (d * sqrt(d));
}
#endif

#ifdef OCCLUSION
layout(binding = TRIP_GL_LIGHT_OPEN) uniform sampler3D light_open;

float open_at(vec3 position, surface s)
{
    vec3 shift = aside(s.normal, s.strength);
    float one = lattice_at(light_open, (position + shift) * per_voxel.y);
    if (s.strength > 0.0)
        one = max(one, lattice_at(light_open, (position - shift) * per_voxel.y));
    return min(1.0, (1.0 + s.strength) * one);
}
#endif

#ifdef LIT
// Returns the lit colour. `towards_light` and `eye` (direction to the eye) may be undefined without
// SHADOWS.
vec3 lit_at(vec3 colour, surface s, vec3 position, vec3 towards_light, vec3 eye)
{
    float reached = 1.0, open = 1.0, scattered = 1.0;
#ifdef SHADOWS
    reached = reached_at(position, s.strength, towards_light);
    scattered = phase_of(towards_light, eye);
#endif
#ifdef OCCLUSION
    open = open_at(position, s);
#endif
    float matt = AMBIENT * open + DIFFUSE * reached * mix(scattered, s.diffuse, s.strength);
    return clamp(colour * matt + s.gloss * reached, 0.0, 1.0);
}
#endif

#ifdef EMISSION
layout(binding = TRIP_GL_HEAT) uniform sampler3D heat;
layout(std140, binding = TRIP_GL_HEAT_COLOURS) uniform trip_gl_heat_colours
{
    vec4 heat_colours[TRIP_GL_EMISSION_STEPS + 1];
};

vec3 emission_at(vec3 position)
{
    vec4 p = vec4(position, 1.0);
    vec3 at = vec3(dot(heat_0, p), dot(heat_1, p), dot(heat_2, p));
    vec3 within = 1.0 - clamp(max(-at, at - heat_last.xyz), 0.0, 1.0);
    float share = within.x * within.y * within.z;
    float x = share * lattice_at(heat, at * per_voxel.z) * float(TRIP_GL_EMISSION_STEPS);
    int row = clamp(int(x), 0, TRIP_GL_EMISSION_STEPS - 1);
    return mix(heat_colours[row].rgb, heat_colours[row + 1].rgb, x - float(row));
}
#endif
