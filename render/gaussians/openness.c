#include "openness.h"

#include <math.h>
#include <string.h>

#include "clock.h"
#include "gaussian_area.h"
#include "gaussian_code.h"
#include "gaussian_colour.h"
#include "gaussian_keys.h"
#include "renderer.h"
#include "report.h"

enum {
    HARMONICS = 9,    /* up to degree 2 */
    CHANNELS = 10,    /* of a node: harmonics, then the weight */
    GROUP = 8,        /* bricks that are read before they are gathered */
    SAMPLES_MAX = 16, /* points along an axis of a surfel */
    LAYERS = 16,      /* of nodes in a piece of work */
};

#define BUFFER_BYTES ((size_t)TRIP_GAUSSIAN_BRICK_RECORDS_MAX * TRIP_GAUSSIAN_RECORD_BYTES)
/* Sums count optical depth in units of 2^-24, and end near 128: no light passes. */
#define FIXED 16777216.0
#define SUM_MAX (UINT32_C(1) << 31)
#define SHARE_MAX 8.0    /* optical depth */
#define SURFEL_REACH 2.0 /* deviations */
/* The weight of a node inside matter: exp(-MATTER s) for the optical depth s of a cell. */
#define MATTER 16.0
#define WEIGHT_MIN 1e-4

typedef enum stage { GATHER, AVERAGE, SWEEP, ADD, WEIGH, BLUR, COMPLETE } stage;

struct trip_openness {
    const trip_gaussian_set *set;
    trip_budget *budget;
    int light_cells;
    double origin[3], cell; /* of node 0; length of a cell */
    double range;           /* R, in cells of the extinction */
    trip_light_grid one;    /* T of a direction; its nodes are the lattice's */
    size_t nodes;
    float *open; /* CHANNELS a node */

    /* While the lattice is made. The extinction has TRIP_OPEN_STRIDE cells in each cell. */
    trip_light_grid extinction; /* optical depth of a cell; first uint32_t sums */
    size_t fine_nodes;
    unsigned char *clear;  /* as in trip_light_sweep */
    void *columns;         /* keeps the memory of the sweeps */
    unsigned char *buffer; /* of GROUP bricks */
    trip_gaussian_walk walk;
    bool has_node;
    uint64_t brick, end; /* of the node */
    const trip_file_gaussian_brick *group[GROUP];
    unsigned group_count;
    trip_light_sweep sweep;
    bool sweeping;
    int direction, layer;
    float basis[HARMONICS]; /* times the weights, of the direction */
    stage stage;
    trip_light_stats stats;
};

/* ---- memory ---- */

/* The buffers, and their sizes in bytes. */
#define RESULT(X) X(o->open, o->nodes *CHANNELS * sizeof *o->open)
#define WORK(X)                                                                                    \
    X(o->extinction.at, o->fine_nodes * sizeof *o->extinction.at)                                  \
    X(o->one.at, o->nodes * sizeof *o->one.at)                                                     \
    X(o->clear, o->nodes)                                                                          \
    X(o->buffer, GROUP *BUFFER_BYTES)                                                              \
    X(o->columns, trip_light_sweep_max_bytes(&o->one))

#define RELEASE(field, bytes) trip_budget_release(o->budget, field, bytes), field = NULL;
#define TAKE(field, bytes) all = all && (field = trip_budget_take(o->budget, bytes)) != NULL;
#define ADD_BYTES(field, bytes) +(bytes)

static void stop(trip_openness *o)
{
    trip_light_sweep_end(&o->sweep);
    o->sweeping = false;
    WORK(RELEASE)
}

void trip_openness_end(trip_openness *o)
{
    if (!o)
        return;
    stop(o);
    RESULT(RELEASE)
    trip_budget_release(o->budget, o, sizeof *o);
}

static bool take_memory(trip_openness *o)
{
    bool all = true;
    RESULT(TAKE)
    WORK(TAKE)
    o->stats.memory_bytes = 0 RESULT(ADD_BYTES);
    return all;
}

/* ---- beginning ---- */

/* Places the lattice over the bounds of the centres, without strays: a side is at most twice as
 * long as the typical one. */
static void place(trip_openness *o)
{
    const trip_file_gaussian_header *h = &o->set->header;
    double side[3], longest = 0, sum = 0;
    for (int a = 0; a < 3; a++) {
        const double more = (h->typical_hi[a] - h->typical_lo[a]) / 2;
        const double lo = fmax(h->centre_lo[a], h->typical_lo[a] - more);
        const double hi = fmin(h->centre_hi[a], h->typical_hi[a] + more);
        side[a] = fmax(0, hi - lo);
        o->origin[a] = lo;
        longest = fmax(longest, side[a]);
        sum += side[a] * side[a];
    }
    const int cells = o->light_cells / TRIP_OPEN_STRIDE;
    o->cell = longest > 0 ? longest / cells : 1;
    o->range = TRIP_OPEN_STRIDE * (longest > 0 ? TRIP_OPENNESS_RANGE * sqrt(sum) / o->cell : 1);
    o->extinction.spacing = 1;
    o->one.spacing = TRIP_OPEN_STRIDE;
    for (int a = 0; a < 3; a++) {
        o->origin[a] -= TRIP_OPENNESS_MARGIN * o->cell;
        o->one.nodes[a] = (int)ceil(side[a] / o->cell - 1e-9) + 1 + 2 * TRIP_OPENNESS_MARGIN;
        o->extinction.nodes[a] = TRIP_OPEN_STRIDE * (o->one.nodes[a] - 1) + 1;
    }
    o->nodes = trip_light_grid_count(&o->one);
    o->fine_nodes = trip_light_grid_count(&o->extinction);
}

int trip_openness_begin(trip_openness **out, const trip_gaussian_set *set, int light_cells,
                        trip_budget *budget)
{
    char text[32];
    trip_openness *o = *out = trip_budget_take(budget, sizeof *o);
    if (!o)
        return trip_fail(TRIP_ERROR, "render", "occlusion", "out of memory; raise --memory");
    *o = (trip_openness){ .set = set, .budget = budget, .light_cells = light_cells };
    place(o);
    if (take_memory(o))
        return 0;
    const size_t bytes = 0 RESULT(ADD_BYTES) WORK(ADD_BYTES);
    const int *nodes = o->one.nodes;
    const int status = trip_fail(TRIP_ERROR, "render", "occlusion",
                                 "a lattice of %d x %d x %d nodes takes %s, which does not fit the "
                                 "memory given; raise --memory or lower --light-cells",
                                 nodes[0], nodes[1], nodes[2], trip_format_bytes(bytes, text));
    trip_openness_end(o);
    *out = NULL;
    return status;
}

/* ---- gathering ---- */

/* Adds to a sum up to SUM_MAX. Later values do not matter, so neither does the order. */
static void add_share(uint32_t *sum, double share)
{
    if (__atomic_load_n(sum, __ATOMIC_RELAXED) < SUM_MAX)
        __atomic_fetch_add(sum, (uint32_t)(share * FIXED + 0.5), __ATOMIC_RELAXED);
}

/* Adds optical depth at a point in cells to the nodes around it, in proportion to their nearness.
 */
static void add_point(trip_openness *o, const double at[3], double depth)
{
    const int *nodes = o->extinction.nodes;
    const size_t step[3] = { 1, (size_t)nodes[0], (size_t)nodes[0] * (size_t)nodes[1] };
    uint32_t *first = (uint32_t *)(void *)o->extinction.at;
    double part[3];
    for (int a = 0; a < 3; a++) {
        if (!(at[a] >= 0 && at[a] < nodes[a] - 1))
            return;
        first += (size_t)at[a] * step[a];
        part[a] = at[a] - floor(at[a]);
    }
    for (int n = 0; n < 8; n++) {
        double share = depth;
        size_t corner = 0;
        for (int a = 0; a < 3; a++) {
            share *= n >> a & 1 ? part[a] : 1 - part[a];
            corner += (size_t)(n >> a & 1) * step[a];
        }
        add_share(&first[corner], share);
    }
}

/* The points of a surfel along one axis, and their shares. */
typedef struct samples {
    int count;
    double at[SAMPLES_MAX], share[SAMPLES_MAX]; /* `at` in cells */
} samples;

static samples samples_of(double deviation)
{
    const double wanted = ceil(2 * SURFEL_REACH * deviation);
    samples s = { .count = wanted > 1 ? wanted < SAMPLES_MAX ? (int)wanted : SAMPLES_MAX : 1 };
    double sum = 0;
    for (int i = 0; i < s.count; i++) {
        const double x = SURFEL_REACH * ((2 * i + 1.0) / s.count - 1);
        s.at[i] = x * deviation;
        s.share[i] = exp(-0.5 * x * x);
        sum += s.share[i];
    }
    for (int i = 0; i < s.count; i++)
        s.share[i] /= sum;
    return s;
}

/* Adds the optical depth of a surfel seen face-on: twice the mean over all directions. */
static void add_surfel(trip_openness *o, const trip_gaussian *g)
{
    const double cell = o->cell / TRIP_OPEN_STRIDE;
    const double depth = 2 * trip_gaussian_mean_depth(g) / (cell * cell);
    const int least = trip_surfel_axis(g), first = least ? 0 : 1, second = 3 - least - first;
    const trip_vec3 across = trip_surfel_principal(g, first),
                    down = trip_surfel_principal(g, second);
    double centre[3];
    for (int a = 0; a < 3; a++)
        centre[a] = (g->centre[a] - o->origin[a]) / cell;
    const samples u = samples_of((double)g->deviations[first] / cell);
    const samples v = samples_of((double)g->deviations[second] / cell);
    for (int i = 0; i < u.count; i++)
        for (int k = 0; k < v.count; k++) {
            double at[3];
            for (int a = 0; a < 3; a++)
                at[a] = centre[a] + u.at[i] * trip_component(across, a) +
                        v.at[k] * trip_component(down, a);
            add_point(o, at, fmin(SHARE_MAX, depth * u.share[i] * v.share[k]));
        }
}

static void gather_brick(void *context, unsigned number)
{
    trip_openness *o = context;
    const trip_file_gaussian_brick *b = o->group[number];
    const unsigned char *record = o->buffer + number * BUFFER_BYTES;
    for (uint32_t i = 0; i < b->records; i++, record += TRIP_GAUSSIAN_RECORD_BYTES) {
        trip_gaussian g;
        trip_gaussian_decode(b, record, NULL, 0, &g);
        add_surfel(o, &g);
    }
}

/* Finds the next brick of the finest level. Returns false after the last one. */
static bool next_brick(trip_openness *o)
{
    const trip_gaussian_lod finest = { 0 };
    while (!o->has_node || o->brick == o->end) {
        o->has_node = trip_gaussian_walk_next(o->set, &finest, &o->walk);
        if (!o->has_node)
            return false;
        const trip_file_gaussian_node *n = &o->set->nodes[o->walk.node];
        o->brick = n->first_brick[0];
        o->end = o->brick + n->brick_count[0];
    }
    return true;
}

static int gather(trip_openness *o, const trip_task_runner *runner)
{
    int status = 0;
    for (o->group_count = 0; o->group_count < GROUP && !status && next_brick(o); o->group_count++) {
        const trip_file_gaussian_brick *b = &o->set->lists[0].bricks[o->brick];
        o->group[o->group_count] = b;
        status = trip_gaussian_set_read(o->set, 0, o->brick++, 0,
                                        o->buffer + o->group_count * BUFFER_BYTES);
        o->stats.splats += b->records;
        o->stats.bytes_read += (uint64_t)b->records * TRIP_GAUSSIAN_RECORD_BYTES;
        o->stats.reads++;
    }
    if (status)
        return status;
    trip_run_tasks(runner, gather_brick, o, o->group_count);
    if (o->group_count < GROUP)
        o->stage = AVERAGE;
    return TRIP_FRAME_MORE;
}

/* ---- sweeps ---- */

static size_t layer_nodes(const trip_openness *o)
{
    return (size_t)o->one.nodes[0] * (size_t)o->one.nodes[1];
}

/* Goes to the next layers. Returns false after the last one. */
static bool next_layers(trip_openness *o)
{
    o->layer += LAYERS;
    if (o->layer < o->one.nodes[2])
        return true;
    o->layer = 0;
    return false;
}

/* Marks the cells around a node of the extinction as not clear, and the cells around these. */
static void mark(trip_openness *o, const int node[3])
{
    int lo[3], hi[3];
    for (int a = 0; a < 3; a++) {
        const int first = (node[a] - 1) / TRIP_OPEN_STRIDE - 1,
                  last = node[a] / TRIP_OPEN_STRIDE + 1;
        lo[a] = first > 0 ? first : 0;
        hi[a] = last < o->one.nodes[a] - 2 ? last : o->one.nodes[a] - 2;
    }
    for (int k = lo[2]; k <= hi[2]; k++)
        for (int j = lo[1]; j <= hi[1]; j++)
            memset(o->clear +
                       ((size_t)k * (size_t)(o->one.nodes[1] - 1) + (size_t)j) *
                           (size_t)(o->one.nodes[0] - 1) +
                       lo[0],
                   0, (size_t)(hi[0] - lo[0] + 1));
}

/* Converts the sums of a row to floats in place. */
static void average_row(trip_openness *o, int j, int k)
{
    const int *nodes = o->extinction.nodes;
    float *row = o->extinction.at + ((size_t)k * (size_t)nodes[1] + (size_t)j) * (size_t)nodes[0];
    for (int i = 0; i < nodes[0]; i++) {
        uint32_t sum;
        memcpy(&sum, &row[i], sizeof sum);
        row[i] = (float)((sum < SUM_MAX ? sum : SUM_MAX) / FIXED);
        if (sum > 0)
            mark(o, (int[]){ i, j, k });
    }
}

static int average(trip_openness *o)
{
    const int *nodes = o->extinction.nodes;
    if (!o->layer)
        memset(o->clear, 1, o->nodes);
    for (int i = 0; i < LAYERS && o->layer < nodes[2]; i++, o->layer++)
        for (int j = 0; j < nodes[1]; j++)
            average_row(o, j, o->layer);
    if (o->layer == nodes[2]) {
        o->layer = 0;
        o->stage = SWEEP;
    }
    return TRIP_FRAME_MORE;
}

/* Sets the harmonics of the direction, times its share and a factor for each degree. The factors of
 * max(0, cos) / pi are 1, 2/3 and 1/4. */
static void set_basis(trip_openness *o, trip_vec3 direction)
{
    static const double of_degree[3] = { 1, 2.0 / 3, 1.0 / 4 };
    double basis[TRIP_SH_MAX];
    trip_sh_basis(2, direction, basis);
    for (int i = 0; i < HARMONICS; i++)
        o->basis[i] =
            (float)(basis[i] * of_degree[(i > 0) + (i > 3)] * 4 * M_PI / TRIP_OPENNESS_DIRECTIONS);
}

static int begin_sweep(trip_openness *o)
{
    static const trip_affine cells = { .m = { { 1, 0, 0, 0 }, { 0, 1, 0, 0 }, { 0, 0, 1, 0 } } };
    const trip_vec3 direction = trip_even_direction(o->direction, TRIP_OPENNESS_DIRECTIONS);
    set_basis(o, direction);
    memset(o->one.at, 0, o->nodes * sizeof *o->one.at);
    o->sweep = (trip_light_sweep){ .extinction = &o->extinction,
                                   .out = &o->one,
                                   .weight = 1,
                                   .range = o->range,
                                   .parts = TRIP_OPEN_STRIDE,
                                   .clear = o->clear,
                                   .index_to_world = &cells };
    for (int a = 0; a < 3; a++)
        o->sweep.last[a] = o->extinction.nodes[a] - 1;
    trip_budget_release(o->budget, o->columns, trip_light_sweep_max_bytes(&o->one));
    o->columns = NULL;
    o->sweeping = trip_light_sweep_begin(&o->sweep, direction, o->budget);
    return o->sweeping ? 0
                       : trip_fail(TRIP_ERROR, "render", "occlusion",
                                   "out of memory; raise --memory or lower --light-cells");
}

static int sweep(trip_openness *o, const trip_task_runner *runner)
{
    const int status = o->sweeping ? 0 : begin_sweep(o);
    if (status)
        return status;
    if (!trip_light_sweep_step(&o->sweep, runner)) {
        trip_light_sweep_end(&o->sweep);
        o->sweeping = false;
        o->stage = ADD;
    }
    return TRIP_FRAME_MORE;
}

static void add_layer(void *context, unsigned number)
{
    const trip_openness *o = context;
    const size_t begin = layer_nodes(o) * ((size_t)o->layer + number);
    const size_t end = begin + layer_nodes(o);
    for (size_t n = begin; n < end; n++) {
        const float through = o->one.at[n];
        float *to = o->open + n * CHANNELS;
        for (int i = 0; i < HARMONICS; i++)
            to[i] += through * o->basis[i];
    }
}

static unsigned layers_left(const trip_openness *o)
{
    const int left = o->one.nodes[2] - o->layer;
    return (unsigned)(left < LAYERS ? left : LAYERS);
}

static int add(trip_openness *o, const trip_task_runner *runner)
{
    trip_run_tasks(runner, add_layer, o, layers_left(o));
    if (!next_layers(o))
        o->stage = ++o->direction < TRIP_OPENNESS_DIRECTIONS ? SWEEP : WEIGH;
    return TRIP_FRAME_MORE;
}

/* Returns the extinction at the first node of a row of the lattice. The next node is
 * TRIP_OPEN_STRIDE further. */
static const float *extinction_of(const trip_openness *o, size_t row)
{
    const size_t rows = (size_t)o->one.nodes[1];
    const size_t j = TRIP_OPEN_STRIDE * (row % rows), k = TRIP_OPEN_STRIDE * (row / rows);
    return o->extinction.at +
           (k * (size_t)o->extinction.nodes[1] + j) * (size_t)o->extinction.nodes[0];
}

/* Multiplies the harmonics of a layer by the weights of its nodes. */
static void weigh_layer(void *context, unsigned number)
{
    const trip_openness *o = context;
    const size_t rows = (size_t)o->one.nodes[1], first = rows * ((size_t)o->layer + number);
    float *to = o->open + first * (size_t)o->one.nodes[0] * CHANNELS;
    for (size_t row = first; row < first + rows; row++) {
        const float *s = extinction_of(o, row);
        for (int n = 0; n < o->one.nodes[0]; n++, s += TRIP_OPEN_STRIDE, to += CHANNELS) {
            to[HARMONICS] = (float)(WEIGHT_MIN + exp(-MATTER * (double)*s));
            for (int i = 0; i < HARMONICS; i++)
                to[i] *= to[HARMONICS];
        }
    }
}

static int weigh(trip_openness *o, const trip_task_runner *runner)
{
    trip_run_tasks(runner, weigh_layer, o, layers_left(o));
    if (!next_layers(o))
        o->stage = BLUR;
    return TRIP_FRAME_MORE;
}

/* Blurs a line of nodes by 1/4, 1/2, 1/4. */
static void blur_line(float *line, size_t step, int count)
{
    float before[CHANNELS];
    memcpy(before, line, sizeof before);
    for (int n = 0; n < count; n++, line += step) {
        const float *after = n + 1 < count ? line + step : line;
        for (int i = 0; i < CHANNELS; i++) {
            const float here = line[i];
            line[i] = 0.25f * (before[i] + after[i]) + 0.5f * here;
            before[i] = here;
        }
    }
}

/* Blurs lines along axes 0 and 1 of a layer, or along axis 2 of a row. */
static void blur_layer(void *context, unsigned number)
{
    const trip_openness *o = context;
    const int *nodes = o->one.nodes;
    const size_t row = (size_t)nodes[0] * CHANNELS, layer = layer_nodes(o) * CHANNELS;
    float *open = o->open + layer * (size_t)(o->layer + (int)number);
    for (int j = 0; j < nodes[1]; j++)
        blur_line(open + row * (size_t)j, CHANNELS, nodes[0]);
    for (int i = 0; i < nodes[0]; i++)
        blur_line(open + (size_t)i * CHANNELS, row, nodes[1]);
}

static void blur_row(void *context, unsigned number)
{
    const trip_openness *o = context;
    const int *nodes = o->one.nodes;
    float *open = o->open + (size_t)nodes[0] * CHANNELS * number;
    for (int i = 0; i < nodes[0]; i++)
        blur_line(open + (size_t)i * CHANNELS, layer_nodes(o) * CHANNELS, nodes[2]);
}

static int blur(trip_openness *o, const trip_task_runner *runner)
{
    trip_run_tasks(runner, blur_layer, o, layers_left(o));
    if (next_layers(o))
        return TRIP_FRAME_MORE;
    trip_run_tasks(runner, blur_row, o, (unsigned)o->one.nodes[1]);
    stop(o);
    o->stage = COMPLETE;
    return TRIP_FRAME_DONE;
}

int trip_openness_step(trip_openness *o, const trip_task_runner *runner)
{
    const double begun = trip_now_ms();
    const bool gathers = o->stage <= AVERAGE;
    const int status = o->stage == GATHER    ? gather(o, runner)
                       : o->stage == AVERAGE ? average(o)
                       : o->stage == SWEEP   ? sweep(o, runner)
                       : o->stage == ADD     ? add(o, runner)
                       : o->stage == WEIGH   ? weigh(o, runner)
                       : o->stage == BLUR    ? blur(o, runner)
                                             : TRIP_FRAME_DONE;
    *(gathers ? &o->stats.gather_ms : &o->stats.sweep_ms) += trip_now_ms() - begun;
    return status;
}

/* ---- results ---- */

bool trip_openness_is_complete(const trip_openness *o)
{
    return o->stage == COMPLETE;
}

int trip_openness_light_cells(const trip_openness *o)
{
    return o->light_cells;
}

const trip_light_grid *trip_openness_grid(const trip_openness *o, double *cell)
{
    *cell = o->cell;
    return &o->one;
}

trip_light_stats trip_openness_stats(const trip_openness *o)
{
    return o->stats;
}

/* Interpolates the channels at a point in cells. */
static void interpolate(const trip_openness *o, const double at[3], double sums[CHANNELS])
{
    const int *nodes = o->one.nodes;
    const size_t step[3] = { CHANNELS, (size_t)nodes[0] * CHANNELS, layer_nodes(o) * CHANNELS };
    const float *from = o->open;
    double part[3];
    for (int a = 0; a < 3; a++) {
        const double last = nodes[a] - 1, x = at[a] > 0 ? at[a] < last ? at[a] : last : 0;
        const int cell = x < last ? (int)x : nodes[a] - 2;
        part[a] = x - cell;
        from += (size_t)cell * step[a];
    }
    memset(sums, 0, CHANNELS * sizeof *sums);
    for (int n = 0; n < 8; n++) {
        const float *node = from;
        double weight = 1;
        for (int a = 0; a < 3; a++) {
            node += (size_t)(n >> a & 1) * step[a];
            weight *= n >> a & 1 ? part[a] : 1 - part[a];
        }
        for (int i = 0; i < CHANNELS; i++)
            sums[i] += weight * (double)node[i];
    }
}

double trip_openness_at(const trip_openness *o, const double centre[3], const double normal[3])
{
    double at[3], sums[CHANNELS], basis[TRIP_SH_MAX], sum = 0;
    for (int a = 0; a < 3; a++)
        at[a] = (centre[a] - o->origin[a]) / o->cell + TRIP_OPENNESS_BIAS * normal[a];
    interpolate(o, at, sums);
    trip_sh_basis(2, trip_v3(normal[0], normal[1], normal[2]), basis);
    for (int i = 0; i < HARMONICS; i++)
        sum += basis[i] * sums[i];
    sum /= sums[HARMONICS];
    return sum > 0 ? sum < 1 ? sum : 1 : 0;
}

trip_openness_view trip_openness_view_of(const trip_openness *o, const trip_camera *c,
                                         const trip_gaussian_transform *placement)
{
    trip_gaussian_lod eye = trip_gaussian_lod_of(c, 0);
    trip_openness_view v = { .openness = o, .parallel = c->ortho };
    double offset;
    const double to_eye[3] = { -c->forward.x, -c->forward.y, -c->forward.z };
    trip_place_lod(&eye, placement);
    if (c->ortho)
        trip_place_function(placement, to_eye, 0, v.eye, &offset);
    else
        memcpy(v.eye, eye.eye, sizeof v.eye);
    return v;
}

void trip_openness_change(const void *view, trip_gaussian *g)
{
    const trip_openness_view *v = view;
    const trip_vec3 n = trip_surfel_normal(g);
    double normal[3] = { n.x, n.y, n.z }, facing = 0;
    for (int a = 0; a < 3; a++)
        facing += normal[a] * (v->parallel ? v->eye[a] : v->eye[a] - g->centre[a]);
    for (int a = 0; a < 3 && facing < 0; a++)
        normal[a] = -normal[a];
    const double open = trip_openness_at(v->openness, g->centre, normal);
    g->hidden = (uint16_t)lround((1 - open) * 65535);
}
