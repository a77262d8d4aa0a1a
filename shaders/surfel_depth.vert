// Covers the discs of a batch: an instance each.
// In: the batch. Out: the corners, and the inputs of surfel_depth.frag.
#include "surfel.glsl"

layout(std430, binding = TRIP_GL_SURFELS) readonly buffer trip_gl_surfels { trip_gl_surfel surfels[]; };
layout(std430, binding = TRIP_GL_SURFEL_PLACES) readonly buffer trip_gl_places { uvec2 places[]; };
layout(location = TRIP_GL_SURFEL_FIRST) uniform uint first;

layout(location = 0) flat out vec4 place;
layout(location = 1) flat out vec4 slope;
layout(location = 2) flat out vec4 disc;

void main()
{
    uint n = first + uint(gl_InstanceID);
    place = surfels[n].at[PLACE];
    slope = surfels[n].at[SLOPE];
    disc = surfels[n].at[DISC];
    bool drawn = places[n].x != TRIP_GL_NO_CELL;
    gl_Position = drawn ? corner_of(place, disc, RIM, gl_VertexID) : vec4(0.0, 0.0, 0.0, 1.0);
}
