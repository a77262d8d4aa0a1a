/* Files that belong to the program and are installed with it: triptych-images, what reads OpenVDB,
 * VTK's worker, the included volume. */
#ifndef TRIP_COMPANION_H
#define TRIP_COMPANION_H

#include <limits.h>
#include <stdbool.h>

/* Finds the file `name`, which may begin with a folder from this program's, beside it, where it is
 * installed with the program or the library, or else at `built`, where it was built; `access_mode`
 * is what access(2) shall allow. */
bool trip_companion_find(char path[PATH_MAX], const char *name, const char *built, int access_mode);

#endif
