/* Builds the command line that bricks a data set again, for a shell. */
#ifndef TRIP_BRICK_COMMAND_H
#define TRIP_BRICK_COMMAND_H

#include "dataset_metadata.h"

/* Returns the command line for the data set at `path`. If `volume` is not NULL, the command bricks
 * that volume into the current folder instead, since `path` is then not the user's file. The
 * command's envelope is `tf` (NULL: the automatic function) and `range` (NULL: none). Free the
 * result with free(). Returns NULL if the data set's text does not name its source. */
char *brick_command(const trip_dataset_metadata *text, const char *path, const char *volume,
                    const char *tf, const double *range);

#endif
