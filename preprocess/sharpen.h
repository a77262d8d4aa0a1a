/* The values of a coarse level as its lists hold them. Means, interpolated linearly, come out
 * smoother than what they are the means of: over the cube of a voxel by an eighth of the second
 * differences along each axis. So each value is moved the other way,
 *
 *     value + the sum over the six voxels beside it of (value - theirs) / TRIP_SHARPEN_PART,
 *
 * those that are not there counting as equal, and within the range of codes, which is wider than
 * that of values (brick_codes.h). Voxels that cover nothing known (level_halo.h) are not moved
 * towards what shows. The voxels come from the file that trip_level_file_append()
 * writes, square by square. They are taken by columns, the squares of a few sheets one behind the
 * other, so that what is made of them lies together in every list; of those sheets and the ones
 * before and behind only where their squares lie is held, and a few squares by each lane. One
 * thread opens and closes it; threads take columns one at a time, and sharpen them at the same
 * time, each in a lane. */
#ifndef TRIP_SHARPEN_H
#define TRIP_SHARPEN_H

#include "coarse.h"
#include "level_positions.h"

/* An eighth undoes it for what is smooth. */
enum { TRIP_SHARPEN_PART = 8 };

typedef struct trip_sharpen_square trip_sharpen_square;

/* Sheets of a column: the first is a multiple of that. Held are those before and behind, too. */
enum { TRIP_SHARPEN_SHEETS = TRIP_LEVEL_SHEETS_HELD - 2 };

/* A square, and those beside it, which have no voxels where the count is 0: along u, along v, in
 * the sheets before and behind. */
typedef struct trip_sharpen_neighbourhood {
    trip_level_position square, beside[6];
} trip_sharpen_neighbourhood;

typedef struct trip_sharpen_column {
    uint64_t sheet, morton; /* of its first square */
    trip_sharpen_neighbourhood squares[TRIP_SHARPEN_SHEETS];
} trip_sharpen_column;

/* Memory of a thread. */
typedef struct trip_sharpen_lane {
    trip_coarse_value *values, *beside;
    int32_t *sums; /* of a square's voxels: how much more each is than those beside */
    trip_sharpen_square *squares; /* the one at hand, and some that were needed lately */
} trip_sharpen_lane;

typedef struct trip_sharpen {
    const trip_output *file;
    unsigned edge_log2;
    bool round; /* what is not kept lies above what is */
    trip_level_positions positions;
    uint64_t sheet;                   /* the first of the columns at hand */
    size_t next[TRIP_SHARPEN_SHEETS]; /* square of each of their sheets */
} trip_sharpen;

/* Of a file with squares of 2^edge_log2 voxels, with means or without; `round`: codes are turned
 * round in `around` (coarse.h). The file is complete and flushed before the first square is taken.
 */
void trip_sharpen_open(trip_sharpen *s, const trip_output *file, bool means, bool round,
                       unsigned edge_log2, trip_budget *budget);
void trip_sharpen_close(trip_sharpen *s);

/* Lays out a lane in memory of so many bytes, zeroed and aligned to 64; with NULL it computes these
 * only. */
size_t trip_sharpen_lane_make(trip_sharpen_lane *l, unsigned edge_log2, unsigned char *memory);

/* The next column. Returns 1, 0 after the last one, or a negative status. One thread at a time. */
int trip_sharpen_take(trip_sharpen *s, trip_sharpen_column *column);
/* Of one of its squares the of->square.count values, in the lane until the next call. */
int trip_sharpen_do(const trip_sharpen *s, trip_sharpen_lane *l,
                    const trip_sharpen_neighbourhood *of);

#endif
