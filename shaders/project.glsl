// Projects a splat. render/splat.h has the formulas.
// In: `c` and `position` of a record (fetch.glsl). Out: the footprint.
// Mirrors trip_splat_project() in render/splat.c, with three changes that keep all numbers within
// the range of a float. Rays are scaled; A and B are divided by depth and `step`; and all
// covariances are multiplied by u, which carries the size of a splat in pixels.
//
// With NEAR, and when splats are counted, some splats may be near, and all get the fields for near
// splats. With AFFINE all other splats are affine (render/splat.h), and these fields are 0. With
// UNEVEN, own_width and own_size of rays.glsl must be set for the splat.
#include "rays.glsl"

#if defined(TRIP_DOUBLE) && !defined(NEAR)
#define NEAR
#endif

struct splat {
    real2 centre;     // pixels from the image's centre
    real3 conic;      // xx, xy, yy of S'^-1
    real ray2;        // |ray|^2 through the centre; 1 in parallel views
    real amplitude;
    real4 bounds;     // x0, y0, x1, y1
    real radius;      // in the index space of the list
#ifdef NEAR
    bool near;
    real3 a, b, along; // dot products with (1, x, y) for pixels (x, y) from the image's centre
#endif
};

// Returns sigma^2 of round kernels.
real own_sigma2()
{
    return kernel.x * (own_size * own_size);
}

#ifdef FLATTENED
// The flattening of the current splat: trip_flattening of render/splat.h, list axes.
vec4 flattening;

// Returns xx, xy, yy of S and its determinant for a flattened kernel, from the values of the round
// kernel. gx and gy are the gradients of x and y. `share` is the share of the part at right angles
// to the normal. `along` is normal . (unit ray).
real4 flattened(real4 s, real3 gx, real3 gy, real along)
{
    real3 x = cross(gx, flattening.xyz), y = cross(gy, flattening.xyz);
    return real4(mix(s.xyz, real3(dot(x, x), dot(x, y), dot(y, y)), flattening.w),
                 s.w * mix(1.0, along * along, flattening.w));
}
#endif

#ifdef NEAR
#ifdef PARALLEL
// Sets `near` and `along`. Returns false if the whole splat lies behind the plane of the eye.
// `half_size` is the half extent of the round kernel's support.
bool project_near(real3 position, real2 half_size, inout splat s)
{
    real3 ray = own_vector(ray_0.xyz), x = own_vector(ray_x.xyz), y = own_vector(ray_y.xyz);
    real unit = 1.0 / (length(ray) * sqrt(own_sigma2())), k = sqrt(kernel.y);
    real2 slope = real2(dot(ray, x), dot(ray, y)) * (-ray_x.w * unit);
    real middle = position.z * dot(ray, ray) * unit;
    real reach = k + dot(abs(slope), half_size);
    s.near = !(middle >= reach);
    s.along = real3(middle - dot(slope, s.centre), slope);
    return middle > -reach;
}
#else
// Finds the minimum and maximum p in [-half_size, half_size] with (x - p z)^2 <= reach^2 |to - p
// forward|^2. Returns false if there is none.
bool bound_along(real3 to, real3 forward, real x, real z, real reach, real half_size, out real2 bounds)
{
    real r2 = reach * reach, q2 = z * z - r2 * dot(forward, forward);
    real q1 = x * z - r2 * dot(to, forward), q0 = x * x - r2 * dot(to, to);
    real3 across = to * z - forward * x, normal = cross(to, forward);
    real root = r2 * (dot(across, across) - r2 * dot(normal, normal));
    bool lowest = (q2 * half_size + 2.0 * q1) * half_size + q0 <= 0.0;
    bool highest = (q2 * half_size - 2.0 * q1) * half_size + q0 <= 0.0;
    bounds = real2(-half_size, half_size);
    if (lowest && highest || !(root >= 0.0))
        return lowest || highest || q2 <= 0.0;
    real h = q1 + (q1 < 0.0 ? -sqrt(root) : sqrt(root));
    if (h == 0.0 || q2 == 0.0)
        return true;
    real first = min(q0 / h, h / q2), last = max(q0 / h, h / q2);
    if (!lowest)
        bounds.x = first > -half_size ? first : last;
    if (!highest)
        bounds.y = last < half_size ? last : first;
    return bounds.x <= half_size && bounds.y >= -half_size && bounds.x <= bounds.y;
}

real3 form_of(real3 e, real scale)
{
    e = own_vector(e); // e . own_vector(ray) is own_vector(e) . ray
    return real3(dot(e, ray_0.xyz), real2(dot(e, ray_x.xyz), dot(e, ray_y.xyz)) * ray_x.w) * scale;
}

// Sets the fields for near splats. For near splats it also sets the bounds and the amplitude.
// Returns false if the splat is not visible.
bool project_near(real3 c, real3 position, inout splat s)
{
    real3 size = abs(c), v = c;
    real3 other = size.x <= size.y && size.x <= size.z ? real3(1.0, 0.0, 0.0)
                  : size.y <= size.z                   ? real3(0.0, 1.0, 0.0)
                                                       : real3(0.0, 0.0, 1.0);
    if (!(dot(v, v) > 0.0))
        v = other.yzx;
    real3 e0 = normalize(cross(v, other)), e1 = normalize(cross(v, e0));
    real depth = max(position.z, real(0.0)) * ray_x.w, low = kernel.z * depth * depth / own_sigma2();
    real3 ray_dx = own_vector(ray_x.xyz), ray_dy = own_vector(ray_y.xyz);
    real2 x = real2(dot(e0, ray_dx), dot(e1, ray_dx));
    real2 y = real2(dot(e0, ray_dy), dot(e1, ray_dy));
    real w00 = 1.0 + low * (x.x * x.x + y.x * y.x), w11 = 1.0 + low * (x.y * x.y + y.y * y.y);
    real w01 = low * (x.x * x.y + y.x * y.y), area = low * (x.x * y.y - x.y * y.x);
    real det = w00 + w11 - 1.0 + area * area, scale = length(c) / sqrt(own_sigma2());
    s.a = form_of(e0 - e1 * (w01 / w11), scale * sqrt(w11 / det));
    s.b = form_of(e1, scale / sqrt(w11));
    s.along = form_of(c, 1.0 / sqrt(own_sigma2()));
    if (!s.near)
        return true;
    s.amplitude = kernel.w * own_size / sqrt(det);
    s.ray2 = 1.0;
    s.centre = real2(0.0);
    s.conic = real3(0.0);
    real half_difference = 0.5 * (w00 - w11);
    real largest = 0.5 * (w00 + w11) + sqrt(half_difference * half_difference + w01 * w01);
    real reach = sqrt(own_sigma2() * kernel.y * largest);
    s.radius = 1e18;
    real2 columns, rows;
    real3 z = own_gradient(forward.xyz);
    bool seen = bound_along(own_gradient(to_x.xyz), z, position.x, position.z, reach, screen.x, columns) &&
                bound_along(own_gradient(to_y.xyz), z, position.y, position.z, reach, screen.y, rows);
    s.bounds = real4(columns.x, rows.x, columns.y, rows.y);
    return seen && position.z >= -sqrt(2.0 * own_sigma2() * kernel.y * dot(z, z));
}
#endif
#endif

#ifdef PARALLEL
#if defined(UNEVEN) || defined(FLATTENED)
// Computes the footprint if splats have different ones. Covariances are divided by sigma^2
// `longest`. half_size becomes the half extent of the round kernel's support.
void shape_footprint(inout splat s, inout real2 half_size)
{
    real3 x = own_gradient(to_x.xyz), y = own_gradient(to_y.xyz), ray = own_vector(ray_0.xyz);
    real longest = max(dot(x, x), dot(y, y)), sigma2 = own_sigma2() * longest;
    real3 gx = x * inversesqrt(longest), gy = y * inversesqrt(longest), area = cross(gx, gy);
    real low = kernel.z / sigma2, det_s = dot(area, area);
    real4 shape = real4(dot(gx, gx), dot(gx, gy), dot(gy, gy), det_s);
#ifdef UNEVEN
    real half_difference = 0.5 * (shape.x - shape.z);
    real largest = 0.5 * (shape.x + shape.z) +
                   sqrt(half_difference * half_difference + shape.y * shape.y);
    s.radius = sqrt(own_sigma2() * kernel.y * (1.0 + low * largest / det_s));
    half_size = sqrt(real2(shape.x + low, shape.z + low) * (kernel.y * sigma2));
#endif
#ifdef FLATTENED
    shape = flattened(shape, gx, gy, dot(normalize(ray), flattening.xyz));
#endif
    real det = shape.w + low * (shape.x + shape.z) + low * low;
    s.conic = real3(shape.z + low, -shape.y, shape.x + low) / (det * sigma2);
    s.amplitude = parallel_size.w * sqrt(det_s / det);
#ifdef UNEVEN
    s.amplitude *= own_size * length(ray_0.xyz) / length(ray);
#endif
    real2 reach = sqrt(real2(shape.x + low, shape.z + low) * (kernel.y * sigma2));
    s.bounds = real4(s.centre - reach, s.centre + reach);
}
#endif

bool project_own(real3 c, real3 position, out splat s)
{
    real2 half_size = parallel_size.xy;
    s.centre = position.xy;
    s.conic = parallel.xyz;
    s.ray2 = 1.0;
    s.amplitude = parallel.w;
    s.bounds = real4(s.centre - half_size, s.centre + half_size);
    s.radius = parallel_size.z;
#if defined(UNEVEN) || defined(FLATTENED)
    shape_footprint(s, half_size);
#endif
#ifdef NEAR
    return project_near(position, half_size, s);
#else
    return position.z > 0.0;
#endif
}
#else
#ifdef FIXED
bool project_far(real3 c, real3 position, out splat s)
{
    if (!(position.z > 0.0))
        return false;
    s.centre = position.xy / position.z;
    s.conic = parallel.xyz;
    s.ray2 = 1.0;
    s.amplitude = parallel.w;
#ifdef ANISOTROPIC
    s.amplitude *= sqrt(world_ray2(s.centre) / own_ray2(s.centre));
#endif
    s.bounds = real4(s.centre - parallel_size.xy, s.centre + parallel_size.xy);
    s.radius = parallel_size.z * position.z;
    return max(abs(s.centre.x), abs(s.centre.y)) < 1e9;
}
#else
bool project_far(real3 c, real3 position, out splat s)
{
    if (!(position.z > 0.0))
        return false;
    real inverse = 1.0 / position.z;
    real3 ray = c * inverse;
    s.centre = position.xy * inverse;
    s.ray2 = dot(ray, ray);

    // u S = [b.b -a.b; -a.b a.a]. Beyond u = 1e17 a splat is smaller than 1e-8 pixels, and larger
    // numbers could only overflow products.
    real3 rx = own_vector(ray_x.xyz), ry = own_vector(ray_y.xyz);
    real3 a = cross(ray, rx), b = cross(ray, ry);
    real to_sigma = forward.w / own_size, u = min(to_sigma * to_sigma * (position.z * position.z), real(1e17));
    real low = kernel.z * u;
    real sxx = dot(b, b), sxy = -dot(a, b), syy = dot(a, a);
    real det_s = ray_y.w * s.ray2, det_shape = det_s;
#ifdef AFFINE
    real spread = dot(real3(sxx + low, 2.0 * sxy, syy + low),
                      real3(dot(rx, rx), dot(rx, ry), dot(ry, ry)));
#endif
    real half_difference = 0.5 * (sxx - syy);
    real largest = 0.5 * (sxx + syy) + sqrt(half_difference * half_difference + sxy * sxy);
#ifdef FLATTENED
    real4 shape = flattened(real4(sxx, sxy, syy, det_s), b, -a, dot(ray, flattening.xyz) * inversesqrt(s.ray2));
    sxx = shape.x;
    sxy = shape.y;
    syy = shape.z;
    det_shape = shape.w;
#endif
    real inverse_det = 1.0 / (det_shape + low * (sxx + syy) + low * low);
    real3 conic = real3(syy + low, -sxy, sxx + low) * inverse_det;
    s.conic = conic * u;
    s.amplitude = kernel.w * own_size * sqrt(det_s * inverse_det);

    // The maximum eigenvalue of S^-1 is the maximum eigenvalue of S divided by |S|. Both are of the
    // round kernel.
    s.radius = sqrt(own_sigma2() * kernel.y * (1.0 + low * largest / det_s));

#ifdef AFFINE
    if (!(s.ray2 * u * (AFFINE_MAX * AFFINE_MAX) >= kernel.y * ray_x.w * ray_x.w * spread))
        return false;
    real2 half_size = sqrt(real2(sxx + low, syy + low) * (kernel.y / u));
    s.bounds = real4(s.centre - half_size, s.centre + half_size);
    s.radius *= AFFINE_REACH;
#ifdef ANISOTROPIC
    s.amplitude *= sqrt(world_ray2(s.centre) / s.ray2);
#endif
    s.ray2 = 1.0;
    return true;
#else
    // E and l, divided by u.
    real k = kernel.y * ray_x.w / (s.ray2 * u), k_step = k * ray_x.w;
    real exx = conic.x - k_step * dot(rx, rx);
    real exy = conic.y - k_step * dot(rx, ry);
    real eyy = conic.z - k_step * dot(ry, ry);
    real lx = k * dot(ray, rx), ly = k * dot(ray, ry);
    real det = exx * eyy - exy * exy;
    if (!(exx > 0.0 && det > 0.0))
        return false;
    real inverse_e = 1.0 / det;
    real2 middle = real2(eyy * lx - exy * ly, exx * ly - exy * lx) * inverse_e;
    real size = (kernel.y / u + lx * middle.x + ly * middle.y) * inverse_e;
    real2 half_size = real2(sqrt(size * eyy), sqrt(size * exx));
    s.bounds = real4(s.centre + middle - half_size, s.centre + middle + half_size);
    return true;
#endif
}
#endif

bool project_own(real3 c, real3 position, out splat s)
{
    bool far = project_far(c, position, s);
#if defined(NEAR) && defined(FIXED)
    s.near = false;
    s.a = s.b = s.along = real3(0.0);
    return far;
#elif defined(NEAR) && defined(AFFINE)
    s.near = !far;
    s.a = s.b = s.along = real3(0.0);
    return far || project_near(c, position, s);
#elif defined(NEAR)
    s.near = !(far && dot(c, c) >= own_sigma2() * kernel.y + s.radius * s.radius);
    return project_near(c, position, s);
#else
    return far;
#endif
}
#endif

bool project(real3 c, real3 position, out splat s)
{
    bool seen = project_own(own_vector(c), position, s);
#ifdef UNEVEN
    s.radius *= max(own_width.x, max(own_width.y, own_width.z));
#endif
    return seen;
}

// Returns the first and last pixel (from the image's corner) with a centre inside both the bounds
// and the image. There are none if a first pixel exceeds its last.
ivec4 covered_pixels(splat s)
{
    real4 inside = clamp(s.bounds + screen.xyxy, real4(-1.0), screen.zwzw + 1.0);
    ivec2 first = ivec2(ceil(inside.xy - 0.5)), last = ivec2(floor(inside.zw - 0.5));
    return ivec4(max(first, ivec2(0)), min(last, ivec2(screen.zw) - 1));
}
