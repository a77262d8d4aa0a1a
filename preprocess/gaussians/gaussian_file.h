/* Reads the Gaussians of a scene from a file, in the order of the file and in bounded memory. The
 * content and the name of a file tell its format. One thread at a time. */
#ifndef TRIP_GAUSSIAN_FILE_H
#define TRIP_GAUSSIAN_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gaussian.h"

enum { TRIP_GAUSSIAN_TRAINER_BYTES = 256 };

typedef struct trip_gaussian_info {
    const char *format; /* such as "3DGS PLY"; static */
    uint64_t count;     /* Gaussians in the file, also those that are left out */
    int degree;         /* of the spherical harmonics, 0 to 3 */
    bool antialiased;   /* trained with a compensated opacity (Mip-Splatting) */
    bool flat;          /* surfels: the third deviation is 0 (2D Gaussian Splatting) */
    /* The axis that points up: "x", "y", "z", or with a minus. Captures have "-y". */
    char up[3];
    /* The program that trained or wrote the scene, and other comments; or "". */
    char trainer[TRIP_GAUSSIAN_TRAINER_BYTES];
} trip_gaussian_info;

typedef struct trip_gaussian_file trip_gaussian_file;

/* Returns whether a file is a Gaussian scene that trip_gaussian_file_open() reads. A damaged scene
 * counts. Reports nothing. */
bool trip_gaussian_file_is(const char *path);

/* Opens a scene. The failure of a file that is no scene is reported too. */
int trip_gaussian_file_open(const char *path, trip_gaussian_file **out);
void trip_gaussian_file_close(trip_gaussian_file *f); /* NULL is allowed */

const trip_gaussian_info *trip_gaussian_file_info(const trip_gaussian_file *f);

/* Reads up to `room` Gaussians. *got_out is 0 only at the end. Gaussians with a value that is not
 * finite are left out. The first pass over the file ends with a warning that counts them. */
int trip_gaussian_file_read(trip_gaussian_file *f, trip_gaussian *out, size_t room,
                            size_t *got_out);
int trip_gaussian_file_rewind(trip_gaussian_file *f);

/* Returns the number of Gaussians that were left out so far in this pass. */
uint64_t trip_gaussian_file_left_out(const trip_gaussian_file *f);

#endif
