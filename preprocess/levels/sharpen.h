/* Computes the values of a coarse level that its lists store. Ids stay as they are. Otherwise,
 * linear interpolation of means is smoother than the original values. Over the cube of a voxel the
 * difference is an eighth of the second differences along each axis. Each value is therefore moved
 * the other way:
 *
 *   value + the sum over the six neighbours of (value - neighbour) / TRIP_SHARPEN_PART
 *
 * A missing neighbour counts as equal. The result is clamped to the range of codes, which is wider
 * than the range of values (brick_codes.h). Voxels that cover no known value (level_halo.h) are
 * never moved towards visible values.
 *
 * Interpolation already shows a part of the variance. Along an axis, from the centre of the cube to
 * its face, it goes half-way from the mean m to the mean m' of the neighbour. Over these six ways
 * the mean square of the way from m adds up to
 *
 *   the sum over the six neighbours of (m - m')^2 / 24
 *
 * At level n the 2^n voxels along an axis have 1 - 4^-n of it. This part is taken off the variance.
 *
 * The voxels come from a file of trip_level_file_append(), square by square. They are taken in
 * columns: the squares at one position in a few consecutive sheets. The records of a column are
 * then contiguous in every list. Memory holds the positions of squares in these sheets and in the
 * sheets before and after them. Each lane also holds a few squares.
 *
 * One thread opens and closes a trip_sharpen. Threads take columns one at a time, and sharpen them
 * in parallel, each in its own lane. */
#ifndef TRIP_SHARPEN_H
#define TRIP_SHARPEN_H

#include "coarse.h"
#include "level_positions.h"

/* 8 undoes the smoothing where values are smooth. */
enum { TRIP_SHARPEN_PART = 8 };

typedef struct trip_sharpen_square trip_sharpen_square;

/* Sheets of a column. The first sheet is a multiple of this number. Memory also holds the sheets
 * before and after them. */
enum { TRIP_SHARPEN_SHEETS = TRIP_LEVEL_SHEETS_HELD - 2 };

/* A square and its neighbours: two along u, two along v, and those in the previous and the next
 * sheet. A missing neighbour has count 0. */
typedef struct trip_sharpen_neighbourhood {
    trip_level_position square, beside[6];
} trip_sharpen_neighbourhood;

typedef struct trip_sharpen_column {
    uint64_t sheet, morton; /* of the column's first square */
    trip_sharpen_neighbourhood squares[TRIP_SHARPEN_SHEETS];
} trip_sharpen_column;

/* Working memory of one thread. */
typedef struct trip_sharpen_lane {
    trip_coarse_value *values, *beside;
    /* For each voxel of a square, the sum of its differences to its neighbours: in codes, or in
     * values for knots. */
    int32_t *sums;
    double *value_sums;
    double *square_sums;          /* sums of the squared differences, in codes */
    trip_sharpen_square *squares; /* the current square, then some recently used ones */
} trip_sharpen_lane;

typedef struct trip_sharpen {
    const trip_output *file;
    unsigned edge_log2;
    bool labels; /* values stay as they are: a sharpened label is another one */
    bool round;  /* codes in `around` are reversed, as dropped values lie above kept ones */
    const trip_quantiser *quantiser; /* NULL means even codes */
    const double *value_of;          /* value of each code, for knots */
    double shown; /* variance that interpolation shows, per squared difference; 0 if not needed */
    trip_level_positions positions;
    uint64_t sheet; /* first sheet of the current columns; UINT64_MAX if there are none yet */
    size_t next[TRIP_SHARPEN_SHEETS]; /* next square in each of the sheets */
} trip_sharpen;

/* Opens a file with squares of 2^edge_log2 voxels, with or without means. `round` tells that codes
 * in `around` are reversed (coarse.h). The file must be complete and flushed before the first call
 * of trip_sharpen_take(). */
void trip_sharpen_open(trip_sharpen *s, const trip_output *file, bool means, bool round,
                       unsigned edge_log2, trip_budget *budget);
void trip_sharpen_close(trip_sharpen *s);

/* Returns the variance that interpolation shows at a level, per squared difference of means. */
double trip_sharpen_shown(unsigned level);

/* Lays out a lane in `memory`, which must be zeroed and aligned to 64. Returns the size of a lane
 * in bytes; NULL computes only the size. */
size_t trip_sharpen_lane_make(trip_sharpen_lane *l, unsigned edge_log2, unsigned char *memory);

/* Takes the next column. Returns 1, 0 after the last column, or a negative status. One thread at a
 * time. */
int trip_sharpen_take(trip_sharpen *s, trip_sharpen_column *column);
/* Computes the of->square.count values of one square of a column. They stay in the lane until the
 * next call. */
int trip_sharpen_do(const trip_sharpen *s, trip_sharpen_lane *l,
                    const trip_sharpen_neighbourhood *of);

#endif
