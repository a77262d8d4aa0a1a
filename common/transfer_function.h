/* Transfer functions: a scalar value maps to a colour and an opacity, piecewise linear. A function
 * is built once and is read-only afterwards, so threads may share it. Sources are `.tf` text, files
 * of other programs, built-in presets, and histograms. TRANSFER_FUNCTIONS.md describes them all.
 *
 * Opacity is per unit of length: a constant region of opacity o and thickness L units has opacity
 * 1 - (1 - o)^L. The extinction is tau = -ln(1 - o) / unit. The default unit is one voxel, the cube
 * root of the voxel's volume in world space. Opacity 1 (infinite extinction) is clamped to
 * TRIP_OPACITY_MAX. */
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
    double opacity; /* per unit of length, in [0, 1] */
} trip_rgba;

typedef struct trip_tf_point {
    double value;
    trip_rgba colour;
} trip_tf_point;

/* Counts the finite values of a volume in equal bins over [value_min, value_max], its typical
 * range. Values outside are left out. `total` is the sum. */
typedef struct trip_histogram {
    double value_min, value_max;
    uint64_t counts[1024];
    uint64_t total;
    /* The distinct values of a volume of ids, ascending. NULL if they are not known. The caller
     * owns them. */
    const double *ids;
    uint32_t id_count; /* 0 if the values are no ids */
} trip_histogram;

/* Kinds of volumes. Each kind has an automatic transfer function. */
typedef enum trip_tf_kind {
    TRIP_TF_AUTOMATIC, /* not recognised yet */
    TRIP_TF_CT,        /* in Hounsfield units */
    TRIP_TF_MR,
    TRIP_TF_FOG,
    TRIP_TF_LABELS,
    TRIP_TF_SIMULATION, /* and all other data */
    TRIP_TF_KINDS
} trip_tf_kind;

/* Names of the kinds: "auto", "ct", "mr", "fog", "labels", "simulation". trip_tf_kind_from_name()
 * returns TRIP_TF_AUTOMATIC for other texts. */
const char *trip_tf_kind_name(trip_tf_kind kind);
/* Returns a title for people, such as "CT in Hounsfield units". */
const char *trip_tf_kind_title(trip_tf_kind kind);
trip_tf_kind trip_tf_kind_from_name(const char *name);

/* Properties of a volume besides its values. */
typedef struct trip_tf_origin {
    bool sparse;          /* only some voxels exist, and the histogram counts only these */
    bool integers;        /* values are integers */
    bool patient;         /* world space is anatomical */
    const char *modality; /* from DICOM: "CT", "MR", ...; NULL or "" if unknown */
} trip_tf_origin;
trip_tf_kind trip_tf_recognise(const trip_tf_origin *origin, const trip_histogram *histogram);

/* Loads a transfer function. `path_or_preset` may be:
 * - the name of a preset ("bone", "preset:bone"), even if there is a file with this name
 * - a file, recognised by its content: `.tf` text, JSON of ParaView or 3D Slicer, a .vp, or XML
 *   of Slicer, VTK or ParaView
 * - "FILE#NAME" for one of several functions in a file
 * trip_tf_parse() takes `.tf` text. All report a failure and return a negative status, TRIP_USAGE
 * for an unknown preset. */
int trip_tf_load(trip_tf **out, const char *path_or_preset);
int trip_tf_parse(trip_tf **out, const char *name, const char *text, size_t bytes);
int trip_tf_from_points(trip_tf **out, const trip_tf_point *points, size_t count, bool normalised,
                        double unit_world);
int trip_tf_from_histogram(trip_tf **out, const trip_histogram *histogram);
/* Makes a function for densities of smoke or clouds. The histogram counts only voxels that contain
 * some. If there are values below zero, this equals trip_tf_from_histogram(). */
int trip_tf_fog_from_histogram(trip_tf **out, const trip_histogram *histogram);
int trip_tf_ct_from_histogram(trip_tf **out, const trip_histogram *histogram);
int trip_tf_mr_from_histogram(trip_tf **out, const trip_histogram *histogram);
int trip_tf_labels_from_histogram(trip_tf **out, const trip_histogram *histogram);
/* Makes the automatic function of a kind other than TRIP_TF_AUTOMATIC. */
int trip_tf_make_automatic(trip_tf **out, trip_tf_kind kind, const trip_histogram *histogram);
/* Mixes share 1 - t of function `a` and share t of `b`, for t from 0 to 1. Both must be in data
 * units. Colours and opacities are mixed at every value. Fails if the units of opacity differ. */
int trip_tf_mix(trip_tf **out, const trip_tf *a, const trip_tf *b, double t);
void trip_tf_destroy(trip_tf *tf);

/* The built-in presets, counted from 0. The functions return NULL beyond the last. The basis says
 * which units the values have. */
bool trip_tf_is_preset(const char *name);
const char *trip_tf_preset_name(size_t i);
const char *trip_tf_preset_summary(size_t i);
const char *trip_tf_preset_basis(size_t i);

/* Whether trip_tf_adapt() fails without a histogram. */
bool trip_tf_needs_histogram(const trip_tf *tf);
/* Whether a window replaces the range of trip_tf_adapt(). */
bool trip_tf_spans_window(const trip_tf *tf);
/* Whether values are fractions of the data's range. Otherwise they are in data units. */
bool trip_tf_is_normalised(const trip_tf *tf);
/* Converts a normalised function to data units in place. Leaves other functions unchanged. */
void trip_tf_denormalise(trip_tf *tf, double value_min, double value_max);

/* The data that a function is for. */
typedef struct trip_tf_data {
    double value_min, value_max;
    const trip_histogram *histogram; /* NULL if unknown */
    trip_tf_kind kind;               /* the recognised kind */
} trip_tf_data;

/* Whether the function is normalised, or still to be made from a histogram ("auto", "mr", ...). */
bool trip_tf_needs_data(const trip_tf *tf);
/* Converts such a function to data units in place. Fails if it needs a histogram and there is none.
 * `where` names the data in the message. */
int trip_tf_adapt(trip_tf *tf, const trip_tf_data *data, const char *where);
/* Stretches the function over level - width / 2 to level + width / 2, and converts it to data
 * units. Its domain is 0 to 1 if it is normalised, otherwise from its first to its last point. */
int trip_tf_window(trip_tf *tf, double width, double level);
/* Warns if no value in [value_min, value_max] is visible, and if a function in Hounsfield units is
 * used for other values. */
void trip_tf_check_range(const trip_tf *tf, double value_min, double value_max, const char *where);

/* Finds the first peak narrower than a code: a point between two codes with more than twice the
 * opacity of both. A table of the codes does not show it. Returns false if there is none. */
bool trip_tf_lost_peak(const trip_tf *tf, double lo, double hi, trip_tf_point *out);

/* Returns the unit of length in world units; 0 means one voxel. */
double trip_tf_unit_world(const trip_tf *tf);

/* Returns the points of the piecewise linear function, by ascending value. */
const trip_tf_point *trip_tf_points(const trip_tf *tf, size_t *count);

/* Returns the colour and opacity at a value in data units. Outside the points, the end points hold.
 * At a repeated value (a step), the later point holds. */
trip_rgba trip_tf_evaluate(const trip_tf *tf, double value);

/* Whether any value of [lo, hi] has opacity > 0. */
bool trip_tf_visible_in(const trip_tf *tf, double lo, double hi);

/* Finds the lowest and highest value of [lo, hi] with opacity > 0 or with visible values next to
 * it. Returns false if there are none. */
bool trip_tf_visible_span(const trip_tf *tf, double lo, double hi, double span[2]);

/* Returns the function as `.tf` text, to store in a data set. Free it with free(). */
char *trip_tf_to_text(const trip_tf *tf);

/* Formats that functions are written in. */
typedef enum trip_tf_format {
    TRIP_TF_TEXT, /* `.tf` */
    TRIP_TF_PARAVIEW,
    TRIP_TF_VP,
    TRIP_TF_VP_JSON,
    TRIP_TF_SLICER,
    TRIP_TF_VTK,
} trip_tf_format;

/* Writes the function under the name `name` to *text, for free(). Fails for a normalised function
 * if the format has data units only. Warns if the unit of opacity is lost. */
int trip_tf_write(const trip_tf *tf, trip_tf_format format, const char *name, char **text);

/* Returns the extinction per unit of length of an opacity: -ln(1 - min(opacity, TRIP_OPACITY_MAX)).
 */
double trip_extinction(double opacity);

/* One entry per code: r, g, b in [0, 1] and extinction per world unit, as floats. `voxel_world` is
 * the length of one voxel. */
typedef struct trip_tf_entry {
    float r, g, b, extinction;
} trip_tf_entry;
/* Returns the entry of a value in data units. */
trip_tf_entry trip_tf_entry_at(const trip_tf *tf, double value, double voxel_world);
/* Fills a table for even codes. Code c, 0 to 65535, stands for value lo + (hi - lo) * c / 65535. */
void trip_tf_fill_table(const trip_tf *tf, double lo, double hi, double voxel_world,
                        trip_tf_entry table[65536]);

#ifdef __cplusplus
}
#endif

#endif
