/* Shows pictures in the window as a textured quad, by OpenGL 3.2. Only the window's thread may call
 * these functions, with its GL context current. */
#ifndef TRIP_VIEW_BLIT_H
#define TRIP_VIEW_BLIT_H

#include <stdbool.h>
#include <stdint.h>

typedef struct trip_blit trip_blit;

/* Returns 0, or a reported failure. */
int trip_blit_create(trip_blit **out);
void trip_blit_destroy(trip_blit *b);

/* Takes width * height pixels of 4 bytes, top row first. */
void trip_blit_upload(trip_blit *b, const uint8_t *rgba, int width, int height);
/* Draws the picture into four corners in clip coordinates (x, y, z, w): upper left, upper right,
 * lower left, lower right. Filters linearly, or by nearest pixel if `exact`. */
void trip_blit_draw(const trip_blit *b, const float corners[4][4], bool exact);
/* Copies the window's contents into width * height * 4 floats, top row first, alpha 1. */
void trip_blit_read(int width, int height, float *rgba);
/* Fills the window with one colour, and sets the viewport to its size in pixels. */
void trip_blit_clear(int width, int height, float r, float g, float b);

#endif
