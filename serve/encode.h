/* Encodes pictures in memory. Any thread may call these functions. */
#ifndef TRIP_SERVE_ENCODE_H
#define TRIP_SERVE_ENCODE_H

#include <stddef.h>
#include <stdint.h>

/* Encodes width * height opaque pixels of 4 bytes as JPEG. *file is for free(), NULL if memory is
 * exhausted. */
void trip_encode_jpeg(const uint8_t *rgba, int width, int height, unsigned char **file,
                      size_t *bytes);
/* Encodes the same as PNG. */
void trip_encode_png(const uint8_t *rgba, int width, int height, unsigned char **file,
                     size_t *bytes);

#endif
