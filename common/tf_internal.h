/* What the tf_*.c files share with transfer_function.c: the representation and the parts a
 * function is built by. Nobody else includes this, but for tests and fuzzers. */
#ifndef TRIP_TF_INTERNAL_H
#define TRIP_TF_INTERNAL_H

#include "transfer_function.h"

enum {
    TRIP_TF_MAX_POINTS = 65536,
    TRIP_TF_MAX_FILE_BYTES = 8 << 20,
};

/* The stage that errors name. */
#define TRIP_TF_STAGE "transfer function"

struct trip_tf {
    trip_tf_point *points; /* values never decrease; equal ones are a step */
    size_t count;          /* at least 1 */
    bool normalised;
    double unit_world; /* 0: one voxel */
};

/* Why a point cannot stand in a function, or NULL. `before` is the point before it, or NULL. */
const char *trip_tf_point_fault(const trip_tf_point *point, const trip_tf_point *before,
                                bool normalised);

/* The colour and opacity just below `value`: differs from trip_tf_evaluate() at a step. */
trip_rgba trip_tf_evaluate_below(const trip_tf *tf, double value);

/* A built-in preset; reports an unknown name. */
int trip_tf_from_preset(trip_tf **out, const char *name);

/* A ParaView colour map, or an array of them of which `preset` names one (NULL: the first). */
int trip_tf_parse_colormap(trip_tf **out, const char *name, const char *text, size_t bytes,
                           const char *preset);

#endif
