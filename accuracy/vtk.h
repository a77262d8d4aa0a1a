/* VTK's ray caster beside the settings, where VTK for Python is installed. */
#ifndef TRIP_ACCURACY_VTK_H
#define TRIP_ACCURACY_VTK_H

#include <stdbool.h>
#include <stddef.h>

/* The command of `--compare` that draws a volume by vtk_worker.py, a sample every half voxel; false
 * where VTK, a display without a screen or the worker is not there, or VTK does not read the
 * volume. Starts Python, which takes part of a second. */
bool accuracy_vtk_command(const char *source, char *command, size_t bytes);

/* What VTK takes at most of memory for a voxel: the value read and its copy as single precision. */
enum { ACCURACY_VTK_VOXEL_BYTES = 8 };

#endif
