/* Clouds of points, for the library's own files. */
#ifndef TRIP_LIBRARY_POINTS_H
#define TRIP_LIBRARY_POINTS_H

#include "triptych_brick.h"

/* Refuses options of clouds for another file. */
int trip_context_check_no_points(const char *path, const triptych_brick_options *o);
/* Writes the options of clouds that decide the data set to `text` (at least 256 bytes). Fails for
 * options that are out of range. */
int trip_context_describe_points_form(const char *path, const triptych_brick_options *o,
                                      char text[256]);

/* *out gets the description of the surfels; NULL is allowed. */
int trip_context_brick_points(triptych *t, const char *path, const char *data_set,
                              const triptych_brick_options *options, triptych_gaussians *out);

/* Returns the notes of the data set of a scene: JSON for free(). */
char *trip_context_scene_notes(const char *path, const triptych_gaussians *g);

#endif
