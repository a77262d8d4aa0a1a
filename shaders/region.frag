// Selects the pixels where the current list has weight and the ray has the direction of the pass.
// Other pixels are discarded; the selected ones set the stencil, and only they are drawn.
// In: pixel positions. Out: the stencil. Mirrors trip_weight() > 0 and trip_ray_goes() in
// render/camera/weight.h.
#include "weight.glsl"

layout(location = TRIP_GL_ROW) uniform int row; // row of the image at row 0 of the fragments
layout(location = TRIP_GL_WAY) uniform int way;

void main()
{
    real2 pixel = real2(gl_FragCoord.xy) + real2(0.0, row);
    int axis = int(weight.z);
    if (!(weight_of(pixel, axis) > 0.0 && goes(pixel, axis, way)))
        discard;
}
