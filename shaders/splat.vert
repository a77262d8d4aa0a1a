// Projects the splats of a batch to footprints on the screen.
// In: draw positions by gl_VertexID (four vertices for each splat with QUADS), the batch's storage
// blocks, the frame's constants. Out: the pixels to cover, and the flat inputs of splat.frag.
// Mirrors trip_splat_project(), trip_weight_may_reach() and trip_shade() in render/.
#include "fetch.glsl"
#include "project.glsl"
#include "weight.glsl"
#include "shade.glsl"

layout(std430, binding = TRIP_GL_TABLE) readonly buffer trip_gl_table { vec4 table[]; };

layout(location = 0) flat out vec4 footprint;  // centre, conic xx and yy times ray2
layout(location = 1) flat out vec4 colour;     // r, g, b, extinction * amplitude
layout(location = 2) flat out float shear;     // 2 conic xy times ray2
#ifdef DEPTH
layout(location = 3) flat out float centre_depth;  // depth of the centre's plane, as in layers
#endif
#ifdef NEAR
layout(location = 4) flat out mat3 forms; // a, b and along of project.glsl
#endif
#ifdef OWN_RAYS
layout(location = 7) flat out vec3 width;  // own_width of rays.glsl
#endif

out gl_PerVertex
{
    vec4 gl_Position;
    float gl_PointSize;
};

// Sets the corners at pixel borders. Every pixel of the bounds is covered, and rounding cannot
// change the set. A sprite is a square about the middle.
void cover(ivec4 pixels)
{
    vec2 image = vec2(screen.zw), corner = vec2(pixels.xy), size = vec2(pixels.zw - pixels.xy + 1);
#ifdef QUADS
    corner += size * vec2(gl_VertexID & 1, gl_VertexID >> 1 & 1);
#else
    corner += 0.5 * size;
    gl_PointSize = max(size.x, size.y);
#endif
    gl_Position = vec4(corner * 2.0 / image - 1.0, 0.0, 1.0);
}

// Returns colour and extinction of a code. The code of a mean (stream/mean.h) gets the extinction
// of the kept part of its cube.
vec4 look_up(uint code)
{
    float length = float(means.x);
    if (length <= 0.0)
        return table[code];
    const float covers[8] = float[](1.0 / 64.0, 1.0 / 32.0, 1.0 / 16.0, 1.0 / 8.0, 0.25, 0.5, 0.75, 1.0);
    vec4 entry = table[uint(floor(float(means.y) + float(means.z) * float(code >> 6) / 1023.0 + 0.5))];
    float cover = covers[code & 7u], depth_part = float((code >> 3 & 7u) + 1u) / 8.0;
    float thick = entry.a * depth_part * length;
    if (cover >= 1.0 || thick < 1e-4)
        entry.a *= cover * depth_part;
    else
        entry.a = -log(1.0 - cover * (1.0 - exp(-thick))) / length;
    return entry;
}

void drop()
{
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    gl_PointSize = 1.0;
    footprint = colour = vec4(0.0);
    shear = 0.0;
#ifdef DEPTH
    centre_depth = 0.0;
#endif
#ifdef NEAR
    forms = mat3(0.0);
#endif
#ifdef OWN_RAYS
    width = vec3(1.0);
#endif
}

void main()
{
#ifdef QUADS
    record r = fetch_record(uint(gl_VertexID) >> 2);
#else
    record r = fetch_record(uint(gl_VertexID));
#endif
    splat s;
    vec4 entry = look_up(r.code);
#ifdef UNEVEN
    use_width(r.width);
#endif
#ifdef FLATTENED
    vec4 g = unpack_normal(r.normal);
    vec3 n = vec3(dot(world_0.xyz, g.xyz), dot(world_1.xyz, g.xyz), dot(world_2.xyz, g.xyz));
    n = own_gradient(n);
    flattening = vec4(n / max(length(n), 1e-15), min(1.0, g.w) * to_x.w);
#endif
    if (entry.a <= 0.0 || !project(r.from_eye, r.position, s) || !may_reach(r.from_eye, s.radius)) {
        drop();
        return;
    }
    ivec4 pixels = covered_pixels(s);
    if (any(greaterThan(pixels.xy, pixels.zw))) {
        drop();
        return;
    }
    cover(pixels);
    footprint = vec4(s.centre, s.conic.xz * s.ray2);
    shear = 2.0 * s.conic.y * s.ray2;
    if (debug_colour.w > 0.0)
        entry.rgb = vec3(debug_colour.xyz);
#ifdef LIT
    entry.rgb = shade_here(entry.rgb, r.normal, r.from_eye, position_of(r.voxel));
#elif defined(SHADED)
    entry.rgb = shade(entry.rgb, r.normal, r.from_eye);
#endif
#ifdef EMISSION
    entry.rgb += emission_at(position_of(r.voxel));
#endif
#ifdef CUED
    entry.rgb = cued(entry.rgb, position_of(r.voxel));
#endif
    colour = vec4(entry.rgb, entry.a * s.amplitude);
#ifdef DEPTH
    centre_depth = max(r.position.z, 0.0) * depth.x;
#endif
#ifdef OWN_RAYS
    width = own_width;
#endif
#if defined(NEAR) && defined(PARALLEL)
    forms = mat3(vec3(0.0), vec3(0.0), s.along);
#elif defined(NEAR)
    forms = mat3(s.a, s.b, s.along);
#endif
}
