/* The command line that bricks a data set again, as one would type it into a shell. */
#ifndef TRIP_BRICK_COMMAND_H
#define TRIP_BRICK_COMMAND_H

#include "dataset_metadata.h"

/* For the data set at `path`, or, where `volume` is not NULL, for one of that volume, in this
 * folder: what is at `path` is then not the user's. `tf` is the function then kept in it, NULL for
 * the automatic one, and `range` is kept too (NULL: none). For free(); NULL where the data set's
 * text does not say what it was made of. */
char *brick_command(const trip_dataset_metadata *text, const char *path, const char *volume,
                    const char *tf, const double *range);

#endif
