/* Several objects in one picture: finds or makes their data sets in the cache, and opens them
 * together. Main thread only, except placed_input_open(). */
#ifndef TRIP_CLI_PLACED_INPUT_H
#define TRIP_CLI_PLACED_INPUT_H

#include "cached_volume.h"

/* Zeroed before its first use. Without objects, one data set is the input. */
typedef struct placed_input {
    triptych_object *objects; /* of data sets */
    unsigned count;
    triptych_object *given; /* as in the file */
    cached_volume *volumes; /* of objects that are no data sets; zeroed for the others */
    double seconds;         /* of bricking */
    unsigned bricked;
} placed_input;

/* Reads a scene file, and finds or makes the data sets of its objects. The caller closes *p even
 * after a failure. */
int placed_input_read(placed_input *p, triptych *t, const char *path,
                      const triptych_brick_options *options);
/* Finds or makes the data sets of inputs that are named one by one. `places` has X,Y,Z or
 * X,Y,Z,SCALE for each, with a
 * ';' between them; NULL places nothing. */
int placed_input_list(placed_input *p, triptych *t, const char *const *paths, unsigned count,
                      const char *places, const triptych_brick_options *options);
/* Opens the objects, or the data set `path` if there are none. Any thread. */
int placed_input_open(const placed_input *p, triptych *t, const char *path,
                      const triptych_resources *resources);
void placed_input_close(placed_input *p);

/* Prints the objects of a scene file and their places. `options` tells that options of volumes were
 * given, which is a reported failure. */
int placed_input_print(triptych *t, const char *path, bool options, bool json);

#endif
