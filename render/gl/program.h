/* Builds programs from the files of shaders/. It resolves `#include "name"`, and compile errors
 * name the original file and line. TRIPTYCH_SHADER_DIR=FOLDER reads the files from FOLDER instead
 * of the binary. The context must be current. */
#ifndef TRIP_GL_PROGRAM_H
#define TRIP_GL_PROGRAM_H

#include <epoxy/gl.h>

typedef struct trip_gl_program_source {
    const char *vertex, *fragment, *compute; /* file names; NULL for a stage that is absent */
    const char *defines;                     /* "#define" lines for the start of each stage */
} trip_gl_program_source;

int trip_gl_program_build(GLuint *out, const trip_gl_program_source *source);

#endif
