// The projection of a splat. Mirrors trip_splat_project() in render/splat.c with the rays scaled,
// A, B taken per unit of depth and of `step`, and all covariances times u, which alone carries the
// size of a splat in pixels: no number leaves a float's range. See render/splat.h for the formulas.
// `c` and `place` are a record's (fetch.glsl).
#include "real.glsl"

struct splat {
    real2 centre;     // pixels from the image's centre
    real3 conic;      // xx, xy, yy of S'^-1
    real ray2;        // |ray|^2 through the centre; 1 in parallel views
    real amplitude;
    real4 bounds;     // x0, y0, x1, y1
    real radius;      // index space
};

#ifdef PARALLEL
bool project(real3 c, real3 place, out splat s)
{
    s.centre = place.xy;
    s.conic = parallel.xyz;
    s.ray2 = 1.0;
    s.amplitude = parallel.w;
    s.bounds = real4(s.centre - parallel_size.xy, s.centre + parallel_size.xy);
    s.radius = parallel_size.z;
    return place.z > 0.0;
}
#else
bool project(real3 c, real3 place, out splat s)
{
    if (!(place.z > 0.0))
        return false;
    real inverse = 1.0 / place.z;
    real3 ray = c * inverse;
    s.centre = place.xy * inverse;
    s.ray2 = dot(ray, ray);

    // u S = [b.b -a.b; -a.b a.a]. Beyond 1e17 splats are 1e-8 pixels and only products would suffer.
    real3 a = cross(ray, ray_x.xyz), b = cross(ray, ray_y.xyz);
    real u = min(forward.w * forward.w * (place.z * place.z), real(1e17));
    real low = kernel.z * u;
    real sxx = dot(b, b), sxy = -dot(a, b), syy = dot(a, a);
    real det_s = ray_y.w * s.ray2;
    real inverse_det = 1.0 / (det_s + low * (sxx + syy) + low * low);
    real3 conic = real3(syy + low, -sxy, sxx + low) * inverse_det;
    s.conic = conic * u;
    s.amplitude = kernel.w * sqrt(det_s * inverse_det);

    // The largest eigenvalue of S^-1 is that of S over |S|.
    real half_difference = 0.5 * (sxx - syy);
    real largest = 0.5 * (sxx + syy) + sqrt(half_difference * half_difference + sxy * sxy);
    s.radius = sqrt(kernel.x * kernel.y * (1.0 + low * largest / det_s));

    // E and l over u.
    real k = kernel.y * ray_x.w / (s.ray2 * u), k_step = k * ray_x.w;
    real exx = conic.x - k_step * dot(ray_x.xyz, ray_x.xyz);
    real exy = conic.y - k_step * dot(ray_x.xyz, ray_y.xyz);
    real eyy = conic.z - k_step * dot(ray_y.xyz, ray_y.xyz);
    real lx = k * dot(ray, ray_x.xyz), ly = k * dot(ray, ray_y.xyz);
    real det = exx * eyy - exy * exy;
    if (!(exx > 0.0 && det > 0.0))
        return false;
    real inverse_e = 1.0 / det;
    real2 middle = real2(eyy * lx - exy * ly, exx * ly - exy * lx) * inverse_e;
    real size = (kernel.y / u + lx * middle.x + ly * middle.y) * inverse_e;
    real2 half_size = real2(sqrt(size * eyy), sqrt(size * exx));
    s.bounds = real4(s.centre + middle - half_size, s.centre + middle + half_size);
    return true;
}
#endif

// First and last pixel (from the image's corner) whose centre lies in the bounds and in the image;
// none where a first exceeds its last.
ivec4 covered_pixels(splat s)
{
    real4 inside = clamp(s.bounds + screen.xyxy, real4(-1.0), screen.zwzw + 1.0);
    ivec2 first = ivec2(ceil(inside.xy - 0.5)), last = ivec2(floor(inside.zw - 0.5));
    return ivec4(max(first, ivec2(0)), min(last, ivec2(screen.zw) - 1));
}
