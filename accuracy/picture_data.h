/* Encodes pictures as "data:image/png;base64,..." for self-contained HTML pages. One thread. */
#ifndef TRIP_ACCURACY_PICTURE_DATA_H
#define TRIP_ACCURACY_PICTURE_DATA_H

/* Encodes a picture of width * height * 4 floats over black. A whole factor reduces it to at most
 * `max` pixels on each side. The caller frees the text. Returns NULL without a report if memory is
 * exhausted. */
char *accuracy_picture_data(const float *rgba, int width, int height, int max);

/* Encodes the difference of two pictures, the maximum over the channels of each pixel. Colours run
 * from black over red and yellow to white at ACCURACY_DIFFERENCE_MAX of 255. A reduced pixel shows
 * the maximum of its pixels. Size and memory are as in accuracy_picture_data(). */
#define ACCURACY_DIFFERENCE_MAX 16.0
char *accuracy_difference_data(const float *a, const float *b, int width, int height, int max);

#endif
