// Composites the summed splats of a sheet as one fragment (render/splat.h).
// In: the sheet's sums of optical depth times colour and of optical depth, and with DEPTH of
// optical depth times distance. Out: premultiplied colour for blending in list order, and with
// DEPTH the distance, also premultiplied.
// Mirrors composite_sheet() in render/reference/reference.c.
#include "real.glsl"
#include "opacity.glsl"

layout(binding = TRIP_GL_LAYER) uniform sampler2D sheet;
layout(location = TRIP_GL_OUT_COLOUR) out vec4 fragment;
#ifdef DEPTH
layout(binding = TRIP_GL_LAYER_DEPTH) uniform sampler2D sheet_depth;
layout(location = TRIP_GL_OUT_DEPTH) out vec4 fragment_depth; // blending uses the opacity in its fourth component
#endif

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 sum = texelFetch(sheet, at, 0);
    if (!(sum.a > 0.0))
        discard;
    float alpha = opacity(sum.a);
    fragment = vec4(sum.rgb * (alpha / sum.a), alpha);
#ifdef DEPTH
    fragment_depth = vec4(texelFetch(sheet_depth, at, 0).r * (alpha / sum.a), 0.0, 0.0, alpha);
#endif
}
