/* Reads the metadata that `brick` wrote: the JSON text in the index of a data set. A key that is
 * missing or has the wrong type counts as not given, so that data sets of other programs draw. One
 * thread at a time. The keys are:
 *
 *   "format"             "openvdb", "nrrd", ...: the format of the volume
 *   "space"              "RAS": the anatomical directions of world space (anatomy.h)
 *   "oriented"           true if the file gave the directions of its axes: nothing is guessed
 *   "mirror"             "x", "y" or "z": the only axis of the grid across which the kept voxels
 *                        are mirror-symmetric; for volumes without orientation
 *   "footing"            "-x" ... "+z": the only side of the grid at which the kept voxels are
 *                        level; for volumes without orientation
 *   "source"             the volume's file; absent for a volume from memory
 *   "source_path"        its path relative to the data set's folder, if it does not lie in it
 *   "source_options"     the options of `brick` that make the data set again, without the options
 *                        for kept values
 *   "note"               a choice that the file left open, for people
 *   "function_kind"      "ct", "mr", "fog", "labels" or "simulation": the kind of volume
 *   "up"                 "+x" ... "-z": the world direction that is up, overriding all else
 *   "front"              "+x" ... "-z": the world direction that the object faces
 *   "transfer_function"  the default transfer function as `.tf` text in data units
 *   "envelope"           [[lo, hi], ...]: the kept values, closed intervals
 *   "histogram"          { "value_min": a, "value_max": b, "counts": [...] }: finite values in [a,
 *                        b], kept or not, in at most 65536 equal bins
 *   "fills"              [value, ...]: values that were taken for "no value", given to
 *                        `brick` or found by it */
#ifndef TRIP_DATASET_METADATA_H
#define TRIP_DATASET_METADATA_H

#include "dataset.h"
#include "transfer_function.h"

typedef struct trip_dataset_metadata trip_dataset_metadata;

/* Parses the metadata. Fails if the text is not a JSON object or exceeds the data set's budget.
 * Like all functions below, it takes a time linear in the length of the text. */
int trip_dataset_metadata_parse(trip_dataset_metadata **out, const trip_dataset *d);
void trip_dataset_metadata_destroy(trip_dataset_metadata *t);

/* Return the source file's name without its folder, and option number i of `brick` that makes the
 * data set again. They return NULL if the text has none, or beyond the last option. */
const char *trip_dataset_metadata_source(const trip_dataset_metadata *t);
/* Returns the source's path relative to the data set's folder, or NULL if the text has none. */
const char *trip_dataset_metadata_source_path(const trip_dataset_metadata *t);
const char *trip_dataset_metadata_source_option(const trip_dataset_metadata *t, int i);

/* Returns the kind of the volume, or TRIP_TF_SIMULATION if the text has none. */
trip_tf_kind trip_dataset_metadata_kind(const trip_dataset_metadata *t);

/* Converts a transfer function that is relative to the data or its histogram to data units. `where`
 * names the data in messages. */
int trip_dataset_metadata_adapt(const trip_dataset_metadata *t, const trip_dataset *d, trip_tf *tf,
                                const char *where);

/* Loads the stored transfer function, or else a faint grey ramp over the values. */
int trip_dataset_metadata_tf(const trip_dataset_metadata *t, const trip_dataset *d, trip_tf **out);

/* Reads the histogram. Returns false, with a count of 0, if the text has none. */
bool trip_dataset_metadata_histogram(const trip_dataset_metadata *t, trip_histogram *out);

/* Returns whether the data set keeps all values from `lo` to `hi`. False without an envelope. */
bool trip_dataset_metadata_keeps(const trip_dataset_metadata *t, double lo, double hi);

/* Estimates from the histogram how many dropped voxels `tf` shows, and the range of their values. A
 * bin that is shown in part counts in proportion. Returns 0 if the text lacks a histogram or
 * envelope. */
double trip_dataset_metadata_culled(const trip_dataset_metadata *t, const trip_tf *tf,
                                    double range[2]);

/* Sets the world directions that are up and front. The sources in order are the text, the patient's
 * position, the format's custom, and a guess, which preprocess/brick_metadata.c notes. Zero means
 * the default of a view. */
void trip_dataset_metadata_orient(const trip_dataset_metadata *t, const trip_dataset *d,
                                  trip_vec3 *up, trip_vec3 *front);

/* Writes the values of "fills", at most `max`, and returns their number. */
size_t trip_dataset_metadata_fills(const trip_dataset_metadata *t, double *values, size_t max);

#endif
