#include "frame.h"

#include <time.h>

#include "report.h"

static double now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static void add_reader_stats(trip_reader_stats *sum, const trip_reader_stats *s)
{
    sum->bytes_read += s->bytes_read;
    sum->reads += s->reads;
    sum->bytes_cached += s->bytes_cached;
    sum->splats += s->splats;
    sum->runs_skipped += s->runs_skipped;
    sum->bytes_skipped += s->bytes_skipped;
    sum->wait_ns += s->wait_ns;
}

/* A frame being drawn. */
typedef struct drawing {
    trip_renderer *renderer;
    trip_reader *reader;
    const trip_frame *frame;
    trip_frame_stats *stats;
    uint64_t splats; /* drawn so far */
} drawing;

static void tell_progress(drawing *d, const trip_batch *batch)
{
    uint64_t total = 0;
    if (!d->frame->progress)
        return;
    for (size_t i = 0; i < batch->run_count; i++)
        d->splats += batch->runs[i].count;
    for (int axis = 0; axis < 3; axis++)
        total += d->frame->plan->lists[axis].splats_selected;
    d->frame->progress(d->frame->progress_user, d->splats, total);
}

static int draw_batches(drawing *d, bool front_to_back)
{
    trip_batch batch;
    int status;
    while ((status = trip_reader_next(d->reader, &batch)) > 0) {
        double start = now_ms();
        status = d->renderer->ops->draw(d->renderer, &batch, front_to_back);
        d->stats->draw_ms += now_ms() - start;
        tell_progress(d, &batch);
        trip_reader_release(d->reader, &batch);
        if (status)
            return status;
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "render", "frame", "interrupted");
    }
    return status;
}

static int draw_pass(drawing *d, const trip_plan_pass *pass)
{
    int status = trip_reader_begin(d->reader, &pass->selection);
    if (status)
        return status;
    status = draw_batches(d, pass->front_to_back);
    trip_reader_stats read = trip_reader_get_stats(d->reader);
    add_reader_stats(&d->stats->reader, &read);
    d->stats->lists[pass->selection.axis].bytes_read += read.bytes_read;
    return status;
}

static int draw_lists(drawing *d)
{
    for (int axis = 0; axis < 3; axis++) {
        const trip_plan_list *list = &d->frame->plan->lists[axis];
        if (list->pass_count == 0)
            continue;
        int status = d->renderer->ops->begin_list(d->renderer, axis);
        for (int i = 0; i < list->pass_count && !status; i++)
            status = draw_pass(d, &list->passes[i]);
        if (status)
            return status;
    }
    return 0;
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

int trip_frame_draw(trip_renderer *renderer, trip_reader *reader, const trip_frame *frame,
                    float *rgba, trip_frame_stats *stats)
{
    double start = now_ms();
    *stats = (trip_frame_stats){ 0 };
    drawing d = { .renderer = renderer, .reader = reader, .frame = frame, .stats = stats };
    int status = renderer->ops->begin_frame(renderer, frame);
    if (!status)
        status = draw_lists(&d);
    double merge_start = now_ms();
    if (!status)
        status = renderer->ops->end_frame(renderer, rgba);
    if (status)
        return status;
    stats->merge_ms = now_ms() - merge_start;
    stats->ms = now_ms() - start;
    stats->read_ms = (double)stats->reader.wait_ns * 1e-6;
    take_counts(renderer, stats);
    return 0;
}
