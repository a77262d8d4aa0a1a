/* Prints the count, the degree and the bounds of a Gaussian scene, as text or JSON. */
#ifndef GAUSSIAN_INFO_PRINT_H
#define GAUSSIAN_INFO_PRINT_H

#include <stdbool.h>

#include "triptych_brick.h"

/* Returns whether a path is a Gaussian scene. */
bool gaussian_info_wanted(triptych *t, const char *path);

/* `options` tells that options of volumes were given, which is a reported failure. Returns a
 * negative status after a reported failure. */
int gaussian_info_print(triptych *t, const char *path, bool options, bool json);

/* Prints the open data set of a Gaussian scene. */
int gaussian_info_print_scene(triptych *t, const char *path, bool json, bool verified);

#endif
