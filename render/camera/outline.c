#include "outline.h"

#include <assert.h>
#include <string.h>

#include "mean.h"
#include "report.h"

enum {
    AXIS = 2,   /* the list to read; all lists of a level hold the same voxels */
    EDGE = 128, /* maximum number of voxels along each side of the level */
    DIRECTIONS = 7,
    HIDDEN_MAX = 1, /* number of directions from which a visible voxel may be hidden */
    CODES = 65536,
    ENOUGH = 1 << 20, /* optical depth of a ray that is opaque enough */
};

/* Steps along the list's indices: the axes, then the diagonals. */
static const int directions[DIRECTIONS][3] = {
    { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 }, { 1, 1, 1 }, { 1, 1, -1 }, { 1, -1, 1 }, { 1, -1, -1 },
};

/* The visible voxels of a row along i; first > last if there are none. */
typedef struct row {
    int16_t first, last;
} row;

struct trip_outline {
    trip_budget *budget;
    trip_affine map; /* from the list's indices to world space */
    /* List coordinate of index 0, and step between indices, in indices of level 0. */
    double first, step;
    uint64_t splats;
    row rows[EDGE][EDGE]; /* [k][j] */
};

/* The optical depths along the lines of a direction. All lines of a direction have their own place
 * in a square of 2 EDGE x 2 EDGE. */
typedef struct lines {
    uint32_t depths[2 * EDGE][2 * EDGE];
} lines;

/* State of summing the voxels. */
typedef struct summing {
    trip_outline *outline;
    const trip_outline_params *params;
    const trip_list *list;
    double lengths[DIRECTIONS]; /* of a step, in units of the depth that is enough */
    uint32_t voxels[TRIP_RUN_RECORDS_MAX];
    float extinctions[CODES];                /* by code */
    uint64_t counted[EDGE][EDGE][EDGE / 64]; /* [k][j]: voxels with enough extinction, a bit each */
    lines lines[DIRECTIONS];
} summing;

/* Returns the finest level that is small enough. It depends only on the grid, because data sets
 * with coarse levels have them down to one brick. */
static const trip_list *coarse_list(const trip_dataset *data)
{
    unsigned level = 0;
    if (trip_coordinates_uneven(&data->coordinates))
        return NULL;
    for (int a = 0; a < 3; a++)
        while ((data->header.dims[a] - 1) >> level >= EDGE)
            level++;
    const trip_list *values =
        trip_dataset_find(data, AXIS, level, level ? TRIP_KIND_VALUES : TRIP_KIND_VOXELS);
    return values ? values : trip_dataset_find(data, AXIS, level, TRIP_KIND_MEANS);
}

static trip_vec3 column(const trip_affine *m, int axis)
{
    return trip_v3(m->m[0][axis], m->m[1][axis], m->m[2][axis]);
}

/* Returns the place of a voxel's line. A line meets plane 0 of an axis along which it steps, at
 * coordinates that may be up to EDGE beyond the grid. */
static uint32_t *line_of(lines *of, const int d[3], int i, int j, int k)
{
    if (d[0])
        return &of->depths[k - d[2] * i + (d[2] > 0 ? EDGE : 0)]
                          [j - d[1] * i + (d[1] > 0 ? EDGE : 0)];
    return d[1] ? &of->depths[k][i] : &of->depths[j][i];
}

trip_code_range trip_outline_codes(const trip_dataset *data, const trip_tf_entry *table, double min)
{
    const trip_file_header *h = &data->header;
    const double lo = floor(trip_codes_code(&data->codes, h->typical_min));
    const double hi = ceil(trip_codes_code(&data->codes, h->typical_max));
    const trip_code_range all = { 0, CODES - 1 }, typical = { (uint16_t)lo, (uint16_t)hi };
    if (h->typical_min <= h->value_min && h->typical_max >= h->value_max)
        return all;
    for (unsigned code = typical.min; code <= typical.max; code++)
        if ((double)table[code].extinction >= min)
            return typical;
    return all;
}

static void fill_extinctions(summing *s)
{
    const trip_code_range codes =
        trip_outline_codes(s->params->data, s->params->table, s->params->min_extinction);
    const trip_file_header *h = &s->params->data->header;
    const trip_mean_scale scale =
        trip_mean_scale_make(h->typical_min, h->typical_max, &s->params->data->codes);
    const double length = trip_length(column(&s->list->index_to_world, AXIS));
    double extinctions[TRIP_MEAN_SHARES];
    for (unsigned code = 0; code < CODES; code += TRIP_MEAN_SHARES) {
        const double of_mean = (double)s->params->table[trip_mean_value(&scale, code)].extinction;
        if (s->list->kind == TRIP_KIND_MEANS)
            trip_mean_extinctions(of_mean, length, extinctions);
        for (unsigned i = 0; i < TRIP_MEAN_SHARES; i++)
            s->extinctions[code + i] = s->list->kind == TRIP_KIND_MEANS ? (float)extinctions[i]
                                       : code + i < codes.min || code + i > codes.max
                                           ? 0
                                           : s->params->table[code + i].extinction;
    }
}

static bool some_counts(const summing *s, const trip_file_brick *b)
{
    for (unsigned code = b->code_min; code <= b->code_max; code++)
        if (s->extinctions[code] > 0)
            return true;
    return false;
}

static void add_voxel(summing *s, int i, int j, int k, double extinction)
{
    if ((unsigned)i >= EDGE || (unsigned)j >= EDGE || (unsigned)k >= EDGE)
        return;
    if (extinction >= s->params->min_extinction)
        s->counted[k][j][i / 64] |= UINT64_C(1) << i % 64;
    for (int n = 0; n < DIRECTIONS; n++) {
        const double depth = extinction * s->lengths[n];
        *line_of(&s->lines[n], directions[n], i, j, k) +=
            depth < ENOUGH ? (uint32_t)depth : (uint32_t)ENOUGH;
    }
}

static void add_run(summing *s, const trip_batch *batch, const trip_run *run)
{
    const trip_block block = trip_block_of(batch, run);
    trip_block_voxels(&block, 0, run->count, s->voxels);
    s->outline->splats += run->count;
    for (uint32_t n = 0; n < run->count; n++) {
        const double extinction = (double)s->extinctions[trip_voxel_code(s->voxels[n])];
        if (extinction > 0)
            add_voxel(s, (int)(run->u + (int64_t)trip_voxel_u(s->voxels[n])),
                      (int)(run->v + (int64_t)trip_voxel_v(s->voxels[n])), (int)run->sheet,
                      extinction);
    }
}

static int read_selected(summing *s, const trip_selection *selection)
{
    trip_reader *reader = s->params->reader;
    trip_batch batch;
    const trip_pass pass = trip_pass_of(selection);
    int status = trip_reader_begin(reader, &pass);
    while (!status && (status = trip_reader_next(reader, &batch)) > 0) {
        for (size_t i = 0; i < batch.run_count; i++)
            add_run(s, &batch, &batch.runs[i]);
        trip_reader_release(reader, &batch);
        status =
            trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "render", "view", "interrupted") : 0;
    }
    trip_reader_begin(reader, NULL);
    return status;
}

static int sum_list(summing *s)
{
    const trip_outline_params *p = s->params;
    trip_selection selection;
    int status =
        trip_selection_create(&selection, p->data, s->list, false, 0, INT32_MAX, p->budget);
    if (status)
        return status;
    for (uint64_t b = 0; b < s->list->brick_count; b++)
        if (some_counts(s, &s->list->bricks[b]))
            trip_selection_add(&selection, b);
    status = read_selected(s, &selection);
    trip_selection_destroy(&selection, p->budget);
    return status;
}

/* Adds up the voxels of all joined data sets. */
static int sum(summing *s)
{
    const trip_list *list = s->list;
    int status = 0;
    for (; list && !status;
         list = trip_dataset_next(s->params->data, list, AXIS, list->level, list->kind)) {
        s->list = list;
        status = sum_list(s);
    }
    return status;
}

static bool is_visible(summing *s, int i, int j, int k)
{
    int hidden = 0;
    if (!(s->counted[k][j][i / 64] >> i % 64 & 1))
        return false;
    for (int n = 0; n < DIRECTIONS && hidden <= HIDDEN_MAX; n++)
        hidden += *line_of(&s->lines[n], directions[n], i, j, k) < ENOUGH;
    return hidden <= HIDDEN_MAX;
}

/* Sets the visible voxels of a row: only the ends are needed. */
static row row_of(summing *s, int j, int k)
{
    row r = { 0, EDGE - 1 };
    while (r.first < EDGE && !is_visible(s, r.first, j, k))
        r.first++;
    while (r.last > r.first && !is_visible(s, r.last, j, k))
        r.last--;
    return r;
}

static bool find_rows(summing *s)
{
    bool some = false;
    for (int k = 0; k < EDGE; k++)
        for (int j = 0; j < EDGE; j++) {
            const row r = s->outline->rows[k][j] = row_of(s, j, k);
            some |= r.first <= r.last;
        }
    return some;
}

static void start(summing *s, trip_outline *o, const trip_outline_params *p, const trip_list *list)
{
    const double enough = -log1p(-TRIP_OUTLINE_OPACITY);
    memset(s->counted, 0, sizeof s->counted);
    memset(s->lines, 0, sizeof s->lines);
    s->outline = o;
    s->params = p;
    s->list = list;
    o->budget = p->budget;
    o->splats = 0;
    o->map = list->index_to_world;
    o->first = list->sheet_first;
    o->step = list->sheet_step;
    for (int n = 0; n < DIRECTIONS; n++) {
        const int *d = directions[n];
        s->lengths[n] =
            trip_length(trip_affine_vector(&o->map, trip_v3(d[0], d[1], d[2]))) * ENOUGH / enough;
    }
    fill_extinctions(s);
}

int trip_outline_make(trip_outline **out, const trip_outline_params *params)
{
    const trip_list *list = coarse_list(params->data);
    int status = 0;
    bool some = false;
    *out = NULL;
    if (!list)
        return 0;
    trip_outline *o = trip_budget_take(params->budget, sizeof *o);
    summing *s = trip_budget_take(params->budget, sizeof *s);
    if (o && s) {
        start(s, o, params, list);
        status = sum(s);
        some = !status && find_rows(s);
    } else {
        status = trip_fail(TRIP_ERROR, "render", "view",
                           "the outline of the visible part does not fit the memory given; raise "
                           "--memory");
    }
    if (s)
        trip_budget_release(params->budget, s, sizeof *s);
    if (o && !some)
        trip_budget_release(params->budget, o, sizeof *o);
    else
        *out = o;
    return status;
}

void trip_outline_destroy(trip_outline *o)
{
    if (o)
        trip_budget_release(o->budget, o, sizeof *o);
}

/* Returns the maximum of a linear function over the visible voxels' centres, in list indices. */
static double farthest(const trip_outline *o, trip_vec3 n)
{
    double max = -INFINITY;
    for (int k = 0; k < EDGE; k++)
        for (int j = 0; j < EDGE; j++) {
            const row *r = &o->rows[k][j];
            if (r->first <= r->last)
                max = fmax(max, n.x * (n.x > 0 ? r->last : r->first) + n.y * j + n.z * k);
        }
    return max;
}

void trip_outline_reach(const trip_outline *o, const trip_reach_origin *origin,
                        const trip_reach *wanted, int count, double *values)
{
    const trip_vec3 from =
        trip_v3((origin->index.x - o->first) / o->step, (origin->index.y - o->first) / o->step,
                (origin->index.z - o->first) / o->step);
    for (int i = 0; i < count; i++) {
        assert(!(wanted[i].around > 0));
        const trip_vec3 n = trip_affine_transpose_vector(&o->map, wanted[i].along);
        values[i] = farthest(o, n) - trip_dot(n, from);
    }
}

uint64_t trip_outline_splats(const trip_outline *o)
{
    return o->splats;
}
