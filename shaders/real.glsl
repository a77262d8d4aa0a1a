// Defines the number type of a pass: double if TRIP_DOUBLE is defined, else float. Counts and
// weights need double, because every decision must agree with the reference.
// Out: `real` types and the frame's constants. Mirrors trip_gl_frame_round() in
// render/gl/frame_block.c.
#include "shared.h"

#ifdef TRIP_DOUBLE
#define real double
#define real2 dvec2
#define real3 dvec3
#define real4 dvec4
#else
#define real float
#define real2 vec2
#define real3 vec3
#define real4 vec4
#endif

layout(std140, binding = TRIP_GL_FRAME) uniform trip_gl_frame
{
    TRIP_GL_FRAME_FIELDS(real4)
};
