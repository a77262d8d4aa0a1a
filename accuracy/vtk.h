/* Measures VTK's ray caster beside the settings if VTK for Python is installed. One thread. */
#ifndef TRIP_ACCURACY_VTK_H
#define TRIP_ACCURACY_VTK_H

#include <stdbool.h>
#include <stddef.h>

/* Makes the --compare command that draws a volume by vtk_worker.py with a sample every half voxel.
 * Returns false if VTK, xvfb-run or the worker is missing, or if VTK cannot read the volume. Starts
 * Python, which takes part of a second. */
bool accuracy_vtk_command(const char *source, char *command, size_t bytes);

/* Maximum memory of VTK for a voxel: the value read and its copy in single precision. */
enum { ACCURACY_VTK_VOXEL_BYTES = 8 };

#endif
