/* Pictures as files in memory. Any thread. */
#ifndef TRIP_SERVE_ENCODE_H
#define TRIP_SERVE_ENCODE_H

#include <stddef.h>
#include <stdint.h>

/* width * height pixels of 4 bytes, opaque: *file is for free(), NULL without memory. */
void trip_encode_jpeg(const uint8_t *rgba, int width, int height, unsigned char **file,
                      size_t *bytes);
/* The same without loss. */
void trip_encode_png(const uint8_t *rgba, int width, int height, unsigned char **file,
                     size_t *bytes);

#endif
