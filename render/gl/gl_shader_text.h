/* The text of the shaders at build time, by file name. cmake/shaders.cmake generates the array,
 * which ends with a NULL name. Read-only. */
#ifndef TRIP_GL_SHADER_TEXT_H
#define TRIP_GL_SHADER_TEXT_H

typedef struct trip_gl_shader_text {
    const char *name, *text;
} trip_gl_shader_text;

extern const trip_gl_shader_text trip_gl_shader_texts[];

#endif
