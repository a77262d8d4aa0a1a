// The number type of a pass: float, or double where TRIP_DOUBLE is defined (counts and weights,
// which must agree with the reference in every decision), and the frame's constants in it.
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
