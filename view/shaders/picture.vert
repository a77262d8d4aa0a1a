// In: the number of a corner of the quad, 0 to 3, and its position in clip coordinates.
// Out: the position in clip coordinates, and in the picture, 0 to 1 from the top left.
#version 150

uniform vec4 corners[4];
out vec2 position;

void main()
{
    position = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = corners[gl_VertexID];
}
