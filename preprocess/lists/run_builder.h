/* Combines the pieces of one tile of a sheet into a run of the data set. One thread. */
#ifndef TRIP_RUN_BUILDER_H
#define TRIP_RUN_BUILDER_H

#include "piece.h"

typedef struct trip_run_builder trip_run_builder;

/* `f` is the format of the list's pieces. */
int trip_run_builder_create(trip_run_builder **out, const trip_piece_format *f,
                            trip_budget *budget);
void trip_run_builder_destroy(trip_run_builder *b);
/* Adds a valid piece. All pieces of a run must have the same key; they may come in any order. A
 * voxel in several pieces becomes one record. */
void trip_run_builder_add(trip_run_builder *b, const trip_piece *p);
/* Ends the run and returns the number of its records. Sets the pointers to records in list order,
 * in the form that trip_writer_append() takes. *beside points to normals or deviations, or is NULL
 * without either. The records are valid until the next piece is added. */
uint32_t trip_run_builder_take(trip_run_builder *b, const trip_quantiser *q,
                               const uint32_t **voxels, const uint32_t **beside);

#endif
