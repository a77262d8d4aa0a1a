#include "vtk.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "companion.h"

static bool ends_with(const char *path, const char *end)
{
    const size_t length = strlen(path), min = strlen(end);
    return length >= min && strcasecmp(path + length - min, end) == 0;
}

bool accuracy_vtk_command(const char *source, char *command, size_t bytes)
{
    static const char *const ends[] = { ".nrrd", ".nhdr", ".nii", ".nii.gz" };
    char worker[PATH_MAX];
    bool is_read = false;
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++)
        is_read |= ends_with(source, ends[i]);
    /* Refuses a path that the quotes in the command would not protect. */
    if (!is_read ||
        !trip_companion_find(worker, TRIP_WORKER_FROM_BIN, TRIP_WORKER_OF_SOURCE, R_OK) ||
        strchr(worker, '\'') ||
        system("command -v xvfb-run >/dev/null && "
               "python3 -c 'import numpy, vtkmodules.vtkRenderingVolume' >/dev/null 2>&1") != 0)
        return false;
    const int length = snprintf(command, bytes, "xvfb-run -a python3 '%s' --step 0.5", worker);
    return length >= 0 && (size_t)length < bytes;
}
