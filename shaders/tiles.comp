// Composites Gaussians into tiles, front to back: each work group a tile, each invocation a pixel.
// In: jobs, the pairs that they name, and the splats that the pairs name. In and out: the planes,
// and the number of closed pixels of each tile.
// With DEPTH it also adds up depths. With CURVED the footprints have a denominator.
// Mirrors draw_vector() and radius2() in render/gaussians/tiles_tmpl.h.
#include "tile.glsl"

layout(std430, binding = TRIP_GL_TILE_SPLATS) readonly buffer trip_gl_splats { trip_gl_projected splats[]; };
layout(std430, binding = TRIP_GL_TILE_PAIRS) readonly buffer trip_gl_pairs { uint pairs[]; };
layout(std430, binding = TRIP_GL_TILE_JOBS) readonly buffer trip_gl_jobs { trip_gl_tile jobs[]; };
layout(location = TRIP_GL_TILE_TERMINATION) uniform float termination;
layout(location = TRIP_GL_TILE_FIRST_JOB) uniform uint first_job;
#ifdef CURVED
layout(std430, binding = TRIP_GL_TILE_CURVES) readonly buffer trip_gl_curves { trip_gl_curve curves[]; };
#endif

// Returns the squared radius q at `d` pixels from the pixel that the splat is given at.
float radius2(uint n, vec4 uv, float down, vec2 d)
{
    float u = uv.x + (uv.z * d.x - uv.w * d.y), v = uv.y + down * d.y;
    float numerator = u * u + v * v;
#ifdef CURVED
    vec4 at = curves[n].w_a_b, steps = curves[n].steps;
    float w = at.x + dot(steps.xy, d), a = at.y + dot(steps.zw, d), b = at.z + at.w * d.y;
    return w > 0.0 ? numerator / (w * w + a * a + b * b) : 1e30;
#else
    return numerator;
#endif
}

void main()
{
    trip_gl_tile job = jobs[first_job + gl_WorkGroupID.x];
    ivec2 pixel = pixel_of(job.tile);
    uint at = plane_of(job.tile), plane = uint(TRIP_GL_TILE_PIXELS);
    float passes = planes[at];
    if (passes <= 0.0)
        return;
    vec3 colour = vec3(planes[at + plane], planes[at + 2u * plane], planes[at + 3u * plane]);
#ifdef DEPTH
    float depth = planes[at + 4u * plane];
#endif
    for (uint i = 0u; i < job.count; i++) {
        uint n = pairs[job.first + i], tile = splats[n].tile;
        vec4 rest = splats[n].rest; // down, limit, opacity, z
        vec2 d = vec2(pixel - ivec2(tile & 0xffffu, tile >> 16) * TRIP_GL_TILE_PX);
        float q = radius2(n, splats[n].uv, rest.x, d);
        if (q > rest.y)
            continue;
        float alpha = min(rest.z * exp(-0.5 * q), ALPHA_MAX);
        if (alpha < ALPHA_MIN)
            continue;
        float after = passes * (1.0 - alpha);
        if (after < termination) {
            passes = -passes;
            atomicAdd(closed[first_tile() + job.tile], 1u);
            break;
        }
        float weight = passes * alpha;
        colour += weight * splats[n].rgb;
#ifdef DEPTH
        depth += weight * rest.w;
#endif
        passes = after;
    }
    planes[at] = passes;
    planes[at + plane] = colour.r;
    planes[at + 2u * plane] = colour.g;
    planes[at + 3u * plane] = colour.b;
#ifdef DEPTH
    planes[at + 4u * plane] = depth;
#endif
}
