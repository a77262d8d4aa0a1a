#include "light_map.h"

#include <string.h>

#include "clock.h"
#include "light_shares.h"
#include "renderer.h"
#include "report.h"

enum {
    CODES = 65536,
    SLOTS = 4,
    SLOT_BYTES = 256 << 10,
    PIECE_NODES = 1 << 16, /* nodes that a step averages or clears, in less than a millisecond */
};

/* The next stage. */
typedef enum stage { GATHER, AVERAGE, SWEEP_REACHED, SWEEP_OPEN, COMPLETE } stage;

struct trip_light_map {
    trip_budget *budget;
    trip_light_source source; /* of the frame */

    /* The inputs of the gathered extinction. */
    bool has_key, pre;
    const trip_dataset *data;
    unsigned level;
    trip_clip clip;
    float extinctions[CODES];  /* per world unit, by code */
    uint32_t shown[CODES + 1]; /* number of codes below this one with extinction */
    bool point_light;
    trip_vec3 light;            /* light of `reached`, as in trip_effects_view */
    bool has_reached, has_open; /* the lattices are complete */

    /* Sums of extinction while gathering; then floats, followed by the floats of `reached`. */
    double *memory;
    trip_light_grid extinction, reached, open;
    size_t nodes, open_nodes;
    trip_light_shares shares[3]; /* for uneven spacing, while gathering and averaging */

    stage stage;
    trip_reader *reader;        /* while gathering and averaging; otherwise NULL */
    trip_selection *selections; /* while gathering: room for all lists of the data set */
    unsigned list_count;
    trip_pass pass;
    size_t averaged; /* number of rows of nodes averaged */
    size_t cleared;  /* next node of the current grid */
    trip_light_sweep sweep;
    bool sweeping;
    int part;         /* current direction of `open`, or region of a point light */
    uint64_t made_ns; /* time of completion */
    trip_light_stats stats;
    uint32_t voxels[TRIP_RUN_RECORDS_MAX]; /* of a run */
};

int trip_light_map_create(trip_light_map **out, trip_budget *budget)
{
    trip_light_map *m = *out = trip_budget_take(budget, sizeof *m);
    if (!m)
        return trip_fail(TRIP_ERROR, "render", "light", "out of memory; raise --memory");
    m->budget = budget;
    m->stage = COMPLETE;
    return 0;
}

static void stop_gathering(trip_light_map *m)
{
    trip_reader_destroy(m->reader);
    m->reader = NULL;
    for (unsigned i = 0; i < m->pass.selection_count; i++)
        trip_selection_destroy(&m->selections[i], m->budget);
    trip_budget_release(m->budget, m->selections, m->list_count * sizeof *m->selections);
    m->selections = NULL;
    m->averaged = 0;
    m->pass = (trip_pass){ 0 };
    for (int a = 0; a < 3; a++)
        trip_light_shares_destroy(&m->shares[a], m->budget);
}

static void stop_sweeping(trip_light_map *m)
{
    trip_light_sweep_end(&m->sweep);
    m->sweeping = false;
    m->part = 0;
    m->cleared = 0;
}

static void drop_open(trip_light_map *m)
{
    if (m->open.at)
        trip_budget_release(m->budget, m->open.at, m->open_nodes * sizeof *m->open.at);
    m->open.at = NULL;
    m->has_open = false;
}

static void drop_all(trip_light_map *m)
{
    stop_gathering(m);
    stop_sweeping(m);
    drop_open(m);
    if (m->memory)
        trip_budget_release(m->budget, m->memory, m->nodes * sizeof *m->memory);
    m->memory = NULL;
    m->has_key = m->has_reached = false;
}

void trip_light_map_destroy(trip_light_map *m)
{
    if (!m)
        return;
    drop_all(m);
    trip_budget_release(m->budget, m, sizeof *m);
}

/* ---- reuse ---- */

static bool same_clip(const trip_clip *a, const trip_clip *b)
{
    bool same = a->count == b->count;
    for (int i = 0; i < a->count && same; i++) {
        const trip_half_space *p = &a->planes[i], *q = &b->planes[i];
        same = p->offset == q->offset && p->normal.x == q->normal.x && p->normal.y == q->normal.y &&
               p->normal.z == q->normal.z;
    }
    return same;
}

static bool same_function(const trip_light_map *m, const trip_tf_entry *table)
{
    for (int code = 0; code < CODES; code++)
        if (m->extinctions[code] != table[code].extinction)
            return false;
    return true;
}

static bool is_gathered_for(const trip_light_map *m, const trip_light_source *s)
{
    const trip_light_grid grid =
        trip_light_grid_over(s->data->header.dims, s->settings->effects.cells, 1);
    return m->has_key && m->data == s->data && m->level == s->level &&
           m->pre == (s->settings->classify == TRIP_CLASSIFY_PRE) &&
           m->extinction.spacing == grid.spacing && same_clip(&m->clip, s->clip) &&
           same_function(m, s->table);
}

static trip_vec3 to_index(const trip_light_source *s, trip_vec3 direction)
{
    trip_affine map;
    trip_affine_invert(&s->data->index_to_world, &map); /* checked when opened */
    return trip_affine_vector(&map, direction);
}

/* Returns the direction to the light per world unit, or the light's position, in index space. */
static trip_vec3 light_of(const trip_light_source *s)
{
    return s->settings->point_light ? trip_light_position(s->settings, &s->data->index_to_world)
                                    : to_index(s, s->settings->light_direction);
}

/* Records the light. Returns false if `reached` belongs to another light. */
static bool take_light(trip_light_map *m, const trip_light_source *s)
{
    const trip_vec3 light = light_of(s), apart = trip_sub(light, m->light);
    const bool same = m->point_light == s->settings->point_light && trip_dot(apart, apart) == 0;
    m->point_light = s->settings->point_light;
    m->light = light;
    return same;
}

/* ---- beginning ---- */

static int no_memory(const trip_light_grid *g, size_t bytes)
{
    char text[32];
    return trip_fail(TRIP_ERROR, "render", "light",
                     "a grid of %d x %d x %d nodes takes %s, which does not fit the memory given; "
                     "raise --memory or lower --light-cells",
                     g->nodes[0], g->nodes[1], g->nodes[2], trip_format_bytes(bytes, text));
}

static void note_key(trip_light_map *m, const trip_light_source *s)
{
    m->data = s->data;
    m->level = s->level;
    m->pre = s->settings->classify == TRIP_CLASSIFY_PRE;
    m->clip = *s->clip;
    for (int code = 0; code < CODES; code++) {
        m->extinctions[code] = s->table[code].extinction;
        m->shown[code + 1] = m->shown[code] + (m->extinctions[code] > 0);
    }
    m->has_key = true;
}

static int take_grids(trip_light_map *m, const trip_light_source *s)
{
    const int cells = s->settings->effects.cells;
    m->extinction = m->reached = trip_light_grid_over(s->data->header.dims, cells, 1);
    m->open = trip_light_grid_over(s->data->header.dims, cells, TRIP_OPEN_STRIDE);
    m->nodes = trip_light_grid_count(&m->extinction);
    m->open_nodes = trip_light_grid_count(&m->open);
    size_t columns = trip_light_sweep_max_bytes(&m->reached);
    bool fits = trip_budget_left_bytes(m->budget) > m->nodes * sizeof *m->memory + columns;
    m->memory = fits ? trip_budget_take(m->budget, m->nodes * sizeof *m->memory) : NULL;
    if (!m->memory)
        return no_memory(&m->extinction, m->nodes * sizeof *m->memory + columns);
    m->extinction.at = (float *)m->memory;
    m->reached.at = m->extinction.at + m->nodes;
    return 0;
}

/* Returns the axis of the list to read. */
static int axis_of(const trip_light_source *s)
{
    const uint64_t *dims = s->data->header.dims;
    const trip_vec3 last = trip_v3((double)dims[0] - 1, (double)dims[1] - 1, (double)dims[2] - 1);
    trip_vec3 light = light_of(s);
    if (s->settings->point_light) /* from the centre */
        light = trip_sub(light, trip_scale(last, 0.5));
    int axis = 2;
    for (int a = 0; a < 2 && s->settings->effects.shadows; a++)
        if (fabs(trip_component(light, a)) > fabs(trip_component(light, axis)))
            axis = a;
    return axis;
}

/* Returns whether the list is read. Halo voxels count if values are interpolated. If data sets are
 * joined, halo voxels do not count, because a visible halo voxel of one is a kept voxel of another.
 */
static bool is_read(const trip_light_source *s, const trip_list *list, int axis)
{
    const trip_kind_info *kind = trip_kind_of(list->kind);
    const bool kept_alone =
        s->settings->classify == TRIP_CLASSIFY_PRE || trip_dataset_parts(s->data) > 1;
    return list->axis == axis && list->level == 0 && list->records > 0 &&
           (kept_alone ? kind->splatted && !kind->coarse : kind->lattice);
}

/* Selects all bricks with visible codes. */
static int select_list(trip_light_map *m, const trip_list *list)
{
    trip_selection *s = &m->selections[m->pass.selection_count];
    int status =
        trip_selection_create(s, m->data, list, false, 0, list->dims[list->axis] - 1, m->budget);
    bool some = false;
    for (uint64_t i = 0; i < list->brick_count && !status; i++) {
        const trip_file_brick *brick = &list->bricks[i];
        if (m->shown[brick->code_max + 1] > m->shown[brick->code_min]) {
            trip_selection_add(s, i);
            some = true;
        }
    }
    if (some)
        m->pass.selection_count++;
    else if (!status)
        trip_selection_destroy(s, m->budget);
    return status;
}

static int take_shares(trip_light_map *m)
{
    const trip_coordinates *c = &m->data->coordinates;
    const trip_light_grid *g = &m->extinction;
    bool fits = true;
    for (int a = 0; a < 3 && trip_coordinates_uneven(c) && fits; a++)
        fits = trip_light_shares_make(&m->shares[a], c, a, g->spacing, g->nodes[a], m->budget);
    return fits ? 0
                : trip_fail(TRIP_ERROR, "render", "light",
                            "the voxels' shares do not fit the memory given; raise --memory");
}

static int start_gathering(trip_light_map *m, const trip_light_source *s)
{
    const int axis = axis_of(s);
    int status = take_shares(m);
    if (status)
        return status;
    m->list_count = s->data->list_count;
    m->selections = trip_budget_take(m->budget, m->list_count * sizeof *m->selections);
    if (!m->selections)
        return trip_fail(TRIP_ERROR, "render", "light",
                         "%u lists do not fit the memory given; raise --memory", m->list_count);
    m->pass = (trip_pass){ .selections = m->selections };
    for (unsigned i = 0; i < m->list_count && !status; i++)
        if (is_read(s, &s->data->lists[i], axis))
            status = select_list(m, &s->data->lists[i]);
    if (status || m->pass.selection_count == 0)
        return status;
    const trip_reader_params params = {
        .engine = s->engine == TRIP_ENGINE_NULL ? TRIP_ENGINE_AUTO : s->engine,
        .planes = 1u << TRIP_PLANE_VOXELS,
        .slots = SLOTS,
        .slot_bytes = trip_reader_slot_bytes(s->data, 1u << TRIP_PLANE_VOXELS, SLOT_BYTES),
        .threads = s->threads,
    };
    status = trip_reader_create(&m->reader, s->data, &params, m->budget);
    return status ? status : trip_reader_begin(m->reader, &m->pass);
}

static int gather_anew(trip_light_map *m, const trip_light_source *s)
{
    drop_all(m);
    note_key(m, s);
    int status = take_grids(m, s);
    if (!status)
        status = start_gathering(m, s);
    if (status)
        drop_all(m);
    m->stage = GATHER;
    return status;
}

static int take_open(trip_light_map *m)
{
    const size_t bytes = m->open_nodes * sizeof *m->open.at;
    m->open.at = trip_budget_take(m->budget, bytes);
    return m->open.at ? 0 : no_memory(&m->open, bytes);
}

/* Chooses the stage after the extinction is complete. */
static stage next_stage(const trip_light_map *m)
{
    const trip_effects *e = &m->source.settings->effects;
    return e->shadows && !m->has_reached  ? SWEEP_REACHED
           : e->occlusion && !m->has_open ? SWEEP_OPEN
                                          : COMPLETE;
}

int trip_light_map_begin(trip_light_map *m, const trip_light_source *s)
{
    const trip_effects *e = &s->settings->effects;
    int status = 0;
    m->source = *s;
    m->stats = (trip_light_stats){ 0 };
    if (!is_gathered_for(m, s))
        status = gather_anew(m, s);
    if (!status && e->occlusion && !m->open.at)
        status = take_open(m);
    if (!e->occlusion)
        drop_open(m);
    if (status)
        return status;
    const bool same = take_light(m, s);
    m->has_reached &= same;
    if (m->stage > AVERAGE && !(same && m->stage == next_stage(m))) {
        stop_sweeping(m);
        m->stage = next_stage(m);
    }
    return 0;
}

/* ---- gathering ---- */

/* Adds a voxel to the nodes around it in proportion to their nearness. The shares add up to 1. */
static void add_voxel(trip_light_map *m, const int64_t at[3], double extinction)
{
    const trip_light_grid *g = &m->extinction;
    const size_t step[3] = { 1, (size_t)g->nodes[0], (size_t)g->nodes[0] * (size_t)g->nodes[1] };
    const int64_t spacing = (int64_t)g->spacing;
    double *first = m->memory, part[3];
    for (int a = 0; a < 3; a++) {
        first += (size_t)(at[a] / spacing) * step[a];
        part[a] = (double)(at[a] % spacing) / g->spacing;
    }
    for (int n = 0; n < 8; n++) {
        double share = extinction;
        size_t corner = 0;
        for (int a = 0; a < 3; a++) {
            share *= n >> a & 1 ? part[a] : 1 - part[a];
            corner += (size_t)(n >> a & 1) * step[a];
        }
        if (share > 0)
            first[corner] += share;
    }
}

/* Adds a voxel with uneven spacing. */
static void add_shares(trip_light_map *m, const int64_t at[3], double extinction)
{
    const trip_light_grid *g = &m->extinction;
    const double *share[3];
    size_t count[3], first[3];
    for (int a = 0; a < 3; a++) {
        const trip_light_shares *s = &m->shares[a];
        share[a] = s->shares + s->begin[at[a]];
        count[a] = s->begin[at[a] + 1] - s->begin[at[a]];
        first[a] = (size_t)s->first[at[a]];
    }
    for (size_t k = 0; k < count[2]; k++)
        for (size_t j = 0; j < count[1]; j++) {
            const double part = extinction * share[2][k] * share[1][j];
            double *row =
                m->memory + first[0] +
                (size_t)g->nodes[0] * (first[1] + j + (size_t)g->nodes[1] * (first[2] + k));
            for (size_t i = 0; i < count[0] && part > 0; i++)
                row[i] += part * share[0][i];
        }
}

static void gather_run(trip_light_map *m, const trip_batch *batch, const trip_run *run)
{
    const trip_block block = trip_block_of(batch, run);
    const int axis = trip_batch_list(batch, run)->axis;
    const trip_coordinates *positions = &m->data->coordinates;
    trip_block_voxels(&block, 0, run->count, m->voxels);
    for (uint32_t n = 0; n < run->count; n++) {
        const double extinction = (double)m->extinctions[trip_voxel_code(m->voxels[n])];
        if (!(extinction > 0))
            continue;
        int64_t at[3];
        at[axis] = run->sheet;
        at[(axis + 1) % 3] = run->u + (int64_t)trip_voxel_u(m->voxels[n]);
        at[(axis + 2) % 3] = run->v + (int64_t)trip_voxel_v(m->voxels[n]);
        const trip_vec3 voxel = trip_v3((double)at[0], (double)at[1], (double)at[2]);
        if (!trip_clip_has(&m->clip, trip_coordinates_point(positions, voxel)))
            continue;
        if (trip_coordinates_uneven(positions))
            add_shares(m, at, extinction);
        else
            add_voxel(m, at, extinction);
    }
}

/* Returns the sum of all voxels' shares along an axis at a node. */
static double shares_at(const trip_light_map *m, int axis, int node)
{
    const int64_t spacing = (int64_t)m->extinction.spacing, middle = node * spacing;
    const int64_t last = (int64_t)m->data->header.dims[axis] - 1;
    double sum = 0;
    if (m->shares[axis].sums)
        return m->shares[axis].sums[node];
    if (middle >= spacing - 1 && middle + spacing - 1 <= last)
        return (double)spacing; /* the shares are all inside the grid */
    for (int64_t i = middle - spacing + 1; i < middle + spacing; i++)
        if (i >= 0 && i <= last)
            sum +=
                (double)(spacing - (i < middle ? middle - i : i - middle)) / m->extinction.spacing;
    return sum;
}

/* Converts the sums of a row to float means in place, behind the read position. */
static void average_row(trip_light_map *m, size_t row)
{
    const trip_light_grid *g = &m->extinction;
    const int j = (int)(row % (size_t)g->nodes[1]), k = (int)(row / (size_t)g->nodes[1]);
    const double shares = shares_at(m, 2, k) * shares_at(m, 1, j);
    size_t n = row * (size_t)g->nodes[0];
    for (int i = 0; i < g->nodes[0]; i++, n++) {
        double sum;
        memcpy(&sum, &m->memory[n], sizeof sum);
        float mean = sum > 0 ? (float)(sum / (shares * shares_at(m, 0, i))) : 0;
        memcpy(&g->at[n], &mean, sizeof mean);
    }
}

/* A piece. */
static int average(trip_light_map *m)
{
    const size_t row_nodes = (size_t)m->extinction.nodes[0], rows = m->nodes / row_nodes;
    for (size_t done = 0; done < PIECE_NODES && m->averaged < rows; done += row_nodes)
        average_row(m, m->averaged++);
    if (m->averaged == rows) {
        stop_gathering(m);
        m->stage = next_stage(m);
    }
    return TRIP_FRAME_MORE;
}

static int gather(trip_light_map *m)
{
    trip_batch batch;
    int status = 0;
    if (m->reader && !trip_reader_await(m->reader, 0))
        return TRIP_FRAME_WAITS;
    if (m->reader)
        status = trip_reader_next(m->reader, &batch);
    if (status < 0) {
        drop_all(m);
        return status;
    }
    if (status > 0) {
        for (size_t i = 0; i < batch.run_count; i++)
            gather_run(m, &batch, &batch.runs[i]);
        m->stats.splats += batch.splats;
        trip_reader_release(m->reader, &batch);
        return TRIP_FRAME_MORE;
    }
    if (m->reader) {
        const trip_reader_stats read = trip_reader_get_stats(m->reader);
        m->stats.bytes_read = read.bytes_read;
        m->stats.reads = read.reads;
    }
    m->stage = AVERAGE;
    return TRIP_FRAME_MORE;
}

/* ---- sweeps ---- */

static bool begin_sweep(trip_light_map *m)
{
    if (m->stage == SWEEP_OPEN)
        return trip_light_sweep_begin(
            &m->sweep, to_index(&m->source, trip_effects_direction(m->part)), m->budget);
    return m->point_light ? trip_light_sweep_begin_at(&m->sweep, m->light, m->part, m->budget)
                          : trip_light_sweep_begin(&m->sweep, m->light, m->budget);
}

static trip_light_grid *swept_grid(trip_light_map *m)
{
    return m->stage == SWEEP_OPEN ? &m->open : &m->reached;
}

/* Clears a piece of the grid. Returns false if nothing is left to clear. */
static bool clear(trip_light_map *m)
{
    const size_t left = trip_light_grid_count(swept_grid(m)) - m->cleared;
    const size_t count = left < PIECE_NODES ? left : PIECE_NODES;
    memset(swept_grid(m)->at + m->cleared, 0, count * sizeof *m->reached.at);
    m->cleared += count;
    return count > 0;
}

static int start_sweep(trip_light_map *m)
{
    bool open = m->stage == SWEEP_OPEN;
    trip_light_grid *out = swept_grid(m);
    m->sweep = (trip_light_sweep){ .extinction = &m->extinction,
                                   .out = out,
                                   .weight = open ? 1.0 / TRIP_OPEN_DIRECTIONS : 1,
                                   .index_to_world = &m->data->index_to_world };
    for (int a = 0; a < 3; a++)
        m->sweep.last[a] = (double)m->data->header.dims[a] - 1;
    m->sweeping = begin_sweep(m);
    return m->sweeping ? 0 : no_memory(out, trip_light_sweep_max_bytes(out));
}

static int sweep_count(const trip_light_map *m)
{
    return m->stage == SWEEP_OPEN ? TRIP_OPEN_DIRECTIONS : m->point_light ? TRIP_LIGHT_REGIONS : 1;
}

/* A piece. */
static int sweep(trip_light_map *m, const trip_task_runner *runner)
{
    if (clear(m))
        return TRIP_FRAME_MORE;
    int status = m->sweeping ? 0 : start_sweep(m);
    if (status)
        return status;
    if (trip_light_sweep_step(&m->sweep, runner))
        return TRIP_FRAME_MORE;
    trip_light_sweep_end(&m->sweep);
    m->sweeping = false;
    if (++m->part < sweep_count(m))
        return TRIP_FRAME_MORE;
    m->part = 0;
    m->cleared = 0;
    m->has_reached |= m->stage == SWEEP_REACHED;
    m->has_open |= m->stage == SWEEP_OPEN;
    m->stage = next_stage(m);
    return TRIP_FRAME_MORE;
}

int trip_light_map_step(trip_light_map *m, const trip_task_runner *runner)
{
    const uint64_t start = trip_now_ns();
    if (m->stage == COMPLETE)
        return TRIP_FRAME_DONE;
    const bool gathers = m->stage <= AVERAGE;
    int status = m->stage == GATHER    ? gather(m)
                 : m->stage == AVERAGE ? average(m)
                                       : sweep(m, runner);
    m->made_ns = trip_now_ns();
    double ms = (double)(m->made_ns - start) * 1e-6;
    m->stats.gather_ms += gathers ? ms : 0;
    m->stats.sweep_ms += gathers ? 0 : ms;
    return status;
}

void trip_light_map_await(trip_light_map *m, uint64_t timeout_ns)
{
    if (m->stage == GATHER && m->reader)
        trip_reader_await(m->reader, timeout_ns);
}

bool trip_light_map_is_gathered(const trip_light_map *m)
{
    return m->stage > AVERAGE;
}

bool trip_light_map_is_complete(const trip_light_map *m)
{
    return m->stage == COMPLETE;
}

uint64_t trip_light_map_made_ns(const trip_light_map *m)
{
    return m->made_ns;
}

const trip_light_grid *trip_light_map_gathered(const trip_light_map *m)
{
    return &m->extinction;
}

const trip_light_grid *trip_light_map_reached(const trip_light_map *m)
{
    return m->source.settings->effects.shadows ? &m->reached : NULL;
}

const trip_light_grid *trip_light_map_open(const trip_light_map *m)
{
    return m->source.settings->effects.occlusion ? &m->open : NULL;
}

static double reached_at(const void *user, trip_vec3 voxel)
{
    return trip_light_grid_at(&((const trip_light_map *)user)->reached, voxel);
}

static double open_at(const void *user, trip_vec3 voxel)
{
    return trip_light_grid_at(&((const trip_light_map *)user)->open, voxel);
}

void trip_light_map_view(const trip_light_map *m, trip_effects_view *view)
{
    view->user = m;
    view->reached = reached_at;
    view->open = open_at;
}

trip_light_stats trip_light_map_stats(const trip_light_map *m)
{
    trip_light_stats stats = m->stats;
    stats.memory_bytes = m->nodes * sizeof *m->memory;
    if (m->open.at)
        stats.memory_bytes += m->open_nodes * sizeof *m->open.at;
    return stats;
}
