// Lights a splat or a segment.
// In: colour, gradient, and directions to the eye and the light. Out: the lit colour.
// Mirrors trip_shade() in render/light/shade.c and trip_normal_unpack() in stream/normal.c, or
// trip_compact_normal_unpack() with COMPACT. AMBIENT, DIFFUSE, SPECULAR, SHININESS and FACING come
// from render/light/shade.h.
#include "real.glsl"
#include "effects.glsl"

#if defined(SHADED) || defined(FLATTENED)
// Returns the direction of the gradient in world space. w is its length divided by the length at
// which shading is full.
#ifdef COMPACT
vec4 unpack_normal(uint normal)
{
    ivec2 xy = ivec2(int(normal << 24) >> 24, int(normal << 16) >> 24);
    vec3 g = vec3(compact_0.xyz) * float(xy.x) + vec3(compact_1.xyz) * float(xy.y) +
             vec3(compact_2.xyz) * float(normal >> 16 & 127u);
    vec2 p = vec2(normal & 4095u, normal >> 12 & 2047u) / vec2(4095.0, 2047.0) - 0.5;
    vec2 d = vec2(p.x + p.y, p.x - p.y);
    if ((normal & 0x800000u) != 0u)
        return vec4(normalize(vec3(d, 1.0 - abs(d.x) - abs(d.y))), float(compact_0.w));
    float strength = length(g);
    return vec4(g / max(strength, 1e-15), strength);
}
#else
vec4 unpack_normal(uint normal)
{
    float full = float(to_eye.w);
    if ((normal & 0x80000000u) == 0u) {
        ivec3 whole = ivec3(normal << 22, normal << 12, normal << 2) >> 22;
        vec3 g = (vec3(whole) + 0.5 * float(normal >> 30)) * (full / 511.0);
        float strength = length(g);
        return vec4(g / max(strength, 1e-15), strength);
    }
    vec2 p = vec2(normal & 4095u, normal >> 12 & 4095u) * (2.0 / 4095.0) - 1.0;
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    if (n.z < 0.0)
        n.xy = (1.0 - abs(p.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(p, vec2(0.0)));
    float root = 1.0 + float(normal >> 24 & 127u) / 32.0;
    return vec4(normalize(n), root * root * full);
}
#endif
#endif

#if defined(SHADED) || defined(SHADOWS)
// Returns the direction to the eye in world space, for a point at `from_eye` (list axes). Returns 0
// for a point at the eye.
vec3 towards_eye(vec3 from_eye)
{
#ifdef PARALLEL
    return to_eye.xyz;
#else
    vec3 way = vec3(world_0.xyz) * from_eye.x + vec3(world_1.xyz) * from_eye.y +
               vec3(world_2.xyz) * from_eye.z;
    return -way / max(length(way), 1e-30);
#endif
}

// Returns the direction to the light in world space. `eye` is the direction to the eye.
vec3 light_from(vec3 from_eye, vec3 eye)
{
#ifdef HEADLIGHT
    return eye;
#else
    if (light.w == 0.0)
        return vec3(light.xyz);
    vec3 way = vec3(light.xyz) - from_eye;
    vec3 world = vec3(world_0.xyz) * way.x + vec3(world_1.xyz) * way.y + vec3(world_2.xyz) * way.z;
    return world / max(length(world), 1e-15);
#endif
}
#endif

#ifdef SHADED
// Returns the light on a surface. `gradient` is a result of unpack_normal(), and `eye` is the
// direction to the eye.
surface surface_of(vec4 gradient, vec3 towards_light, vec3 eye)
{
    surface s;
#ifdef HEADLIGHT
    vec3 middle = eye;
#else
    vec3 middle = towards_light + eye;
    middle /= max(length(middle), 1e-30);
#endif
    float specular = pow(abs(dot(gradient.xyz, middle)), SHININESS);
#ifndef HEADLIGHT
    specular *= clamp(FACING * dot(gradient.xyz, towards_light) * dot(gradient.xyz, eye), 0.0, 1.0);
#endif
    s.normal = gradient.xyz;
    s.strength = min(1.0, gradient.w);
    s.diffuse = abs(dot(gradient.xyz, towards_light));
    s.gloss = s.strength * SPECULAR * specular;
    return s;
}

vec3 lit(vec3 colour, vec4 gradient, vec3 eye, vec3 from_eye)
{
    surface s = surface_of(gradient, light_from(from_eye, eye), eye);
    float matt = 1.0 + s.strength * (AMBIENT + DIFFUSE * s.diffuse - 1.0);
    return clamp(colour * matt + s.gloss, 0.0, 1.0);
}

vec3 shade(vec3 colour, uint normal, vec3 from_eye)
{
    return lit(colour, unpack_normal(normal), towards_eye(from_eye), from_eye);
}
#endif

#ifdef LIT
// Lights a colour with effects looked up at a position in index space.
vec3 lit_here(vec3 colour, vec4 gradient, vec3 eye, vec3 from_eye, vec3 position)
{
    surface s = surface(0.0, 0.0, 0.0, vec3(0.0));
    vec3 towards_light = vec3(0.0);
#if defined(SHADED) || defined(SHADOWS)
    towards_light = light_from(from_eye, eye);
#endif
#ifdef SHADED
    s = surface_of(gradient, towards_light, eye);
#endif
    return lit_at(colour, s, position, towards_light, eye);
}

vec3 shade_here(vec3 colour, uint normal, vec3 from_eye, vec3 position)
{
    vec3 eye = vec3(0.0);
    vec4 gradient = vec4(0.0);
#if defined(SHADED) || defined(SHADOWS)
    eye = towards_eye(from_eye);
#endif
#ifdef SHADED
    gradient = unpack_normal(normal);
#endif
    return lit_here(colour, gradient, eye, from_eye, position);
}
#endif
