/* Reads scene files: JSON that places data sets in one picture (triptych.h). Any thread. */
#ifndef TRIP_SCENE_FILE_H
#define TRIP_SCENE_FILE_H

#include <stdbool.h>

#include "triptych.h"

/* Whether a path names a scene file. Reports nothing. */
bool trip_scene_file_is(const char *path);

/* Reads a scene file. Every fault is one reported failure. */
int trip_scene_file_read(const char *path, triptych_object **objects, unsigned *count);
void trip_scene_file_free(triptych_object *objects, unsigned count);

#endif
