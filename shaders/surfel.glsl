// A surfel in the picture, and the bounds of its ellipses.
// Mirrors render/surfels/surfel_projected.h. The results have the same bits on most drivers, since
// no operations are fused.
#include "shared.h"

layout(location = TRIP_GL_SURFEL_PICTURE) uniform ivec2 picture; // width and height

const int PLACE = 0; // x, y, base, near
const int SLOPE = 1; // slope_x, slope_y, far, tolerance
const int BLEND = 2; // across, shear, down, mass
const int DISC = 3;  // across, shear, down, front
const int COLOUR = 4;

// Returns the squared radius at `d` pixels from the centre.
float radius2(vec4 oval, vec2 d)
{
    precise float along = d.x - oval.y * d.y, u = oval.x * along, v = oval.z * d.y;
    precise float q = u * u + v * v;
    return q;
}

float depth_at(vec4 place, vec4 slope, vec2 d)
{
    precise float v = place.z + slope.x * d.x + slope.y * d.y;
#ifdef PARALLEL
    float z = v;
#else
    float z = v > 0.0 ? 1.0 / v : uintBitsToFloat(0x7f800000u);
#endif
    return z < place.w ? place.w : z > slope.z ? slope.z : z;
}

// Returns corner `n` of the pixels with squared radii up to `limit`, or of some more.
vec4 corner_of(vec4 place, vec4 oval, float limit, int n)
{
    float down = 1.0 / oval.z, across = 1.0 / oval.x, shear = oval.y * down;
    vec2 reach = sqrt(limit) * vec2(sqrt(across * across + shear * shear), down) + 0.01;
    vec2 low = max(floor(place.xy - reach), 0.0), high = min(ceil(place.xy + reach), vec2(picture));
    vec2 corner = mix(low, max(low, high), vec2(n & 1, n >> 1));
    return vec4(corner * 2.0 / vec2(picture) - 1.0, 0.0, 1.0);
}
