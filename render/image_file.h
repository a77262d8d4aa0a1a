/* Pictures in files: PNG, written here (png_file.h), and JPEG, TIFF and OpenEXR, which the helper
 * program of image_helper.h writes.
 * One thread at a time uses a helper; several threads have one each.
 *
 * In memory a picture is float RGBA, premultiplied (associated) alpha, `height` rows of `width`
 * pixels, row 0 at the top. Colours are display values (sRGB): PNG, JPEG and TIFF get what the
 * transfer function says, without a curve. EXR is linear light by convention: its colours, without
 * their alpha, go through the sRGB transfer function, and come back through its inverse. */
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

/* Zero means the default everywhere. */
typedef struct trip_image_params {
    trip_image_depth depth;
    bool drop_alpha;  /* write RGB only: the picture over black; JPEG always does */
    int jpeg_quality; /* 1 to 100; default 95 */
    bool distances;   /* a picture of width * height floats, one a pixel; TIFF and EXR only */
} trip_image_params;

/* The helper, started when first wanted and kept for the pictures that follow. Starts zeroed. */
typedef struct trip_image_files {
    struct trip_image_helper *helper;
} trip_image_files;

/* Checks that `path` names a format that can hold `params` (which may be NULL), before any work is
 * done: 0, or TRIP_USAGE and one line that names the formats. */
int trip_image_check_path(const char *path, const trip_image_params *params);

/* Starts the helper where files of that name are written by it: it needs a fifth of a second to get
 * ready, for which the first picture then need not wait, and one that is missing is noticed before
 * any work is done. */
int trip_image_prepare(trip_image_files *files, const char *path);
/* Ends the helper. */
void trip_image_close(trip_image_files *files);

/* Writes the picture in the format that the extension names (.png, .jpg, .jpeg, .tif, .tiff, .exr,
 * in any case). Integers are rounded to nearest after clamping to [0, 1]. PNG gets unassociated
 * alpha, computed before rounding, as its standard wants; TIFF and EXR associated alpha. The file
 * is written under another name in the same folder and renamed when complete, so that a failed
 * write leaves what was there. A pixel that is not finite is a reported failure, not written.
 * Distances go as they are into one channel of floats, in EXR called Z, and may be +infinity. */
int trip_image_write(trip_image_files *files, const char *path, int width, int height,
                     const float *pixels, const trip_image_params *params);

/* A component as an integer from 0 to `top`, as files have it. */
static inline unsigned trip_image_integer(float v, unsigned top)
{
    const float within = v < 0 ? 0 : v > 1 ? 1 : v;
    return (unsigned)(within * (float)top + 0.5f);
}

/* Reads a picture of one to four channels (grey, grey and alpha, RGB, RGBA) into *rgba_out, which
 * the caller frees with free(). */
int trip_image_read(trip_image_files *files, const char *path, int *width_out, int *height_out,
                    float **rgba_out);

#ifdef __cplusplus
}
#endif

#endif
