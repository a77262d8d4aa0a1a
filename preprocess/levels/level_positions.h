/* Knows the file positions of squares written by trip_level_file_append(), for a few consecutive
 * sheets. While one thread advances in the file, no other may look up squares. */
#ifndef TRIP_LEVEL_POSITIONS_H
#define TRIP_LEVEL_POSITIONS_H

#include "budget.h"
#include "level_source.h"
#include "output.h"

typedef struct trip_level_position {
    uint64_t key, at; /* `at` is the file position of its voxels */
    uint32_t count;
} trip_level_position;

/* The squares of a sheet, by ascending key. */
typedef struct trip_level_sheet {
    uint64_t number;
    trip_level_position *positions;
    size_t count, room;
} trip_level_sheet;

enum { TRIP_LEVEL_SHEETS_HELD = 10 };

typedef struct trip_level_positions {
    trip_budget *budget;
    const trip_output *file;
    bool means; /* the file contains means */
    unsigned edge_log2;
    uint64_t ahead; /* file position of the first square not yet in a sheet */
    trip_level_sheet sheets[TRIP_LEVEL_SHEETS_HELD]; /* by number modulo their count */
} trip_level_positions;

/* Opens the positions of a file with squares of 2^edge_log2 voxels, with or without means. The file
 * must be complete and flushed before a lookup. */
void trip_level_positions_open(trip_level_positions *p, const trip_output *file, bool means,
                               unsigned edge_log2, trip_budget *budget);
void trip_level_positions_close(trip_level_positions *p);

/* Return the maximum number of squares of a sheet and the maximum bytes allocated later, for a
 * level of at most `voxels` voxels. */
uint64_t trip_level_positions_squares(const int64_t dims[3], unsigned edge_log2, uint64_t voxels);
uint64_t trip_level_positions_later_bytes(const int64_t dims[3], unsigned edge_log2,
                                          uint64_t voxels);

/* Reads ahead until all squares of sheets up to `last` are known. New sheets replace the oldest
 * ones. */
int trip_level_positions_look_ahead(trip_level_positions *p, uint64_t last);
/* Sets *sheet to the sheet of the first square after the known ones, or to UINT64_MAX at the end of
 * the file. */
int trip_level_positions_next(const trip_level_positions *p, uint64_t *sheet);

/* Returns a sheet, or NULL if its squares are not known. */
static inline const trip_level_sheet *trip_level_positions_sheet(const trip_level_positions *p,
                                                                 uint64_t number)
{
    const trip_level_sheet *sheet = &p->sheets[number % TRIP_LEVEL_SHEETS_HELD];
    return sheet->number == number ? sheet : NULL;
}

/* Returns the position of the square at an offset, in squares and sheets, from the square of a key.
 * Its count is 0 if there is no such square. */
trip_level_position trip_level_position_beside(const trip_level_positions *p, uint64_t key,
                                               int64_t u, int64_t v, int64_t sheet);

/* Returns the square's index in its sheet along u (0) or v (1). */
int64_t trip_level_key_square(uint64_t key, int axis);

#endif
