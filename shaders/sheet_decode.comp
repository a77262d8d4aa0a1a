// Decodes the squares of a block into a sheet. Each work group decodes one square, each invocation
// one voxel.
// In: squares and their codes, bytes as in the files; with EXACT, the exact draw code of each stored
// code. Out: draw codes of the voxels present.
// With BLURRED also in: deviations of the squares, one byte each; with EXACT, their growth in draw
// codes. Out: deviations of the voxels present, divided by 255.
// Mirrors trip_block_voxels() in stream/block.c. With EXACT it also mirrors trip_draw_code_exact()
// and trip_draw_deviation() in render/classification/draw_codes.c.
#include "shared.h"

layout(local_size_x = 64) in;
layout(std430, binding = TRIP_GL_VOXELS) readonly buffer trip_gl_voxels { uint voxels[]; };
layout(std430, binding = TRIP_GL_SQUARES) readonly buffer trip_gl_squares { trip_gl_sheet_square squares[]; };
layout(r32f, binding = TRIP_GL_IMAGE) writeonly uniform image2D sheet;
layout(location = TRIP_GL_SHEET) uniform uvec2 form; // first square, step of codes

#ifdef EXACT
layout(std430, binding = TRIP_GL_DRAW_CODES) readonly buffer trip_gl_draw_codes { float draw_codes[]; };
#endif

#ifdef BLURRED
layout(r16, binding = TRIP_GL_IMAGE_DEVIATIONS) writeonly uniform image2D sheet_deviations;
#ifdef EXACT
layout(std430, binding = TRIP_GL_DRAW_DEVIATIONS) readonly buffer trip_gl_draw_deviations { float growths[]; };
#endif
#endif

#include "code.glsl"

// Extracts the even bits of a Morton number within a square.
uint even_bits(uint n)
{
    return (n & 1u) | (n >> 1 & 2u) | (n >> 2 & 4u);
}

#ifdef BLURRED
// Returns the deviation of record k of a square, as a draw code divided by 255.
float deviation_at(trip_gl_sheet_square square, uint k, uint code)
{
    uint at = square.deviations + k;
    if (square.deviations == TRIP_GL_NO_DEVIATIONS)
        return 0.0;
    float d = float(voxels[at >> 2] >> 8u * (at & 3u) & 255u);
#ifdef EXACT
    d *= growths[code];
#endif
    return min(d / 255.0, 1.0);
}
#endif

void main()
{
    uint n = gl_LocalInvocationID.x, bit = 1u << (n & 31u);
    trip_gl_sheet_square square = squares[form.x + gl_WorkGroupID.x];
    uint word = n < 32u ? square.mask_low : square.mask_high;
    if ((word & bit) == 0u)
        return;
    uint before = uint(bitCount(word & (bit - 1u))) + (n < 32u ? 0u : uint(bitCount(square.mask_low)));
    uint code = code_at(square.codes, square.min_width, before) * form.y;
    uvec2 position = uvec2(square.corner, square.corner >> 16) + uvec2(even_bits(n), even_bits(n >> 1));
#ifdef EXACT
    imageStore(sheet, ivec2(position & 0xffffu), vec4(draw_codes[code]));
#else
    imageStore(sheet, ivec2(position & 0xffffu), vec4(code));
#endif
#ifdef BLURRED
    imageStore(sheet_deviations, ivec2(position & 0xffffu), vec4(deviation_at(square, before, code)));
#endif
}
