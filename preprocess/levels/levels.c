#include "levels.h"

#include <math.h>
#include <pthread.h>
#include <string.h>

#include "folder.h"
#include "level_halo.h"
#include "level_lane.h"
#include "report.h"

enum { SOURCES = TRIP_LEVEL_SOURCES, PROGRESS_MS = 200 };

/* Memory that holds a level's voxels before they go to disk: at most 1 / FILE_PART of the memory
 * left, but at least FILE_BUFFER_BYTES. */
enum { FILE_PART = 8, FILE_BUFFER_BYTES = 1 << 16 };
/* Maximum number of finished squares per lane that wait to be written. */
enum { AHEAD = 2 };

/* Memory of a list builder without its pieces. */
#define BUILDER_BYTES ((uint64_t)3 << 20)
/* Bytes of pieces per voxel of the level below. */
#define PIECE_BYTES 64

/* A square that waits to be written, with memory for its voxels. */
typedef struct made_square {
    bool waits;
    uint64_t key;
    uint32_t count;
    trip_coarse_value *values;
    trip_coarse_mean *means;
} made_square;

/* A level in progress. Each thread takes the next square and makes it in its lane. Voxels are
 * appended to the file in the order of squares. The thread that made the next square appends it and
 * all consecutive waiting squares. */
typedef struct making {
    const trip_levels_params *params;
    trip_level_work work; /* lanes only read it */
    trip_budget *budget;
    unsigned level, first_list;
    int64_t dims[3];
    trip_level_source sources[SOURCES];
    unsigned source_count;
    trip_output *file;     /* file of its voxels, for its values and the next level; may be NULL */
    trip_output with_halo; /* copy of the file with the level's own halo, for its values; used above
                              level 1 */
    trip_sharpen sharpen;
    uint64_t sheets_before, sheets; /* sheets of lower levels; of all levels */

    unsigned lane_count;
    trip_level_lane *lanes;
    size_t lane_bytes; /* bytes of memory per lane, with the squares that wait */
    unsigned char *memory;
    made_square *made; /* `ahead` squares; square n is at n modulo `ahead` */
    unsigned ahead;

    pthread_mutex_t lock; /* guards all below, the sources, and the state of sharpening */
    pthread_cond_t turned;
    uint64_t taken;    /* number of squares taken by lanes */
    uint64_t appended; /* number of the next square to write */
    bool appending;    /* a thread uses the file */
    uint64_t sheet;
    bool failed;
} making;

unsigned trip_levels_count(const int64_t dims[3], int wanted, unsigned tile_voxels)
{
    const int64_t last = wanted > 0 ? 1 : (int64_t)tile_voxels;
    const unsigned max =
        wanted > 0 && wanted < TRIP_LEVELS_MAX ? (unsigned)wanted : TRIP_LEVELS_MAX;
    unsigned levels = 0;
    for (int a = 0; a < 3 && wanted >= 0; a++)
        while (levels < max && (dims[a] - 1) >> levels >= last)
            levels++;
    return levels;
}

static void level_dims(const int64_t dims[3], unsigned level, int64_t out[3])
{
    for (int a = 0; a < 3; a++)
        out[a] = ((dims[a] - 1) >> level) + 1;
}

/* The centre of a coarse voxel is the centre of the level 0 voxels that it covers. */
static trip_writer_list list_of(const int64_t dims[3], const trip_affine *index_to_world,
                                unsigned level)
{
    double step = ldexp(1, (int)level);
    trip_affine map = trip_affine_identity();
    trip_writer_list list = { .level = level, .sheet_first = 0.5 * (step - 1), .sheet_step = step };
    for (int a = 0; a < 3; a++) {
        map.m[a][a] = step;
        map.m[a][3] = list.sheet_first;
    }
    level_dims(dims, level, list.dims);
    list.index_to_world = level ? trip_affine_multiply(index_to_world, &map) : *index_to_world;
    return list;
}

trip_level_kinds trip_levels_kinds(trip_brick_levels_for wanted, bool halo)
{
    return (trip_level_kinds){ .means = !halo || wanted >= TRIP_LEVELS_FOR_PRE,
                               .values = halo && wanted != TRIP_LEVELS_FOR_PRE };
}

/* Labels have no mean, and hence no deviation from it. */
static bool has_deviations(const trip_levels_params *p)
{
    return p->kinds.values && !p->labels && !p->quantiser.ids;
}

/* Adds three lists of a kind after `n` others. Returns the new number. */
static unsigned add_lists(trip_writer_list *lists, unsigned n, trip_writer_list list,
                          trip_kind kind)
{
    list.kind = kind;
    for (list.axis = 0; list.axis < 3; list.axis++)
        lists[n++] = list;
    return n;
}

unsigned trip_levels_lists(const int64_t dims[3], const trip_affine *index_to_world, bool halo,
                           trip_level_kinds kinds, unsigned levels, trip_writer_list *lists)
{
    unsigned n = 0;
    for (unsigned level = 0; level <= levels; level++) {
        const trip_writer_list list = list_of(dims, index_to_world, level);
        if (level == 0 || kinds.means)
            n = add_lists(lists, n, list, level ? TRIP_KIND_MEANS : TRIP_KIND_VOXELS);
        if (level == 0 ? halo : kinds.values)
            n = add_lists(lists, n, list, level ? TRIP_KIND_VALUES : TRIP_KIND_HALO);
    }
    return n;
}

unsigned trip_levels_first_list(bool halo, trip_level_kinds kinds, unsigned level)
{
    const unsigned finest = halo ? 6 : 3, coarse = kinds.means && kinds.values ? 6 : 3;
    return level > 0 ? finest + (level - 1) * coarse : 0;
}

/* ---- memory ---- */

static uint64_t records_below(const making *m)
{
    uint64_t records = 0;
    for (unsigned list = 0; list < m->first_list; list++)
        records += trip_writer_records(m->params->writer, list);
    return records;
}

/* Level 1 has no halo of its own. Level 0's halo reaches most neighbours of its voxels, and adding
 * the others would make its lists 1.5 times as long. */
static bool has_halo_of_its_own(const making *m)
{
    return m->work.format.halo && m->level > 1;
}

/* Memory allocated while the lists are built. */
static uint64_t late_bytes(const making *m)
{
    uint64_t bytes = BUILDER_BYTES;
    if (has_halo_of_its_own(m)) /* a kept voxel has 26 neighbours, hence 27 */
        bytes += trip_level_halo_bytes(m->dims, m->work.edge_log2, 27 * records_below(m));
    else if (m->work.format.halo)
        bytes += trip_level_positions_later_bytes(m->dims, m->work.edge_log2, records_below(m));
    return bytes;
}

/* Lays out the memory. With NULL it only computes the bytes. */
static size_t lay_out_made(const making *m, made_square *made, unsigned char *memory)
{
    const size_t plane = (size_t)1 << 2 * m->work.edge_log2;
    size_t used = 0;
    made->values = trip_level_carve(memory, &used, plane * sizeof *made->values);
    if (m->params->kinds.means)
        made->means = trip_level_carve(memory, &used, plane * sizeof *made->means);
    return used;
}

/* One lane per worker, or as many as memory allows. */
static int open_lanes(making *m)
{
    const trip_levels_params *p = m->params;
    const uint64_t left = trip_budget_left_bytes(m->budget), late = late_bytes(m);
    unsigned count = trip_workers_count(p->workers);
    trip_level_lane lane;
    made_square square;
    const size_t made_bytes = AHEAD * lay_out_made(m, &square, NULL);
    const size_t own_bytes = trip_level_lane_make(&lane, &m->work, 0, NULL);
    m->lane_bytes = own_bytes + made_bytes;
    while (count > 1 && count * (m->lane_bytes + sizeof lane + AHEAD * sizeof square) + late +
                                trip_list_builder_min_bytes(&m->work.format, count) >
                            left)
        count--;
    m->lane_count = count;
    m->ahead = AHEAD * count;
    m->memory = trip_budget_take(m->budget, count * m->lane_bytes);
    m->lanes = trip_budget_take(m->budget, count * sizeof *m->lanes);
    m->made = trip_budget_take(m->budget, m->ahead * sizeof *m->made);
    if (!m->memory || !m->lanes || !m->made)
        return trip_level_fail_memory();
    for (unsigned i = 0; i < count; i++) {
        unsigned char *memory = m->memory + i * m->lane_bytes;
        trip_level_lane_make(&m->lanes[i], &m->work, i, memory);
        for (unsigned n = 0; n < AHEAD; n++)
            lay_out_made(m, &m->made[i * AHEAD + n], memory + own_bytes + n * made_bytes / AHEAD);
    }
    return 0;
}

static int open_builder(making *m)
{
    const trip_levels_params *p = m->params;
    const uint64_t min = trip_list_builder_min_bytes(&m->work.format, m->lane_count);
    const uint64_t wanted = min + records_below(m) * PIECE_BYTES, late = late_bytes(m);
    uint64_t left = trip_budget_left_bytes(m->budget);
    left = left > late + min ? left - late : min;
    for (size_t i = 0; i < trip_spill_count(p->spill); i++)
        trip_spill_retire(p->spill, i);
    trip_list_builder_params b = { .format = m->work.format,
                                   .quantiser = p->quantiser,
                                   .producers = m->lane_count,
                                   .from = p->kinds.means ? 0 : TRIP_HALO_LISTS,
                                   .first_list = m->first_list,
                                   .memory_bytes = wanted < left ? wanted : left,
                                   .writer = p->writer,
                                   .spill = p->spill };
    memcpy(b.dims, m->dims, sizeof b.dims);
    return trip_list_builder_create(&m->work.builder, &b, m->budget);
}

/* ---- a level ---- */

static uint64_t first_key(const making *m)
{
    uint64_t first = UINT64_MAX;
    for (unsigned i = 0; i < m->source_count; i++)
        if (m->sources[i].has && m->sources[i].key < first)
            first = m->sources[i].key;
    return first;
}

static int poll(void)
{
    return trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted") : 0;
}

/* Stops all lanes if `status` is a failure. Returns `status`. */
static int end_lane(making *m, int status)
{
    if (status == 0)
        return 0;
    pthread_mutex_lock(&m->lock);
    m->failed = true;
    pthread_cond_broadcast(&m->turned);
    pthread_mutex_unlock(&m->lock);
    return status;
}

/* Finds the sources of the next square's voxels. Returns 1, or 0 if no square is left or another
 * lane failed. */
static int take_square(making *m, trip_level_lane *l)
{
    int status = 0;
    pthread_mutex_lock(&m->lock);
    l->key = m->failed ? UINT64_MAX : first_key(m);
    l->number = m->taken;
    l->square_count = 0;
    if (l->key != UINT64_MAX) {
        m->taken++;
        m->sheet = l->key >> TRIP_TILE_MORTON_BITS;
    }
    for (unsigned i = 0; i < m->source_count && l->key != UINT64_MAX; i++) {
        trip_level_source *s = &m->sources[i];
        while (s->has && s->key == l->key && status == 0) {
            l->squares[l->square_count++] = *s;
            status = trip_level_source_next(s);
        }
    }
    pthread_mutex_unlock(&m->lock);
    return status < 0 ? status : l->key != UINT64_MAX;
}

/* Appends the squares that are next in file order. The caller holds the lock, which is released
 * while the file is written. */
static int append_made(making *m)
{
    int status = 0;
    for (;;) {
        made_square *of = &m->made[m->appended % m->ahead];
        if (!of->waits || m->appending || m->failed || status < 0)
            return status;
        m->appending = true;
        pthread_mutex_unlock(&m->lock);
        if (of->count > 0)
            status = trip_level_file_append(m->file, of->key, of->values, of->means, of->count);
        pthread_mutex_lock(&m->lock);
        of->waits = m->appending = false;
        m->appended++;
        pthread_cond_broadcast(&m->turned);
    }
}

/* Queues the current square's voxels for the file. Waits until fewer than `ahead` squares before it
 * are unwritten. The lane continues with other memory. */
static int append(making *m, trip_level_lane *l, uint32_t count)
{
    made_square *to = &m->made[l->number % m->ahead];
    pthread_mutex_lock(&m->lock);
    while (l->number >= m->appended + m->ahead && !m->failed)
        pthread_cond_wait(&m->turned, &m->lock);
    const made_square spare = *to;
    *to = (made_square){ true, l->key, count, l->values, l->means };
    l->values = spare.values;
    l->means = spare.means;
    const int status = append_made(m);
    pthread_mutex_unlock(&m->lock);
    return status;
}

static int make_square(making *m, trip_level_lane *l)
{
    int status = 0;
    for (unsigned i = 0; i < l->square_count && status == 0; i++)
        status = trip_level_lane_add(l, &m->work, &l->squares[i], l->square_count - i);
    uint32_t count = status == 0 ? trip_level_lane_take(l, &m->work) : 0;
    if (status == 0 && l->means)
        status = trip_level_lane_emit_means(l, &m->work, l->key, count);
    if (status == 0 && m->file)
        status = append(m, l, count);
    return status == 0 ? poll() : status;
}

/* Runs a lane until no square is left. */
static int make_squares(void *user, unsigned thread, uint64_t item)
{
    making *m = user;
    trip_level_lane *l = &m->lanes[item];
    int status = 0;
    (void)thread;
    while (status == 0 && (status = take_square(m, l)) == 1)
        status = make_square(m, l);
    return end_lane(m, status);
}

static int take_column(making *m, trip_sharpen_column *column)
{
    pthread_mutex_lock(&m->lock);
    int status = m->failed ? 0 : trip_sharpen_take(&m->sharpen, column);
    if (status == 1)
        m->sheet = column->sheet;
    pthread_mutex_unlock(&m->lock);
    return status;
}

/* Makes the lists of values, once the file is complete. */
static int make_values(void *user, unsigned thread, uint64_t item)
{
    making *m = user;
    trip_level_lane *l = &m->lanes[item];
    trip_sharpen_column column;
    int status = 0;
    (void)thread;
    while (status == 0 && (status = take_column(m, &column)) == 1) {
        status = trip_level_lane_emit_values(l, &m->work, &m->sharpen, &column);
        status = status == 0 ? poll() : status;
    }
    return end_lane(m, status);
}

static void show(making *m)
{
    const trip_levels_params *p = m->params;
    pthread_mutex_lock(&m->lock);
    const uint64_t sheet = m->sheet;
    pthread_mutex_unlock(&m->lock);
    if (p->progress)
        p->progress(p->progress_user, m->sheets_before + sheet, m->sheets);
}

static int run_lanes(making *m, trip_work work)
{
    trip_workers *workers = m->params->workers;
    int status;
    show(m);
    trip_workers_start(workers, work, m, m->lane_count);
    while (!trip_workers_wait(workers, PROGRESS_MS, &status))
        show(m);
    return status;
}

static int add_halo(making *m)
{
    const trip_levels_params *p = m->params;
    int status = trip_level_halo_add(m->file, p->kinds.means, p->hidden_above, &m->with_halo,
                                     m->dims, m->work.edge_log2, m->budget);
    return status == 0 ? trip_output_flush(&m->with_halo) : status;
}

static int make_level(making *m)
{
    int status = run_lanes(m, make_squares);
    if (status == 0 && m->file)
        status = trip_output_flush(m->file);
    if (status == 0 && has_halo_of_its_own(m))
        status = add_halo(m);
    if (status == 0 && m->work.format.halo)
        status = run_lanes(m, make_values);
    if (status == 0)
        status = trip_list_builder_finish(m->work.builder, &m->params->quantiser,
                                          m->params->workers, NULL, NULL);
    return status;
}

static int open_lists(making *m)
{
    const trip_levels_params *p = m->params;
    int status = 0;
    for (unsigned i = 0; i < 4 && status == 0; i++) {
        bool halo = i / 2;
        if (halo && !p->kinds.values)
            continue;
        status = trip_level_source_list(&m->sources[m->source_count++], p->writer,
                                        (halo ? TRIP_HALO_LISTS : 0) + 2, !halo, p->kinds.means,
                                        i % 2, p->format.tile_log2, m->work.edge_log2, m->budget);
    }
    return status;
}

static int open_file(making *m, const trip_output *below)
{
    int status = 0;
    for (unsigned odd = 0; odd < 2 && status == 0; odd++)
        status = trip_level_source_file(&m->sources[m->source_count++], below,
                                        m->params->kinds.means, odd, m->work.edge_log2);
    return status;
}

/* Returns the size of the memory for `voxels` voxels. In the worst case, each voxel has its own
 * square. */
static size_t file_buffer_bytes(const making *m, uint64_t voxels, bool means)
{
    const uint64_t grid = (uint64_t)m->dims[0] * (uint64_t)m->dims[1] * (uint64_t)m->dims[2];
    const uint64_t each = TRIP_LEVEL_SQUARE_BYTES + trip_level_voxels_bytes(1, means);
    const uint64_t max = trip_budget_left_bytes(m->budget) / FILE_PART;
    const uint64_t min = FILE_BUFFER_BYTES, all = (voxels < grid ? voxels : grid) * each;
    uint64_t bytes = all < max ? all : max;
    bytes -= bytes % min;
    return bytes < min ? min : bytes;
}

/* Creates an unnamed file, in memory if there is enough. */
static int create_file(const making *m, trip_output *file, uint64_t voxels, bool means)
{
    return trip_output_create(
        file,
        &(trip_output_params){ .folder = m->params->folder,
                               .name = TRIP_SPOOL_NAME,
                               .buffer_bytes = file_buffer_bytes(m, voxels, means),
                               .unnamed = true },
        m->budget);
}

static int open_sharpen(making *m)
{
    const bool own = has_halo_of_its_own(m);
    /* A kept voxel has 26 neighbours, hence 27. */
    int status = own ? create_file(m, &m->with_halo, 27 * records_below(m), false) : 0;
    trip_sharpen_open(&m->sharpen, own ? &m->with_halo : m->file, m->params->kinds.means && !own,
                      m->params->hidden_above, m->work.edge_log2, m->budget);
    m->sharpen.value_of = m->work.value_of;
    m->sharpen.quantiser = &m->work.quantiser;
    m->sharpen.labels = m->params->labels;
    if (m->work.format.deviations)
        m->sharpen.shown = trip_sharpen_shown(m->level);
    return status;
}

static void close_making(making *m)
{
    trip_list_builder_destroy(m->work.builder);
    trip_sharpen_close(&m->sharpen);
    trip_output_close(&m->with_halo);
    for (unsigned i = 0; i < m->source_count; i++)
        trip_level_source_close(&m->sources[i]);
    if (m->lanes)
        trip_budget_release(m->budget, m->lanes, m->lane_count * sizeof *m->lanes);
    if (m->made)
        trip_budget_release(m->budget, m->made, m->ahead * sizeof *m->made);
    if (m->memory)
        trip_budget_release(m->budget, m->memory, m->lane_count * m->lane_bytes);
    pthread_mutex_destroy(&m->lock);
    pthread_cond_destroy(&m->turned);
}

static int make(making *m, const trip_output *below, trip_output *file)
{
    const bool halo = m->work.format.halo;
    int status = m->work.lists ? open_lists(m) : open_file(m, below);
    if (status == 0 && (m->level < m->params->levels || halo))
        status = create_file(m, m->file = file, records_below(m), m->params->kinds.means);
    if (status == 0 && halo)
        status = open_sharpen(m);
    if (status == 0)
        status = open_lanes(m);
    if (status == 0)
        status = open_builder(m);
    return status == 0 ? make_level(m) : status;
}

static void begin(making *m, const trip_levels_params *params, unsigned level,
                  const double *value_of, trip_budget *budget)
{
    *m =
        (making){ .params = params,
                  .budget = budget,
                  .level = level,
                  .with_halo = { .fd = -1 },
                  .first_list = trip_levels_first_list(params->format.halo, params->kinds, level) };
    trip_level_work *w = &m->work;
    w->format = params->format;
    w->format.quantised = true; /* pieces of coarse levels always hold codes */
    w->format.halo = params->kinds.values;
    w->format.normals = params->format.normals && params->kinds.means;
    w->format.deviations = has_deviations(params);
    w->means = params->kinds.means;
    w->values = params->kinds.values;
    w->hidden_above = params->hidden_above;
    w->labels = params->labels;
    w->quantiser = params->quantiser;
    w->compact = params->compact;
    w->index_to_world = params->index_to_world;
    w->scale = trip_mean_scale_make(params->typical_min, params->typical_max, &params->codes);
    w->value_of = value_of;
    w->edge_log2 = (unsigned)__builtin_ctzll((unsigned long long)trip_splat_box_edge(&w->format));
    w->lists = level == 1;
    trip_splat_box_tables_fill(&w->tables, &w->format);
    level_dims(params->dims, level, m->dims);
    pthread_mutex_init(&m->lock, NULL);
    pthread_cond_init(&m->turned, NULL);
}

/* Makes a table with the value of each code, for codes that follow the values. */
static int make_values_of_codes(const trip_levels_params *params, double **out, trip_budget *budget)
{
    double *value_of = *out = NULL;
    if (!params->quantiser.knots)
        return 0;
    value_of = *out = trip_budget_take(budget, TRIP_CODES * sizeof *value_of);
    for (int code = 0; code < TRIP_CODES && value_of; code++)
        value_of[code] = trip_codes_value(&params->codes, code);
    return value_of ? 0 : trip_level_fail_memory();
}

int trip_levels_make(const trip_levels_params *params, trip_budget *budget)
{
    trip_output files[2] = { { .fd = -1 }, { .fd = -1 } };
    making *m = trip_budget_take(budget, sizeof *m);
    uint64_t sheets = 0, before = 0;
    double *value_of = NULL;
    int status = m ? make_values_of_codes(params, &value_of, budget) : trip_level_fail_memory();
    if (status == 0 && has_deviations(params))
        status = trip_writer_add_deviations(params->writer);
    for (unsigned level = 1; level <= params->levels; level++)
        sheets += (uint64_t)((params->dims[2] - 1) >> level) + 1;
    for (unsigned level = 1; level <= params->levels && status == 0; level++) {
        begin(m, params, level, value_of, budget);
        m->sheets_before = before;
        m->sheets = sheets;
        status = make(m, &files[(level - 1) % 2], &files[level % 2]);
        close_making(m);
        trip_output_close(&files[(level - 1) % 2]);
        before += (uint64_t)m->dims[2];
    }
    trip_output_close(&files[0]);
    trip_output_close(&files[1]);
    if (value_of)
        trip_budget_release(budget, value_of, TRIP_CODES * sizeof *value_of);
    if (m)
        trip_budget_release(budget, m, sizeof *m);
    return status;
}
