/* The stages of `triptych brick` beside what bounds them: a plain direct read of the input and a
 * plain write of as many bytes as the data set has, on the same disks, right after the run. */
#ifndef TRIP_CLI_BRICK_LIMITS_H
#define TRIP_CLI_BRICK_LIMITS_H

#include <cjson/cJSON.h>

#include "plain_disk.h"
#include "triptych_brick.h"

typedef struct brick_limits {
    plain_disk read;  /* no bytes where the input is not one file that holds the values */
    plain_disk write; /* of the data set's bytes, or, of a large one, a part: seconds for all */
} brick_limits;

double brick_seconds(const triptych_brick_summary *s);

int brick_limits_measure(brick_limits *l, const char *volume, const char *data_set,
                         const triptych_brick_summary *s);
void brick_limits_print(const brick_limits *l, const triptych_brick_summary *s);
cJSON *brick_limits_to_json(const brick_limits *l, const triptych_brick_summary *s);

#endif
