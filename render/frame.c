#include "frame.h"

#include <time.h>

#include "report.h"
#include "splat.h"

static double now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

enum { HELD_MAX = 16 };

/* A frame being drawn. */
typedef struct drawing {
    trip_renderer *renderer;
    trip_reader *reader;
    const trip_frame *frame;
    trip_frame_stats *stats;
    int next_axis;       /* layers before this one were begun */
    uint64_t splats;     /* drawn so far */
    uint64_t bytes_read; /* counted so far */
    /* Drawn, but perhaps not done with: held[held_first % HELD_MAX] is the oldest. */
    trip_batch held[HELD_MAX];
    unsigned held_first, held_count;
} drawing;

static void tell_progress(drawing *d, const trip_batch *batch)
{
    if (!d->frame->progress)
        return;
    for (size_t i = 0; i < batch->run_count; i++)
        d->splats += batch->runs[i].count;
    d->frame->progress(d->frame->progress_user, d->splats, trip_plan_splats(d->frame->plan));
}

/* Passes are read one behind the other, so that the next is on its way while the last batches of
 * one are drawn. */
static int begin_reading(drawing *d)
{
    trip_reader_set_runs_only(d->reader, d->renderer->resident);
    int status = trip_reader_begin(d->reader, NULL);
    for (int axis = 0; axis < 3; axis++) {
        const trip_plan_layer *layer = &d->frame->plan->layers[axis];
        for (int i = 0; i < layer->pass_count && !status; i++)
            status = trip_reader_then(d->reader, &layer->passes[i].pass);
    }
    return status;
}

/* The layers up to `last` that have passes, in order. */
static int begin_layers(drawing *d, int last)
{
    int status = 0;
    for (; d->next_axis <= last && !status; d->next_axis++)
        if (d->frame->plan->layers[d->next_axis].pass_count)
            status = d->renderer->ops->begin_layer(d->renderer, d->next_axis);
    return status;
}

static bool is_front_to_back(const drawing *d, const trip_batch *batch)
{
    int axis = batch->pass->selections->list->axis;
    const trip_plan_pass *passes = d->frame->plan->layers[axis].passes;
    return passes[batch->pass != &passes[0].pass].front_to_back;
}

static int draw_batch(drawing *d, const trip_batch *batch)
{
    uint64_t bytes = trip_reader_get_stats(d->reader).bytes_read;
    int axis = batch->pass->selections->list->axis;
    d->stats->lists[axis].bytes_read += bytes - d->bytes_read;
    d->bytes_read = bytes;
    int status = begin_layers(d, axis);
    if (status)
        return status;
    double start = now_ms();
    status = d->renderer->ops->draw(d->renderer, batch, is_front_to_back(d, batch));
    d->stats->draw_ms += now_ms() - start;
    tell_progress(d, batch);
    return status;
}

static int is_done(const drawing *d, const trip_batch *batch, bool wait)
{
    return d->renderer->ops->is_done ? d->renderer->ops->is_done(d->renderer, batch, wait) : 1;
}

static void release_oldest(drawing *d)
{
    trip_reader_release(d->reader, &d->held[d->held_first++ % HELD_MAX]);
    d->held_count--;
}

/* Gives back the slots of batches that the renderer is done with, oldest first; where more than
 * `most` are held it is waited for. */
static int release_drawn(drawing *d, unsigned most)
{
    int done = 1;
    while (d->held_count > 0 &&
           (done = is_done(d, &d->held[d->held_first % HELD_MAX], d->held_count > most)) > 0)
        release_oldest(d);
    return done < 0 ? done : 0;
}

/* A renderer may hold up to half of the ring, so that the disk is busy with the other half. */
static unsigned may_hold(const drawing *d)
{
    unsigned half = trip_reader_slots(d->reader) / 2;
    return half < HELD_MAX ? half : HELD_MAX - 1;
}

static int draw_lists(drawing *d)
{
    trip_batch batch;
    int status = begin_reading(d);
    while (!status && (status = trip_reader_next(d->reader, &batch)) > 0) {
        status = draw_batch(d, &batch);
        d->held[(d->held_first + d->held_count++) % HELD_MAX] = batch;
        if (!status)
            status = release_drawn(d, may_hold(d));
        if (!status)
            status = trip_frame_poll();
    }
    return status ? status : begin_layers(d, 2);
}

/* The renderer's counts; bytes were counted here. */
static void take_counts(const trip_renderer *renderer, trip_frame_stats *stats)
{
    trip_list_stats counts[3];
    renderer->ops->stats(renderer, counts);
    for (int axis = 0; axis < 3; axis++) {
        counts[axis].bytes_read = stats->lists[axis].bytes_read;
        stats->lists[axis] = counts[axis];
    }
}

/* Nothing is seen by a camera whose numbers are none, and no renderer could tell. */
static int check_camera(const trip_camera *c)
{
    const trip_vec3 all[] = { c->eye, c->r0, c->rx, c->ry, c->forward, c->to_x, c->to_y };
    double sum = c->voxel_world;
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++)
        sum += 0 * (all[i].x + all[i].y + all[i].z);
    return isfinite(sum) ? 0 : trip_splat_fail();
}

int trip_frame_draw(trip_renderer *renderer, trip_reader *reader, const trip_frame *frame,
                    float *rgba, trip_frame_stats *stats)
{
    double start = now_ms();
    *stats = (trip_frame_stats){ .counted = frame->count };
    drawing d = { .renderer = renderer, .reader = reader, .frame = frame, .stats = stats };
    int status = check_camera(frame->camera);
    if (!status)
        status = renderer->ops->begin_frame(renderer, frame);
    if (!status)
        status = draw_lists(&d);
    stats->reader = trip_reader_get_stats(reader);
    double merge_start = now_ms();
    if (!status)
        status = renderer->ops->end_frame(renderer, rgba);
    if (status && renderer->ops->abort_frame)
        renderer->ops->abort_frame(renderer);
    while (d.held_count > 0) /* the image is there, or is given up */
        release_oldest(&d);
    if (status)
        return status;
    stats->merge_ms = now_ms() - merge_start;
    stats->ms = now_ms() - start;
    stats->read_ms = (double)stats->reader.wait_ns * 1e-6;
    take_counts(renderer, stats);
    return 0;
}
