/* What `brick` reads: the opened volume with the memory and threads to work on it, and which of its
 * values are kept. One thread. */
#ifndef TRIP_BRICK_INPUT_H
#define TRIP_BRICK_INPUT_H

#include "brick.h"
#include "envelope.h"
#include "piece.h"
#include "scan.h"

/* Zeroed before it is opened. */
typedef struct trip_brick_input {
    const trip_brick_params *params;
    trip_budget *budget;
    trip_workers *workers;
    trip_volume *volume;
    const trip_volume_info *info;
    uint64_t grid_voxels;  /* of the dims: what progress counts */
    uint64_t memory_bytes; /* left once the input was opened */
    trip_tf **functions;   /* params->function_count of them */
    bool scanned;          /* the tally is of a pass over the volume before */
    trip_tally *tally;
    trip_histogram histogram;
    trip_envelope envelope;
} trip_brick_input;

/* The format of pieces that the parameters ask for, not quantised yet. */
trip_piece_format trip_brick_format(const trip_brick_params *p);

/* Opens the volume and loads the transfer functions. */
int trip_brick_input_open(trip_brick_input *in, const trip_brick_params *params);
/* Also after a failure to open. */
void trip_brick_input_close(trip_brick_input *in);

/* 8 and 16 bit integers: codes stand for all values of the type, without a look at the data. */
bool trip_brick_has_narrow_type(const trip_brick_input *in);
/* Of a code: 1 where all values of the type are 8-bit codes exactly, else 2. */
unsigned trip_brick_code_bytes(const trip_brick_input *in);
/* Of a normal, once it is known whether the volume is scanned; 0 without. */
unsigned trip_brick_normal_bytes(const trip_brick_input *in);
/* What all codes stand for where the type is narrow. */
void trip_brick_type_range(const trip_volume_info *info, double *lo, double *hi);
/* Whether a pass over the volume has to go first: the envelope is automatic, a function depends on
 * the values, or compact normals on their range. */
bool trip_brick_input_needs_scan(const trip_brick_input *in);
/* Whether the range of the codes is known before pieces are made: that of the type, or what the
 * scan will find. */
bool trip_brick_will_be_quantised(const trip_brick_input *in);
/* Fills the tally with `known`, and makes the functions that depend on the data. */
int trip_brick_input_set_tally(trip_brick_input *in, const trip_tally *known);
/* Fills the tally from the volume, as slices, stride and passing_seconds of `scan` say. */
int trip_brick_input_scan(trip_brick_input *in, trip_scan_params scan);
int trip_brick_input_make_envelope(trip_brick_input *in);

void trip_brick_input_progress(const trip_brick_input *in, const char *stage, uint64_t done,
                               uint64_t total);

#endif
