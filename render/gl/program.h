/* Programs from the files of shaders/: `#include "name"` is resolved here, and a compiler's
 * complaint names the file and line it is about. TRIPTYCH_SHADER_DIR=folder reads the files from
 * there instead of from the binary. Needs a current context. */
#ifndef TRIP_GL_PROGRAM_H
#define TRIP_GL_PROGRAM_H

#include <epoxy/gl.h>

typedef struct trip_gl_program_source {
    const char *vertex, *fragment, *compute; /* file names; NULL: no such stage */
    const char *defines;                     /* "#define" lines put before each stage */
} trip_gl_program_source;

int trip_gl_program_build(GLuint *out, const trip_gl_program_source *source);

#endif
