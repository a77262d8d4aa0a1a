#include "list_output.h"

#include <stdatomic.h>

#include "format.h"
#include "report.h"

/* Pieces between checks for an interruption. */
enum { INTERRUPT_PIECES = 512 };

int trip_list_output_create(trip_list_output *o, unsigned list, const trip_piece_format *f,
                            trip_writer *writer, trip_budget *budget)
{
    *o = (trip_list_output){ .list = list, .writer = writer };
    return trip_run_builder_create(&o->builder, f, budget);
}

void trip_list_output_destroy(trip_list_output *o)
{
    trip_run_builder_destroy(o->builder);
    o->builder = NULL;
}

int trip_list_output_append(trip_list_output *o, uint64_t key, const uint32_t *voxels,
                            const uint32_t *normals, uint32_t splats)
{
    uint64_t tile = key & ((UINT64_C(1) << TRIP_TILE_MORTON_BITS) - 1);
    int status = trip_writer_append(o->writer, o->list, (uint32_t)(key >> TRIP_TILE_MORTON_BITS),
                                    trip_morton_even(tile), trip_morton_even(tile >> 1), voxels,
                                    normals, splats);
    atomic_fetch_add_explicit(&o->splats, splats, memory_order_relaxed);
    return status;
}

/* The run in progress. */
typedef struct building {
    trip_list_output *output;
    const trip_quantiser *quantiser;
    uint64_t key;
    bool pending;
} building;

static int append_pending(building *a)
{
    trip_list_output *o = a->output;
    const uint32_t *voxels, *normals;
    if (!a->pending)
        return 0;
    a->pending = false;
    uint32_t splats = trip_run_builder_take(o->builder, a->quantiser, &voxels, &normals);
    int status = trip_list_output_append(o, a->key, voxels, normals, splats);
    return status == 0 && o->run ? o->run(o->run_user, a->key, voxels, normals, splats) : status;
}

static int take_piece(void *user, const trip_piece *piece)
{
    building *a = user;
    int status = 0;
    if (a->pending && piece->key != a->key)
        status = append_pending(a);
    trip_run_builder_add(a->output->builder, piece);
    a->key = piece->key;
    a->pending = true;
    if (++a->output->pieces % INTERRUPT_PIECES == 0 && status == 0 && trip_interrupted())
        status = trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted");
    return status;
}

int trip_list_output_merge(trip_list_output *o, const trip_quantiser *quantiser,
                           trip_piece_source **sources, size_t count)
{
    building a = { .output = o, .quantiser = quantiser };
    int status = trip_merge(sources, count, take_piece, &a);
    return status == 0 ? append_pending(&a) : status;
}
