/* What of the light reaches places of a volume, on coarse lattices: made of one pass over the list
 * nearest to the light's direction, whose extinction is gathered at the nodes, and of sweeps
 * through that (light_sweep.h). Kept from frame to frame: a pass is read again when the data, the
 * transfer function or what is cut away has changed, the sweeps are made again when the light has.
 * Where spacing is uneven they lie over places
 * (coordinates.h). The lattices depend on the data's size and the settings alone. One thread;
 * renderers read the grids of a map that is complete. */
#ifndef TRIP_LIGHT_MAP_H
#define TRIP_LIGHT_MAP_H

#include "effects.h"
#include "light_sweep.h"
#include "reader.h"
#include "transfer_function.h"

typedef struct trip_light_map trip_light_map;

/* What it is made from; all outlives the frame that it is for. */
typedef struct trip_light_source {
    const trip_dataset *data;
    unsigned level; /* that the data set is of */
    const trip_settings *settings;
    const trip_clip *clip; /* index space */
    const trip_tf_entry *table;
    trip_engine engine;
    unsigned threads;
} trip_light_source;

typedef struct trip_light_stats {
    uint64_t splats, bytes_read, reads; /* of the pass; 0 where it was kept */
    double gather_ms, sweep_ms;         /* reading and gathering; sweeps */
    size_t memory_bytes;                /* of the lattices */
} trip_light_stats;

int trip_light_map_create(trip_light_map **out, trip_budget *budget);
/* Waits for reads under way. */
void trip_light_map_destroy(trip_light_map *m);

/* Takes the lattices and starts the reads; what is there from before and the same is kept, as far
 * as it was made. Fails (reported) where the lattices do not fit the memory given. */
int trip_light_map_begin(trip_light_map *m, const trip_light_source *source);
/* A piece of what is ready: a batch, or some rows of nodes or columns, by `runner` (NULL: by the
 * caller's thread). trip_frame's TRIP_FRAME_* of what it has come to. */
int trip_light_map_step(trip_light_map *m, const trip_task_runner *runner);
/* Waits until there is something to do, at most for the timeout. */
void trip_light_map_await(trip_light_map *m, uint64_t timeout_ns);
bool trip_light_map_is_complete(const trip_light_map *m);
/* When its numbers came to be, once it is complete: no two lattices of a process that differ have
 * the same, so that it says of a copy whether it is of this one. */
uint64_t trip_light_map_made_ns(const trip_light_map *m);

/* The means of extinction, once those are gathered. */
const trip_light_grid *trip_light_map_gathered(const trip_light_map *m);
/* NULL where the effect is off. Their numbers are there once the map is complete. */
const trip_light_grid *trip_light_map_reached(const trip_light_map *m);
const trip_light_grid *trip_light_map_open(const trip_light_map *m);
/* Lets a frame's effects look places up in the map. */
void trip_light_map_view(const trip_light_map *m, trip_effects_view *view);

/* Since trip_light_map_begin(). */
trip_light_stats trip_light_map_stats(const trip_light_map *m);

#endif
