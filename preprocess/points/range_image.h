/* A range image in memory: distances and colours of one frame (range_frames.h). The helper program
 * (image_helper.h) decodes the files. The other functions are pure; any thread. */
#ifndef TRIP_RANGE_IMAGE_H
#define TRIP_RANGE_IMAGE_H

#include <stdint.h>

#include "range_frames.h"

struct trip_image_helper;

/* Maximum of pixels. */
enum { TRIP_RANGE_PIXELS_MAX = 1 << 25 };

/* Must be zeroed at first. */
typedef struct trip_range_image {
    const trip_range_frame *frame;
    int width, height;
    float *z;              /* distances along the optical axis; NaN: none */
    unsigned char *colour; /* red, green, blue; NULL: none */
    int colour_width, colour_height;
    double focal[2], centre[2]; /* in pixels; pixel i reaches from i to i + 1 */
} trip_range_image;

/* Loads a frame, which must outlive it. Starts the helper if *helper is NULL. */
int trip_range_image_load(trip_range_image *im, struct trip_image_helper **helper,
                          const trip_range_frame *frame);
void trip_range_image_free(trip_range_image *im);
uint64_t trip_range_image_bytes(const trip_range_image *im);

/* A pixel with a distance, in the space of the scene. */
typedef struct trip_range_sample {
    double position[3];
    double normal[3]; /* to the side of the camera */
    double z, cosine; /* of the angle between the normal and the ray to the camera */
    double half;      /* half the width of the pixel at its distance */
    double sigma;     /* standard deviation of the distance (range_shape.h) */
    double radius;    /* a disc of it covers the spacing of the pixels */
} trip_range_sample;

/* Returns false for a pixel without a distance. */
bool trip_range_image_sample(const trip_range_image *im, int u, int v, bool grazing,
                             trip_range_sample *out);

/* Sets the place in the picture that sees a position, and its distance. Returns false behind the
 * camera. */
bool trip_range_image_find(const trip_range_image *im, const double position[3], double at[2],
                           double *z);

/* Sets the colour at a place in the picture. The colour image shows the same view in any size. */
void trip_range_image_colour(const trip_range_image *im, const double at[2], float rgb[3]);

#endif
