// Lengths of rays, and the index space in which the kernel of the current splat is round.
// In: rays in the index space of the list. Out: vectors and lengths in the space of the kernel.
// With UNEVEN this is the splat's own space (render/splat.h). Its voxel is own_size * own_width
// long along the list's axes. The product of the components of own_width is 1, so that all numbers
// fit a float. Otherwise this is the list's index space. Mirrors trip_splat_frame_scaled() in
// render/splat.c.
#include "real.glsl"

#ifdef UNEVEN
real3 own_width;
real own_size;
#else
const real3 own_width = real3(1.0);
const real own_size = 1.0;
#endif

#ifdef UNEVEN
// Selects the space of a voxel with the given length along each axis.
void use_width(real3 width)
{
    real volume = width.x * width.y * width.z;
    own_size = pow(float(volume), 1.0 / 3.0);
    own_size -= (own_size - volume / (own_size * own_size)) / 3.0; // refines to the precision of the number type
    own_width = width / own_size;
}
#endif

// Converts a vector between positions to this space.
real3 own_vector(real3 v)
{
#ifdef UNEVEN
    return v / own_width;
#else
    return v;
#endif
}

// Converts a gradient to this space, so that its product with such vectors stays the same.
real3 own_gradient(real3 g)
{
#ifdef UNEVEN
    return g * own_width;
#else
    return g;
#endif
}

// Returns |ray|^2 in this space at a pixel position from the image's centre, in perspective.
real own_ray2(real2 p)
{
#ifdef UNEVEN
    real3 ray = own_vector(ray_0.xyz + (ray_x.xyz * p.x + ray_y.xyz * p.y) * ray_x.w);
    return dot(ray, ray);
#else
    return dot(ray2_a, real4(1.0, p, p.x * p.x)) + dot(ray2_b.xy, p.y * p);
#endif
}

// Returns |J ray|^2 / voxel_world^2 at a pixel position from the image's centre.
real world_ray2(real2 p)
{
    return dot(world2_a, real4(1.0, p, p.x * p.x)) + dot(world2_b.xy, p.y * p);
}

// Set if fragments need ray lengths in the splat's own space.
#if defined(UNEVEN) && !defined(PARALLEL) && (defined(NEAR) || !defined(AFFINE))
#define OWN_RAYS
#endif
