/* Tables of options that several commands share, beside draw_settings_table (lib/draw_settings.h).
 * Main thread only. */
#ifndef TRIP_DRAW_OPTIONS_H
#define TRIP_DRAW_OPTIONS_H

#include "command_line.h"
#include "draw_settings.h"
#include "triptych_brick.h"

/* The view, with the memory that triptych_view points to. */
typedef struct view_options {
    triptych_view view; /* without eye, look and up */
    double eye[3], look[3], up[3];
    int has_eye, has_look, has_up;
} view_options;

/* Returns the view. It points into *o. */
triptych_view view_options_view(const view_options *o);
/* Fails for options of the view that exclude one another. */
int view_options_check(const view_options *o);

/* Rows of the tables. */
enum {
    VIEW_SIZE,
    VIEW_AZIMUTH,
    VIEW_ELEVATION,
    VIEW_EYE,
    VIEW_FOV,
    VIEW_LOOK,
    VIEW_ORTHO,
    VIEW_ROLL,
    VIEW_UP,
    VIEW_SIDE,
    VIEW_ZOOM,
    VIEW_OPTIONS
};
enum {
    RESOURCE_ENGINE,
    RESOURCE_MEMORY,
    RESOURCE_RENDERER,
    RESOURCE_THREADS,
    RESOURCE_OCCLUDED,
    RESOURCE_OPTIONS
};
enum { VOLUME_AXES = 5 }; /* a row of volume_options_table */
enum { LOOK_LEVEL, LOOK_OPACITY_SCALE, LOOK_TF, LOOK_WINDOW, LOOK_OPTIONS };

extern const trip_option_table view_options_table; /* view_options */
extern const trip_option_table resource_table;     /* triptych_resources */
/* --renderer of the viewers, which do not draw by slow renderers: triptych_resources. */
extern const trip_option_table viewer_renderer_table;
extern const trip_option_table look_table;           /* triptych_transfer_function */
extern const trip_option_table volume_options_table; /* triptych_brick_options */
extern const trip_option_table point_options_table;  /* the same, for clouds of points */
extern const trip_option_table heat_table;           /* const char *, the data set of heat */

/* Fails if --window and --level were not given together. */
int look_options_check(uint64_t given);
/* Fails if the heat, or its absence, contradicts the effects. */
int heat_options_check(const draw_settings *s, const char *heat);

#endif
