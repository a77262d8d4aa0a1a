/* Writes a list to a data set. It takes pieces by ascending key, combines the pieces of each tile
 * of a sheet into a run, and appends the run. One thread per list. */
#ifndef TRIP_LIST_OUTPUT_H
#define TRIP_LIST_OUTPUT_H

#include "merge.h"
#include "run_builder.h"
#include "writer.h"

typedef struct trip_list_output {
    unsigned list;
    trip_writer *writer;
    trip_run_builder *builder;
    _Atomic uint64_t splats; /* records appended so far; other threads may read it (relaxed) */
    unsigned pieces;         /* pieces taken so far, for the interruption check */
    /* If not NULL, called after each appended run. */
    int (*run)(void *user, uint64_t key, const uint32_t *voxels, const uint32_t *normals,
               uint32_t splats);
    void *run_user;
} trip_list_output;

/* Opens the output. `f` is the format of the list's pieces. */
int trip_list_output_create(trip_list_output *o, unsigned list, const trip_piece_format *f,
                            trip_writer *writer, trip_budget *budget);
void trip_list_output_destroy(trip_list_output *o);

/* Appends all pieces of the sources, merged as by trip_merge(). Later calls need greater keys. */
int trip_list_output_merge(trip_list_output *o, const trip_quantiser *quantiser,
                           trip_piece_source **sources, size_t count);

/* Appends one complete run. */
int trip_list_output_append(trip_list_output *o, uint64_t key, const uint32_t *voxels,
                            const uint32_t *normals, uint32_t splats);

#endif
