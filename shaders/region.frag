// Keeps the pixels where the present list has weight: those that are not discarded set the stencil,
// and only they are shaded. Mirrors trip_weight() > 0.
#include "weight.glsl"

void main()
{
    if (!(weight_of(real2(gl_FragCoord.xy), int(weight.z)) > 0.0))
        discard;
}
