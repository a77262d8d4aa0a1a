#include "vtk.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

static bool ends_with(const char *path, const char *end)
{
    const size_t length = strlen(path), least = strlen(end);
    return length >= least && strcasecmp(path + length - least, end) == 0;
}

/* Beside an installed program, else where the program was built from. Names that sh would take
 * apart do not come into the command. */
static bool find_worker(char *path, size_t bytes)
{
    char program[2048];
    ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
    program[length > 0 ? length : 0] = 0;
    char *slash = strrchr(program, '/');
    snprintf(path, bytes, "%.*s/" TRIP_WORKER_FROM_BIN, slash ? (int)(slash - program) : 0,
             program);
    if (!slash || access(path, R_OK) != 0)
        snprintf(path, bytes, "%s", TRIP_WORKER_OF_SOURCE);
    return access(path, R_OK) == 0 && !strchr(path, '\'');
}

bool accuracy_vtk_command(const char *source, char *command, size_t bytes)
{
    static const char *const ends[] = { ".nrrd", ".nhdr", ".nii", ".nii.gz" };
    char worker[4096];
    bool is_read = false;
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++)
        is_read |= ends_with(source, ends[i]);
    if (!is_read || !find_worker(worker, sizeof worker) ||
        system("command -v xvfb-run >/dev/null && "
               "python3 -c 'import numpy, vtkmodules.vtkRenderingVolume' >/dev/null 2>&1") != 0)
        return false;
    const int length = snprintf(command, bytes, "xvfb-run -a python3 '%s' --step 0.5", worker);
    return length >= 0 && (size_t)length < bytes;
}
