/* What `brick` wrote about a data set, for drawing it: the JSON text in its index. A key that is
 * missing or of another kind is taken as not given, so that data sets made by other programs draw.
 *
 *   "format"             "openvdb", "nrrd", ... : where the volume came from
 *   "space"              "LPS" or "RAS": how world space lies in the patient (anatomy.h)
 *   "oriented"           true: the file gave the directions of its axes, so none are guessed
 *   "mirror"             "x", "y", "z": what was kept is mirror-symmetric across this axis of the
 *                        grid alone, in volumes whose files do not say how they lie
 *   "footing"            "-x" ... "+z": it is level at this side of the grid alone, in the same
 *   "source", "source_options"  the file it was made of, and the options of `brick` that make it
 *                        again, but for those of what is kept
 *   "note"               what was chosen where the file leaves a choice, for people
 *   "function_kind"      "ct", "mr", "fog", "labels", "simulation": what the volume is
 *   "up", "front"        "+x" ... "-z": the world direction that is up, whatever else is said, and
 *                        that the object faces
 *   "transfer_function"  a function as `.tf` text, in data units: drawn when none is given
 *   "envelope"           [[lo, hi], ...]: the values that were kept, closed intervals
 *   "histogram"          { "value_min": a, "value_max": b, "counts": [...] }: of all finite values,
 *                        kept or not, in at most 65536 equal bins over [a, b] */
#ifndef TRIP_DATASET_METADATA_H
#define TRIP_DATASET_METADATA_H

#include "dataset.h"
#include "framing.h"
#include "transfer_function.h"

typedef struct trip_dataset_metadata trip_dataset_metadata;

/* Fails when the text is not a JSON object, or takes more memory than the data set's budget has.
 * The time that this and what follows take is in proportion to the length of the text. */
int trip_dataset_metadata_parse(trip_dataset_metadata **out, const trip_dataset *d);
void trip_dataset_metadata_destroy(trip_dataset_metadata *t);

/* Of what it was made: a file's name without its folder, and the options of `brick` that make it
 * again, from 0 on; NULL where the text does not say, or beyond the last. */
const char *trip_dataset_metadata_source(const trip_dataset_metadata *t);
const char *trip_dataset_metadata_source_option(const trip_dataset_metadata *t, int i);

/* What was chosen for the user where the file left a choice; NULL: nothing. */
const char *trip_dataset_metadata_note(const trip_dataset_metadata *t);

/* What the volume is; TRIP_TF_SIMULATION where the text does not say. */
trip_tf_kind trip_dataset_metadata_kind(const trip_dataset_metadata *t);

/* Turns a function that is relative to the data, or made from its histogram, into data units. */
int trip_dataset_metadata_adapt(const trip_dataset_metadata *t, const trip_dataset *d, trip_tf *tf);

/* The stored function; without one, a grey ramp over the values, faint as fog. */
int trip_dataset_metadata_tf(const trip_dataset_metadata *t, const trip_dataset *d, trip_tf **out);

/* False, and nothing counted, where the text holds none. */
bool trip_dataset_metadata_histogram(const trip_dataset_metadata *t, trip_histogram *out);

/* How many voxels hold values that `tf` shows but that were left out when the data set was made,
 * and the range of those values. An estimate from the histogram (bins count in proportion); 0 when
 * the text does not say. */
double trip_dataset_metadata_culled(const trip_dataset_metadata *t, const trip_tf *tf,
                                    double range[2]);

/* Adds what the data set says to what the default view is to have: bounds of the splats, up,
 * front. The bounds do not depend on how the data set is divided into tiles. */
void trip_dataset_metadata_frame(const trip_dataset_metadata *t, const trip_dataset *d,
                                 trip_camera_framing *framing);

#endif
