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

static int draw_batches(trip_renderer *renderer, trip_reader *reader, bool front_to_back,
                        trip_frame_stats *stats)
{
    trip_batch batch;
    int status;
    while ((status = trip_reader_next(reader, &batch)) > 0) {
        double start = now_ms();
        status = renderer->ops->draw(renderer, &batch, front_to_back);
        trip_reader_release(reader, &batch);
        stats->draw_ms += now_ms() - start;
        if (status)
            return status;
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "render", "frame", "interrupted");
    }
    return status;
}

static int draw_pass(trip_renderer *renderer, trip_reader *reader, const trip_plan_pass *pass,
                     trip_frame_stats *stats)
{
    int status = trip_reader_begin(reader, &pass->selection);
    if (status)
        return status;
    status = draw_batches(renderer, reader, pass->front_to_back, stats);
    trip_reader_stats read = trip_reader_get_stats(reader);
    add_reader_stats(&stats->reader, &read);
    stats->lists[pass->selection.axis].bytes_read += read.bytes_read;
    return status;
}

static int draw_lists(trip_renderer *renderer, trip_reader *reader, const trip_plan *plan,
                      trip_frame_stats *stats)
{
    for (int axis = 0; axis < 3; axis++) {
        const trip_plan_list *list = &plan->lists[axis];
        if (list->pass_count == 0)
            continue;
        int status = renderer->ops->begin_list(renderer, axis);
        for (int i = 0; i < list->pass_count && !status; i++)
            status = draw_pass(renderer, reader, &list->passes[i], stats);
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
    int status = renderer->ops->begin_frame(renderer, frame);
    if (!status)
        status = draw_lists(renderer, reader, frame->plan, stats);
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
