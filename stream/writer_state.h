/* The state of a writer, for writer.c and list_cursor.c only. */
#ifndef TRIP_WRITER_STATE_H
#define TRIP_WRITER_STATE_H

#include <stdatomic.h>

#include "block.h"
#include "folder.h"
#include "output.h"
#include "slab.h"
#include "writer.h"

enum { TRIP_DEFAULT_LISTS = 6 };

/* A list being written. Its tables go to unnamed files until the index is written, so that memory
 * does not grow with the data. */
typedef struct trip_list_writer {
    trip_writer_list is;
    unsigned planes_present; /* one bit per trip_plane */
    trip_output planes[TRIP_PLANES];
    trip_output checksums[TRIP_PLANES];
    trip_output slabs, bricks, runs;
    trip_slab slab;
    trip_block_form form;
    uint64_t records, slab_count, brick_count;
    uint64_t slab_first_record, slab_first_block;
    uint64_t last_tile;     /* Morton code of the last run's tile */
    int64_t sheet;          /* of the last run; -1 before the first */
    _Atomic uint64_t bytes; /* progress for other threads (relaxed) */
} trip_list_writer;

struct trip_writer {
    trip_writer_params params;
    trip_budget *budget;
    trip_folder folder;
    trip_flusher *flusher;
    atomic_bool failed; /* shared by the outputs */
    trip_file_header header;
    trip_writer_list default_lists[TRIP_DEFAULT_LISTS];
    trip_list_writer *lists; /* from the budget */
    unsigned list_count;
};

/* Adds the current slab, if any, to the list's tables. */
int trip_writer_end_slab(trip_writer *w, trip_list_writer *l);

#endif
