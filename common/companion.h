/* Finds files that are installed with the program: triptych-images, the OpenVDB module, VTK's
 * worker, the included volume. */
#ifndef TRIP_COMPANION_H
#define TRIP_COMPANION_H

#include <limits.h>
#include <stdbool.h>

/* Finds the file `name`, which may start with a folder. Looks beside this program, in the places
 * where the program or the library is installed, and then at `built`, where it was built.
 * `access_mode` is the access that access(2) must allow. Returns false if there is no such file. */
bool trip_companion_find(char path[PATH_MAX], const char *name, const char *built, int access_mode);

#endif
