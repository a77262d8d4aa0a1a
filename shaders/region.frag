// Keeps the pixels where the present list has weight: those that are not discarded set the stencil,
// and only they are shaded. Mirrors trip_weight() > 0.
#include "weight.glsl"

layout(location = TRIP_GL_ROW) uniform int row; // of the image, in which fragments' row 0 lies

void main()
{
    if (!(weight_of(real2(gl_FragCoord.xy) + real2(0.0, row), int(weight.z)) > 0.0))
        discard;
}
