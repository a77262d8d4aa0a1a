// Lengths of rays, and the index space in which the kernel of the splat at hand is round. With UNEVEN
// that is the splat's own (render/splat.h): its voxel is own_size times own_width long along the
// list's axes, and the product of own_width is 1, so that no number leaves a float's range. It is
// the list's otherwise.
#include "real.glsl"

#ifdef UNEVEN
real3 own_width;
real own_size;
#else
const real3 own_width = real3(1.0);
const real own_size = 1.0;
#endif

#ifdef UNEVEN
// How long the voxel is.
void use_width(real3 width)
{
    real volume = width.x * width.y * width.z;
    own_size = pow(float(volume), 1.0 / 3.0);
    own_size -= (own_size - volume / (own_size * own_size)) / 3.0; // the number type's precision
    own_width = width / own_size;
}
#endif

// What lies between places, in that space.
real3 own_vector(real3 v)
{
#ifdef UNEVEN
    return v / own_width;
#else
    return v;
#endif
}

// What such is multiplied by.
real3 own_gradient(real3 g)
{
#ifdef UNEVEN
    return g * own_width;
#else
    return g;
#endif
}

// |ray|^2 there of a pixel position from the image's centre, in perspective.
real own_ray2(real2 p)
{
#ifdef UNEVEN
    real3 ray = own_vector(ray_0.xyz + (ray_x.xyz * p.x + ray_y.xyz * p.y) * ray_x.w);
    return dot(ray, ray);
#else
    return dot(ray2_a, real4(1.0, p, p.x * p.x)) + dot(ray2_b.xy, p.y * p);
#endif
}

// |J ray|^2 / voxel_world^2 of one.
real world_ray2(real2 p)
{
    return dot(world2_a, real4(1.0, p, p.x * p.x)) + dot(world2_b.xy, p.y * p);
}

// Whether fragments need the splat's own lengths of rays.
#if defined(UNEVEN) && !defined(PARALLEL) && (defined(NEAR) || !defined(AFFINE))
#define OWN_RAYS
#endif
