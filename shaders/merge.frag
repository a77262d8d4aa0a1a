// The picture from the layers: C = sum w^2 C_a / sum w^2 over the lists with weight (2005 section
// 5.2, 2008 section 4.2), with the background behind. In: a band of the layers. Out:
// premultiplied colour.
// Mirrors merging in render/reference.c. LAYERS has bit a set where list a was drawn.
#include "weight.glsl"

layout(binding = TRIP_GL_LAYER) uniform sampler2D layers[3];
layout(location = TRIP_GL_ROW) uniform int row;           // of the image, in which fragments' row 0 lies
layout(location = TRIP_GL_ROW_IN_BAND) uniform int row_in_band; // likewise
layout(location = 0) out vec4 image;

void add_layer(int axis, vec4 layer, inout vec4 sum, inout float weights)
{
    float w = float(weight_of(real2(gl_FragCoord.xy) + real2(0.0, row), axis));
    weights += w * w;
    // Where there is no weight the layer is masked: what it holds is nothing.
    if (w > 0.0)
        sum += w * w * layer;
}

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy) + ivec2(0, row_in_band);
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    add_layer(0, (LAYERS & 1) != 0 ? texelFetch(layers[0], at, 0) : vec4(0.0), sum, weights);
    add_layer(1, (LAYERS & 2) != 0 ? texelFetch(layers[1], at, 0) : vec4(0.0), sum, weights);
    add_layer(2, (LAYERS & 4) != 0 ? texelFetch(layers[2], at, 0) : vec4(0.0), sum, weights);
    sum /= weights;
    vec4 behind = vec4(background);
    image = sum + (1.0 - sum.a) * vec4(behind.rgb * behind.a, behind.a);
}
