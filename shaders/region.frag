// Keeps the pixels where the present list has weight and whose rays go the way at hand: those that
// are not discarded set the stencil, and only they are shaded. Mirrors trip_weight() > 0 and
// trip_ray_goes().
#include "weight.glsl"

layout(location = TRIP_GL_ROW) uniform int row; // of the image, in which fragments' row 0 lies
layout(location = TRIP_GL_WAY) uniform int way;

void main()
{
    real2 pixel = real2(gl_FragCoord.xy) + real2(0.0, row);
    int axis = int(weight.z);
    if (!(weight_of(pixel, axis) > 0.0 && goes(pixel, axis, way)))
        discard;
}
