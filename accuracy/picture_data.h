/* Pictures as text: "data:image/png;base64,..." for pages that hold all they show. One thread. */
#ifndef TRIP_ACCURACY_PICTURE_DATA_H
#define TRIP_ACCURACY_PICTURE_DATA_H

/* A picture of width * height times 4 floats, shown over black, made smaller by a whole factor to
 * be at most `most` pixels wide and high; for free(). NULL, with nothing reported, without memory.
 */
char *accuracy_picture_data(const float *rgba, int width, int height, int max);

/* Likewise how far two pictures are apart: the largest difference of a channel at each pixel, from
 * black over red and yellow to white at ACCURACY_DIFFERENCE_MAX of 255; of the pixels that become
 * one, the largest. */
#define ACCURACY_DIFFERENCE_MAX 16.0
char *accuracy_difference_data(const float *a, const float *b, int width, int height, int max);

#endif
