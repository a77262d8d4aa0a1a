#include "gaussian_sheet_frame.h"

#include <math.h>
#include <string.h>

#include "clock.h"
#include "gaussian_keys.h"
#include "gaussian_sheets.h"
#include "normalise.h"
#include "list_colours.h"
#include "surfel_light.h"
#include "renderer.h"
#include "weight.h"

enum { BATCH = 1024, PASSES_MAX = 6 };

/* The reach of an ellipsoid, with room for rounding. */
#define REACH (TRIP_GAUSSIAN_REACH * (1 + 1e-5))

typedef struct pass {
    int axis, way;
} pass;

struct trip_gaussian_sheet_frame {
    trip_gaussian_sheet_frame_params params;
    int axis_of_view;
    pass passes[PASSES_MAX];
    unsigned pass_count, drawn; /* passes; those that are complete */
    trip_gaussian_stream *stream;
    trip_gaussian_sheets *sheets;
    trip_gaussian *batch;
    double *keys;
    float *sum; /* of the complete passes, with depths behind it */
    trip_gaussian_sheet_frame_stats stats;
};

static size_t pixels_of(const trip_gaussian_sheet_frame *f)
{
    return (size_t)f->params.camera->width * (size_t)f->params.camera->height;
}

static float *depths_of(const trip_gaussian_sheet_frame *f, float *rgba)
{
    return f->params.settings.depth ? rgba + 4 * pixels_of(f) : NULL;
}

#define BUFFERS(X)                                                                                 \
    X(f->batch, BATCH * sizeof *f->batch)                                                          \
    X(f->keys, BATCH * sizeof *f->keys)                                                            \
    X(f->sum, pixels_of(f) * (f->params.settings.depth ? 5 : 4) * sizeof *f->sum)

static int take_memory(trip_gaussian_sheet_frame *f)
{
    bool all = true;
#define TAKE(field, size) all = all && (field = trip_budget_take(f->params.budget, size)) != NULL;
    BUFFERS(TAKE)
#undef TAKE
    return all ? 0
               : trip_fail(TRIP_ERROR, "render", "memory",
                           "the layers do not fit; raise --memory or draw a smaller picture");
}

/* ---- passes ---- */

static void find_passes(trip_gaussian_sheet_frame *f)
{
    for (int axis = 0; axis < 3; axis++)
        for (int way = 1; way >= -1; way -= 2)
            if (trip_weight_is_somewhere(f->params.weights, f->params.camera, f->axis_of_view, axis,
                                         way > 0 ? TRIP_WAY_UP : TRIP_WAY_DOWN))
                f->passes[f->pass_count++] = (pass){ axis, way };
}

/* Returns how far the low-pass filter widens a Gaussian along the axis of a pass, by its centre. */
static trip_gaussian_key spread_of(const trip_gaussian_sheet_frame *f, const pass *p)
{
    const trip_camera *c = f->params.camera;
    trip_gaussian_key key = { .offset = 1 };
    if (!c->ortho)
        key = trip_gaussian_key_of_depth(c);
    const double by = (1 + 1e-5) * trip_gaussian_sheets_spread(c, p->axis);
    for (int a = 0; a < 3; a++)
        key.direction[a] *= by;
    key.offset *= by;
    return key;
}

static trip_gaussian_stream_params stream_of(const trip_gaussian_sheet_frame *f, const pass *p,
                                             trip_gaussian_plane planes[])
{
    const trip_camera *c = f->params.camera;
    return (trip_gaussian_stream_params){
        .axis = p->axis,
        .key = trip_gaussian_key_of_list(c, p->axis, p->way),
        .reach = REACH,
        .spread = spread_of(f, p),
        .hold = trip_gaussian_sheets_step(f->params.thickness),
        .planes = planes,
        .plane_count = trip_gaussian_planes_of(c, planes),
        .degree = f->params.settings.degree,
    };
}

static trip_gaussian_sheets_params sheets_of(const trip_gaussian_sheet_frame *f, const pass *p,
                                             const trip_gaussian_plan *plan)
{
    return (trip_gaussian_sheets_params){
        .camera = f->params.camera,
        .settings = f->params.settings,
        .weights = f->params.weights,
        .axis_of_view = f->axis_of_view,
        .axis = p->axis,
        .way = p->way,
        .thickness = f->params.thickness,
        .room = plan->held_records + BATCH,
        .reference = f->params.reference,
        .budget = f->params.budget,
        .runner = f->params.runner,
    };
}

/* Checks that each pass fits the budget. */
static int check_memory(trip_gaussian_sheet_frame *f)
{
    int status = 0;
    for (unsigned i = 0; i < f->pass_count && !status; i++) {
        trip_gaussian_plane planes[TRIP_GAUSSIAN_PLANES_MAX];
        const trip_gaussian_stream_params p = stream_of(f, &f->passes[i], planes);
        trip_gaussian_plan plan;
        char needed[32], left[32];
        status = trip_gaussian_stream_plan(f->params.placed->set, &p, f->params.budget, &plan);
        if (status)
            break;
        const trip_gaussian_sheets_params sheets = sheets_of(f, &f->passes[i], &plan);
        const uint64_t bytes = plan.bytes + trip_gaussian_sheets_bytes(&sheets);
        if (bytes > trip_budget_left_bytes(f->params.budget))
            status = trip_fail(
                TRIP_ERROR, "render", "memory",
                "this view needs %s, since %llu Gaussians meet a sheet at a time, and --memory "
                "leaves %s: raise --memory, or give thinner sheets by --sheet",
                trip_format_bytes(bytes, needed), (unsigned long long)plan.held_records,
                trip_format_bytes(trip_budget_left_bytes(f->params.budget), left));
        if (plan.held_records > f->stats.held_records)
            f->stats.held_records = plan.held_records;
        f->stats.bricks += plan.bricks;
    }
    return status;
}

static int open_pass(trip_gaussian_sheet_frame *f)
{
    const pass *p = &f->passes[f->drawn];
    trip_gaussian_plane planes[TRIP_GAUSSIAN_PLANES_MAX];
    const trip_gaussian_stream_params params = stream_of(f, p, planes);
    int status =
        trip_gaussian_stream_open(&f->stream, f->params.placed->set, &params, f->params.budget);
    if (status)
        return status;
    const trip_gaussian_plan *plan = trip_gaussian_stream_planned(f->stream);
    const trip_gaussian_sheets_params sheets = sheets_of(f, p, plan);
    f->stats.bytes_read += plan->read_bytes;
    return trip_gaussian_sheets_begin(&f->sheets, &sheets);
}

static void close_pass(trip_gaussian_sheet_frame *f)
{
    trip_gaussian_stream_close(f->stream);
    trip_gaussian_sheets_end(f->sheets);
    f->stream = NULL;
    f->sheets = NULL;
}

int trip_gaussian_sheet_frame_begin(trip_gaussian_sheet_frame **out,
                                    const trip_gaussian_sheet_frame_params *params)
{
    trip_gaussian_sheet_frame *f = *out = trip_budget_take(params->budget, sizeof *f);
    if (!f)
        return trip_fail(TRIP_ERROR, "render", "memory", "the frame does not fit; raise --memory");
    f->params = *params;
    f->axis_of_view = trip_weight_axis_of_view(params->camera);
    find_passes(f);
    f->stats.passes = f->pass_count;
    int status = take_memory(f);
    if (!status)
        status = check_memory(f);
    if (!status)
        return 0;
    trip_gaussian_sheet_frame_end(f);
    *out = NULL;
    return status;
}

void trip_gaussian_sheet_frame_end(trip_gaussian_sheet_frame *f)
{
    if (!f)
        return;
    trip_budget *budget = f->params.budget;
    close_pass(f);
#define RELEASE(field, size) trip_budget_release(budget, field, size);
    BUFFERS(RELEASE)
#undef RELEASE
    trip_budget_release(budget, f, sizeof *f);
}

/* ---- drawing ---- */

static int draw_runs(trip_gaussian_sheet_frame *f, double coordinate)
{
    bool drawn = true;
    int status = 0;
    const double begun = trip_now_ms();
    while (!status && drawn)
        status = trip_gaussian_sheets_draw(f->sheets, coordinate, &drawn);
    f->stats.draw_ms += trip_now_ms() - begun;
    return status;
}

/* Returns the coordinate of the key of a pass. */
static double coordinate_of(const trip_gaussian_sheet_frame *f, double key)
{
    const pass *p = &f->passes[f->drawn];
    return key + p->way * trip_component(f->params.camera->eye, p->axis);
}

/* Reads a batch and draws the sheets that are complete. Sets *got to the size of the batch. */
static int draw_batch(trip_gaussian_sheet_frame *f, size_t *got)
{
    const size_t room = trip_gaussian_sheets_room_left(f->sheets);
    const double begun = trip_now_ms();
    int status =
        trip_gaussian_stream_next(f->stream, f->batch, f->keys, room < BATCH ? room : BATCH, got);
    const double read = trip_now_ms();
    f->stats.read_ms += read - begun;
    f->stats.gaussians += *got;
    for (size_t i = 0; i < *got; i++)
        trip_gaussian_change_apply(&f->params.placed->change, &f->batch[i]);
    trip_surfel_light(f->params.settings.light, f->params.camera, f->batch, *got);
    trip_list_colours(f->params.weights, f->passes[f->drawn].axis, f->batch, *got);
    if (!status && *got)
        status = trip_gaussian_sheets_add(f->sheets, f->batch, *got);
    f->stats.draw_ms += trip_now_ms() - read;
    if (!status)
        status = draw_runs(f, *got ? coordinate_of(f, f->keys[*got - 1]) : INFINITY);
    return status;
}

static int step_pass(trip_gaussian_sheet_frame *f)
{
    size_t got = 0;
    int status = f->sheets ? 0 : open_pass(f);
    if (!status && trip_gaussian_sheets_is_open(f->sheets))
        status = draw_batch(f, &got);
    if (status || got)
        return status;
    trip_gaussian_sheets_merge(f->sheets, f->sum, depths_of(f, f->sum));
    close_pass(f);
    f->drawn++;
    return 0;
}

int trip_gaussian_sheet_frame_step(trip_gaussian_sheet_frame *f, uint64_t deadline_ns)
{
    int status = 0;
    while (!status && f->drawn < f->pass_count) {
        status = step_pass(f);
        if (!status)
            status = trip_frame_poll();
        if (!status && f->drawn < f->pass_count && trip_now_ns() >= deadline_ns)
            return TRIP_FRAME_MORE;
    }
    return status ? status : TRIP_FRAME_DONE;
}

void trip_gaussian_sheet_frame_picture(const trip_gaussian_sheet_frame *f, float *rgba,
                                       float *depth)
{
    const size_t pixels = pixels_of(f);
    memcpy(rgba, f->sum, 4 * pixels * sizeof *rgba);
    if (depth)
        memcpy(depth, depths_of(f, f->sum), pixels * sizeof *depth);
    if (f->sheets)
        trip_gaussian_sheets_merge(f->sheets, rgba, depth);
    for (size_t i = 0; depth && i < pixels; i++)
        depth[i] = rgba[4 * i + 3] > 0 ? depth[i] / rgba[4 * i + 3] : INFINITY;
    trip_put_behind(rgba, pixels, f->params.settings.background);
}

trip_gaussian_sheet_frame_stats
trip_gaussian_sheet_frame_get_stats(const trip_gaussian_sheet_frame *f)
{
    return f->stats;
}
