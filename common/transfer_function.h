/* Transfer functions: scalar value -> colour and opacity, piecewise linear. A function is built
 * once, is read-only afterwards, and may be shared by threads. Forms: our plain `.tf` text, the
 * files of other programs, built-in presets, and those made from a histogram; TRANSFER_FUNCTIONS.md
 * describes them all.
 *
 * Opacity is per unit length: a constant region of opacity o and thickness L units has opacity
 * 1 - (1 - o)^L. So extinction is tau = -ln(1 - o) / unit. One voxel is the default unit, that is
 * the cube root of the voxel's volume in world space. Opacity 1 (infinite extinction) is clamped
 * to TRIP_OPACITY_MAX. */
#ifndef TRIP_TRANSFER_FUNCTION_H
#define TRIP_TRANSFER_FUNCTION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define TRIP_OPACITY_MAX 0.9999

typedef struct trip_tf trip_tf;

typedef struct trip_rgba {
    double r, g, b; /* display values in [0, 1], not premultiplied */
    double opacity; /* per unit length, in [0, 1] */
} trip_rgba;

typedef struct trip_tf_point {
    double value;
    trip_rgba colour;
} trip_tf_point;

/* Counts of a volume's finite values in equal bins over [value_min, value_max]; `total` is their
 * sum. */
typedef struct trip_histogram {
    double value_min, value_max;
    uint64_t counts[1024];
    uint64_t total;
} trip_histogram;

/* The kinds of volumes, each of which has an automatic function of its own. */
typedef enum trip_tf_kind {
    TRIP_TF_AUTOMATIC, /* not recognised yet */
    TRIP_TF_CT,        /* in Hounsfield units */
    TRIP_TF_MR,
    TRIP_TF_FOG,
    TRIP_TF_LABELS,
    TRIP_TF_SIMULATION, /* and all else */
    TRIP_TF_KINDS
} trip_tf_kind;

/* "auto", "ct", "mr", "fog", "labels", "simulation"; of a text that is none of them
 * TRIP_TF_AUTOMATIC. */
const char *trip_tf_kind_name(trip_tf_kind kind);
/* The same for people: "CT in Hounsfield units", ... */
const char *trip_tf_kind_title(trip_tf_kind kind);
trip_tf_kind trip_tf_kind_from_name(const char *name);

/* Properties of a volume besides its values. */
typedef struct trip_tf_origin {
    bool sparse;          /* only some voxels exist, and the histogram holds those */
    bool integers;        /* values are whole numbers */
    bool patient;         /* world space is anatomical */
    const char *modality; /* of DICOM: "CT", "MR", ...; NULL or "": not known */
} trip_tf_origin;
trip_tf_kind trip_tf_recognise(const trip_tf_origin *origin, const trip_histogram *histogram);

/* A preset's name ("bone", "preset:bone"), or a file, distinguished by its content: `.tf` text,
 * JSON of ParaView or 3D Slicer, a .vp, XML of Slicer, VTK or ParaView; "FILE#NAME" for one of
 * several. A name without a slash or a dot that is a preset's is the preset. All report and return
 * a negative status on failure, TRIP_USAGE for an unknown preset. trip_tf_parse() takes `.tf` text
 * itself. */
int trip_tf_load(trip_tf **out, const char *path_or_preset);
int trip_tf_parse(trip_tf **out, const char *name, const char *text, size_t bytes);
int trip_tf_from_points(trip_tf **out, const trip_tf_point *points, size_t count, bool normalised,
                        double unit_world);
int trip_tf_from_histogram(trip_tf **out, const trip_histogram *histogram);
/* The same for densities, as of smoke and clouds, where the histogram holds only the voxels in
 * which there is any: for values below zero it is trip_tf_from_histogram(). */
int trip_tf_fog_from_histogram(trip_tf **out, const trip_histogram *histogram);
int trip_tf_ct_from_histogram(trip_tf **out, const trip_histogram *histogram);
int trip_tf_mr_from_histogram(trip_tf **out, const trip_histogram *histogram);
int trip_tf_labels_from_histogram(trip_tf **out, const trip_histogram *histogram);
/* The one of these for a kind other than TRIP_TF_AUTOMATIC. */
int trip_tf_make_automatic(trip_tf **out, trip_tf_kind kind, const trip_histogram *histogram);
/* Share 1 - t of the function `a` and share t of `b`, both in data units, t from 0 to 1: colours
 * and opacities mixed at every value. Refuses functions of different units of opacity. */
int trip_tf_mix(trip_tf **out, const trip_tf *a, const trip_tf *b, double t);
void trip_tf_destroy(trip_tf *tf);

/* The built-in presets, by number from 0; NULL beyond the last. The basis is what the values are
 * relative to. */
bool trip_tf_is_preset(const char *name);
const char *trip_tf_preset_name(size_t i);
const char *trip_tf_preset_summary(size_t i);
const char *trip_tf_preset_basis(size_t i);

/* True when values are fractions of the data's range rather than in the data's own units. */
bool trip_tf_is_normalised(const trip_tf *tf);
/* Turns a normalised function into data units in place; no effect otherwise. */
void trip_tf_denormalise(trip_tf *tf, double value_min, double value_max);

/* The data that a function is for. */
typedef struct trip_tf_data {
    double value_min, value_max;
    const trip_histogram *histogram; /* NULL: not known */
    trip_tf_kind kind;               /* what the data was recognised as */
} trip_tf_data;

/* Whether the function is normalised, or to be made from a histogram ("auto", "mr", ...). */
bool trip_tf_needs_data(const trip_tf *tf);
/* Turns such a function into data units in place. Fails where a histogram is needed and not known;
 * `where` is for the message. */
int trip_tf_adapt(trip_tf *tf, const trip_tf_data *data, const char *where);
/* Stretches the function, in data units from then on, so that its domain (0 to 1 where it is
 * normalised, else its first to its last point) spans level - width / 2 to level + width / 2. */
int trip_tf_window(trip_tf *tf, double width, double level);
/* Warns where nothing in [value_min, value_max] shows, and where a function in Hounsfield units is
 * used on values that are not. */
void trip_tf_check_range(const trip_tf *tf, double value_min, double value_max, const char *where);

/* The first point that shows between two codes of a data set and less than half as much at both, so
 * that a table of the codes (below) does not show it: a peak narrower than a code. False where
 * there is none. */
bool trip_tf_lost_peak(const trip_tf *tf, double lo, double hi, trip_tf_point *out);

/* Unit of length in world units; 0 means one voxel. */
double trip_tf_unit_world(const trip_tf *tf);

/* The points that the function is linear between, by ascending value. */
const trip_tf_point *trip_tf_points(const trip_tf *tf, size_t *count);

/* Colour and opacity at a value in data units; outside the points the end points hold. At a
 * repeated value (a step) the later point holds. */
trip_rgba trip_tf_evaluate(const trip_tf *tf, double value);

/* Whether any value of [lo, hi] has opacity > 0. */
bool trip_tf_visible_in(const trip_tf *tf, double lo, double hi);

/* The lowest and highest values of [lo, hi] that have opacity > 0, or are next to such; false where
 * there is none. */
bool trip_tf_visible_span(const trip_tf *tf, double lo, double hi, double span[2]);

/* The function as `.tf` text, for keeping in a data set; caller frees. */
char *trip_tf_to_text(const trip_tf *tf);

/* The forms that functions are written in. */
typedef enum trip_tf_format {
    TRIP_TF_TEXT, /* `.tf` */
    TRIP_TF_PARAVIEW,
    TRIP_TF_VP,
    TRIP_TF_VP_JSON,
    TRIP_TF_SLICER,
    TRIP_TF_VTK,
} trip_tf_format;

/* *text, for free(), becomes the function, with the name `name`. Refuses a normalised function in a
 * form that has data units only; warns where the unit of opacity is lost. */
int trip_tf_write(const trip_tf *tf, trip_tf_format format, const char *name, char **text);

/* Extinction per unit length of an opacity: -ln(1 - min(opacity, TRIP_OPACITY_MAX)). */
double trip_extinction(double opacity);

/* The function sampled at the 65536 codes of a data set, value(c) = lo + (hi - lo) * c / 65535:
 * r, g, b in [0, 1] and extinction per *world* unit, as floats. `voxel_world` is the length that
 * stands for one voxel. */
typedef struct trip_tf_entry {
    float r, g, b, extinction;
} trip_tf_entry;
void trip_tf_fill_table(const trip_tf *tf, double lo, double hi, double voxel_world,
                        trip_tf_entry table[65536]);

#ifdef __cplusplus
}
#endif

#endif
