/* Files that belong to the program and lie beside it: triptych-images, and what reads OpenVDB. */
#ifndef TRIP_COMPANION_H
#define TRIP_COMPANION_H

#include <limits.h>
#include <stdbool.h>

/* Finds the file `name` beside this program, where it is installed with the program or the
 * library, or else at `built`, where it was built; `access_mode` is what access(2) shall allow. */
bool trip_companion_find(char path[PATH_MAX], const char *name, const char *built, int access_mode);

#endif
