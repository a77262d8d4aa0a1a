// Computes the weights of the layers at a pixel.
// In: a pixel position. Out: the weight of a list. Mirrors render/camera/weight.c. METHOD is 0 for merge,
// 1 for clip and 2 for axis, as in trip_method.
#include "real.glsl"

#if defined(PARALLEL) || defined(UNCULLED) || METHOD == 2
#define WEIGHT_IS_CONSTANT
#endif

real largest_of(real3 r)
{
    return max(abs(r.x), max(abs(r.y), abs(r.z)));
}

int largest_axis(real3 r)
{
    real3 a = abs(r);
    if (a.x >= a.y && a.x >= a.z)
        return 0;
    return a.y >= a.z ? 1 : 2;
}

// Returns the ray of a pixel position (from the image's corner), in the data's axes.
real3 pixel_ray(real2 pixel)
{
    precise real3 ray = camera_r0.xyz + (camera_rx.xyz * pixel.x + camera_ry.xyz * pixel.y);
    return ray;
}

// Returns trip_weight() at a pixel position.
real weight_of(real2 pixel, int axis)
{
#if METHOD == 2
    return axis == int(weight.w) ? 1.0 : 0.0;
#else
    real3 ray = pixel_ray(pixel);
#if METHOD == 1
    return axis == largest_axis(ray) ? 1.0 : 0.0;
#else
    real h = weight.x;
    return max(real(0.0), (abs(ray[axis]) / largest_of(ray) - h) / (1.0 - h));
#endif
#endif
}

// Whether the ray of a pixel position goes in a direction; mirrors trip_ray_goes().
bool goes(real2 pixel, int axis, int way)
{
    return way == TRIP_GL_WAY_ANY || (pixel_ray(pixel)[axis] >= 0.0) == (way == TRIP_GL_WAY_UP);
}

// Mirrors trip_weight_may_reach() for a splat in list axes, or trip_weight_of_two_points() with
// TWO_POINTS. The plan has already culled by constant weights.
bool may_reach(real3 from_eye, real radius)
{
#ifdef WEIGHT_IS_CONSTANT
    return true;
#elif defined(TWO_POINTS)
    int axis = int(weight.z);
    real3 right = real3(camera_rx[axis], camera_rx[(axis + 1) % 3], camera_rx[(axis + 2) % 3]);
    right *= 0.5 * sqrt(kernel.x * kernel.y) / length(right);
    real3 c = from_eye * to_grid.xyz, beside = c + right * to_grid.xyz;
    real w = abs(c.x) / largest_of(c) - weight.x, v = abs(beside.x) / largest_of(beside) - weight.x;
    return w + abs(w - v) > 0.0;
#else
    real3 c = from_eye * to_grid.xyz;
    real bound = abs(c.x) - weight.x * largest_of(c) + weight.y * (radius * to_grid.w);
#if METHOD == 1
    return bound >= 0.0;
#else
    return bound > 0.0;
#endif
#endif
}
