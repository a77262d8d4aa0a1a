/* The command line of `triptych render`, checked, defaults filled in. */
#ifndef TRIP_RENDER_OPTIONS_H
#define TRIP_RENDER_OPTIONS_H

#include <stdbool.h>

#include "quality_options.h"
#include "triptych_brick.h"

/* What the integral renderer integrates. */
typedef enum render_field {
    RENDER_FIELD_UNSET,
    RENDER_FIELD_STORED, /* the values that the data set holds */
    RENDER_FIELD_SOURCE, /* those of the volume it was made of */
    RENDER_FIELD_SPLATS,
} render_field;

/* What becomes of bricks behind what is already opaque; skipped where nothing is said. */
typedef enum render_occluded {
    RENDER_OCCLUDED_UNSET,
    RENDER_OCCLUDED_SKIP,
    RENDER_OCCLUDED_DRAW,
} render_occluded;

enum { RENDER_MORE_MAX = 63 };

typedef struct render_options {
    const char *input,
        *output; /* data set or volume; an image file, the model of the names of several; a video */
    const char *more[RENDER_MORE_MAX];   /* data sets drawn with it, */
    int more_count;                      /* so many */
    const char *heat;                    /* data set of --emission; NULL: none */
    triptych_brick_options volume;       /* how a volume is read; nothing else of it is set */
    triptych_transfer_function function; /* colour and opacity */
    const char *depth;                   /* a file for distances, or NULL */
    const char *stats;                   /* file, "-" for stdout, or NULL */
    int width, height;
    bool eye_given, look_given, up_given;
    double eye[3], look[3], up[3];
    triptych_side side;
    double azimuth_degrees, elevation_degrees, roll_degrees;
    double zoom, fov_degrees, ortho_height; /* 0: not given */
    bool ortho_fit;                         /* parallel, as high as needed */
    int orbit;                              /* images of a turntable; 0: one image */
    const char *path;                       /* of the camera, a file; or NULL */
    double fps;                             /* of a video; 0: not given */
    int in_flight;                          /* frames drawn at once; 0: not given */
    triptych_settings settings;
    triptych_renderer renderer;
    render_occluded occluded;
    render_field field;
    triptych_engine engine;
    uint64_t memory_bytes; /* 0: the default */
    int threads;           /* 0: the default */
    bool explain, count;
    char measured[ACCURACY_CHECKSUM_BYTES]; /* the data set that --error has to be of, or "" */
    triptych_levels_for levels_for;         /* that a volume is bricked with */
} render_options;

/* 0, or TRIP_USAGE once reported; --help prints and exits. */
int render_options_parse(render_options *o, int argc, char **argv);
#endif
