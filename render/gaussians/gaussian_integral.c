#include "gaussian_integral.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "clock.h"
#include "gaussian_keys.h"
#include "gaussian_profile.h"
#include "gaussian_ray.h"
#include "normalise.h"
#include "surfel_light.h"
#include "pixels.h"
#include "renderer.h"
#include "weight.h"

enum {
    BATCH = 1024,
    PROJECT_TASK = 128, /* Gaussians of a task */
    TILE_PX = 16,
    STEP_TILES = 64, /* of a call of the runner */
};

/* A projected Gaussian, and the tiles that its bounds meet. */
typedef struct splat {
    trip_gaussian_footprint footprint;
    trip_gaussian_profile profile;
    double rgb[3];
    uint16_t left, right, top, bottom; /* empty if left > right */
} splat;

struct trip_gaussian_integral {
    trip_gaussian_integral_params params;
    trip_placed_stream *stream; /* NULL once all is read */
    trip_gaussian *batch;
    size_t batch_count;
    trip_normal_table *table;
    splat *splats;
    size_t room, count;
    int columns, rows; /* of tiles */
    size_t tiles, tiles_done;
    uint64_t *first; /* in pairs, of each tile and behind the last one */
    uint32_t *pairs; /* numbers of splats */
    size_t pair_count;
    float *rgba;        /* of all pixels, without background */
    atomic_bool failed; /* a task got no memory */
    trip_gaussian_integral_stats stats;
};

/* ---- memory ---- */

static size_t pixels_of(const trip_gaussian_integral *g)
{
    return (size_t)g->params.camera->width * (size_t)g->params.camera->height;
}

#define BUFFERS(X)                                                                                 \
    X(g->batch, BATCH * sizeof *g->batch)                                                          \
    X(g->table, sizeof *g->table)                                                                  \
    X(g->splats, g->room * sizeof *g->splats)                                                      \
    X(g->first, (g->tiles + 1) * sizeof *g->first)                                                 \
    X(g->rgba, 4 * pixels_of(g) * sizeof *g->rgba)

static int take_memory(trip_gaussian_integral *g)
{
    char needed[32], left[32];
    trip_budget *budget = g->params.budget;
    const uint64_t free_bytes = trip_budget_left_bytes(budget);
    size_t bytes = 0;
    bool all = true;
#define TAKE(field, size)                                                                          \
    bytes += size;                                                                                 \
    all = all && (field = trip_budget_take(budget, size)) != NULL;
    BUFFERS(TAKE)
#undef TAKE
    return all ? 0
               : trip_fail(TRIP_ERROR, "render", "memory",
                           "the integral keeps all Gaussians in view: %llu of them need %s, and "
                           "--memory leaves %s; raise --memory or use --order sheets",
                           (unsigned long long)g->room, trip_format_bytes(bytes, needed),
                           trip_format_bytes(free_bytes, left));
}

/* ---- reading ---- */

static int open_stream(trip_gaussian_integral *g)
{
    const trip_camera *c = g->params.camera;
    trip_gaussian_plane planes[TRIP_GAUSSIAN_PLANES_MAX];
    const int axis = trip_weight_axis_of_view(c);
    const trip_gaussian_stream_params p = {
        .axis = axis,
        .key = trip_gaussian_key_of_list(c, axis, 1),
        .planes = planes,
        .plane_count = trip_gaussian_planes_of(c, planes),
        .degree = g->params.settings.degree,
    };
    int status = trip_placed_stream_open(&g->stream, g->params.sets, g->params.set_count, &p,
                                         g->params.drawn, g->params.budget);
    if (status)
        return status;
    const trip_gaussian_plan *plan = trip_placed_stream_planned(g->stream);
    g->room = plan->records;
    g->stats.bricks = plan->bricks;
    g->stats.bytes_read = plan->read_bytes;
    g->stats.window_records = plan->window_records;
    return 0;
}

int trip_gaussian_integral_begin(trip_gaussian_integral **out,
                                 const trip_gaussian_integral_params *params)
{
    const trip_camera *c = params->camera;
    trip_gaussian_integral *g = *out = trip_budget_take(params->budget, sizeof *g);
    if (!g)
        return trip_fail(TRIP_ERROR, "render", "memory", "the frame does not fit; raise --memory");
    g->params = *params;
    g->columns = (c->width + TILE_PX - 1) / TILE_PX;
    g->rows = (c->height + TILE_PX - 1) / TILE_PX;
    g->tiles = (size_t)g->columns * (size_t)g->rows;
    atomic_init(&g->failed, false);
    int status = open_stream(g);
    if (!status)
        status = take_memory(g);
    if (!status)
        trip_normal_table_make(g->table);
    if (!status)
        return 0;
    trip_gaussian_integral_end(g);
    *out = NULL;
    return status;
}

void trip_gaussian_integral_end(trip_gaussian_integral *g)
{
    if (!g)
        return;
    trip_budget *budget = g->params.budget;
    trip_placed_stream_close(g->stream);
#define RELEASE(field, size) trip_budget_release(budget, field, size);
    BUFFERS(RELEASE)
#undef RELEASE
    trip_budget_release(budget, g->pairs, g->pair_count * sizeof *g->pairs);
    trip_budget_release(budget, g, sizeof *g);
}

/* Sets a splat, with an empty span of tiles if it is not in the picture. */
static void project(const trip_gaussian_integral *g, const trip_gaussian *from, splat *to)
{
    const trip_camera *c = g->params.camera;
    const trip_gaussian_settings *s = &g->params.settings;
    trip_gaussian_footprint *f = &to->footprint;
    to->left = 1;
    to->right = 0;
    if (!trip_gaussian_footprint_of(c, s, from, f))
        return;
    const trip_pixels x = trip_pixels_within(f->lo[0], f->hi[0], c->width);
    const trip_pixels y = trip_pixels_within(f->lo[1], f->hi[1], c->height);
    if (x.first > x.last || y.first > y.last)
        return;
    to->profile = trip_gaussian_profile_of(c, from, f);
    trip_gaussian_colour(from, s->degree, trip_gaussian_direction(c, from), to->rgb);
    to->left = (uint16_t)(x.first / TILE_PX);
    to->right = (uint16_t)(x.last / TILE_PX);
    to->top = (uint16_t)(y.first / TILE_PX);
    to->bottom = (uint16_t)(y.last / TILE_PX);
}

static void project_some(void *context, unsigned task)
{
    trip_gaussian_integral *g = context;
    const size_t from = (size_t)task * PROJECT_TASK;
    for (size_t i = from; i < from + PROJECT_TASK && i < g->batch_count; i++)
        project(g, &g->batch[i], &g->splats[g->count + i]);
}

/* Projects a batch behind the splats and drops those outside the picture. */
static void add_batch(trip_gaussian_integral *g)
{
    trip_run_tasks(&g->params.runner, project_some, g,
                   (unsigned)((g->batch_count + PROJECT_TASK - 1) / PROJECT_TASK));
    const splat *from = g->splats + g->count;
    for (size_t i = 0; i < g->batch_count; i++)
        if (from[i].left <= from[i].right)
            g->splats[g->count++] = from[i];
}

static uint64_t *tile_of(const trip_gaussian_integral *g, int column, int row)
{
    return &g->first[(size_t)row * (size_t)g->columns + (size_t)column];
}

/* Lists the splats of each tile. */
static int list_tiles(trip_gaussian_integral *g)
{
    uint64_t sum = 0;
    for (const splat *s = g->splats; s < g->splats + g->count; s++)
        for (int row = s->top; row <= s->bottom; row++)
            for (int column = s->left; column <= s->right; column++)
                ++*tile_of(g, column, row);
    for (size_t i = 0; i <= g->tiles; i++) {
        const uint64_t count = g->first[i];
        g->first[i] = sum;
        sum += count;
    }
    g->pair_count = sum;
    g->pairs = sum ? trip_budget_take(g->params.budget, sum * sizeof *g->pairs) : NULL;
    if (sum && !g->pairs)
        return trip_fail(TRIP_ERROR, "render", "memory",
                         "the integral's lists of tiles do not fit; raise --memory or draw a "
                         "smaller picture");
    for (size_t i = 0; i < g->count; i++) {
        const splat *s = &g->splats[i];
        for (int row = s->top; row <= s->bottom; row++)
            for (int column = s->left; column <= s->right; column++)
                g->pairs[(*tile_of(g, column, row))++] = (uint32_t)i;
    }
    for (size_t i = g->tiles; i > 0; i--) /* each tile's end is now its beginning's place */
        g->first[i] = g->first[i - 1];
    g->first[0] = 0;
    g->stats.gaussians = g->count;
    return 0;
}

static int read_batch(trip_gaussian_integral *g)
{
    const double begun = trip_now_ms();
    int status = trip_placed_stream_next(g->stream, g->batch, NULL, BATCH, &g->batch_count);
    g->stats.read_ms += trip_now_ms() - begun;
    trip_surfel_light(g->params.settings.light, g->params.camera, g->batch, g->batch_count);
    if (!status)
        add_batch(g);
    if (status || g->batch_count)
        return status;
    trip_placed_stream_close(g->stream);
    g->stream = NULL;
    return list_tiles(g);
}

/* ---- integration ---- */

static void integrate_pixel(const trip_gaussian_integral *g, size_t tile, trip_ray_scratch *scratch,
                            int x, int y)
{
    const trip_camera *c = g->params.camera;
    const double tolerance = g->params.tolerance;
    size_t count = 0;
    for (uint64_t i = g->first[tile]; i < g->first[tile + 1]; i++) {
        const splat *s = &g->splats[g->pairs[i]];
        trip_ray_density density;
        if (!trip_ray_density_of(&s->footprint, &s->profile, c->ortho, x + 0.5 - s->footprint.x,
                                 y + 0.5 - s->footprint.y, &density))
            continue;
        scratch->parts[count++] = (trip_ray_part){
            .mean = s->footprint.z + density.from_centre,
            .deviation = density.deviation,
            .tau = density.tau,
            .rgb = { s->rgb[0], s->rgb[1], s->rgb[2] },
        };
    }
    double rgba[4];
    trip_ray_integrate(g->table, scratch, count, c->ortho ? -INFINITY : 0,
                       tolerance > 0 ? tolerance : TRIP_GAUSSIAN_TOLERANCE, rgba);
    float *to = g->rgba + 4 * ((size_t)y * (size_t)c->width + (size_t)x);
    for (int i = 0; i < 4; i++)
        to[i] = (float)rgba[i];
}

static void integrate_tile(void *context, unsigned task)
{
    trip_gaussian_integral *g = context;
    const trip_camera *c = g->params.camera;
    const size_t tile = g->tiles_done + task, room = g->first[tile + 1] - g->first[tile];
    const size_t bytes = trip_ray_scratch_bytes(room);
    if (!room || trip_interrupted())
        return;
    void *memory = trip_budget_take(g->params.budget, bytes);
    if (!memory) {
        atomic_store(&g->failed, true);
        return;
    }
    trip_ray_scratch scratch = trip_ray_scratch_in(memory, room);
    const int left = (int)(tile % (size_t)g->columns) * TILE_PX;
    const int top = (int)(tile / (size_t)g->columns) * TILE_PX;
    for (int y = top; y < top + TILE_PX && y < c->height; y++)
        for (int x = left; x < left + TILE_PX && x < c->width; x++)
            integrate_pixel(g, tile, &scratch, x, y);
    trip_budget_release(g->params.budget, memory, bytes);
}

static int integrate_tiles(trip_gaussian_integral *g)
{
    const double begun = trip_now_ms();
    const size_t left = g->tiles - g->tiles_done, count = left < STEP_TILES ? left : STEP_TILES;
    trip_run_tasks(&g->params.runner, integrate_tile, g, (unsigned)count);
    g->tiles_done += count;
    g->stats.draw_ms += trip_now_ms() - begun;
    return atomic_load(&g->failed) ? trip_fail(TRIP_ERROR, "render", "memory",
                                               "the rays of the integral do not fit; raise "
                                               "--memory or use --order sheets")
                                   : 0;
}

int trip_gaussian_integral_step(trip_gaussian_integral *g, uint64_t deadline_ns)
{
    int status = 0;
    while (!status && (g->stream || g->tiles_done < g->tiles)) {
        status = g->stream ? read_batch(g) : integrate_tiles(g);
        if (!status)
            status = trip_frame_poll();
        if (!status && g->tiles_done < g->tiles && trip_now_ns() >= deadline_ns)
            return TRIP_FRAME_MORE;
    }
    return status ? status : TRIP_FRAME_DONE;
}

void trip_gaussian_integral_picture(const trip_gaussian_integral *g, float *rgba)
{
    memcpy(rgba, g->rgba, 4 * pixels_of(g) * sizeof *rgba);
    trip_put_behind(rgba, pixels_of(g), g->params.settings.background);
}

trip_gaussian_integral_stats trip_gaussian_integral_get_stats(const trip_gaussian_integral *g)
{
    return g->stats;
}
