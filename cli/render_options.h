/* Parses and checks the command line of `triptych render`, and fills in the defaults. Main thread
 * only. */
#ifndef TRIP_RENDER_OPTIONS_H
#define TRIP_RENDER_OPTIONS_H

#include <stdbool.h>

#include "draw_options.h"
#include "quality_options.h"

/* The field that the integral renderer integrates. */
typedef enum render_field {
    RENDER_FIELD_UNSET,
    RENDER_FIELD_STORED, /* values in the data set */
    RENDER_FIELD_SOURCE, /* values of the volume that was bricked */
    RENDER_FIELD_SPLATS,
} render_field;

enum { RENDER_MORE_MAX = 63 };

typedef struct render_options {
    const char *input;                 /* a data set or volume */
    const char *more[RENDER_MORE_MAX]; /* further data sets in the same picture */
    int more_count;
    const char *place;  /* of each input, or NULL */
    const char *output; /* an image file or a video; several images add a number to its name */
    const char *heat;   /* data set of --emission, or NULL */
    triptych_brick_options volume; /* only the fields for reading a volume are set */
    triptych_transfer_function function;
    const char *depth;      /* file for distances, or NULL */
    const char *stats;      /* file, "-" for stdout, or NULL */
    view_options view;      /* with the picture's size */
    int orbit;              /* number of views around the object, or 0 */
    const char *path;       /* file with a camera path, or NULL */
    double fps;             /* of a video; 0 if not given */
    int in_flight;          /* frames drawn at once; 0 if not given */
    draw_settings settings; /* of timed frames, which do not count */
    int count;              /* counts splats after all pictures are written */
    int explain;
    triptych_resources resources;
    int field;                      /* a render_field */
    quality_options quality;        /* --error and --report */
    triptych_levels_for levels_for; /* for bricking a volume */
} render_options;

/* Returns 0, or TRIP_USAGE after reporting an error. --help prints the help and exits. */
int render_options_parse(render_options *o, int argc, char **argv);
/* Returns the view, which points into *o. */
triptych_view render_options_view(const render_options *o);
#endif
