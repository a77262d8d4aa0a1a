/* The transmittance of light to all points of a volume, on coarse lattices. One pass over the list
 * nearest to the light's direction gathers the extinction at the nodes. Sweeps over the result give
 * the light (light_sweep.h). The lattices are kept from frame to frame. The pass is repeated if the
 * data, the transfer function or the clipping changed, the sweeps if the light changed. With uneven
 * spacing the lattices lie over positions (coordinates.h). Their size depends only on the data's
 * size and the settings. One thread at a time; renderers read the grids of a complete map. */
#ifndef TRIP_LIGHT_MAP_H
#define TRIP_LIGHT_MAP_H

#include "effects.h"
#include "light_sweep.h"
#include "reader.h"
#include "transfer_function.h"

typedef struct trip_light_map trip_light_map;

/* Inputs of the map. They must outlive the frame. */
typedef struct trip_light_source {
    const trip_dataset *data;
    unsigned level; /* of the data set */
    const trip_settings *settings;
    const trip_clip *clip; /* index space */
    const trip_tf_entry *table;
    trip_engine engine;
    unsigned threads;
} trip_light_source;

typedef struct trip_light_stats {
    uint64_t splats, bytes_read, reads; /* bytes of the pass; 0 if the map was reused */
    double gather_ms, sweep_ms;         /* times of reading and gathering, and of the sweeps */
    size_t memory_bytes;                /* of the lattices */
} trip_light_stats;

int trip_light_map_create(trip_light_map **out, trip_budget *budget);
/* Frees the map. Waits for pending reads. */
void trip_light_map_destroy(trip_light_map *m);

/* Allocates the lattices and starts the reads. Keeps earlier results with the same inputs. Fails,
 * reported, if the lattices exceed the budget. */
int trip_light_map_begin(trip_light_map *m, const trip_light_source *source);
/* Does one piece of ready work: a batch, or some rows of nodes or columns. `runner` may do it with
 * several threads; NULL uses the caller's. Returns a TRIP_FRAME_* of renderer.h. */
int trip_light_map_step(trip_light_map *m, const trip_task_runner *runner);
/* Waits for ready work, at most for the timeout. */
void trip_light_map_await(trip_light_map *m, uint64_t timeout_ns);
bool trip_light_map_is_complete(const trip_light_map *m);
/* Whether the mean extinctions are complete, so that nothing is read. */
bool trip_light_map_is_gathered(const trip_light_map *m);
/* Returns the time of completion. It is unique among the lattices of a process, and so identifies
 * copies. */
uint64_t trip_light_map_made_ns(const trip_light_map *m);

/* Returns the mean extinctions, once gathered. */
const trip_light_grid *trip_light_map_gathered(const trip_light_map *m);
/* Return the grids, or NULL if the effect is off. Values are valid once the map is complete. */
const trip_light_grid *trip_light_map_reached(const trip_light_map *m);
const trip_light_grid *trip_light_map_open(const trip_light_map *m);
/* Connects a frame's effects to the map. */
void trip_light_map_view(const trip_light_map *m, trip_effects_view *view);

/* Returns the statistics since trip_light_map_begin(). */
trip_light_stats trip_light_map_stats(const trip_light_map *m);

#endif
