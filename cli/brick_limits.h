/* Compares the stages of `triptych brick` to a plain direct read of the input and a plain write of
 * the data set's size. Both run on the same disks directly after bricking. Main thread only. */
#ifndef TRIP_CLI_BRICK_LIMITS_H
#define TRIP_CLI_BRICK_LIMITS_H

#include <cjson/cJSON.h>

#include "plain_disk.h"
#include "triptych_brick.h"

typedef struct brick_limits {
    plain_disk read; /* bytes is 0 if the input is not a single file with the values */
    plain_disk
        write; /* large data sets are written in part; seconds is extrapolated to all bytes */
} brick_limits;

double brick_seconds(const triptych_brick_summary *s);

int brick_limits_measure(brick_limits *l, const char *volume, const char *data_set,
                         const triptych_brick_summary *s);
void brick_limits_print(const brick_limits *l, const triptych_brick_summary *s);
cJSON *brick_limits_to_json(const brick_limits *l, const triptych_brick_summary *s);

#endif
