/* The browser's page, embedded at build time by cmake/shaders.cmake. Read-only. */
#ifndef TRIP_SERVE_PAGE_TEXT_H
#define TRIP_SERVE_PAGE_TEXT_H

typedef struct trip_serve_page_shader_text {
    const char *name, *text;
} trip_serve_page_shader_text;

extern const trip_serve_page_shader_text trip_serve_page_shader_texts[];

#endif
