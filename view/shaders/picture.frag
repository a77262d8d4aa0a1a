// In: a position in the picture, 0 to 1. Out: the colour there, opaque.
#version 150

uniform sampler2D picture;
in vec2 position;
out vec4 colour;

void main()
{
    colour = vec4(texture(picture, position).rgb, 1);
}
