/* The input of `brick`: the open volume, the budget, the workers, and the opacity envelope. One
 * thread. */
#ifndef TRIP_BRICK_INPUT_H
#define TRIP_BRICK_INPUT_H

#include "coordinates.h"
#include "brick_params.h"
#include "envelope.h"
#include "piece.h"
#include "scan.h"

/* Zero-initialise it before opening. */
typedef struct trip_brick_input {
    const trip_brick_params *params;
    trip_budget *budget;
    trip_workers *workers;
    trip_volume *volume;
    const trip_volume_info *info;
    uint64_t grid_voxels;  /* product of the dims, the unit of progress */
    trip_region region;    /* params->region, with open ends set to the grid's */
    uint64_t memory_bytes; /* bytes of the budget left after opening the input */
    trip_tf **functions;   /* params->function_count transfer functions */
    bool scanned;          /* the volume was scanned, and the tally is complete */
    trip_tally *tally;
    trip_histogram histogram;
    trip_envelope envelope; /* of values */
    trip_envelope ranks;    /* the same of ranks, for a volume of ids */
    trip_ids ids;
    /* Fill values that nobody declared, and the number of finite values with them. May be set
     * before opening. */
    trip_fills fills;
    uint64_t finite_before;
} trip_brick_input;

trip_coordinates trip_brick_coordinates(const trip_brick_input *in);
/* Returns params->levels, or -1 (no coarse levels) for a grid with uneven spacing. */
int trip_brick_levels(const trip_brick_input *in);

/* Returns the format of pieces, without `quantised`. */
trip_piece_format trip_brick_format(const trip_brick_params *p);

/* Opens the volume and loads the transfer functions. */
int trip_brick_input_open(trip_brick_input *in, const trip_brick_params *params);
/* Closes the input, also after a failure to open. */
void trip_brick_input_close(trip_brick_input *in);

/* Returns whether values are integers of 8 or 16 bits, so that codes cover the type's range. */
bool trip_brick_has_narrow_type(const trip_brick_input *in);
/* Returns the bytes of a code; by default 1 if 8-bit codes keep all values of the type exactly. */
unsigned trip_brick_code_bytes(const trip_brick_input *in);
/* Returns whether values are rounded to 8-bit codes over the range of the values. */
bool trip_brick_rounds_codes(const trip_brick_input *in);
/* Returns the bytes of a normal, or 0 without normals. Call it after the scan, if there is one. */
unsigned trip_brick_normal_bytes(const trip_brick_input *in);
/* Whether the data set stores normals. */
bool trip_brick_stores_normals(const trip_brick_params *p);
/* Returns the envelope of the numbers that decoding gives: values, or ranks of ids. */
static inline const trip_envelope *trip_brick_envelope(const trip_brick_input *in)
{
    return in->ids.count && !in->ids.numbered ? &in->ranks : &in->envelope;
}
/* Looks for fill values that nobody declared, in the tally of the whole volume. Returns the number
 * of new ones, or a negative status. If there are some, the volume must be read again. */
int trip_brick_input_find_fills(trip_brick_input *in, const trip_tally *t);
void trip_brick_input_set_fills(trip_brick_input *in, const trip_fills *fills,
                                uint64_t finite_before);
/* Adds a note about fill values that nobody declared. The tally must be complete. */
void trip_brick_input_tell_fills(trip_brick_input *in);
/* Returns whether distinct integers may be merged by floats or even codes. */
bool trip_brick_input_may_have_ids(const trip_brick_input *in);
/* Finds the typical range of the input's tally, and makes the histogram. */
int trip_brick_input_finish_tally(trip_brick_input *in);
/* Returns the gradient magnitude of full shading, for the range [lo, hi] of the values or, if
 * unknown, of the codes. */
double trip_brick_gradient_full(const trip_brick_input *in, double lo, double hi);
/* Computes the steps of 3-byte normals. Returns whether all gradients below `full` are exact. */
bool trip_brick_choose_compact(const trip_brick_input *in, double full, double step[3]);
/* Returns the values of the lowest and highest code for types of 8 or 16 bits. */
void trip_brick_type_range(const trip_volume_info *info, double *lo, double *hi);
/* Returns whether the volume must be scanned first. It must if the envelope is automatic, a
 * transfer function depends on the values, normals depend on their range, or integers may be ids.
 */
bool trip_brick_input_needs_scan(const trip_brick_input *in);
/* Returns whether the range of codes is known before pieces are made, from the type or the scan. */
bool trip_brick_will_be_quantised(const trip_brick_input *in);
/* Sets the tally to `known` and adapts the transfer functions that depend on the data. */
int trip_brick_input_set_tally(trip_brick_input *in, const trip_tally *known);
/* Scans the volume with the slices, read_ahead, stride and skip_seconds of `scan`. */
int trip_brick_input_scan(trip_brick_input *in, trip_scan_params scan);
int trip_brick_input_make_envelope(trip_brick_input *in);

void trip_brick_input_progress(const trip_brick_input *in, const char *stage, uint64_t done,
                               uint64_t total);

#endif
