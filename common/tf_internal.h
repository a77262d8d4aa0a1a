/* The representation of a transfer function and the parts of its construction. Only the tf_*.c
 * files, transfer_function.c, tests and fuzzers include this. */
#ifndef TRIP_TF_INTERNAL_H
#define TRIP_TF_INTERNAL_H

#include "transfer_function.h"

enum {
    TRIP_TF_MAX_POINTS = 65536,
    TRIP_TF_MAX_FILE_BYTES = 8 << 20,
};

/* The stage in messages. */
#define TRIP_TF_STAGE "transfer function"

struct trip_tf {
    trip_tf_point *points; /* values never decrease; equal ones are a step */
    size_t count;          /* at least 1 */
    bool normalised;
    double unit_world; /* 0: one voxel */
    bool hounsfield;   /* a preset in Hounsfield units */
    bool made;         /* the points are yet to be made from a histogram, ... */
    trip_tf_kind as;   /* ... as for this kind */
};

/* Why a point is not valid in a function, or NULL. `before` is the point before it, or NULL. */
const char *trip_tf_point_fault(const trip_tf_point *point, const trip_tf_point *before,
                                bool normalised);

/* The colour and opacity just below `value`: differs from trip_tf_evaluate() at a step. */
trip_rgba trip_tf_evaluate_below(const trip_tf *tf, double value);

/* A built-in preset; reports an unknown name. */
int trip_tf_from_preset(trip_tf **out, const char *name);
/* The preset of which `name` may be a misspelling, or NULL. */
const char *trip_tf_nearest_preset(const char *name);

/* The function of a kind, whose points trip_tf_adapt() makes. */
int trip_tf_from_kind(trip_tf **out, trip_tf_kind kind);

/* A ParaView colour map, or an array of them of which `preset` names one (NULL: the first), or the
 * JSON that Slicer keeps volume properties in. */
int trip_tf_parse_colormap(trip_tf **out, const char *name, const char *text, size_t bytes,
                           const char *preset);

/* For a volume of one value: fog that transmits about a third of what is behind it. */
int trip_tf_even_fog(trip_tf **out, const trip_histogram *histogram);

/* The tissue above a background of the lowest values. */
typedef struct trip_tf_tissue {
    double valley;       /* the rarest value between the background and the tissue */
    double middle, high; /* half, and 98 % of the tissue lie below */
    double fraction;     /* of all voxels that is above the valley */
    double sharpest;     /* fraction of the tissue in the most frequent thirtieth of its values */
} trip_tf_tissue;
/* False where there is no valley. */
bool trip_tf_find_tissue(trip_tf_tissue *out, const trip_histogram *histogram);

/* A preset of Slicer's, a volume property of VTK's, or a colour map of an older ParaView. */
int trip_tf_parse_xml(trip_tf **out, const char *name, const char *text, size_t bytes,
                      const char *preset);
/* A volume property of Slicer's, as text. */
int trip_tf_parse_vp(trip_tf **out, const char *name, const char *text, size_t bytes);
/* Any of these or a `.tf`, distinguished by the content. */
int trip_tf_parse_any(trip_tf **out, const char *name, const char *text, size_t bytes,
                      const char *preset);

#endif
