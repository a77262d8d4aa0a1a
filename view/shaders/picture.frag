// Draws the picture in the window.
// In: a position in the picture, from 0 to 1. Out: its colour, opaque. It mirrors no C function.
#version 150

uniform sampler2D picture;
in vec2 position;
out vec4 colour;

void main()
{
    colour = vec4(texture(picture, position).rgb, 1);
}
