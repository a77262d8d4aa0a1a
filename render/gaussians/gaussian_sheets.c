#include "gaussian_sheets.h"

#include <math.h>
#include <string.h>

#include "gaussian_code.h"
#include "gaussian_profile.h"
#include "pixels.h"
#include "renderer.h"
#include "weight.h"

enum {
    PROJECT_TASK = 64, /* Gaussians of a task */
    TILE_TASK = 4,     /* tiles of a task */
    PAIRS_PER_GAUSSIAN = 4,
    PAIRS_MIN = 1 << 16,
};

/* A footprint and its density in double precision, for the reference. */
typedef struct exact_splat {
    trip_gaussian_footprint footprint;
    trip_gaussian_profile profile;
    double rgb[3];
} exact_splat;

typedef struct tile_span {
    uint16_t left, right, top, bottom; /* empty if left > right */
} tile_span;

/* The sums of a sheet and the pixel itself, for the reference. */
typedef struct exact_pixel {
    double rgb[3], depth, transmittance;
    double sum_tau, sum_rgb[3], sum_depth;
    bool open;
} exact_pixel;

struct trip_gaussian_sheets {
    trip_gaussian_sheets_params params;
    const trip_tile_kernels *kernels;
    trip_sheet_run run;
    double spread;     /* trip_gaussian_sheets_spread() */
    int64_t undrawn;   /* the first sheet that is not drawn */
    int columns, rows; /* of tiles */
    size_t tiles, tile_floats;
    float *planes;
    uint16_t *open;
    exact_pixel *pixels; /* instead of both, for the reference */

    /* The Gaussians that some sheet still needs, in the order in which they came. */
    trip_sheet_splat *splats;
    exact_splat *exact; /* NULL unless for the reference */
    tile_span *spans;
    size_t count;
    const trip_gaussian *added;
    size_t added_count;

    size_t tile_first, tile_last; /* the tiles that are drawn at once */
    uint32_t *pairs;              /* Gaussians of each tile, in the order of adding */
    size_t pairs_max;
    uint32_t *pair_count, *pair_first; /* by tile */
};

/* ---- memory ---- */

static size_t pixels_of(const trip_gaussian_sheets *g)
{
    return (size_t)g->params.camera->width * (size_t)g->params.camera->height;
}

#define BUFFERS(X)                                                                                 \
    X(g->planes, g->params.reference ? 0 : g->tiles * g->tile_floats * sizeof(float))              \
    X(g->open, g->params.reference ? 0 : g->tiles * sizeof(uint16_t))                              \
    X(g->pixels, g->params.reference ? pixels_of(g) * sizeof(exact_pixel) : 0)                     \
    X(g->splats, g->params.room * sizeof(trip_sheet_splat))                                        \
    X(g->exact, g->params.reference ? g->params.room * sizeof(exact_splat) : 0)                    \
    X(g->spans, g->params.room * sizeof(tile_span))                                                \
    X(g->pairs, g->pairs_max * sizeof(uint32_t))                                                   \
    X(g->pair_count, g->tiles * sizeof(uint32_t))                                                  \
    X(g->pair_first, g->tiles * sizeof(uint32_t))

static void set_sizes(trip_gaussian_sheets *g, const trip_gaussian_sheets_params *p)
{
    const trip_camera *c = p->camera;
    g->params = *p;
    g->columns = (c->width + TRIP_TILE_PX - 1) / TRIP_TILE_PX;
    g->rows = (c->height + TRIP_TILE_PX - 1) / TRIP_TILE_PX;
    g->tiles = (size_t)g->columns * (size_t)g->rows;
    g->tile_floats =
        (size_t)(p->settings.depth ? TRIP_TILE_PLANES_MAX : TRIP_TILE_DEPTH) * TRIP_TILE_PIXELS;
    g->pairs_max = PAIRS_PER_GAUSSIAN * p->room;
    if (g->pairs_max < PAIRS_MIN)
        g->pairs_max = PAIRS_MIN;
}

size_t trip_gaussian_sheets_bytes(const trip_gaussian_sheets_params *p)
{
    trip_gaussian_sheets sizes = { 0 }, *g = &sizes;
    size_t bytes = 4096;
    set_sizes(g, p);
#define ADD(field, size) bytes += ((size) + 4095) / 4096 * 4096;
    BUFFERS(ADD)
#undef ADD
    return bytes;
}

static int take_memory(trip_gaussian_sheets *g)
{
    char needed[32], left[32];
    trip_budget *budget = g->params.budget;
    const uint64_t free_bytes = trip_budget_left_bytes(budget);
    size_t bytes = 0;
    bool all = true;
#define TAKE(field, size)                                                                          \
    bytes += size;                                                                                 \
    if ((size) > 0 && all)                                                                         \
        all = (field = trip_budget_take(budget, size)) != NULL;
    BUFFERS(TAKE)
#undef TAKE
    return all ? 0
               : trip_fail(TRIP_ERROR, "render", "memory",
                           "this view needs %s for the picture and the %llu Gaussians that meet a "
                           "sheet at a time, and --memory leaves %s: raise --memory",
                           trip_format_bytes(bytes, needed), (unsigned long long)g->params.room,
                           trip_format_bytes(free_bytes, left));
}

static trip_vec3 ray_at(const trip_gaussian_sheets *g, int x, int y)
{
    return trip_camera_ray(g->params.camera, x + 0.5, y + 0.5);
}

static double weight_at(const trip_gaussian_sheets *g, int x, int y)
{
    return trip_weight(g->params.weights, g->params.axis_of_view, ray_at(g, x, y), g->params.axis);
}

/* Whether the pass draws a pixel. */
static bool takes(const trip_gaussian_sheets *g, int x, int y)
{
    const trip_way way = trip_ray_goes(ray_at(g, x, y), g->params.axis);
    return (way == TRIP_WAY_UP) == (g->params.way > 0) && weight_at(g, x, y) > 0;
}

static float *plane_at(const trip_gaussian_sheets *g, int x, int y)
{
    const size_t tile =
        (size_t)(y / TRIP_TILE_PX) * (size_t)g->columns + (size_t)(x / TRIP_TILE_PX);
    return g->planes + tile * g->tile_floats + trip_tile_place(x % TRIP_TILE_PX, y % TRIP_TILE_PX);
}

/* Pixels that the pass does not draw are closed from the beginning. */
static void clear_rows(void *context, unsigned row)
{
    trip_gaussian_sheets *g = context;
    const trip_camera *c = g->params.camera;
    for (int column = 0; column < g->columns; column++) {
        const size_t tile = (size_t)row * (size_t)g->columns + (size_t)column;
        float *t = g->planes + tile * g->tile_floats;
        for (int y = 0; y < TRIP_TILE_PX; y++)
            for (int x = 0; x < TRIP_TILE_PX; x++) {
                const int px = column * TRIP_TILE_PX + x, py = (int)row * TRIP_TILE_PX + y;
                const int place = trip_tile_place(x, y);
                const bool open = px < c->width && py < c->height && takes(g, px, py);
                t[place] = open ? 1 : -1;
                if (open)
                    g->open[tile] = (uint16_t)(g->open[tile] | 1u << place / 16);
            }
    }
}

static void clear_pixels(trip_gaussian_sheets *g)
{
    const int width = g->params.camera->width;
    for (size_t i = 0; i < pixels_of(g); i++)
        g->pixels[i] =
            (exact_pixel){ .transmittance = 1,
                           .open = takes(g, (int)(i % (size_t)width), (int)(i / (size_t)width)) };
}

static trip_sheet_run run_of(const trip_gaussian_sheets_params *p)
{
    const trip_camera *c = p->camera;
    const double rx = p->way * trip_component(c->rx, p->axis);
    const double ry = p->way * trip_component(c->ry, p->axis);
    return (trip_sheet_run){
        .thickness = p->thickness,
        .r0 = p->way * trip_component(c->r0, p->axis),
        .rx = c->ortho ? 0 : rx,
        .ry = c->ortho ? 0 : ry,
        .ox = rx,
        .oy = ry,
        .parallel = c->ortho,
    };
}

int trip_gaussian_sheets_begin(trip_gaussian_sheets **out, const trip_gaussian_sheets_params *p)
{
    const trip_tile_kernels *kernels = trip_tile_kernels_choose(p->isa);
    *out = NULL;
    if (!kernels)
        return TRIP_USAGE;
    trip_gaussian_sheets *g = *out = trip_budget_take(p->budget, sizeof *g);
    if (!g)
        return trip_fail(TRIP_ERROR, "render", "memory", "the frame does not fit; raise --memory");
    set_sizes(g, p);
    g->kernels = kernels;
    g->run = run_of(p);
    g->spread = trip_gaussian_sheets_spread(p->camera, p->axis);
    g->undrawn = INT64_MIN;
    const int status = take_memory(g);
    if (status) {
        trip_gaussian_sheets_end(g);
        *out = NULL;
        return status;
    }
    if (p->reference)
        clear_pixels(g);
    else
        trip_run_tasks(&p->runner, clear_rows, g, (unsigned)g->rows);
    return 0;
}

void trip_gaussian_sheets_end(trip_gaussian_sheets *g)
{
    if (!g)
        return;
    trip_budget *budget = g->params.budget;
#define RELEASE(field, size) trip_budget_release(budget, field, size);
    BUFFERS(RELEASE)
#undef RELEASE
    trip_budget_release(budget, g, sizeof *g);
}

/* ---- Gaussians ---- */

/* Returns the number of the sheet at a coordinate. Sheets beyond 10^17 are one. */
static int64_t sheet_of(const trip_gaussian_sheets *g, double coordinate)
{
    return (int64_t)fmax(-1e17, fmin(1e17, floor(coordinate / g->params.thickness)));
}

double trip_gaussian_sheets_spread(const trip_camera *c, int axis)
{
    return TRIP_GAUSSIAN_REACH * sqrt(TRIP_GAUSSIAN_LOW_PASS) *
           hypot(trip_component(c->rx, axis), trip_component(c->ry, axis));
}

/* Sets the sheets that a Gaussian at a depth reaches. Returns false if none is in front of the eye.
 */
static bool find_sheets(const trip_gaussian_sheets *g, const trip_gaussian *from, double z,
                        trip_sheet_splat *to)
{
    const trip_gaussian_sheets_params *p = &g->params;
    double half[3];
    trip_gaussian_half_extents(from, half);
    to->coordinate = p->way * from->centre[p->axis];
    const double reach = hypot(half[p->axis], g->spread * (p->camera->ortho ? 1 : z));
    to->first = sheet_of(g, to->coordinate - reach);
    to->last = sheet_of(g, to->coordinate + reach);
    if (p->camera->ortho)
        return true;
    const int64_t eye = sheet_of(g, p->way * trip_component(p->camera->eye, p->axis));
    if (to->last < eye)
        return false;
    to->first = to->first > eye ? to->first : eye;
    return true;
}

static void set_splat(const trip_gaussian_footprint *f, const trip_gaussian_profile *p,
                      const double rgb[3], trip_sheet_splat *to)
{
    to->footprint = (trip_projected){
        .x = f->x,
        .y = f->y,
        .across = (float)f->across,
        .across_shear = (float)(f->across * f->shear),
        .down = (float)f->down,
        .limit = (float)f->limit * 1.0001f + 0.0001f,
        .opacity = (float)f->opacity,
        .rgb = { (float)rgb[0], (float)rgb[1], (float)rgb[2] },
        .z = (float)f->z,
        .reach_x = (float)f->reach_x,
        .reach_y = (float)f->reach_y,
        .curved = f->curved,
    };
    if (f->curved)
        to->curve = (trip_curve){ (float)f->bend_x,         (float)f->bend_y,
                                  (float)f->tilt,           (float)f->skew,
                                  (float)f->turn,           (float)(f->lo[0] - f->x),
                                  (float)(f->hi[0] - f->x), (float)(f->lo[1] - f->y),
                                  (float)(f->hi[1] - f->y) };
    to->across = (float)p->across;
    to->across_shear = (float)(p->across * p->shear);
    to->down = (float)p->down;
    to->slope_x = (float)p->x;
    to->slope_y = (float)p->y;
    to->variance = (float)p->variance;
    to->unit = (float)p->unit;
}

static void project(trip_gaussian_sheets *g, const trip_gaussian *from, size_t at)
{
    const trip_camera *c = g->params.camera;
    const trip_gaussian_settings *s = &g->params.settings;
    trip_sheet_splat *to = &g->splats[at];
    exact_splat e;
    g->spans[at] = (tile_span){ 1, 0, 1, 0 };
    if (!trip_gaussian_footprint_of(c, s, from, &e.footprint) ||
        !find_sheets(g, from, e.footprint.z, to))
        return;
    const trip_gaussian_footprint *f = &e.footprint;
    const trip_pixels x = trip_pixels_within(f->lo[0], f->hi[0], c->width);
    const trip_pixels y = trip_pixels_within(f->lo[1], f->hi[1], c->height);
    if (x.first > x.last || y.first > y.last)
        return;
    g->spans[at] =
        (tile_span){ (uint16_t)(x.first / TRIP_TILE_PX), (uint16_t)(x.last / TRIP_TILE_PX),
                     (uint16_t)(y.first / TRIP_TILE_PX), (uint16_t)(y.last / TRIP_TILE_PX) };
    e.profile = trip_gaussian_profile_of(c, from, f);
    trip_gaussian_colour(from, s->degree, trip_gaussian_direction(c, from), e.rgb);
    if (g->exact)
        g->exact[at] = e;
    set_splat(f, &e.profile, e.rgb, to);
}

static void project_some(void *context, unsigned task)
{
    trip_gaussian_sheets *g = context;
    const size_t from = (size_t)task * PROJECT_TASK;
    for (size_t i = from; i < from + PROJECT_TASK && i < g->added_count; i++)
        project(g, &g->added[i], g->count + i);
}

static void keep(trip_gaussian_sheets *g, size_t from, size_t to)
{
    if (from == to)
        return;
    g->splats[to] = g->splats[from];
    g->spans[to] = g->spans[from];
    if (g->exact)
        g->exact[to] = g->exact[from];
}

size_t trip_gaussian_sheets_room_left(const trip_gaussian_sheets *g)
{
    return g->params.room - g->count;
}

int trip_gaussian_sheets_add(trip_gaussian_sheets *g, const trip_gaussian *gaussians, size_t count)
{
    g->added = gaussians;
    g->added_count = count;
    trip_run_tasks(&g->params.runner, project_some, g,
                   (unsigned)((count + PROJECT_TASK - 1) / PROJECT_TASK));
    const size_t before = g->count;
    for (size_t i = 0; i < count; i++)
        if (g->spans[before + i].left <= g->spans[before + i].right)
            keep(g, before + i, g->count++);
    return trip_frame_poll();
}

/* ---- drawing ---- */

/* Counts the pairs of a tile and a Gaussian that reaches into the run. */
static void count_pairs(trip_gaussian_sheets *g)
{
    memset(g->pair_count, 0, g->tiles * sizeof *g->pair_count);
    for (size_t i = 0; i < g->count; i++) {
        const tile_span *span = &g->spans[i];
        if (g->splats[i].first >= g->run.first + TRIP_SHEET_RUN)
            continue;
        for (int row = span->top; row <= span->bottom; row++)
            for (int column = span->left; column <= span->right; column++)
                g->pair_count[(size_t)row * (size_t)g->columns + (size_t)column]++;
    }
}

/* Selects the next tiles: as many as the lists have room for. */
static void cut_tiles(trip_gaussian_sheets *g)
{
    size_t sum = 0, tile = g->tile_first = g->tile_last;
    for (; tile < g->tiles; tile++) {
        const size_t count = g->open[tile] ? g->pair_count[tile] : 0;
        if (sum + count > g->pairs_max && tile > g->tile_first)
            break;
        g->pair_first[tile] = (uint32_t)sum;
        sum += count;
    }
    g->tile_last = tile;
}

static void list_tiles(trip_gaussian_sheets *g)
{
    const size_t columns = (size_t)g->columns;
    for (size_t i = 0; i < g->count; i++) {
        const tile_span *span = &g->spans[i];
        if (g->splats[i].first >= g->run.first + TRIP_SHEET_RUN)
            continue;
        for (size_t row = span->top; row <= span->bottom; row++)
            for (size_t tile = row * columns + span->left; tile <= row * columns + span->right;
                 tile++)
                if (tile >= g->tile_first && tile < g->tile_last && g->open[tile])
                    g->pairs[g->pair_first[tile]++] = (uint32_t)i;
    }
    for (size_t tile = g->tile_first; tile < g->tile_last; tile++)
        if (g->open[tile])
            g->pair_first[tile] -= g->pair_count[tile];
}

static void draw_some(void *context, unsigned task)
{
    trip_gaussian_sheets *g = context;
    const trip_gaussian_settings *s = &g->params.settings;
    const size_t from = g->tile_first + (size_t)task * TILE_TASK;
    for (size_t tile = from; tile < from + TILE_TASK && tile < g->tile_last; tile++)
        if (g->open[tile] && g->pair_count[tile])
            g->kernels->draw_sheets(g->planes + tile * g->tile_floats, &g->open[tile], &g->run,
                                    g->splats, g->pairs + g->pair_first[tile], g->pair_count[tile],
                                    (int)(tile % (size_t)g->columns) * TRIP_TILE_PX,
                                    (int)(tile / (size_t)g->columns) * TRIP_TILE_PX,
                                    (float)trip_gaussian_termination(s), s->depth);
}

static void draw_tiles(trip_gaussian_sheets *g)
{
    count_pairs(g);
    for (g->tile_last = 0; g->tile_last < g->tiles;) {
        cut_tiles(g);
        list_tiles(g);
        const size_t tiles = g->tile_last - g->tile_first;
        trip_run_tasks(&g->params.runner, draw_some, g,
                       (unsigned)((tiles + TILE_TASK - 1) / TILE_TASK));
    }
}

/* ---- the reference ---- */

/* Returns the share of a density up to a sheet's beginning. */
static double share_before(const trip_gaussian_sheets *g, const trip_sheet_splat *s, int64_t sheet,
                           double mean, double deviation)
{
    if (sheet <= s->first)
        return 0;
    if (sheet > s->last)
        return 1;
    const double from = (double)sheet * g->params.thickness - s->coordinate - mean;
    return deviation > 0 ? 0.5 * erfc(-from / (deviation * M_SQRT2)) : from > 0;
}

static void add_exact(trip_gaussian_sheets *g, size_t i, int64_t sheet)
{
    const trip_camera *c = g->params.camera;
    const exact_splat *e = &g->exact[i];
    const trip_gaussian_footprint *f = &e->footprint;
    const trip_pixels columns = trip_pixels_within(f->lo[0], f->hi[0], c->width);
    const trip_pixels rows = trip_pixels_within(f->lo[1], f->hi[1], c->height);
    for (int y = rows.first; y <= rows.last; y++)
        for (int x = columns.first; x <= columns.last; x++) {
            exact_pixel *p = &g->pixels[(size_t)y * (size_t)c->width + (size_t)x];
            const double dx = x + 0.5 - f->x, dy = y + 0.5 - f->y;
            trip_ray_density d;
            if (!p->open || !trip_ray_density_of(f, &e->profile, c->ortho, dx, dy, &d))
                continue;
            const trip_sheet_run *r = &g->run;
            const double ray = r->r0 + r->rx * (x + 0.5) + r->ry * (y + 0.5);
            const double mean = d.from_centre * ray + e->profile.unit * (r->ox * dx + r->oy * dy);
            const double deviation = d.deviation * ray;
            const double tau = d.tau * (share_before(g, &g->splats[i], sheet + 1, mean, deviation) -
                                        share_before(g, &g->splats[i], sheet, mean, deviation));
            p->sum_tau += tau;
            p->sum_depth += tau * f->z;
            for (int k = 0; k < 3; k++)
                p->sum_rgb[k] += tau * e->rgb[k];
        }
}

static void composite_exact(const trip_gaussian_sheets *g, exact_pixel *p)
{
    if (!(p->sum_tau > 0))
        return;
    const double absorbed = p->transmittance * -expm1(-p->sum_tau), by = absorbed / p->sum_tau;
    for (int k = 0; k < 3; k++)
        p->rgb[k] += by * p->sum_rgb[k];
    p->depth += by * p->sum_depth;
    p->transmittance -= absorbed;
    p->open = p->transmittance >= trip_gaussian_termination(&g->params.settings);
    p->sum_tau = p->sum_depth = p->sum_rgb[0] = p->sum_rgb[1] = p->sum_rgb[2] = 0;
}

static int draw_exact(trip_gaussian_sheets *g)
{
    int status = 0;
    for (int64_t sheet = g->run.first; sheet < g->run.first + TRIP_SHEET_RUN && !status; sheet++) {
        bool any = false;
        for (size_t i = 0; i < g->count && !status; i++) {
            if (g->splats[i].first > sheet || g->splats[i].last < sheet)
                continue;
            any = true;
            add_exact(g, i, sheet);
            if (i % 64 == 63)
                status = trip_frame_poll();
        }
        for (size_t i = 0; any && i < pixels_of(g); i++)
            composite_exact(g, &g->pixels[i]);
    }
    return status;
}

/* ---- runs ---- */

/* Returns the first sheet of the run that holds a sheet. */
static int64_t begin_of_run(int64_t sheet)
{
    const int64_t rest = sheet % TRIP_SHEET_RUN;
    return sheet - (rest < 0 ? rest + TRIP_SHEET_RUN : rest);
}

/* Drops the Gaussians that end before a sheet. */
static void drop_passed(trip_gaussian_sheets *g, int64_t sheet)
{
    size_t left = 0;
    for (size_t i = 0; i < g->count; i++)
        if (g->splats[i].last >= sheet)
            keep(g, i, left++);
    g->count = left;
}

int trip_gaussian_sheets_draw(trip_gaussian_sheets *g, double coordinate, bool *drawn)
{
    int64_t next = INT64_MAX;
    for (size_t i = 0; i < g->count; i++) {
        trip_sheet_splat *s = &g->splats[i];
        if (s->last < g->undrawn) /* it came late */
            s->first = s->last = g->undrawn;
        const int64_t here = s->first > g->undrawn ? s->first : g->undrawn;
        next = here < next ? here : next;
    }
    *drawn = false;
    if (next == INT64_MAX)
        return 0;
    next = begin_of_run(next);
    if (!((double)(next + TRIP_SHEET_RUN) * g->params.thickness <= coordinate))
        return 0;
    g->run.first = next;
    int status = 0;
    if (g->params.reference)
        status = draw_exact(g);
    else
        draw_tiles(g);
    g->undrawn = next + TRIP_SHEET_RUN;
    drop_passed(g, g->undrawn);
    *drawn = true;
    return status ? status : trip_frame_poll();
}

bool trip_gaussian_sheets_is_open(const trip_gaussian_sheets *g)
{
    if (g->params.reference)
        return true;
    for (size_t i = 0; i < g->tiles; i++)
        if (g->open[i])
            return true;
    return false;
}

/* ---- results ---- */

static float share_of(const trip_gaussian_sheets *g, int x, int y)
{
    const trip_gaussian_sheets_params *p = &g->params;
    double all = 0;
    for (int axis = 0; axis < 3; axis++) {
        const double w = trip_weight(p->weights, p->axis_of_view, ray_at(g, x, y), axis);
        all += w * w;
    }
    const double w = weight_at(g, x, y);
    return (float)(w * w / all);
}

/* Reads a pixel: colour, opacity, and depth weighted by opacity. */
static void read_pixel(const trip_gaussian_sheets *g, int x, int y, float to[5])
{
    const int planes = g->params.settings.depth ? 4 : 3;
    if (g->params.reference) {
        const exact_pixel *p = &g->pixels[(size_t)y * (size_t)g->params.camera->width + (size_t)x];
        for (int k = 0; k < 3; k++)
            to[k] = (float)p->rgb[k];
        to[3] = (float)(1 - p->transmittance);
        to[4] = (float)p->depth;
        return;
    }
    const float *from = plane_at(g, x, y);
    for (int k = 0; k < planes; k++)
        to[k < 3 ? k : 4] = from[(TRIP_TILE_RED + k) * TRIP_TILE_PIXELS];
    to[3] = 1 - fabsf(from[TRIP_TILE_T]);
}

typedef struct merging {
    const trip_gaussian_sheets *g;
    float *rgba, *depth;
} merging;

static void merge_row(void *context, unsigned row)
{
    const merging *m = context;
    const trip_camera *c = m->g->params.camera;
    for (int x = 0, y = (int)row; x < c->width; x++) {
        if (!takes(m->g, x, y))
            continue;
        const size_t at = (size_t)y * (size_t)c->width + (size_t)x;
        const float share = share_of(m->g, x, y);
        float pixel[5] = { 0 };
        read_pixel(m->g, x, y, pixel);
        for (int k = 0; k < 4; k++)
            m->rgba[4 * at + (size_t)k] += share * pixel[k];
        if (m->depth)
            m->depth[at] +=
                (float)((double)(share * pixel[4]) * trip_camera_ray_length(c, x + 0.5, y + 0.5));
    }
}

void trip_gaussian_sheets_merge(const trip_gaussian_sheets *g, float *rgba, float *depth)
{
    merging m = { g, rgba, g->params.settings.depth ? depth : NULL };
    trip_run_tasks(&g->params.runner, merge_row, &m, (unsigned)g->params.camera->height);
}
