/* Picture files. This process writes PNG; the helper program of image_helper.h writes JPEG, TIFF
 * and OpenEXR. One thread at a time uses a helper; several threads have one each.
 *
 * In memory a picture is float RGBA with premultiplied (associated) alpha: `height` rows of `width`
 * pixels, row 0 at the top. Colours are display values (sRGB). PNG, JPEG and TIFF store them
 * without a curve. EXR stores linear light by convention: colours, without their alpha, pass
 * through the sRGB transfer function, and through its inverse when read. */
#ifndef TRIP_IMAGE_FILE_H
#define TRIP_IMAGE_FILE_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum trip_image_depth {
    TRIP_IMAGE_DEPTH_DEFAULT = 0, /* PNG and JPEG 8 bits, TIFF 16 bits, EXR float */
    TRIP_IMAGE_U8,                /* PNG, JPEG, TIFF */
    TRIP_IMAGE_U16,               /* PNG, TIFF */
    TRIP_IMAGE_HALF,              /* EXR */
    TRIP_IMAGE_FLOAT,             /* EXR, TIFF */
} trip_image_depth;

/* Zero means the default. */
typedef struct trip_image_params {
    trip_image_depth depth;
    bool drop_alpha;  /* writes RGB only, over black; JPEG always does */
    int jpeg_quality; /* 1 to 100; default 95 */
    bool distances;   /* one float per pixel; TIFF and EXR only */
} trip_image_params;

/* The helper, started at first use and kept for later pictures. Zero-initialise it. */
typedef struct trip_image_files {
    struct trip_image_helper *helper;
} trip_image_files;

/* Checks that the format of `path` can hold `params`, which may be NULL. Returns 0, or TRIP_USAGE
 * with one line that names the formats. */
int trip_image_check_path(const char *path, const trip_image_params *params);

/* Fails for a path of JPEG, which cannot store a transparent background. */
int trip_image_check_transparent(const char *path);

/* Starts the helper early if `path` needs it. The helper takes a fifth of a second to start, so the
 * first picture need not wait. A missing helper fails before any work is done. */
int trip_image_prepare(trip_image_files *files, const char *path);
/* Ends the helper. */
void trip_image_close(trip_image_files *files);

/* Writes a picture in the format of the extension: .png, .jpg, .jpeg, .tif, .tiff or .exr, in any
 * case.
 * - Integers are clamped to [0, 1] and rounded to nearest.
 * - PNG gets unassociated alpha, computed before rounding; TIFF and EXR get associated alpha.
 * - Distances go unchanged into one channel of floats, named Z in EXR, and may be +infinity.
 * - The file is written under another name in the same folder, then renamed. A failed write leaves
 *   an existing file unchanged.
 * - Any other value that is not finite is a reported failure. */
int trip_image_write(trip_image_files *files, const char *path, int width, int height,
                     const float *pixels, const trip_image_params *params);

/* Converts a component to an integer from 0 to `top`. */
static inline unsigned trip_image_integer(float v, unsigned top)
{
    const float within = v < 0 ? 0 : v > 1 ? 1 : v;
    return (unsigned)(within * (float)top + 0.5f);
}

/* Reads a picture with one to four channels (grey, grey and alpha, RGB, RGBA) into *rgba_out, for
 * free(). */
int trip_image_read(trip_image_files *files, const char *path, int *width_out, int *height_out,
                    float **rgba_out);

#ifdef __cplusplus
}
#endif

#endif
