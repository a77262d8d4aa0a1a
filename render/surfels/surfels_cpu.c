#include "surfels_cpu.h"

#include <math.h>
#include <string.h>

#include "clock.h"
#include "depth_pyramid.h"
#include "pixels.h"
#include "renderer.h"
#include "surfel_footprint.h"
#include "surfel_light.h"
#include "surfel_projected.h"

enum {
    BATCH_MAX = 32768, /* surfels projected at once */
    BATCH_MIN = 512,
    TASK = 256, /* surfels of a task */
    STRIP = 16, /* rows of pixels of a task */
};

#define NO_KEY UINT64_MAX

/* The bounds of the pixels that the visible surfels of a row of cells reach. */
typedef struct row_reach {
    float top, bottom;
    uint64_t visible;
} row_reach;

/* Blending divides the sums in place. */
typedef trip_surfel_sum sum;

struct trip_surfels_cpu {
    trip_camera camera;
    trip_gaussian_settings settings;
    trip_budget *budget;
    trip_task_runner runner;
    size_t pixels, cells;
    int pitch, cell_rows;
    uint32_t *depths;               /* D: bits of floats, which are in the order of the floats */
    uint64_t *keys;                 /* of the cells: bits of z - t, then the number */
    trip_surfel_projected *holders; /* of the cells */
    sum *sums;
    row_reach *reaches;
    trip_depth_pyramid pyramid;
    /* On a device, `keys` holds the fronts of all cells, then their numbers. */
    const trip_surfel_device *device;
    trip_surfel_target *target;
    uint32_t *fronts, *numbers;

    size_t batch_max;
    trip_surfel_projected *batch;
    uint32_t *batch_cells; /* TRIP_SURFEL_NO_CELL: skipped */
    uint32_t *batch_numbers;
    trip_surfel_getter *get;
    const void *context;
    size_t from, count;
    uint64_t outside, hidden; /* counted by tasks */
    bool unselected, blending;

    trip_surfels_cpu_stats stats;
};

/* ---- memory ---- */

/* The fields of `s` that are buffers, and their sizes in bytes. A device has its own holders. */
#define BUFFERS(X)                                                                                 \
    X(s->depths, s->pixels * sizeof(uint32_t))                                                     \
    X(s->sums, s->pixels * sizeof(sum))                                                            \
    X(s->keys, s->cells * sizeof(uint64_t))                                                        \
    X(s->holders, s->device ? 1 : s->cells * sizeof(trip_surfel_projected))                        \
    X(s->reaches, (size_t)s->cell_rows * sizeof(row_reach))                                        \
    X(s->batch, s->batch_max * sizeof(trip_surfel_projected))                                      \
    X(s->batch_cells, s->batch_max * sizeof(uint32_t))                                             \
    X(s->batch_numbers, s->batch_max * sizeof(uint32_t))

static void release_buffers(trip_surfels_cpu *s)
{
#define RELEASE(field, bytes) trip_budget_release(s->budget, field, bytes), field = NULL;
    BUFFERS(RELEASE)
#undef RELEASE
    trip_depth_pyramid_end(&s->pyramid, s->budget);
}

/* Returns 0, a failure (reported), or 1 if the budget refuses (not reported). */
static int take_buffers(trip_surfels_cpu *s, size_t batch_max)
{
    bool all = true;
    s->batch_max = batch_max;
#define TAKE(field, bytes) all = all && (field = trip_budget_take(s->budget, bytes)) != NULL;
    BUFFERS(TAKE)
#undef TAKE
    all =
        all && trip_depth_pyramid_begin(&s->pyramid, s->camera.width, s->camera.height, s->budget);
    const trip_surfel_target_params params = { .width = s->camera.width,
                                               .height = s->camera.height,
                                               .ortho = s->camera.ortho,
                                               .batch_max = batch_max,
                                               .budget = s->budget };
    const int status = !all        ? 1
                       : s->device ? s->device->begin(s->device->user, &s->target, &params)
                                   : 0;
    if (status)
        release_buffers(s);
    return status;
}

static int take_what_fits(trip_surfels_cpu *s)
{
    int status = 1;
    for (size_t batch = BATCH_MAX; batch >= BATCH_MIN && status > 0; batch /= 2)
        status = take_buffers(s, batch);
    return status;
}

static uint32_t bits_of(float f)
{
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    return bits;
}

static float float_of(uint32_t bits)
{
    float f;
    memcpy(&f, &bits, sizeof f);
    return f;
}

int trip_surfels_cpu_begin(trip_surfels_cpu **out, const trip_surfels_cpu_params *params)
{
    const trip_camera *c = params->camera;
    trip_surfels_cpu *s = *out = trip_budget_take(params->budget, sizeof *s);
    int status = s ? 0 : 1;
    if (s) {
        *s = (trip_surfels_cpu){
            .camera = *c,
            .settings = *params->settings,
            .budget = params->budget,
            .runner = params->runner ? *params->runner : (trip_task_runner){ 0 },
            .device = params->device,
            .unselected = params->unselected,
            .pixels = (size_t)c->width * (size_t)c->height,
            .pitch = c->width + 2 * TRIP_SURFEL_GUARD,
            .cell_rows = c->height + 2 * TRIP_SURFEL_GUARD,
        };
        s->cells = (size_t)s->pitch * (size_t)s->cell_rows;
        status = s->cells < TRIP_SURFEL_NO_CELL ? take_what_fits(s) : 1;
    }
    if (status) {
        trip_budget_release(params->budget, s, sizeof *s);
        *out = NULL;
    }
    if (status < 0)
        return status;
    if (status)
        return trip_fail(TRIP_ERROR, "render", "memory",
                         "a picture of %d x %d px does not fit; raise --memory or draw a smaller "
                         "picture",
                         c->width, c->height);
    s->fronts = (uint32_t *)s->keys;
    s->numbers = s->fronts + s->cells;
    for (size_t i = 0; i < s->pixels; i++)
        s->depths[i] = bits_of(INFINITY);
    memset(s->keys, 0xff, s->cells * sizeof *s->keys);
    return 0;
}

void trip_surfels_cpu_end(trip_surfels_cpu *s)
{
    if (!s)
        return;
    if (s->target)
        s->device->end(s->target);
    release_buffers(s);
    trip_budget_release(s->budget, s, sizeof *s);
}

/* ---- visibility and selection ---- */

static void lower_depth(trip_surfels_cpu *s, int x, int y, uint32_t depth)
{
    uint32_t *at = &s->depths[(size_t)y * (size_t)s->camera.width + (size_t)x];
    uint32_t before = __atomic_load_n(at, __ATOMIC_RELAXED);
    if (depth >= before)
        return;
    trip_depth_pyramid_mark(&s->pyramid, x, y);
    while (depth < before && !__atomic_compare_exchange_n(at, &before, depth, true,
                                                          __ATOMIC_RELAXED, __ATOMIC_RELAXED))
        ;
}

static void lower_depths(trip_surfels_cpu *s, const trip_surfel_projected *p)
{
    const trip_pixels rows =
        trip_surfel_rows(&p->disc, p->y, (float)TRIP_SURFEL_RIM, s->camera.height);
    for (int y = rows.first; y <= rows.last; y++) {
        const float dy = (float)y + 0.5f - p->y;
        const trip_pixels columns =
            trip_surfel_columns(&p->disc, p->x, (float)TRIP_SURFEL_RIM, dy, s->camera.width);
        for (int x = columns.first; x <= columns.last; x++) {
            const float dx = (float)x + 0.5f - p->x;
            if (trip_surfel_oval_radius2(&p->disc, dx, dy) <= (float)TRIP_SURFEL_RIM)
                lower_depth(s, x, y,
                            bits_of(trip_surfel_projected_depth(p, s->camera.ortho, dx, dy)));
        }
    }
}

static void lower_key(trip_surfels_cpu *s, uint32_t cell, uint64_t key)
{
    uint64_t before = __atomic_load_n(&s->keys[cell], __ATOMIC_RELAXED);
    while (key < before && !__atomic_compare_exchange_n(&s->keys[cell], &before, key, true,
                                                        __ATOMIC_RELAXED, __ATOMIC_RELAXED))
        ;
}

static int clamped(double at, int size)
{
    return at > 0 ? at < size - 1 ? (int)at : size - 1 : 0;
}

/* The rectangle also holds the pixel nearest to the centre's cell. */
static bool is_hidden(const trip_surfels_cpu *s, const double lo[2], const double hi[2],
                      float depth)
{
    const int width = s->camera.width, height = s->camera.height;
    return !s->unselected &&
           trip_depth_pyramid_is_before(&s->pyramid, clamped(lo[0], width), clamped(lo[1], height),
                                        clamped(hi[0], width), clamped(hi[1], height), depth);
}

bool trip_surfels_cpu_hides(const trip_surfels_cpu *s, const double lo[2], const double hi[2],
                            double depth)
{
    return depth > 0 && is_hidden(s, lo, hi, nextafterf((float)depth, 0));
}

static uint64_t key_of(const trip_surfel_projected *p, uint32_t number)
{
    return (uint64_t)bits_of(p->front) << 32 | number;
}

typedef struct skipped {
    uint64_t outside, hidden;
} skipped;

/* Projects surfel `i` of the batch, and lowers the depths and the key of its cell. */
static void project(trip_surfels_cpu *s, size_t i, skipped *skip)
{
    trip_surfel_footprint f;
    trip_gaussian g;
    trip_surfel_projected *p = &s->batch[i];
    s->batch_cells[i] = TRIP_SURFEL_NO_CELL;
    s->batch_numbers[i] = s->get(s->context, s->from + i, &g);
    if (!trip_surfel_footprint_of(&s->camera, &s->settings, &g, &f)) {
        skip->outside++;
        return;
    }
    *p = trip_surfel_project(&f);
    const double lo[2] = { f.x - f.reach_x - 0.01, f.y - f.reach_y - 0.01 };
    const double hi[2] = { f.x + f.reach_x + 0.01, f.y + f.reach_y + 0.01 };
    if (is_hidden(s, lo, hi, fminf(p->near, p->front))) {
        skip->hidden++;
        return;
    }
    double rgb[3];
    trip_surfel_light(s->settings.light, &s->camera, &g, 1);
    trip_gaussian_colour(&g, s->settings.degree, trip_gaussian_direction(&s->camera, &g), rgb);
    for (int k = 0; k < 3; k++)
        p->rgb[k] = (float)rgb[k];
    const int column = trip_surfel_cell(f.x, s->camera.width) + TRIP_SURFEL_GUARD;
    const int row = trip_surfel_cell(f.y, s->camera.height) + TRIP_SURFEL_GUARD;
    s->batch_cells[i] = (uint32_t)row * (uint32_t)s->pitch + (uint32_t)column;
    if (s->blending || s->device)
        return;
    lower_depths(s, p);
    lower_key(s, s->batch_cells[i], key_of(p, s->batch_numbers[i]));
}

static void project_some(void *context, unsigned task)
{
    trip_surfels_cpu *s = context;
    const size_t begin = (size_t)task * TASK;
    const size_t end = begin + TASK < s->count ? begin + TASK : s->count;
    skipped skip = { 0 };
    for (size_t i = begin; i < end; i++)
        project(s, i, &skip);
    __atomic_fetch_add(&s->outside, skip.outside, __ATOMIC_RELAXED);
    __atomic_fetch_add(&s->hidden, skip.hidden, __ATOMIC_RELAXED);
}

/* Draws the batch on the device. */
static int add_to_device(trip_surfels_cpu *s)
{
    const trip_surfel_batch batch = { s->batch, s->batch_cells, s->batch_numbers, s->count };
    const int status = s->device->add(s->target, &batch, s->pyramid.greatest[0]);
    if (!status)
        trip_depth_pyramid_refresh_above(&s->pyramid);
    return status;
}

/* Each cell has one holder, since no number occurs twice. */
static void write_some(void *context, unsigned task)
{
    trip_surfels_cpu *s = context;
    const size_t begin = (size_t)task * TASK;
    const size_t end = begin + TASK < s->count ? begin + TASK : s->count;
    for (size_t i = begin; i < end; i++) {
        const uint32_t cell = s->batch_cells[i];
        if (cell != TRIP_SURFEL_NO_CELL &&
            s->keys[cell] == key_of(&s->batch[i], s->batch_numbers[i]))
            s->holders[cell] = s->batch[i];
    }
}

static unsigned tasks_for(size_t count, size_t per_task)
{
    return (unsigned)((count + per_task - 1) / per_task);
}

static void blend_batch(void *context, unsigned strip);

/* Projects surfels batch by batch, and lets them take their cells, or blends them. */
static int project_all(trip_surfels_cpu *s, trip_surfel_getter *get, const void *context,
                       size_t count)
{
    s->get = get;
    s->context = context;
    int status = 0;
    for (s->from = 0; s->from < count && !status; s->from += s->count) {
        status = trip_frame_poll();
        if (status)
            return status;
        s->count = count - s->from < s->batch_max ? count - s->from : s->batch_max;
        trip_run_tasks(&s->runner, project_some, s, tasks_for(s->count, TASK));
        if (s->blending) {
            trip_run_tasks(&s->runner, blend_batch, s, tasks_for((size_t)s->camera.height, STRIP));
        } else if (s->device) {
            status = add_to_device(s);
        } else {
            trip_run_tasks(&s->runner, write_some, s, tasks_for(s->count, TASK));
            trip_depth_pyramid_refresh(&s->pyramid, s->depths, &s->runner);
        }
    }
    return status;
}

int trip_surfels_cpu_add_from(trip_surfels_cpu *s, trip_surfel_getter *get, const void *context,
                              size_t count)
{
    const uint64_t began = trip_now_ns();
    const int status = project_all(s, get, context, count);
    if (status)
        return status;
    s->stats.added += count;
    s->stats.outside = s->outside;
    s->stats.hidden = s->hidden;
    s->stats.project_ns += trip_now_ns() - began;
    return 0;
}

typedef struct array {
    const trip_gaussian *surfels;
    uint32_t first;
} array;

static uint32_t get_from_array(const void *context, size_t i, trip_gaussian *out)
{
    const array *from = context;
    *out = from->surfels[i];
    return from->first + (uint32_t)i;
}

int trip_surfels_cpu_add(trip_surfels_cpu *s, const trip_gaussian *surfels, size_t count,
                         uint32_t first)
{
    const array from = { surfels, first };
    return trip_surfels_cpu_add_from(s, get_from_array, &from, count);
}

/* ---- blending ---- */

static void divide(sum *at)
{
    at->coverage = fminf(1, at->coverage);
    if (!(at->weight > 0))
        return;
    for (int k = 0; k < 3; k++)
        at->rgb[k] /= at->weight;
    at->tolerance /= at->weight;
}

static size_t cell_at(const trip_surfels_cpu *s, int row, int column)
{
    return (size_t)row * (size_t)s->pitch + (size_t)column;
}

static uint64_t key_at(const trip_surfels_cpu *s, size_t cell)
{
    return s->device ? (uint64_t)s->fronts[cell] << 32 | s->numbers[cell] : s->keys[cell];
}

/* Returns whether a cell holds a visible surfel. */
static bool is_visible(const trip_surfels_cpu *s, int row, int column)
{
    const uint64_t key = key_at(s, cell_at(s, row, column));
    const int x = trip_surfel_pixel(column - TRIP_SURFEL_GUARD, s->camera.width);
    const int y = trip_surfel_pixel(row - TRIP_SURFEL_GUARD, s->camera.height);
    return key != NO_KEY &&
           (uint32_t)(key >> 32) <= s->depths[(size_t)y * (size_t)s->camera.width + (size_t)x];
}

static const trip_surfel_projected *holder(const trip_surfels_cpu *s, int row, int column)
{
    return &s->holders[cell_at(s, row, column)];
}

static void bound_row(void *context, unsigned row)
{
    trip_surfels_cpu *s = context;
    row_reach reach = { INFINITY, -INFINITY, 0 };
    for (int column = 0; column < s->pitch; column++) {
        if (!is_visible(s, (int)row, column))
            continue;
        const trip_surfel_projected *p = holder(s, (int)row, column);
        const float half = sqrtf((float)TRIP_SURFEL_REACH) / p->blend.down + 0.01f;
        reach.top = fminf(reach.top, p->y - half);
        reach.bottom = fmaxf(reach.bottom, p->y + half);
        reach.visible++;
    }
    s->reaches[row] = reach;
}

static void blend_at(sum *to, const trip_surfel_projected *p, float q, float dx, float dy)
{
    const float weight = trip_surfel_projected_weight(p, q);
    for (int k = 0; k < 3; k++)
        to->rgb[k] += weight * p->rgb[k];
    to->tolerance += weight * p->tolerance;
    to->weight += weight;
    if (to->coverage < 1 && trip_surfel_oval_radius2(&p->disc, dx, dy) <= (float)TRIP_SURFEL_RIM)
        to->coverage += trip_surfel_oval_coverage(&p->disc, dx, dy);
}

/* Adds a visible surfel to the rows of a strip. */
static void blend(trip_surfels_cpu *s, const trip_surfel_projected *p, int top, int end)
{
    trip_pixels rows =
        trip_surfel_rows(&p->blend, p->y, (float)TRIP_SURFEL_REACH, s->camera.height);
    rows.first = rows.first > top ? rows.first : top;
    rows.last = rows.last < end - 1 ? rows.last : end - 1;
    for (int y = rows.first; y <= rows.last; y++) {
        const float dy = (float)y + 0.5f - p->y;
        const trip_pixels columns =
            trip_surfel_columns(&p->blend, p->x, (float)TRIP_SURFEL_REACH, dy, s->camera.width);
        const size_t row = (size_t)y * (size_t)s->camera.width;
        for (int x = columns.first; x <= columns.last; x++) {
            const float dx = (float)x + 0.5f - p->x;
            const float q = trip_surfel_oval_radius2(&p->blend, dx, dy);
            const float z = trip_surfel_projected_depth(p, s->camera.ortho, dx, dy);
            if (q < (float)TRIP_SURFEL_REACH &&
                fabsf(z - float_of(s->depths[row + (size_t)x])) <= p->tolerance)
                blend_at(&s->sums[row + (size_t)x], p, q, dx, dy);
        }
    }
}

/* Blends the visible surfels in the order of their cells. So no bit depends on the strips. */
static void blend_strip(void *context, unsigned strip)
{
    trip_surfels_cpu *s = context;
    const int top = (int)strip * STRIP, width = s->camera.width;
    const int end = top + STRIP < s->camera.height ? top + STRIP : s->camera.height;
    sum *sums = s->sums + (size_t)top * (size_t)width;
    const size_t count = (size_t)(end - top) * (size_t)width;
    memset(sums, 0, count * sizeof *sums);
    for (int row = 0; row < s->cell_rows; row++) {
        if (s->reaches[row].top > (float)end || s->reaches[row].bottom < (float)top)
            continue;
        for (int column = 0; column < s->pitch; column++)
            if (is_visible(s, row, column))
                blend(s, holder(s, row, column), top, end);
    }
}

static void blend_batch(void *context, unsigned strip)
{
    trip_surfels_cpu *s = context;
    const int top = (int)strip * STRIP;
    const int end = top + STRIP < s->camera.height ? top + STRIP : s->camera.height;
    for (size_t i = 0; i < s->count; i++)
        if (s->batch_cells[i] != TRIP_SURFEL_NO_CELL)
            blend(s, &s->batch[i], top, end);
}

int trip_surfels_cpu_blend_from(trip_surfels_cpu *s, trip_surfel_getter *get, const void *context,
                                size_t count)
{
    const uint64_t began = trip_now_ns();
    if (!s->blending)
        memset(s->sums, 0, s->pixels * sizeof *s->sums);
    s->blending = true;
    const int status = project_all(s, get, context, count);
    s->stats.blend_ns += trip_now_ns() - began;
    return status;
}

/* Blends the visible surfels on the device, in the order of their cells. */
static int blend_on_device(trip_surfels_cpu *s)
{
    size_t count = 0;
    int status = s->device->read_depths(s->target, s->depths, s->fronts, s->numbers);
    s->stats.visible = 0;
    for (int row = 0; row < s->cell_rows && !status; row++)
        for (int column = 0; column < s->pitch && !status; column++) {
            if (!is_visible(s, row, column))
                continue;
            s->batch_cells[count++] = (uint32_t)cell_at(s, row, column);
            s->stats.visible++;
            if (count < s->batch_max)
                continue;
            status = s->device->blend(s->target, s->batch_cells, count);
            count = 0;
        }
    if (!status && count)
        status = s->device->blend(s->target, s->batch_cells, count);
    return status ? status : s->device->read_sums(s->target, s->sums);
}

static void blend_on_cpu(trip_surfels_cpu *s)
{
    trip_run_tasks(&s->runner, bound_row, s, (unsigned)s->cell_rows);
    if (!s->unselected)
        trip_run_tasks(&s->runner, blend_strip, s, tasks_for((size_t)s->camera.height, STRIP));
    s->stats.visible = 0;
    for (int row = 0; row < s->cell_rows; row++)
        s->stats.visible += s->reaches[row].visible;
}

static void divide_strip(void *context, unsigned strip)
{
    trip_surfels_cpu *s = context;
    const size_t per_strip = (size_t)STRIP * (size_t)s->camera.width, begin = strip * per_strip;
    for (size_t i = begin; i < begin + per_strip && i < s->pixels; i++)
        divide(&s->sums[i]);
}

void trip_surfels_cpu_each_visible(const trip_surfels_cpu *s,
                                   void (*mark)(void *context, uint32_t number), void *context)
{
    for (int row = 0; row < s->cell_rows; row++)
        for (int column = 0; column < s->pitch; column++)
            if (is_visible(s, row, column))
                mark(context, (uint32_t)key_at(s, cell_at(s, row, column)));
}

/* ---- edges ---- */

typedef struct picture {
    const trip_surfels_cpu *s;
    float *rgba, *depth;
} picture;

/* The neighbours of a pixel inside the picture, with the pixel itself; inclusive. */
typedef struct square {
    int left, right, top, bottom;
} square;

static square square_about(const trip_surfels_cpu *s, int x, int y)
{
    return (square){ x > 0 ? x - 1 : 0, x + 1 < s->camera.width ? x + 1 : x, y > 0 ? y - 1 : 0,
                     y + 1 < s->camera.height ? y + 1 : y };
}

static float depth_at(const trip_surfels_cpu *s, size_t pixel)
{
    return float_of(s->depths[pixel]);
}

/* Returns the sums on the border of a square with the least difference to a depth, or NULL if it
 * has none. Smaller squares about the same pixel must have none. */
static const sum *nearest_on(const trip_surfels_cpu *s, int x, int y, int reach, float depth)
{
    const sum *found = NULL;
    float least = INFINITY;
    for (int row = y - reach; row <= y + reach; row++) {
        const int step = row == y - reach || row == y + reach ? 1 : 2 * reach;
        if (row < 0 || row >= s->camera.height)
            continue;
        for (int column = x - reach; column <= x + reach; column += step) {
            if (column < 0 || column >= s->camera.width)
                continue;
            const size_t next = (size_t)row * (size_t)s->camera.width + (size_t)column;
            const float apart = fabsf(depth_at(s, next) - depth);
            if (s->sums[next].weight > 0 && apart < least) {
                found = &s->sums[next];
                least = apart;
            }
        }
    }
    return found;
}

/* Returns the sums that give pixel `at` its colour, or NULL for none. */
static const sum *donor_of(const trip_surfels_cpu *s, size_t at, int x, int y)
{
    const float depth = depth_at(s, at);
    const sum *found = NULL;
    if (isinf(depth))
        return NULL;
    if (s->sums[at].weight > 0)
        return &s->sums[at];
    for (int reach = 1; reach <= TRIP_SURFEL_DONORS && !found; reach++)
        found = nearest_on(s, x, y, reach, depth);
    return found;
}

/* Puts the neighbours that lie behind a pixel behind its colour. */
static void put_neighbours_behind(const trip_surfels_cpu *s, size_t at, square near, float limit,
                                  float rgba[4])
{
    float behind[4] = { 0 }, count = 0;
    for (int y = near.top; y <= near.bottom; y++)
        for (int x = near.left; x <= near.right; x++) {
            const size_t next = (size_t)y * (size_t)s->camera.width + (size_t)x;
            if (!(depth_at(s, next) > limit))
                continue;
            if (isinf(depth_at(s, next)))
                count++;
            if (!(s->sums[next].weight > 0))
                continue;
            count++;
            behind[3] += 1;
            for (int k = 0; k < 3; k++)
                behind[k] += s->sums[next].rgb[k];
        }
    const float opacity = s->sums[at].coverage;
    for (int k = 0; k < 4 && count > 0; k++)
        rgba[k] = opacity * rgba[k] + (1 - opacity) * behind[k] / count;
}

static void write_pixel(const picture *p, int x, int y)
{
    const trip_surfels_cpu *s = p->s;
    const size_t at = (size_t)y * (size_t)s->camera.width + (size_t)x;
    const square near = square_about(s, x, y);
    const sum *own = donor_of(s, at, x, y);
    const double *behind = s->settings.background;
    float rgba[4] = { 0 };
    if (own) {
        memcpy(rgba, own->rgb, sizeof own->rgb);
        rgba[3] = 1;
    }
    if (own && s->sums[at].coverage < 1)
        put_neighbours_behind(s, at, near, depth_at(s, at) + own->tolerance, rgba);
    const float opacity = (float)trip_surfel_opacity(&s->settings);
    for (int k = 0; k < 4; k++)
        rgba[k] *= opacity;
    const float rest = (1 - rgba[3]) * (float)behind[3];
    for (int k = 0; k < 3; k++)
        p->rgba[4 * at + (size_t)k] = rgba[k] + rest * (float)behind[k];
    p->rgba[4 * at + 3] = rgba[3] + rest;
    if (p->depth)
        p->depth[at] = own ? (float)((double)depth_at(s, at) *
                                     trip_camera_ray_length(&s->camera, x + 0.5, y + 0.5))
                           : INFINITY;
}

static void write_row(void *context, unsigned row)
{
    const picture *p = context;
    for (int x = 0; x < p->s->camera.width; x++)
        write_pixel(p, x, (int)row);
}

int trip_surfels_cpu_picture(trip_surfels_cpu *s, float *rgba, float *depth)
{
    const uint64_t began = trip_now_ns();
    picture p = { s, rgba, s->settings.depth ? depth : NULL };
    int status = 0;
    if (s->device)
        status = blend_on_device(s);
    else
        blend_on_cpu(s);
    if (!status) {
        trip_run_tasks(&s->runner, divide_strip, s, tasks_for((size_t)s->camera.height, STRIP));
        trip_run_tasks(&s->runner, write_row, &p, (unsigned)s->camera.height);
    }
    s->stats.blend_ns += trip_now_ns() - began;
    return status;
}

trip_surfels_cpu_stats trip_surfels_cpu_get_stats(const trip_surfels_cpu *s)
{
    return s->stats;
}
