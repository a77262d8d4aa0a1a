/* Adds the files of volumes and data sets to the files that a command reads. One thread. */
#ifndef TRIP_CLI_READ_DATA_H
#define TRIP_CLI_READ_DATA_H

#include "read_files.h"
#include "triptych_brick.h"

/* Adds a data set, or all files of a volume read with these options. Leaves the context
 * unchanged. */
int read_files_add_data(read_files *r, triptych *t, const char *input,
                        const triptych_brick_options *options);

#endif
