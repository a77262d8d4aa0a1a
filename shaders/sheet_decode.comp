// Decodes the squares of a block into a sheet. Each work group decodes one square, each invocation
// one voxel.
// In: squares and their codes, bytes as in the files; the draw code of each stored code, if the two
// differ. Out: draw codes of the voxels present.
// Mirrors trip_block_voxels() in stream/block.c and trip_draw_code() in
// render/classification/draw_codes.h.
#include "shared.h"

layout(local_size_x = 64) in;
layout(std430, binding = TRIP_GL_VOXELS) readonly buffer trip_gl_voxels { uint voxels[]; };
layout(std430, binding = TRIP_GL_SQUARES) readonly buffer trip_gl_squares { trip_gl_sheet_square squares[]; };
layout(r32f, binding = TRIP_GL_IMAGE) writeonly uniform image2D sheet;
// The draw codes of two stored codes in each word, the lower code in the lower half.
layout(std430, binding = TRIP_GL_DRAW_CODES) readonly buffer trip_gl_draw_codes { uint draw_codes[]; };
// First square, step of codes, 1 if draw codes differ from stored codes.
layout(location = TRIP_GL_SHEET) uniform uvec3 form;

#include "code.glsl"

// Extracts the even bits of a Morton number within a square.
uint even_bits(uint n)
{
    return (n & 1u) | (n >> 1 & 2u) | (n >> 2 & 4u);
}

void main()
{
    uint n = gl_LocalInvocationID.x, bit = 1u << (n & 31u);
    trip_gl_sheet_square square = squares[form.x + gl_WorkGroupID.x];
    uint word = n < 32u ? square.mask_low : square.mask_high;
    if ((word & bit) == 0u)
        return;
    uint before = uint(bitCount(word & (bit - 1u))) + (n < 32u ? 0u : uint(bitCount(square.mask_low)));
    uint code = code_at(square.codes, square.min_width, before) * form.y;
    if (form.z != 0u)
        code = draw_codes[code >> 1] >> 16u * (code & 1u) & 0xffffu;
    uvec2 position = uvec2(square.corner, square.corner >> 16) + uvec2(even_bits(n), even_bits(n >> 1));
    imageStore(sheet, ivec2(position & 0xffffu), vec4(code));
}
