// Covers the surfels of visible cells: an instance each.
// In: the numbers of the cells, and their surfels. Out: the corners, and the inputs of
// surfel_blend.frag.
#include "surfel.glsl"

layout(std430, binding = TRIP_GL_SURFEL_CELLS) readonly buffer trip_gl_cells { uint cells[]; };
layout(binding = TRIP_GL_SURFEL_HOLDERS) uniform sampler2DArray holders;
layout(location = TRIP_GL_SURFEL_PITCH) uniform uint pitch; // cells of a row

layout(location = 0) flat out vec4 place;
layout(location = 1) flat out vec4 slope;
layout(location = 2) flat out vec4 blend;
layout(location = 3) flat out vec4 disc;
layout(location = 4) flat out vec3 rgb;

void main()
{
    uint n = cells[gl_InstanceID];
    ivec2 cell = ivec2(n % pitch, n / pitch);
    place = texelFetch(holders, ivec3(cell, PLACE), 0);
    slope = texelFetch(holders, ivec3(cell, SLOPE), 0);
    blend = texelFetch(holders, ivec3(cell, BLEND), 0);
    disc = texelFetch(holders, ivec3(cell, DISC), 0);
    rgb = texelFetch(holders, ivec3(cell, COLOUR), 0).rgb;
    gl_Position = corner_of(place, blend, REACH, gl_VertexID);
}
