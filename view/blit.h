/* Shows pictures in the window by OpenGL 3.2: a texture on a quad. On the window's thread, with its
 * GL context current. */
#ifndef TRIP_VIEW_BLIT_H
#define TRIP_VIEW_BLIT_H

#include <stdbool.h>
#include <stdint.h>

typedef struct trip_blit trip_blit;

/* 0, or a reported failure. */
int trip_blit_create(trip_blit **out);
void trip_blit_destroy(trip_blit *b);

/* width * height pixels of 4 bytes, the first row at the top. */
void trip_blit_upload(trip_blit *b, const uint8_t *rgba, int width, int height);
/* Corners in clip coordinates (x, y, z, w): upper left, upper right, lower left, lower right.
 * Pixels are smoothed, or, where `exact`, as they are. */
void trip_blit_draw(const trip_blit *b, const float corners[4][4], bool exact);
/* What the window shows, for width * height * 4 floats, the first row at the top; opaque. */
void trip_blit_read(int width, int height, float *rgba);
/* Makes all of it this colour; its size in pixels is set, too. */
void trip_blit_clear(int width, int height, float r, float g, float b);

#endif
