// Places the picture in the window.
// In: gl_VertexID from 0 to 3, and the corners of the quad in clip coordinates. Out: the position
// in clip coordinates, and the position in the picture, from 0 to 1 from the top left. It mirrors
// no C function.
#version 150

uniform vec4 corners[4];
out vec2 position;

void main()
{
    position = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = corners[gl_VertexID];
}
