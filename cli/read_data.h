/* The files of data among what a command reads. One thread. */
#ifndef TRIP_CLI_READ_DATA_H
#define TRIP_CLI_READ_DATA_H

#include "read_files.h"
#include "triptych_brick.h"

/* A data set, or a volume that is read so. The context stays as it is. */
int read_files_add_data(read_files *r, triptych *t, const char *input,
                        const triptych_brick_options *options);

#endif
