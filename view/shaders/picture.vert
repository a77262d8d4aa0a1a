// In: a corner of the quad by its number, 0 to 3, its place in clip coordinates.
// Out: that place, and where it is in the picture, whose first row is at the top.
#version 150

uniform vec4 corners[4];
out vec2 position;

void main()
{
    position = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = corners[gl_VertexID];
}
