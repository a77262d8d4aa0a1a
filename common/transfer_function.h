/* Transfer functions: scalar value -> colour and opacity, piecewise linear. A function is built
 * once, is read-only afterwards, and may be shared by threads. Forms: our plain `.tf` text,
 * ParaView colour-map JSON, built-in presets, and one made from a histogram; TRANSFER_FUNCTIONS.md
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

/* Counts of a volume's finite values in equal bins over [value_min, value_max]. */
typedef struct trip_histogram {
    double value_min, value_max;
    uint64_t counts[1024];
    uint64_t total;
} trip_histogram;

/* From a file: `.tf` text or ParaView JSON (told apart by content), "FILE.json#NAME" for one map of
 * several; "preset:NAME"; or the text of a `.tf` itself via trip_tf_parse. All report and return a
 * negative status on failure, TRIP_USAGE for an unknown preset. */
int trip_tf_load(trip_tf **out, const char *path_or_preset);
int trip_tf_parse(trip_tf **out, const char *name, const char *text, size_t bytes);
int trip_tf_from_points(trip_tf **out, const trip_tf_point *points, size_t count, bool normalised,
                        double unit_world);
int trip_tf_from_histogram(trip_tf **out, const trip_histogram *histogram);
/* The same for densities, as of smoke and clouds, where the histogram holds only the voxels in
 * which there is any: for values below zero it is trip_tf_from_histogram(). */
int trip_tf_fog_from_histogram(trip_tf **out, const trip_histogram *histogram);
void trip_tf_destroy(trip_tf *tf);

/* Names of the built-in presets, NULL-terminated. */
const char *const *trip_tf_preset_names(void);

/* True when values are fractions of the data's range rather than in the data's own units. */
bool trip_tf_is_normalised(const trip_tf *tf);
/* Turns a normalised function into data units in place; no effect otherwise. */
void trip_tf_denormalise(trip_tf *tf, double value_min, double value_max);

/* Unit of length in world units; 0 means one voxel. */
double trip_tf_unit_world(const trip_tf *tf);

/* The points that the function is linear between, by ascending value. */
const trip_tf_point *trip_tf_points(const trip_tf *tf, size_t *count);

/* Colour and opacity at a value in data units; outside the points the end points hold. At a
 * repeated value (a step) the later point holds. */
trip_rgba trip_tf_evaluate(const trip_tf *tf, double value);

/* Whether any value of [lo, hi] has opacity > 0. */
bool trip_tf_visible_in(const trip_tf *tf, double lo, double hi);

/* The function as `.tf` text, for keeping in a data set; caller frees. */
char *trip_tf_to_text(const trip_tf *tf);

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

#endif
