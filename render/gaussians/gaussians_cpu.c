#include "gaussians_cpu.h"

#include <math.h>
#include <string.h>

#include "clock.h"
#include "gaussian_footprint.h"
#include "gaussian_tiles.h"
#include "pixels.h"
#include "renderer.h"

enum {
    BATCH_MAX = 32768, /* Gaussians projected at once */
    BATCH_MIN = 512,
    PAIRS_PER_GAUSSIAN = 8, /* room for the tiles that a batch meets */
    PROJECT_TASK = 256,     /* Gaussians of a task */
    STRIP_BYTES = 1 << 20,  /* planes that a device writes at once, approximately */
};

/* Rounding must not end a pixel after two Gaussians of the greatest opacity: T is then 1e-4, which
 * is not below 1e-4. */
#define TERMINATION_SLACK 4e-6

/* The tiles that a footprint's bounds meet, inclusive; empty if left > right. */
typedef struct tile_span {
    uint16_t left, right, top, bottom;
} tile_span;

/* The tiles of one row that a footprint meets; empty if left > right. */
typedef struct row_entry {
    uint32_t splat;
    uint16_t left, right;
} row_entry;

struct trip_gaussians_cpu {
    trip_camera camera;
    trip_gaussian_settings settings;
    trip_budget *budget;
    trip_task_runner runner;
    const trip_tile_kernels *kernels;
    const trip_tile_device *device; /* composites in place of the kernels; or NULL */
    trip_tiles *on_device;
    int columns, rows; /* of tiles */
    size_t tiles;
    size_t tile_floats;  /* of a tile's planes */
    size_t tile_task;    /* tiles of a task */
    size_t planes_tiles; /* tiles in `planes`: strip_rows rows */
    int strip_rows;      /* rows that a device writes at once; without a device all rows */
    float *planes;
    uint16_t *open; /* for each tile, see trip_tile_kernels.draw */

    /* A batch, and the pieces of it that fit the lists. */
    size_t batch_max, curves_max, pairs_max;
    size_t batch;                   /* Gaussians that are projected */
    const trip_gaussian *gaussians; /* the next ones to project */
    size_t next;
    trip_projected *splats;
    trip_curve *curves; /* NULL unless footprints are exact */
    tile_span *spans;
    size_t piece_from, piece_to;
    size_t *row_first, *row_pairs; /* entries and pairs before each row, and after the last */
    row_entry *entries;
    uint32_t *tile_first, *tile_count; /* in `pairs` */
    uint32_t *pairs;

    trip_gaussians_cpu_stats stats;
};

static float termination_of(const trip_gaussians_cpu *g)
{
    return (float)(trip_gaussian_termination(&g->settings) * (1 - TERMINATION_SLACK));
}

/* ---- memory ---- */

/* The fields of `g` that are buffers, and their sizes in bytes. */
#define BUFFERS(X)                                                                                 \
    X(g->planes, g->planes_tiles * g->tile_floats * sizeof(float))                                 \
    X(g->open, g->tiles * sizeof(uint16_t))                                                        \
    X(g->row_first, ((size_t)g->rows + 1) * sizeof(size_t))                                        \
    X(g->row_pairs, ((size_t)g->rows + 1) * sizeof(size_t))                                        \
    X(g->tile_first, g->tiles * sizeof(uint32_t))                                                  \
    X(g->tile_count, g->tiles * sizeof(uint32_t))                                                  \
    X(g->splats, g->batch_max * sizeof(trip_projected))                                            \
    X(g->curves, g->curves_max * sizeof(trip_curve))                                               \
    X(g->spans, g->batch_max * sizeof(tile_span))                                                  \
    X(g->entries, g->pairs_max * sizeof(row_entry))                                                \
    X(g->pairs, g->pairs_max * sizeof(uint32_t))

static void release_buffers(trip_gaussians_cpu *g)
{
#define RELEASE(field, bytes) trip_budget_release(g->budget, field, bytes), field = NULL;
    BUFFERS(RELEASE)
#undef RELEASE
}

/* Returns NULL for 0 bytes. Clears *all if the budget refuses. */
static void *take(trip_gaussians_cpu *g, size_t bytes, bool *all)
{
    void *memory = bytes ? trip_budget_take(g->budget, bytes) : NULL;
    *all &= memory || !bytes;
    return memory;
}

/* Returns 0, a failure, or 1 if the memory does not suffice. */
static int begin_on_device(trip_gaussians_cpu *g)
{
    if (!g->device)
        return 0;
    const trip_tiles_params params = {
        .width = g->camera.width,
        .height = g->camera.height,
        .splats_max = g->batch_max,
        .pairs_max = g->pairs_max,
        .curved = g->curves_max > 0,
        .depth = g->settings.depth,
        .termination = termination_of(g),
        .budget = g->budget,
    };
    return g->device->begin(g->device->user, &g->on_device, &params);
}

/* Returns 0, a failure, or 1 if the memory does not suffice. */
static int take_buffers(trip_gaussians_cpu *g, size_t batch_max)
{
    bool all = true;
    g->batch_max = batch_max;
    g->curves_max = g->settings.shape == TRIP_GAUSSIAN_EXACT ? batch_max : 0;
    g->pairs_max = batch_max * PAIRS_PER_GAUSSIAN; /* one Gaussian can meet all tiles */
    if (g->pairs_max < g->tiles)
        g->pairs_max = g->tiles;
#define TAKE(field, bytes) field = take(g, bytes, &all);
    BUFFERS(TAKE)
#undef TAKE
    const int status = all ? begin_on_device(g) : 1;
    if (status)
        release_buffers(g);
    return status;
}

/* Returns 0, a failure, or 1 if the memory does not suffice. */
static int take_what_fits(trip_gaussians_cpu *g)
{
    int status = 1;
    size_t batch_max = g->device ? g->device->batch_max : BATCH_MAX;
    for (; batch_max >= BATCH_MIN && status > 0; batch_max /= 2)
        status = take_buffers(g, batch_max);
    return status;
}

static int clamped(int at, int max)
{
    return at < max ? at : max;
}

/* Pixels beyond the picture are closed from the beginning. */
static void clear_tile(trip_gaussians_cpu *g, size_t tile)
{
    float *t = g->planes + tile * g->tile_floats;
    const int left = (int)(tile % (size_t)g->columns) * TRIP_TILE_PX;
    const int top = (int)(tile / (size_t)g->columns) * TRIP_TILE_PX;
    const int columns = clamped(g->camera.width - left, TRIP_TILE_PX);
    const int rows = clamped(g->camera.height - top, TRIP_TILE_PX);
    for (int i = 0; i < TRIP_TILE_PIXELS; i++)
        t[i] = -1;
    for (int y = 0; y < rows; y++)
        for (int x = 0; x < columns; x++) {
            const int place = trip_tile_place(x, y);
            t[place] = 1;
            g->open[tile] = (uint16_t)(g->open[tile] | 1u << place / 16);
        }
}

/* The device has cleared its own planes. */
static void clear_tiles(trip_gaussians_cpu *g)
{
    if (g->device)
        memset(g->open, 0xff, g->tiles * sizeof *g->open);
    for (size_t i = 0; i < g->tiles && !g->device; i++)
        clear_tile(g, i);
}

/* Sets how many rows of tiles the planes hold. */
static void size_planes(trip_gaussians_cpu *g)
{
    const size_t row_bytes = (size_t)g->columns * g->tile_floats * sizeof(float);
    g->strip_rows = g->device ? clamped(1 + (int)(STRIP_BYTES / row_bytes), g->rows) : g->rows;
    g->planes_tiles = (size_t)g->strip_rows * (size_t)g->columns;
}

int trip_gaussians_cpu_begin(trip_gaussians_cpu **out, const trip_gaussians_cpu_params *params)
{
    *out = NULL;
    const trip_tile_kernels *kernels = trip_tile_kernels_choose(params->isa);
    if (!kernels)
        return TRIP_USAGE;
    const trip_camera *c = params->camera;
    int status = 1;
    trip_gaussians_cpu *g = trip_budget_take(params->budget, sizeof *g);
    if (g) {
        g->camera = *c;
        g->device = params->device;
        g->settings = *params->settings;
        g->budget = params->budget;
        g->runner = params->runner ? *params->runner : (trip_task_runner){ 0 };
        g->kernels = kernels;
        g->columns = (c->width + TRIP_TILE_PX - 1) / TRIP_TILE_PX;
        g->rows = (c->height + TRIP_TILE_PX - 1) / TRIP_TILE_PX;
        g->tiles = (size_t)g->columns * (size_t)g->rows;
        g->tile_task = 4 + g->tiles / 65536;
        g->tile_floats =
            (size_t)(g->settings.depth ? TRIP_TILE_PLANES_MAX : TRIP_TILE_DEPTH) * TRIP_TILE_PIXELS;
        size_planes(g);
        status = take_what_fits(g);
    }
    if (!status) {
        clear_tiles(g);
        *out = g;
        return 0;
    }
    trip_budget_release(params->budget, g, sizeof *g);
    return status < 0
               ? status
               : trip_fail(TRIP_ERROR, "render", "memory",
                           "a picture of %d x %d px does not fit; raise --memory or draw a smaller "
                           "picture",
                           c->width, c->height);
}

void trip_gaussians_cpu_end(trip_gaussians_cpu *g)
{
    if (!g)
        return;
    if (g->device)
        g->device->end(g->on_device);
    release_buffers(g);
    trip_budget_release(g->budget, g, sizeof *g);
}

/* ---- projection ---- */

static bool span_is_open(const trip_gaussians_cpu *g, const tile_span *span)
{
    for (int row = span->top; row <= span->bottom; row++)
        for (int column = span->left; column <= span->right; column++)
            if (g->open[(size_t)row * (size_t)g->columns + (size_t)column])
                return true;
    return false;
}

/* Returns false if the footprint meets no open tile. */
static bool find_span(const trip_gaussians_cpu *g, const trip_gaussian_footprint *f,
                      tile_span *span)
{
    const trip_pixels x = trip_pixels_within(f->lo[0], f->hi[0], g->camera.width);
    const trip_pixels y = trip_pixels_within(f->lo[1], f->hi[1], g->camera.height);
    if (x.first > x.last || y.first > y.last)
        return false;
    *span = (tile_span){ (uint16_t)(x.first / TRIP_TILE_PX), (uint16_t)(x.last / TRIP_TILE_PX),
                         (uint16_t)(y.first / TRIP_TILE_PX), (uint16_t)(y.last / TRIP_TILE_PX) };
    return span_is_open(g, span);
}

/* Sets the span of place `i` of the batch, and its projection unless the span is empty. */
static void project(trip_gaussians_cpu *g, const trip_gaussian *from, size_t i)
{
    trip_gaussian_footprint f;
    tile_span span;
    g->spans[i] = (tile_span){ 1, 0, 1, 0 };
    if (!trip_gaussian_footprint_of(&g->camera, &g->settings, from, &f) || !find_span(g, &f, &span))
        return;
    double rgb[3];
    trip_gaussian_colour(from, g->settings.degree, trip_gaussian_direction(&g->camera, from), rgb);
    g->spans[i] = span;
    g->splats[i] = (trip_projected){
        .x = f.x,
        .y = f.y,
        .across = (float)f.across,
        .across_shear = (float)(f.across * f.shear),
        .down = (float)f.down,
        .limit = (float)f.limit * 1.0001f + 0.0001f,
        .opacity = (float)f.opacity,
        .rgb = { (float)rgb[0], (float)rgb[1], (float)rgb[2] },
        .z = (float)f.z,
        .reach_x = (float)f.reach_x,
        .reach_y = (float)f.reach_y,
        .curved = f.curved,
    };
    if (f.curved)
        g->curves[i] =
            (trip_curve){ (float)f.bend_x,        (float)f.bend_y,        (float)f.tilt,
                          (float)f.skew,          (float)f.turn,          (float)(f.lo[0] - f.x),
                          (float)(f.hi[0] - f.x), (float)(f.lo[1] - f.y), (float)(f.hi[1] - f.y) };
}

static void project_some(void *context, unsigned task)
{
    trip_gaussians_cpu *g = context;
    const size_t from = (size_t)task * PROJECT_TASK;
    for (size_t i = from; i < from + PROJECT_TASK && i < g->next; i++)
        project(g, &g->gaussians[i], g->batch + i);
}

/* ---- lists of tiles ---- */

/* Selects the next piece: as many Gaussians as the lists have room for. Counts the entries and the
 * pairs of each row, then sets where each row begins. */
static void cut_piece(trip_gaussians_cpu *g)
{
    size_t pairs = 0, i = g->piece_to;
    for (int row = 0; row <= g->rows; row++)
        g->row_first[row] = g->row_pairs[row] = 0;
    g->piece_from = i;
    for (; i < g->batch; i++) {
        const tile_span *span = &g->spans[i];
        if (span->left > span->right)
            continue;
        const size_t width = (size_t)(span->right - span->left) + 1;
        const size_t area = width * ((size_t)(span->bottom - span->top) + 1);
        if (pairs + area > g->pairs_max)
            break;
        pairs += area;
        g->stats.drawn++;
        for (int row = span->top; row <= span->bottom; row++) {
            g->row_first[row + 1]++;
            g->row_pairs[row + 1] += width;
        }
    }
    g->piece_to = i;
    for (int row = 0; row < g->rows; row++) {
        g->row_first[row + 1] += g->row_first[row];
        g->row_pairs[row + 1] += g->row_pairs[row];
    }
}

/* Lists the Gaussians of each row, in their order. */
static void list_rows(trip_gaussians_cpu *g)
{
    for (size_t i = g->piece_from; i < g->piece_to; i++) {
        const tile_span *span = &g->spans[i];
        if (span->left > span->right)
            continue;
        for (int row = span->top; row <= span->bottom; row++)
            g->entries[g->row_first[row]++] = (row_entry){ (uint32_t)i, span->left, span->right };
    }
    for (int row = g->rows; row > 0; row--) /* each row's end is now its beginning's place */
        g->row_first[row] = g->row_first[row - 1];
    g->row_first[0] = 0;
}

/* Returns the distance from the centre to the ellipse's rightmost point where dy is in [from, to].
 * Give the negative `shear` for the distance to the leftmost point. */
static float farthest(const trip_projected *s, float shear, float from, float to)
{
    /* The rightmost point of the whole ellipse. Its reach_x^2 is limit (1 / across^2 + (shear /
     * down)^2). */
    const float at = s->limit * shear / (s->down * s->down * s->reach_x);
    if (at >= from && at <= to)
        return s->reach_x;
    const float dy = at < from ? from : to, v = s->down * dy;
    return shear * dy + sqrtf(fmaxf(0, s->limit - v * v)) / s->across;
}

/* Narrows an entry of a row to the tiles that the ellipse meets there. The
 * entry never grows, since a span of closed tiles alone gives no entry. */
static void narrow(const trip_gaussians_cpu *g, int row, row_entry *entry)
{
    const trip_projected *s = &g->splats[entry->splat];
    const float slack = 0.01f; /* px */
    const float top = (float)(row * TRIP_TILE_PX + 0.5 - s->y);
    const float from = fmaxf(top, -s->reach_y) - slack;
    const float to = fminf(top + (TRIP_TILE_PX - 1), s->reach_y) + slack;
    const float shear = s->across_shear / s->across;
    const double right = s->x + (double)(farthest(s, shear, from, to) + slack);
    const double left = s->x - (double)(farthest(s, -shear, from, to) + slack);
    const trip_pixels x = trip_pixels_within(left, right, g->camera.width);
    const int first = x.first / TRIP_TILE_PX, last = x.last / TRIP_TILE_PX;
    if (x.first > x.last || first > entry->right || last < entry->left) {
        *entry = (row_entry){ entry->splat, 1, 0 };
        return;
    }
    entry->left = (uint16_t)(first > entry->left ? first : entry->left);
    entry->right = (uint16_t)(last < entry->right ? last : entry->right);
}

/* Lists the Gaussians of each tile of a row, in their order. */
static void list_tiles(void *context, unsigned row)
{
    trip_gaussians_cpu *g = context;
    row_entry *from = g->entries + g->row_first[row], *to = g->entries + g->row_first[row + 1];
    const size_t tile = (size_t)row * (size_t)g->columns;
    uint32_t *first = g->tile_first + tile, *count = g->tile_count + tile;
    memset(count, 0, (size_t)g->columns * sizeof *count);
    for (row_entry *e = from; e < to; e++) {
        if (e->left < e->right && !g->splats[e->splat].curved)
            narrow(g, (int)row, e);
        for (int column = e->left; column <= e->right; column++)
            count[column]++;
    }
    size_t at = g->row_pairs[row];
    for (int column = 0; column < g->columns; column++) {
        first[column] = (uint32_t)at;
        at += count[column];
        count[column] = 0;
    }
    for (const row_entry *e = from; e < to; e++)
        for (int column = e->left; column <= e->right; column++)
            g->pairs[first[column] + count[column]++] = e->splat;
}

/* ---- compositing ---- */

static void composite_some(void *context, unsigned task)
{
    trip_gaussians_cpu *g = context;
    const float termination = termination_of(g);
    const size_t from = (size_t)task * g->tile_task;
    for (size_t tile = from; tile < from + g->tile_task && tile < g->tiles; tile++)
        if (g->tile_count[tile] && g->open[tile])
            g->kernels->draw(g->planes + tile * g->tile_floats, &g->open[tile], g->splats,
                             g->curves, g->pairs + g->tile_first[tile], g->tile_count[tile],
                             (int)(tile % (size_t)g->columns) * TRIP_TILE_PX,
                             (int)(tile / (size_t)g->columns) * TRIP_TILE_PX, termination,
                             g->settings.depth);
}

static unsigned tasks_for(size_t count, size_t per_task)
{
    return (unsigned)((count + per_task - 1) / per_task);
}

static int composite(trip_gaussians_cpu *g)
{
    if (!g->device) {
        trip_run_tasks(&g->runner, composite_some, g, tasks_for(g->tiles, g->tile_task));
        return 0;
    }
    return g->device->draw(g->on_device,
                           &(trip_tile_piece){ .splats = g->splats,
                                               .curves = g->curves,
                                               .splat_from = g->piece_from,
                                               .splat_to = g->piece_to,
                                               .first = g->tile_first,
                                               .count = g->tile_count,
                                               .pairs = g->pairs,
                                               .pair_count = g->row_pairs[g->rows] },
                           g->open);
}

static void project_next(trip_gaussians_cpu *g)
{
    const uint64_t began = trip_now_ns();
    trip_run_tasks(&g->runner, project_some, g, tasks_for(g->next, PROJECT_TASK));
    g->batch += g->next;
    g->stats.project_ns += trip_now_ns() - began;
}

/* Lists and composites the batch, and empties it. */
int trip_gaussians_cpu_flush(trip_gaussians_cpu *g)
{
    int status = 0;
    for (g->piece_to = 0; g->piece_to < g->batch && !status;) {
        const uint64_t bins = trip_now_ns();
        cut_piece(g);
        list_rows(g);
        trip_run_tasks(&g->runner, list_tiles, g, (unsigned)g->rows);
        const uint64_t composites = trip_now_ns();
        status = composite(g);
        g->stats.bin_ns += composites - bins;
        g->stats.composite_ns += trip_now_ns() - composites;
        for (size_t i = 0; i < g->tiles; i++)
            g->stats.pairs += g->tile_count[i];
    }
    g->batch = 0;
    return status;
}

int trip_gaussians_cpu_add(trip_gaussians_cpu *g, const trip_gaussian *gaussians, size_t count)
{
    for (size_t i = 0; i < count; i += g->next) {
        int status = trip_frame_poll();
        if (status)
            return status;
        const size_t room = g->batch_max - g->batch;
        g->gaussians = gaussians + i;
        g->next = count - i < room ? count - i : room;
        g->stats.added += g->next;
        if (trip_gaussians_cpu_open_tiles(g))
            project_next(g);
        /* A device takes large batches only: each loads and stores planes. */
        if (!g->device || g->batch == g->batch_max)
            status = trip_gaussians_cpu_flush(g);
        if (status)
            return status;
    }
    return 0;
}

/* ---- results ---- */

bool trip_gaussians_cpu_is_open(const trip_gaussians_cpu *g, const double lo[2], const double hi[2])
{
    const trip_pixels x = trip_pixels_within(lo[0], hi[0], g->camera.width);
    const trip_pixels y = trip_pixels_within(lo[1], hi[1], g->camera.height);
    if (x.first > x.last || y.first > y.last)
        return false;
    return span_is_open(
        g, &(tile_span){ (uint16_t)(x.first / TRIP_TILE_PX), (uint16_t)(x.last / TRIP_TILE_PX),
                         (uint16_t)(y.first / TRIP_TILE_PX), (uint16_t)(y.last / TRIP_TILE_PX) });
}

bool trip_gaussians_cpu_needs_box(const trip_gaussians_cpu *g, const double lo[3],
                                  const double hi[3], double deviation)
{
    double from[2], to[2];
    if (!trip_gaussian_box_bounds(&g->camera, lo, hi, deviation, from, to))
        return false;
    /* Footprints without limits have no bounds in common. */
    if (g->settings.shape != TRIP_GAUSSIAN_PROJECTED && !g->camera.ortho)
        return trip_gaussians_cpu_open_tiles(g) > 0;
    return trip_gaussians_cpu_is_open(g, from, to);
}

size_t trip_gaussians_cpu_open_tiles(const trip_gaussians_cpu *g)
{
    size_t open = 0;
    for (size_t i = 0; i < g->tiles; i++)
        open += g->open[i] != 0;
    return open;
}

typedef struct picture {
    const trip_gaussians_cpu *g;
    float *rgba, *depth;
    int first_row; /* of tiles, in the planes */
} picture;

static void write_pixel(const picture *p, int x, int y)
{
    const trip_gaussians_cpu *g = p->g;
    const float *from = g->planes +
                        ((size_t)(y / TRIP_TILE_PX - p->first_row) * (size_t)g->columns +
                         (size_t)(x / TRIP_TILE_PX)) *
                            g->tile_floats +
                        trip_tile_place(x % TRIP_TILE_PX, y % TRIP_TILE_PX);
    const size_t at = (size_t)y * (size_t)g->camera.width + (size_t)x;
    const double *behind = g->settings.background;
    const float transmittance = fabsf(from[TRIP_TILE_T]);
    const float rest = transmittance * (float)behind[3];
    for (int c = 0; c < 3; c++)
        p->rgba[4 * at + (size_t)c] =
            from[(TRIP_TILE_RED + c) * TRIP_TILE_PIXELS] + rest * (float)behind[c];
    p->rgba[4 * at + 3] = 1 - transmittance + rest;
    if (!p->depth)
        return;
    const float opacity = 1 - transmittance;
    const double z = (double)from[TRIP_TILE_DEPTH * TRIP_TILE_PIXELS] / (double)opacity;
    p->depth[at] =
        opacity > 0 ? (float)(z * trip_camera_ray_length(&g->camera, x + 0.5, y + 0.5)) : INFINITY;
}

static void write_rows(void *context, unsigned row)
{
    const picture *p = context;
    const int first = (p->first_row + (int)row) * TRIP_TILE_PX;
    const int end = clamped(first + TRIP_TILE_PX, p->g->camera.height);
    for (int y = first; y < end; y++)
        for (int x = 0; x < p->g->camera.width; x++)
            write_pixel(p, x, y);
}

int trip_gaussians_cpu_picture(trip_gaussians_cpu *g, float *rgba, float *depth)
{
    picture p = { g, rgba, g->settings.depth ? depth : NULL, 0 };
    int status = trip_gaussians_cpu_flush(g);
    for (; p.first_row < g->rows && !status; p.first_row += g->strip_rows) {
        const int rows = clamped(g->rows - p.first_row, g->strip_rows);
        if (g->device)
            status = g->device->read(g->on_device, (size_t)p.first_row * (size_t)g->columns,
                                     (size_t)rows * (size_t)g->columns, g->planes);
        if (!status)
            trip_run_tasks(&g->runner, write_rows, &p, (unsigned)rows);
    }
    return status;
}

trip_gaussians_cpu_stats trip_gaussians_cpu_get_stats(const trip_gaussians_cpu *g)
{
    return g->stats;
}
