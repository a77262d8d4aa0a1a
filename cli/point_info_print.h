/* Prints the count, the attributes and the bounds of a cloud of points, as text or JSON. */
#ifndef POINT_INFO_PRINT_H
#define POINT_INFO_PRINT_H

#include <stdbool.h>

#include "triptych_brick.h"

/* `options` tells that options of volumes were given, which is a reported failure. Returns a
 * negative status after a reported failure. */
int point_info_print(triptych *t, const char *path, bool options, bool json);

#endif
