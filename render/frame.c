#include "frame.h"

#include <assert.h>
#include <math.h>

#include "clock.h"
#include "emission.h"
#include "light_map.h"
#include "report.h"
#include "splat.h"

enum { HELD_MAX = TRIP_FRAME_HELD_MAX };

/* Interval at which a waiting frame checks for cancellation. */
enum { POLL_NS = 20000000 };

static void report_progress(trip_drawing *d, const trip_batch *batch)
{
    if (!d->frame->progress)
        return;
    const bool of_values = trip_plan_is_of_values(d->frame->plan, d->frame->settings);
    for (size_t i = 0; i < batch->run_count; i++)
        d->splats += batch->runs[i].count;
    d->frame->progress(d->frame->progress_user, of_values ? "draw" : "splat", d->splats,
                       trip_plan_splats(d->frame->plan));
}

/* The reader reads all passes in sequence, so that the next pass loads while the last batches of a
 * pass are drawn. */
static int begin_reading(trip_drawing *d)
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

/* Begins the layers with passes, up to axis `last`, in order. Returns TRIP_FRAME_DONE once all have
 * begun. */
static int begin_layers(trip_drawing *d, int last)
{
    int status = 0;
    for (; d->next_axis <= last; d->next_axis++) {
        if (d->frame->plan->layers[d->next_axis].pass_count)
            status = d->renderer->ops->begin_layer(d->renderer, d->next_axis);
        if (status)
            return status;
    }
    return TRIP_FRAME_DONE;
}

static bool is_front_to_back(const trip_drawing *d, const trip_batch *batch)
{
    int axis = batch->pass->selections->list->axis;
    const trip_plan_pass *passes = d->frame->plan->layers[axis].passes;
    return passes[batch->pass != &passes[0].pass].front_to_back;
}

static void begin_batch(trip_drawing *d, const trip_batch *batch)
{
    assert(batch->run_count > 0);
    d->held[(d->held_first + d->held_count++) % HELD_MAX] = *batch;
    d->in_batch = true;
    d->next_run = 0;
}

static const trip_batch *newest_held(const trip_drawing *d)
{
    return &d->held[(d->held_first + d->held_count - 1) % HELD_MAX];
}

/* Takes the next runs of the batch, with at most `max` splats together, but at least one run. */
static trip_batch next_piece(trip_drawing *d, const trip_batch *batch, uint64_t max)
{
    trip_batch piece = *batch;
    size_t end = d->next_run;
    uint64_t splats = 0;
    do
        splats += batch->runs[end++].count;
    while (end < batch->run_count && splats + batch->runs[end].count <= max);
    piece.runs = batch->runs + d->next_run;
    piece.run_count = end - d->next_run;
    d->next_run = end;
    return piece;
}

/* Draws the next runs of a batch. Its layer has begun. */
static int draw_piece(trip_drawing *d, bool whole)
{
    const trip_renderer_ops *ops = d->renderer->ops;
    const trip_batch *batch = newest_held(d);
    double start = trip_now_ms();
    int begun = begin_layers(d, batch->pass->selections->list->axis);
    if (begun)
        return begun;
    size_t first = d->next_run;
    trip_batch piece = next_piece(d, batch, whole || ops->in_parts ? UINT64_MAX : TRIP_FRAME_PIECE);
    int status = ops->draw(d->renderer, &piece, is_front_to_back(d, batch));
    if (status > 0)
        d->next_run = first;
    else
        report_progress(d, &piece);
    d->in_batch = d->next_run < batch->run_count;
    d->stats.draw_ms += trip_now_ms() - start;
    return status;
}

static int is_done(const trip_drawing *d, const trip_batch *batch)
{
    return d->renderer->ops->is_done ? d->renderer->ops->is_done(d->renderer, batch) : 1;
}

static void release_oldest(trip_drawing *d)
{
    trip_reader_release(d->reader, &d->held[d->held_first++ % HELD_MAX]);
    d->held_count--;
}

/* Releases the slots of finished batches, oldest first. */
static int release_drawn(trip_drawing *d)
{
    int done = 1;
    while (d->held_count > d->in_batch &&
           (done = is_done(d, &d->held[d->held_first % HELD_MAX])) > 0)
        release_oldest(d);
    return done < 0 ? done : 0;
}

/* Returns whether the renderer holds as many batches as it may. It may hold half of the ring, so
 * that the disk can fill the other half. */
static bool holds_many(const trip_drawing *d)
{
    unsigned half = trip_reader_slots(d->reader) / 2;
    return d->held_count - d->in_batch > (half < HELD_MAX ? half : HELD_MAX - 1);
}

static int end_passes(trip_drawing *d)
{
    int status = begin_layers(d, 2);
    return status || !d->renderer->ops->end_passes ? status
                                                   : d->renderer->ops->end_passes(d->renderer);
}

/* Takes the next batch from the reader, once the last one is drawn. Sets in_batch, or all_read at
 * the end. Returns 0, TRIP_FRAME_WAITS or a failure. */
static int next_batch(trip_drawing *d)
{
    trip_batch batch;
    if (!trip_reader_await(d->reader, 0))
        return TRIP_FRAME_WAITS;
    int status = trip_reader_next(d->reader, &batch);
    if (status > 0)
        begin_batch(d, &batch);
    d->all_read = status == 0;
    return status < 0 ? status : 0;
}

/* Loads a piece of the renderer's resident data. Returns TRIP_FRAME_DONE once all is loaded and the
 * reads have begun. */
static int load(trip_drawing *d)
{
    if (d->loaded)
        return TRIP_FRAME_DONE;
    int status = d->renderer->ops->load(d->renderer);
    d->loaded = status == TRIP_FRAME_DONE;
    if (d->loaded)
        status = begin_reading(d);
    return status;
}

/* Returns the next lattice to make, or NULL. */
static trip_light_map *lattice_left(const trip_drawing *d)
{
    const trip_frame *f = d->frame;
    trip_light_map *const maps[] = { f->emission ? trip_emission_map(f->emission) : NULL,
                                     f->light };
    for (size_t i = 0; i < sizeof maps / sizeof *maps; i++)
        if (maps[i] && !trip_light_map_is_complete(maps[i]))
            return maps[i];
    return NULL;
}

/* Makes the lattices of light and heat before drawing. */
static int make_light(trip_drawing *d)
{
    trip_light_map *map = lattice_left(d);
    const trip_task_runner runner = trip_renderer_runner(d->renderer);
    return map ? trip_light_map_step(map, &runner) : TRIP_FRAME_DONE;
}

/* Does one piece of the ready work. */
static int draw_next(trip_drawing *d, bool whole)
{
    int status = make_light(d);
    if (status == TRIP_FRAME_DONE)
        status = load(d);
    if (status != TRIP_FRAME_DONE)
        return status;
    status = release_drawn(d);
    if (!status && !d->in_batch && !d->all_read)
        status = holds_many(d) ? TRIP_FRAME_WAITS : next_batch(d);
    if (status)
        return status;
    if (d->all_read)
        return end_passes(d);
    status = draw_piece(d, whole);
    if (!status && !d->in_batch)
        status = release_drawn(d);
    return status ? status : TRIP_FRAME_MORE;
}

trip_list_stats trip_frame_list_stats(const trip_renderer *renderer, const trip_reader *reader,
                                      unsigned list)
{
    trip_list_stats stats = renderer->ops->stats(renderer, list);
    stats.bytes_read = trip_reader_list_bytes(reader, list);
    return stats;
}

static void take_counts(trip_drawing *d)
{
    trip_list_stats *all = &d->stats.all;
    *all = (trip_list_stats){ 0 };
    for (unsigned i = 0; i < d->frame->data->list_count; i++) {
        trip_list_stats list = trip_frame_list_stats(d->renderer, d->reader, i);
        all->splats_read += list.splats_read;
        all->splats_projected += list.splats_projected;
        all->splats_drawn += list.splats_drawn;
        all->bytes_read += list.bytes_read;
    }
}

/* Refuses cameras with numbers that are not finite: renderers do not check them. */
static int check_camera(const trip_camera *c)
{
    const trip_vec3 all[] = { c->eye, c->r0, c->rx, c->ry, c->forward, c->to_x, c->to_y };
    double sum = c->voxel_world;
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++)
        sum += 0 * (all[i].x + all[i].y + all[i].z);
    return isfinite(sum) ? 0 : trip_splat_fail();
}

static int check_forms(const trip_settings *s, const trip_renderer *renderer)
{
    const struct {
        bool wanted;
        unsigned form;
        const char *why;
    } forms[] = {
        { s->footprint == TRIP_FOOTPRINT_FIXED, TRIP_DRAWS_FIXED,
          "does not draw footprints of a fixed size; use the renderer reference or gl" },
        { s->vertex_weights, TRIP_DRAWS_VERTEX_WEIGHTS,
          "does not weight vertices; use the renderer reference" },
        { s->method == TRIP_METHOD_IMAGE, TRIP_DRAWS_IMAGE_SHEETS,
          "does not draw image-aligned sheets; use the renderer reference" },
    };
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++)
        if (forms[i].wanted && !(renderer->ops->forms & forms[i].form))
            return trip_fail(TRIP_USAGE, "render", renderer->ops->name, "%s", forms[i].why);
    return 0;
}

/* Refuses settings that the renderer cannot draw. */
static int check_renderer(const trip_frame *frame, const trip_renderer *renderer)
{
    const trip_settings *s = frame->settings;
    if (s->classify == TRIP_CLASSIFY_POST && !frame->plan->gathers &&
        !renderer->ops->classifies_post)
        return trip_fail(
            TRIP_USAGE, "render", renderer->ops->name,
            "does not classify after interpolation; use another renderer or --classify pre");
    if (trip_effects_some(&s->effects) && !(renderer->ops->effects >> s->classify & 1))
        return trip_fail(TRIP_USAGE, "render", renderer->ops->name,
                         "does not draw effects; use another renderer or --effects none");
    return frame->plan->gathers ? 0 : check_forms(s, renderer);
}

int trip_frame_begin(trip_drawing *d, trip_renderer *renderer, trip_reader *reader,
                     const trip_frame *frame)
{
    *d = (trip_drawing){ .renderer = renderer,
                         .reader = reader,
                         .frame = frame,
                         .stats = { .counted = frame->count },
                         .scope = { .around = trip_scope_current() },
                         .loaded = !renderer->ops->load,
                         .begun_ms = trip_now_ms() };
    trip_scope *before = trip_scope_enter(&d->scope);
    int status = check_camera(frame->camera);
    if (!status)
        status = check_renderer(frame, renderer);
    if (!status) {
        d->begun = true;
        status = renderer->ops->begin_frame(renderer, frame);
    }
    if (!status && d->loaded)
        status = begin_reading(d);
    trip_scope_enter(before);
    return status;
}

int trip_frame_step(trip_drawing *d, uint64_t deadline_ns)
{
    bool whole = deadline_ns == UINT64_MAX;
    trip_scope *before = trip_scope_enter(&d->scope);
    int status = trip_frame_poll();
    if (!status)
        do {
            status = d->done ? TRIP_FRAME_DONE : draw_next(d, whole);
            if (status == TRIP_FRAME_MORE && trip_frame_poll())
                status = TRIP_INTERRUPTED;
        } while (status == TRIP_FRAME_MORE && (whole || trip_now_ns() < deadline_ns));
    d->done = status == TRIP_FRAME_DONE;
    trip_scope_enter(before);
    return status;
}

/* Waiting for the renderer's device or threads counts as drawing. */
static void await_renderer(trip_drawing *d, uint64_t timeout_ns)
{
    const trip_renderer_ops *ops = d->renderer->ops;
    const double start = trip_now_ms();
    if (ops->await && !d->done)
        ops->await(d->renderer, timeout_ns);
    d->stats.draw_ms += trip_now_ms() - start;
}

void trip_frame_await(trip_drawing *d, uint64_t timeout_ns)
{
    trip_light_map *map = lattice_left(d);
    if (map)
        trip_light_map_await(map, timeout_ns);
    else if (!d->loaded || d->in_batch || d->all_read || holds_many(d))
        await_renderer(d, timeout_ns);
    else
        trip_reader_await(d->reader, timeout_ns);
}

#ifndef NDEBUG
/* Debug builds check every picture with it. Components must not be NaN, and distances must be
 * positive. */
static bool is_of_numbers(const trip_frame *frame, const float *rgba, const float *depth)
{
    const int rows = frame->rows ? frame->rows : frame->camera->height;
    size_t pixels = (size_t)frame->camera->width * (size_t)rows;
    for (size_t i = 0; i < 4 * pixels; i++)
        if (!isfinite(rgba[i]))
            return false;
    for (size_t i = 0; i < pixels && depth; i++)
        if (!(depth[i] >= 0))
            return false;
    return true;
}
#endif

int trip_frame_picture(trip_drawing *d, float *rgba, float *depth)
{
    double start = trip_now_ms();
    trip_scope *before = trip_scope_enter(&d->scope);
    int status = trip_frame_poll();
    if (!status)
        status = d->renderer->ops->picture(d->renderer, rgba, depth);
    assert(status || is_of_numbers(d->frame, rgba, depth));
    trip_scope_enter(before);
    if (status || !d->done)
        return status;
    d->stats.merge_ms = trip_now_ms() - start;
    d->stats.ms = trip_now_ms() - d->begun_ms;
    d->stats.reader = trip_reader_get_stats(d->reader);
    d->stats.read_ms = (double)d->stats.reader.wait_ns * 1e-6;
    take_counts(d);
    return 0;
}

void trip_frame_cancel(trip_drawing *d)
{
    trip_scope_cancel(&d->scope);
}

void trip_frame_end(trip_drawing *d)
{
    trip_frame_cancel(d); /* a finished frame has no work in progress */
    if (d->begun && d->renderer->ops->end_frame)
        d->renderer->ops->end_frame(d->renderer);
    while (d->held_count > 0)
        release_oldest(d);
    if (!d->done) {
        d->stats.reader = trip_reader_get_stats(d->reader);
        trip_reader_begin(d->reader, NULL);
    }
    d->begun = false;
}

int trip_frame_draw(trip_renderer *renderer, trip_reader *reader, const trip_frame *frame,
                    float *rgba, float *depth, trip_frame_stats *stats)
{
    trip_drawing d;
    int status = trip_frame_begin(&d, renderer, reader, frame);
    while (!status && (status = trip_frame_step(&d, UINT64_MAX)) == TRIP_FRAME_WAITS) {
        trip_frame_await(&d, POLL_NS);
        status = 0;
    }
    if (!status)
        status = trip_frame_picture(&d, rgba, depth);
    trip_frame_end(&d);
    *stats = d.stats;
    return status;
}
