/* The input of `brick`: the opened volume, the budget and the workers to process it with, and the
 * envelope, which says what is kept of it. One thread. */
#ifndef TRIP_BRICK_INPUT_H
#define TRIP_BRICK_INPUT_H

#include "coordinates.h"
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
    uint64_t grid_voxels;  /* product of the dims, in which progress is counted */
    trip_region region;    /* params->region, its ends those of the grid where they were open */
    uint64_t memory_bytes; /* left once the input was opened */
    trip_tf **functions;   /* params->function_count of them */
    bool scanned;          /* the tally is complete: the volume was scanned */
    trip_tally *tally;
    trip_histogram histogram;
    trip_envelope envelope;
} trip_brick_input;

trip_coordinates trip_brick_coordinates(const trip_brick_input *in);
/* The parameter of that name, but that grids with uneven spacing have no coarse levels. */
int trip_brick_levels(const trip_brick_input *in);

/* The format of pieces for these parameters, with `quantised` not set yet. */
trip_piece_format trip_brick_format(const trip_brick_params *p);

/* Opens the volume and loads the transfer functions. */
int trip_brick_input_open(trip_brick_input *in, const trip_brick_params *params);
/* May also be called after a failure to open. */
void trip_brick_input_close(trip_brick_input *in);

/* Whether values are integers of 8 or 16 bits, so that codes cover the whole range of the type. */
bool trip_brick_has_narrow_type(const trip_brick_input *in);
/* Bytes of a code: by default 1 where 8-bit codes represent all values of the type exactly. */
unsigned trip_brick_code_bytes(const trip_brick_input *in);
/* Whether values are rounded to codes of a byte, which then cover the range of the values. */
bool trip_brick_rounds_codes(const trip_brick_input *in);
/* Bytes of a normal, 0 without normals; after the scan, if there is one. */
unsigned trip_brick_normal_bytes(const trip_brick_input *in);
/* The magnitude from which on shading is full, for the range of the values or, where that is
 * unknown, of the codes, [lo, hi]. */
double trip_brick_gradient_full(const trip_brick_input *in, double lo, double hi);
/* Steps of normals of 3 bytes; whether all gradients below `full` are kept exactly. */
bool trip_brick_choose_compact(const trip_brick_input *in, double full, double step[3]);
/* The values of the lowest and the highest code, for types of 8 or 16 bits. */
void trip_brick_type_range(const trip_volume_info *info, double *lo, double *hi);
/* Whether the volume has to be scanned first: because the envelope is automatic, a function depends
 * on the values, or normals depend on their range. */
bool trip_brick_input_needs_scan(const trip_brick_input *in);
/* Whether the range of the codes is known before pieces are made, from the type or the scan. */
bool trip_brick_will_be_quantised(const trip_brick_input *in);
/* Takes `known` as the tally and adapts the functions that depend on the data. */
int trip_brick_input_set_tally(trip_brick_input *in, const trip_tally *known);
/* Scans the volume; the slices, read_ahead, stride and skip_seconds of `scan` are used. */
int trip_brick_input_scan(trip_brick_input *in, trip_scan_params scan);
int trip_brick_input_make_envelope(trip_brick_input *in);

void trip_brick_input_progress(const trip_brick_input *in, const char *stage, uint64_t done,
                               uint64_t total);

#endif
