// Merges the layers into the picture: C = sum w^2 C_a / sum w^2 over the lists with weight (2005,
// section 5.2; 2008, section 4.2). Adds the background behind it. With DEPTH it also computes the
// mean distance of the visible matter. LAYERS has bit a set if list a was drawn.
// In: a band of the layers. Out: premultiplied colour, and distance in world units.
// Mirrors the merging in render/reference/reference.c and render/layer.h.
#include "weight.glsl"

layout(binding = TRIP_GL_LAYER) uniform sampler2D layers[3];
layout(location = TRIP_GL_ROW) uniform int row; // row of the image at row 0 of the fragments
layout(location = TRIP_GL_ROW_IN_BAND) uniform int row_in_band; // row of the band at row 0 of the fragments
layout(location = TRIP_GL_OUT_COLOUR) out vec4 image;
#ifdef DEPTH
layout(binding = TRIP_GL_LAYER_DEPTH) uniform sampler2D layer_depths[3];
layout(location = TRIP_GL_OUT_DEPTH) out float image_depth;
#endif

struct sums {
    vec4 colour;
    float depth, weight;
};

void add_layer(int axis, sampler2D layer, sampler2D depths, inout sums sum)
{
    ivec2 at = ivec2(gl_FragCoord.xy) + ivec2(0, row_in_band);
    float w = float(weight_of(real2(gl_FragCoord.xy) + real2(0.0, row), axis));
    sum.weight += w * w;
    // Pixels without weight are masked in the layer. A layer that was not drawn is empty.
    if (!(w > 0.0) || (LAYERS & 1 << axis) == 0)
        return;
    sum.colour += w * w * texelFetch(layer, at, 0);
    sum.depth += w * w * texelFetch(depths, at, 0).r;
}

#ifdef DEPTH
// Returns the distance in world units, or infinity for transparent pixels. `opacity` belongs to the
// same sum.
float distance_of(float depth_sum, float opacity)
{
    real2 p = real2(gl_FragCoord.xy) + real2(0.0, row) - screen.xy;
    real ray2 = dot(world2_a, real4(1.0, p, p.x * p.x)) + dot(world2_b.xy, p.y * p);
    float infinity = uintBitsToFloat(0x7f800000u);
    return opacity > 0.0 ? float(sqrt(ray2) * depth.y) * (depth_sum / opacity) : infinity;
}
#define DEPTHS(axis) layer_depths[axis]
#else
#define DEPTHS(axis) layers[axis]
#endif

void main()
{
    sums sum = sums(vec4(0.0), 0.0, 0.0);
    add_layer(0, layers[0], DEPTHS(0), sum);
    add_layer(1, layers[1], DEPTHS(1), sum);
    add_layer(2, layers[2], DEPTHS(2), sum);
    sum.colour /= sum.weight;
    vec4 behind = vec4(background);
    image = sum.colour + (1.0 - sum.colour.a) * vec4(behind.rgb * behind.a, behind.a);
#ifdef DEPTH
    image_depth = distance_of(sum.depth / sum.weight, sum.colour.a);
#endif
}
