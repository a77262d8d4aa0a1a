/* Checks of the index of a Gaussian scene. Used by gaussian_set.c; any thread. */
#ifndef TRIP_GAUSSIAN_CHECK_H
#define TRIP_GAUSSIAN_CHECK_H

#include "gaussian_format.h"

/* Coordinates of centres and sizes of splats reach at most so far. */
#define TRIP_GAUSSIAN_FARTHEST 1e15
/* The greatest magnitude of a coefficient of spherical harmonics. */
#define TRIP_GAUSSIAN_COEFFICIENT_MAX 1e30f

/* Checks the first bytes of a file of `file_bytes` bytes. Reports the first fault at `where`. */
int trip_gaussian_check_header(const trip_file_gaussian_header *h, uint64_t file_bytes,
                               const char *where);
/* Checks all bytes behind the header. `index` begins with the checked header `h`. */
int trip_gaussian_check_tables(const unsigned char *index, const trip_file_gaussian_header *h,
                               const char *where);

#endif
