/* Combines the pieces of one tile of a sheet into the run that a data set holds. One thread. */
#ifndef TRIP_RUN_BUILDER_H
#define TRIP_RUN_BUILDER_H

#include "piece.h"

typedef struct trip_run_builder trip_run_builder;

/* `f` is the format of the list's pieces. */
int trip_run_builder_create(trip_run_builder **out, const trip_piece_format *f,
                            trip_budget *budget);
void trip_run_builder_destroy(trip_run_builder *b);
/* Adds a sound piece; all pieces of a run have the same key and may come in any order. A voxel that
 * several pieces have is one record. */
void trip_run_builder_add(trip_run_builder *b, const trip_piece *p);
/* Ends the run: returns the number of its records and points to them, in list order: (u, v, code)
 * and normals as trip_writer_append() takes them, *normals being NULL without normals. They are
 * valid until the next piece is added. */
uint32_t trip_run_builder_take(trip_run_builder *b, const trip_quantiser *q,
                               const uint32_t **voxels, const uint32_t **normals);

#endif
