/* The representation of a transfer function, and the steps of its construction. Only the tf_*.c
 * files, transfer_function.c, tests and fuzzers include this header. */
#ifndef TRIP_TF_INTERNAL_H
#define TRIP_TF_INTERNAL_H

#include "transfer_function.h"

enum {
    TRIP_TF_MAX_POINTS = 65536,
    TRIP_TF_MAX_FILE_BYTES = 8 << 20,
};

/* stage of all messages about transfer functions */
#define TRIP_TF_STAGE "transfer function"

struct trip_tf {
    trip_tf_point *points; /* values never decrease; two points of one value form a step */
    size_t count;          /* at least 1 */
    bool normalised;
    double unit_world; /* 0 means one voxel */
    bool hounsfield;   /* preset in Hounsfield units */
    bool ramp; /* colours without opacities; trip_tf_adapt() starts the ramp above background */
    bool made; /* points are still to be made from a histogram */
    trip_tf_kind as; /* kind of data to make them for */
};

/* Returns why a point is invalid, or NULL. `before` is the previous point, or NULL. */
const char *trip_tf_point_fault(const trip_tf_point *point, const trip_tf_point *before,
                                bool normalised);

/* Returns the colour and opacity just below `value`. At a step this differs from
 * trip_tf_evaluate(). */
trip_rgba trip_tf_evaluate_below(const trip_tf *tf, double value);

/* Makes a built-in preset. An unknown name is a reported failure. */
int trip_tf_from_preset(trip_tf **out, const char *name);
/* Returns the preset that `name` may be a misspelling of, or NULL. */
const char *trip_tf_nearest_preset(const char *name);

/* Makes the function of a kind. trip_tf_adapt() adds its points. */
int trip_tf_from_kind(trip_tf **out, trip_tf_kind kind);

/* Parses a ParaView colour map, an array of them, or the JSON of Slicer's volume properties.
 * `preset` names one of an array; NULL selects the first. */
int trip_tf_parse_colormap(trip_tf **out, const char *name, const char *text, size_t bytes,
                           const char *preset);

/* Finds the interval of values beside the background, from the background's edge to the extreme on
 * its other side. lo > hi if the background is bright. Returns false if all values are alike. */
bool trip_tf_find_foreground(const trip_histogram *histogram, double *edge, double *extreme);

/* Makes fog for a volume of one value. It transmits about a third of the light behind it. */
int trip_tf_even_fog(trip_tf **out, const trip_histogram *histogram);

/* The tissue in a histogram, above a background of the lowest values. */
typedef struct trip_tf_tissue {
    double valley;       /* rarest value between background and tissue */
    double middle, high; /* half and 98 % of the tissue lie below these values */
    double fraction;     /* fraction of all voxels above the valley */
    double sharpest;     /* fraction of the tissue in the most frequent thirtieth of its range */
} trip_tf_tissue;
/* Finds the tissue. Returns false if there is no valley. */
bool trip_tf_find_tissue(trip_tf_tissue *out, const trip_histogram *histogram);

/* Parses a preset of Slicer, a volume property of VTK, or a colour map of an older ParaView. */
int trip_tf_parse_xml(trip_tf **out, const char *name, const char *text, size_t bytes,
                      const char *preset);
/* Parses a volume property of Slicer in text form. */
int trip_tf_parse_vp(trip_tf **out, const char *name, const char *text, size_t bytes);
/* Parses a `.tf` or another format. Recognises the format by the content. */
int trip_tf_parse_any(trip_tf **out, const char *name, const char *text, size_t bytes,
                      const char *preset);

#endif
