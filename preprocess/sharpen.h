/* The values of a coarse level as its lists hold them. Means, interpolated linearly, come out
 * smoother than what they are the means of: over the cube of a voxel by an eighth of the second
 * differences along each axis. So each value is moved the other way,
 *
 *     value + the sum over the six voxels beside it of (value - theirs) / TRIP_SHARPEN_PART,
 *
 * those that are not there counting as equal, and within the volume's range of values. The voxels
 * come from the file that trip_level_file_append() writes, square by square; of the sheets before
 * and behind only where their squares lie is held, and a few squares. One thread. */
#ifndef TRIP_SHARPEN_H
#define TRIP_SHARPEN_H

#include "coarse.h"
#include "output.h"

/* An eighth would undo it for what is smooth, and would make more of noise than a tenth. */
enum { TRIP_SHARPEN_PART = 10 };

typedef struct trip_sharpen_square trip_sharpen_square;

/* The squares of a sheet, by ascending key. */
typedef struct trip_sharpen_sheet {
    uint64_t number;
    struct trip_sharpen_place {
        uint64_t key, at; /* in the file: of its voxels */
        uint32_t count;
    } * places;
    size_t count, room;
} trip_sharpen_sheet;

typedef struct trip_sharpen {
    trip_budget *budget;
    const trip_output *file;
    unsigned edge_log2;
    uint16_t least, most;
    uint64_t ahead;               /* in the file: the first square that is not in a sheet below */
    trip_sharpen_sheet sheets[3]; /* by number, modulo 3 */
    uint64_t sheet;               /* of the square at hand */
    size_t next;                  /* square of that sheet */
    trip_coarse_voxel *voxels;
    int32_t *sums; /* of a square's voxels: how much more each is than those beside */
    trip_sharpen_square *squares; /* the one at hand, and some that were needed lately */
    size_t bytes;
    unsigned char *memory; /* of the arrays above */
} trip_sharpen;

/* Of a file with squares of 2^edge_log2 voxels; values remain in [least, most]. The file is
 * complete and flushed before the first square is read. */
int trip_sharpen_open(trip_sharpen *s, const trip_output *file, unsigned edge_log2, uint16_t least,
                      uint16_t most, trip_budget *budget);
void trip_sharpen_close(trip_sharpen *s);

/* What it takes of the budget later, at most, of a level of at most so many voxels. */
uint64_t trip_sharpen_later_bytes(const int64_t dims[3], unsigned edge_log2, uint64_t voxels);

/* The next square, its key and voxels, which are valid until the next call. Returns 1, 0 after the
 * last one, or a negative status. */
int trip_sharpen_next(trip_sharpen *s, uint64_t *key, trip_coarse_voxel **voxels, uint32_t *count);

#endif
