/* The window's shaders, embedded at build time. cmake/shaders.cmake generates the array; its last
 * name is NULL. Read-only. */
#ifndef TRIP_VIEW_SHADER_TEXT_H
#define TRIP_VIEW_SHADER_TEXT_H

typedef struct trip_view_shader_text {
    const char *name, *text;
} trip_view_shader_text;

extern const trip_view_shader_text trip_view_shader_texts[];

#endif
