// Draws one triangle over the whole image, for passes that visit every pixel.
// In: gl_VertexID 0 to 2. Out: its corners. It mirrors no C function.
void main()
{
    gl_Position = vec4(4.0 * float(gl_VertexID & 1) - 1.0, 2.0 * float(gl_VertexID & 2) - 1.0, 0.0, 1.0);
}
