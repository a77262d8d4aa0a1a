/* Parses and checks the command line of `triptych render`, and fills in the defaults. Main thread
 * only. */
#ifndef TRIP_RENDER_OPTIONS_H
#define TRIP_RENDER_OPTIONS_H

#include <stdbool.h>

#include "quality_options.h"
#include "triptych_brick.h"

/* The field that the integral renderer integrates. */
typedef enum render_field {
    RENDER_FIELD_UNSET,
    RENDER_FIELD_STORED, /* values in the data set */
    RENDER_FIELD_SOURCE, /* values of the volume that was bricked */
    RENDER_FIELD_SPLATS,
} render_field;

/* How cpu treats bricks behind opaque ones. RENDER_OCCLUDED_UNSET means skip. */
typedef enum render_occluded {
    RENDER_OCCLUDED_UNSET,
    RENDER_OCCLUDED_SKIP,
    RENDER_OCCLUDED_DRAW,
} render_occluded;

enum { RENDER_MORE_MAX = 63 };

typedef struct render_options {
    const char *input, *output; /* input: a data set or volume. output: an image file or a video;
                                   several images add a number to its name */
    const char *more[RENDER_MORE_MAX]; /* further data sets in the same picture */
    int more_count;
    const char *heat;              /* data set of --emission, or NULL */
    triptych_brick_options volume; /* only the fields for reading a volume are set */
    triptych_transfer_function function;
    const char *depth; /* file for distances, or NULL */
    const char *stats; /* file, "-" for stdout, or NULL */
    int width, height;
    bool eye_given, look_given, up_given;
    double eye[3], look[3], up[3];
    triptych_side side;
    double azimuth_degrees, elevation_degrees, roll_degrees;
    double zoom, fov_degrees, ortho_height; /* 0 if not given */
    bool ortho_fit;                         /* parallel view that shows the whole object */
    int orbit;                              /* number of views around the object, or 0 */
    const char *path;                       /* file with a camera path, or NULL */
    double fps;                             /* of a video; 0 if not given */
    int in_flight;                          /* frames drawn at once; 0 if not given */
    triptych_settings settings;
    triptych_renderer renderer;
    render_occluded occluded;
    render_field field;
    triptych_engine engine;
    uint64_t memory_bytes; /* 0 selects the default */
    int threads;           /* 0 selects the default */
    bool explain, count;
    char measured[ACCURACY_CHECKSUM_BYTES]; /* checksum for --error, or "" */
    triptych_levels_for levels_for;         /* for bricking a volume */
} render_options;

/* Returns 0, or TRIP_USAGE after reporting an error. --help prints the help and exits. */
int render_options_parse(render_options *o, int argc, char **argv);
#endif
