/* One list on its way into a data set: pieces come by ascending key, those of one tile are put
 * together, and their run is appended. One thread a list. */
#ifndef TRIP_LIST_OUTPUT_H
#define TRIP_LIST_OUTPUT_H

#include "merge.h"
#include "writer.h"

typedef struct trip_list_output {
    unsigned list;
    trip_writer *writer;
    trip_tile *tile;
    _Atomic uint64_t splats; /* appended; other threads may look (relaxed) */
    unsigned looked;         /* pieces since the last look for a signal */
    /* Hears of every run appended; NULL: nobody. */
    int (*run)(void *user, uint64_t key, const uint32_t *voxels, const uint32_t *normals,
               uint32_t splats);
    void *run_user;
} trip_list_output;

/* `f` is the list's own. */
int trip_list_output_create(trip_list_output *o, unsigned list, const trip_piece_format *f,
                            trip_writer *writer, trip_budget *budget);
void trip_list_output_destroy(trip_list_output *o);

/* Everything that the sources hold, as by trip_merge(). Keys of a later call must be greater. */
int trip_list_output_merge(trip_list_output *o, const trip_quantiser *quantiser,
                           trip_piece_source **sources, size_t count);

/* One run that was put together before. */
int trip_list_output_append(trip_list_output *o, uint64_t key, const uint32_t *voxels,
                            const uint32_t *normals, uint32_t splats);

#endif
