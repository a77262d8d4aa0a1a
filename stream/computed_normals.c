#include "computed_normals.h"

#include <assert.h>
#include <string.h>

#include "clock.h"
#include "clones.h"
#include "dataset_normals.h"
#include "mean.h"
#include "normal.h"
#include "report.h"

/* Limits of a batch that is handed out. */
enum { OUT_RECORDS = 1 << 16, OUT_BYTES = 1 << 19, OUT_RUNS = 1 << 12, OUT_ROOM = 64 };
/* Number of levels of a data set, and of sheets whose values are in memory. */
enum { LEVELS = 32, SHEETS = 3, DRAWN = 2 };
/* Number of records that one task computes, at least a run. */
enum { TASK_RECORDS = 4096, TASKS_MAX = OUT_RECORDS / TASK_RECORDS * 2 + 2 };
/* Maximum number of tiles of a sheet. */
#define TILES_MAX (INT64_C(1) << 26)

/* The values of 8 x 8 voxels, row by row: voxel (u, v) is entry 8 v + u. */
typedef struct square {
    uint64_t present;
    uint16_t codes[64]; /* 0 where no voxel is present */
} square;

/* The values of a sheet, by tile and square. */
typedef struct sheet {
    int64_t index;     /* -1 if empty */
    uint32_t *tile_of; /* [v][u] of the level's tiles; 0, or 1 + a tile's number */
    uint32_t *tile_at; /* by number, the entry in tile_of */
    uint32_t *squares; /* by number and square of the tile; 0, or 1 + an entry in `values` */
    square *values;
    uint32_t tile_count, square_count;
} sheet;

/* The runs of a sheet that are drawn. */
typedef struct drawn {
    double order;  /* in the order of the pass */
    int64_t index; /* sheet */
    trip_run *runs;
    unsigned char *blocks;
    size_t run_count, next_run; /* the runs before next_run were handed out */
    size_t bytes;
} drawn;

/* The room that a sheet of a level takes. */
typedef struct room {
    uint64_t tiles, squares, runs, block_bytes;
} room;

/* A level of the data set that has splats. Memory suffices for each axis. */
typedef struct level {
    bool used;
    room room;
    struct {
        int64_t first_u, first_v, across, down; /* tiles with bricks */
    } tiles[3];                                 /* by axis */
    sheet sheets[SHEETS];
    drawn drawn[DRAWN];
} level;

struct trip_computed_normals {
    const trip_dataset *data;
    trip_budget *budget;
    trip_task_runner runner;
    bool (*skip)(void *user, const trip_selection *s, const trip_run *run);
    void *skip_user;
    trip_mean_scale means;
    double value_per_code, to_world[LEVELS][3][3]; /* for gradients of each level */
    level levels[LEVELS];
    unsigned char *memory;
    size_t bytes;
    uint16_t *selection_of; /* by selection of the pass around: 1 + the selection of the pass */

    const trip_pass *pass;
    const trip_batch *added; /* NULL if it is used up */
    const trip_pass *added_pass;
    size_t next_added;
    bool ended, held;
    drawn *sending; /* the sheet with runs to hand out; NULL if no sheet is ready */

    /* The batch that is handed out. */
    unsigned char *blocks, *normals;
    trip_run *runs;
    size_t run_count, block_bytes, first_new; /* runs from first_new on have no normals yet */
    uint32_t records;
    uint64_t skipped, ns;
};

/* ---- memory ---- */

typedef struct slab_sum {
    uint64_t tiles[64], squares[64], runs[64], block_bytes[64]; /* by sheet of a slab */
} slab_sum;

static void add_slab(slab_sum *sum, const trip_dataset *d, const trip_list *list,
                     const trip_file_slab *slab)
{
    const uint32_t sheets = d->header.slab_sheets;
    const uint32_t squares = 1u << 2 * (d->header.tile_log2 - 3);
    const bool source = trip_dataset_has_gradients_of(d, list);
    const bool splatted = trip_kind_of(list->kind)->splatted;
    for (uint64_t b = slab->first_brick; b < slab->first_brick + slab->brick_count; b++)
        for (uint32_t s = 0; s < sheets; s++) {
            const trip_file_run *run = &list->runs[b * sheets + s];
            if (run->records > 0 && source) {
                sum->tiles[s]++;
                sum->squares[s] += run->records < squares ? run->records : squares;
            }
            if (run->records > 0 && splatted) {
                sum->runs[s]++;
                sum->block_bytes[s] += 8 * (uint64_t)run->words;
            }
        }
}

static uint64_t larger(uint64_t a, uint64_t b)
{
    return a > b ? a : b;
}

/* Enlarges the room to the largest sheet of the lists of a level along an axis. `at` has room for a
 * number per list. */
static void fit_sheets(room *to, const trip_dataset *d, unsigned number, int axis, uint64_t *at)
{
    memset(at, 0, d->list_count * sizeof *at);
    for (;;) {
        uint32_t slab = UINT32_MAX;
        slab_sum sum = { 0 };
        for (unsigned i = 0; i < d->list_count; i++) {
            const trip_list *list = &d->lists[i];
            if (list->level == number && list->axis == axis && at[i] < list->slab_count &&
                list->slabs[at[i]].slab < slab)
                slab = list->slabs[at[i]].slab;
        }
        if (slab == UINT32_MAX)
            return;
        for (unsigned i = 0; i < d->list_count; i++) {
            const trip_list *list = &d->lists[i];
            if (list->level == number && list->axis == axis && at[i] < list->slab_count &&
                list->slabs[at[i]].slab == slab)
                add_slab(&sum, d, list, &list->slabs[at[i]++]);
        }
        for (uint32_t s = 0; s < d->header.slab_sheets; s++) {
            to->tiles = larger(to->tiles, sum.tiles[s]);
            to->squares = larger(to->squares, sum.squares[s]);
            to->runs = larger(to->runs, sum.runs[s]);
            to->block_bytes = larger(to->block_bytes, sum.block_bytes[s]);
        }
    }
}

static void find_tiles(level *l, const trip_dataset *d, unsigned number, int axis)
{
    int64_t lo[2] = { INT64_MAX, INT64_MAX }, hi[2] = { -1, -1 };
    for (unsigned i = 0; i < d->list_count; i++) {
        const trip_list *list = &d->lists[i];
        if (list->level != number || list->axis != axis)
            continue;
        l->used |= trip_kind_of(list->kind)->splatted && list->records > 0;
        for (uint64_t k = 0; k < list->brick_count; k++) {
            const int64_t at[2] = { list->bricks[k].tile_u, list->bricks[k].tile_v };
            for (int a = 0; a < 2; a++) {
                lo[a] = at[a] < lo[a] ? at[a] : lo[a];
                hi[a] = at[a] > hi[a] ? at[a] : hi[a];
            }
        }
    }
    if (hi[0] < 0)
        return;
    l->tiles[axis].first_u = lo[0];
    l->tiles[axis].first_v = lo[1];
    l->tiles[axis].across = hi[0] - lo[0] + 1;
    l->tiles[axis].down = hi[1] - lo[1] + 1;
}

static int find_levels(trip_computed_normals *n)
{
    const trip_dataset *d = n->data;
    const size_t bytes = d->list_count * sizeof(uint64_t);
    uint64_t *at = trip_budget_take(n->budget, bytes);
    if (!at)
        return trip_fail(TRIP_ERROR, "read", d->path, "no memory for its lists; raise --memory");
    for (unsigned i = 0; i < LEVELS; i++)
        for (int axis = 0; axis < 3; axis++)
            find_tiles(&n->levels[i], d, i, axis);
    for (unsigned i = 0; i < LEVELS; i++)
        for (int axis = 0; axis < 3 && n->levels[i].used; axis++)
            fit_sheets(&n->levels[i].room, d, i, axis, at);
    trip_budget_release(n->budget, at, bytes);
    return TRIP_OK;
}

static uint64_t tiles_of(const level *l)
{
    int64_t most = 0;
    for (int a = 0; a < 3; a++) {
        const int64_t across = l->tiles[a].across, down = l->tiles[a].down;
        const int64_t tiles =
            across > 0 && down > TILES_MAX / across ? TILES_MAX + 1 : across * down;
        most = tiles > most ? tiles : most;
    }
    return (uint64_t)most;
}

/* Returns the next `count` elements of the memory. With a NULL base it only counts the size. */
static void *carve(unsigned char *base, size_t *used, uint64_t count, size_t each_bytes)
{
    size_t at = *used;
    *used += (size_t)(count * each_bytes + 63) & ~(size_t)63;
    return base ? base + at : NULL;
}

/* Lays out the memory at `base` and returns its size in bytes. */
static size_t lay_out(trip_computed_normals *n, unsigned char *base)
{
    const size_t squares = (size_t)1 << 2 * (n->data->header.tile_log2 - 3);
    size_t used = 0;
    n->selection_of = carve(base, &used, n->data->list_count, sizeof *n->selection_of);
    n->blocks = carve(base, &used, OUT_BYTES + OUT_ROOM, 1);
    n->normals = carve(base, &used, OUT_RECORDS + OUT_ROOM, sizeof(uint32_t));
    n->runs = carve(base, &used, OUT_RUNS, sizeof *n->runs);
    for (unsigned i = 0; i < LEVELS; i++) {
        level *l = &n->levels[i];
        for (int s = 0; s < SHEETS && l->used; s++) {
            sheet *to = &l->sheets[s];
            to->tile_of = carve(base, &used, tiles_of(l), sizeof *to->tile_of);
            to->tile_at = carve(base, &used, l->room.tiles, sizeof *to->tile_at);
            to->squares = carve(base, &used, l->room.tiles * squares, sizeof *to->squares);
            to->values = carve(base, &used, l->room.squares, sizeof *to->values);
        }
        for (int s = 0; s < DRAWN && l->used; s++) {
            l->drawn[s].runs = carve(base, &used, l->room.runs, sizeof *l->drawn[s].runs);
            l->drawn[s].blocks = carve(base, &used, l->room.block_bytes, 1);
        }
    }
    return used;
}

uint64_t trip_computed_normals_bytes(const trip_dataset *d)
{
    trip_computed_normals n = { .data = d, .budget = d->budget };
    return find_levels(&n) == TRIP_OK ? sizeof n + lay_out(&n, NULL) : sizeof n;
}

static int take_memory(trip_computed_normals *n)
{
    char text[32];
    for (unsigned i = 0; i < LEVELS; i++)
        if (tiles_of(&n->levels[i]) > (uint64_t)TILES_MAX)
            return trip_fail(TRIP_ERROR, "read", n->data->path,
                             "has more than %lld tiles in a sheet, too many to compute normals; "
                             "brick it with --normals or larger tiles",
                             (long long)TILES_MAX);
    n->bytes = lay_out(n, NULL);
    n->memory = trip_budget_take(n->budget, n->bytes);
    if (!n->memory)
        return trip_fail(TRIP_ERROR, "read", n->data->path,
                         "three sheets of values to compute normals take %s, which does not fit "
                         "the memory given; raise --memory, brick with --normals, or use "
                         "--no-shading",
                         trip_format_bytes(n->bytes, text));
    lay_out(n, n->memory);
    return TRIP_OK;
}

static const trip_list *list_at(const trip_dataset *d, unsigned number)
{
    for (unsigned i = 0; i < d->list_count; i++)
        if (d->lists[i].level == number)
            return &d->lists[i];
    return NULL;
}

/* Makes the maps of gradients, from index space to world space: the inverse transpose of
 * index_to_world. With uneven spacing, all levels are in the positions of level 0. */
static void make_maps(trip_computed_normals *n)
{
    const trip_dataset *d = n->data;
    n->value_per_code = (d->header.code_hi - d->header.code_lo) / 65535;
    n->means = trip_mean_scale_make(d->header.value_min, d->header.value_max, d->header.code_lo,
                                    d->header.code_hi);
    for (unsigned i = 0; i < LEVELS; i++) {
        const trip_list *list = list_at(d, i);
        trip_affine to_index;
        if (!list)
            continue;
        trip_affine_invert(trip_coordinates_uneven(&d->coordinates) ? &d->index_to_world
                                                                    : &list->index_to_world,
                           &to_index);
        for (int row = 0; row < 3; row++)
            for (int column = 0; column < 3; column++)
                n->to_world[i][row][column] = to_index.m[column][row];
    }
}

int trip_computed_normals_create(trip_computed_normals **out, const trip_dataset *d,
                                 const trip_reader_params *params, trip_budget *budget)
{
    trip_computed_normals *n = *out = trip_budget_take(budget, sizeof *n);
    if (!n)
        return trip_fail(TRIP_ERROR, "read", d->path, "no memory for normals; raise --memory");
    n->data = d;
    n->budget = budget;
    n->runner = params->runner;
    n->skip = params->skip;
    n->skip_user = params->skip_user;
    make_maps(n);
    int status = find_levels(n);
    if (status == TRIP_OK)
        status = take_memory(n);
    if (status == TRIP_OK) {
        trip_computed_normals_begin(n);
    } else {
        trip_computed_normals_destroy(n);
        *out = NULL;
    }
    return status;
}

void trip_computed_normals_destroy(trip_computed_normals *n)
{
    if (!n)
        return;
    trip_budget_release(n->budget, n->memory, n->memory ? n->bytes : 0);
    trip_budget_release(n->budget, n, sizeof *n);
}

/* ---- sheets ---- */

static void clear_sheet(sheet *s)
{
    for (uint32_t i = 0; i < s->tile_count; i++)
        s->tile_of[s->tile_at[i]] = 0;
    s->tile_count = s->square_count = 0;
    s->index = -1;
}

static void clear_levels(trip_computed_normals *n)
{
    for (unsigned i = 0; i < LEVELS; i++) {
        for (int s = 0; s < SHEETS && n->levels[i].used; s++)
            clear_sheet(&n->levels[i].sheets[s]);
        for (int s = 0; s < DRAWN; s++)
            n->levels[i].drawn[s].run_count = n->levels[i].drawn[s].next_run = 0;
    }
    n->sending = NULL;
}

static void clear_batch(trip_computed_normals *n)
{
    n->run_count = n->block_bytes = n->first_new = 0;
    n->records = 0;
    n->held = false;
}

void trip_computed_normals_begin(trip_computed_normals *n)
{
    clear_levels(n);
    clear_batch(n);
    n->pass = n->added_pass = NULL;
    n->added = NULL;
    n->ended = false;
    n->skipped = n->ns = 0;
}

/* Returns the sheet with the values at `index`, or NULL. */
static const sheet *find_sheet(const level *l, int64_t index)
{
    const sheet *s = index < 0 ? NULL : &l->sheets[index % SHEETS];
    return s && s->index == index ? s : NULL;
}

static sheet *open_sheet(level *l, int64_t index)
{
    sheet *s = &l->sheets[index % SHEETS];
    if (s->index != index)
        clear_sheet(s);
    s->index = index;
    return s;
}

/* Returns the squares of a tile, which begins at voxel (u, v). */
static uint32_t *open_tile(const trip_computed_normals *n, const level *l, sheet *s, int axis,
                           int64_t u, int64_t v)
{
    const unsigned log2 = n->data->header.tile_log2;
    const size_t squares = (size_t)1 << 2 * (log2 - 3);
    const size_t at = (size_t)(((v >> log2) - l->tiles[axis].first_v) * l->tiles[axis].across +
                               (u >> log2) - l->tiles[axis].first_u);
    if (!s->tile_of[at]) {
        s->tile_at[s->tile_count] = (uint32_t)at;
        memset(s->squares + s->tile_count * squares, 0, squares * sizeof *s->squares);
        s->tile_of[at] = ++s->tile_count;
    }
    return s->squares + (s->tile_of[at] - 1) * squares;
}

/* Returns the entry of the voxel with a Morton number in its square. */
static inline unsigned entry_of(unsigned number)
{
    const unsigned u = (number & 1) | (number >> 1 & 2) | (number >> 2 & 4);
    const unsigned v = (number >> 1 & 1) | (number >> 2 & 2) | (number >> 3 & 4);
    return 8 * v + u;
}

static void put_square(const trip_computed_normals *n, square *to, const trip_square *from,
                       bool means)
{
    uint16_t codes[64];
    trip_square_codes(from, codes);
    uint64_t present = to->present, mask = from->mask;
    for (unsigned i = 0; mask; mask &= mask - 1, i++) {
        const unsigned entry = entry_of((unsigned)__builtin_ctzll(mask));
        present |= UINT64_C(1) << entry;
        to->codes[entry] = means ? (uint16_t)trip_mean_value(&n->means, codes[i]) : codes[i];
    }
    to->present = present;
}

/* Adds the values of a run to its sheet. */
static void put_values(const trip_computed_normals *n, level *l, const trip_list *list,
                       const trip_run *run, const trip_block *block)
{
    sheet *s = open_sheet(l, run->sheet);
    uint32_t *tile = open_tile(n, l, s, list->axis, run->u, run->v);
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    const uint32_t count = trip_block_squares(block, squares);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t *at = &tile[squares[i].number];
        if (!*at) {
            memset(&s->values[s->square_count], 0, sizeof *s->values);
            *at = ++s->square_count;
        }
        put_square(n, &s->values[*at - 1], &squares[i], list->kind == TRIP_KIND_MEANS);
    }
}

/* Returns the index of the run's selection in the pass that is drawn, or -1 if the pass does not
 * draw the run. */
static int drawn_selection(const trip_computed_normals *n, const trip_run *run)
{
    const int number = n->selection_of[run->selection] - 1;
    const trip_selection *s = number < 0 ? NULL : &n->pass->selections[number];
    return s && run->sheet >= s->sheet_first && run->sheet <= s->sheet_last &&
                   trip_selection_has(s, run->brick)
               ? number
               : -1;
}

static double order_of(const trip_computed_normals *n, const trip_list *list, int64_t index)
{
    const double at = trip_list_sheet_coordinate(list, index);
    return n->pass->descending ? -at : at;
}

/* Keeps a run that is drawn, and its block. */
static void put_drawn(const trip_computed_normals *n, level *l, const trip_list *list,
                      const trip_run *run, int selection, const void *block)
{
    drawn *d = &l->drawn[run->sheet % DRAWN];
    if (d->next_run == d->run_count) {
        d->run_count = d->next_run = d->bytes = 0;
        d->index = run->sheet;
        d->order = order_of(n, list, run->sheet);
    }
    assert(d->index == run->sheet && d->run_count < l->room.runs);
    trip_run *to = &d->runs[d->run_count++];
    *to = *run;
    to->selection = (uint16_t)selection;
    to->at[TRIP_PLANE_VOXELS] = d->bytes;
    memcpy(d->blocks + d->bytes, block, 8 * (size_t)run->words);
    d->bytes += 8 * (size_t)run->words;
}

static void put_run(trip_computed_normals *n, const trip_run *run)
{
    const trip_list *list = trip_batch_list(n->added, run);
    level *l = &n->levels[list->level];
    const int selection = drawn_selection(n, run);
    const trip_block_form form = trip_block_form_of(&n->data->header, list->kind);
    const void *from = n->added->planes[TRIP_PLANE_VOXELS] + run->at[TRIP_PLANE_VOXELS];
    const trip_block block = trip_block_make(&form, run->count, run->words, from, NULL);
    if (trip_dataset_has_gradients_of(n->data, list))
        put_values(n, l, list, run, &block);
    if (selection >= 0)
        put_drawn(n, l, list, run, selection, from);
}

/* ---- gradients ---- */

/* The squares around one. */
enum { HERE, U_BELOW, U_ABOVE, V_BELOW, V_ABOVE, SHEET_BELOW, SHEET_ABOVE, AROUND };

/* The reciprocal distances between neighbours along an axis, of 8 voxels in a row: between both
 * neighbours, and to the neighbours below and above. */
typedef struct distances {
    float both[8], below[8], above[8];
} distances;

/* Returns the position of a voxel of a level along an axis. With uneven spacing, a coarse voxel is
 * midway between the first and the last voxel that it covers. */
static double position_of(const trip_computed_normals *n, unsigned number, int axis, int64_t at)
{
    const trip_coordinates *c = &n->data->coordinates;
    if (!trip_coordinates_uneven(c))
        return (double)at;
    const int64_t end = c->voxels[axis] - 1;
    const int64_t first = at << number, last = ((at + 1) << number) - 1;
    return (c->along[axis][first < end ? first : end] + c->along[axis][last < end ? last : end]) /
           2;
}

/* Computes the distances of voxels from `first` on. Voxels outside the grid count as even. */
static void find_distances(const trip_computed_normals *n, unsigned number, int axis,
                           int64_t voxels, int64_t first, int count, distances *d)
{
    const bool uneven = trip_coordinates_uneven(&n->data->coordinates);
    for (int i = 0; i < count; i++) {
        const int64_t at = first + i;
        d->both[i] = 0.5f;
        d->below[i] = d->above[i] = 1;
        if (!uneven || at >= voxels)
            continue;
        const double x = position_of(n, number, axis, at);
        const double lo = at > 0 ? position_of(n, number, axis, at - 1) : x - 1;
        const double hi = at + 1 < voxels ? position_of(n, number, axis, at + 1) : x + 1;
        d->both[i] = (float)(1 / (hi - lo));
        d->below[i] = (float)(1 / (x - lo));
        d->above[i] = (float)(1 / (hi - x));
    }
}

/* Codes with a border of one voxel, and 1 where a voxel is present, otherwise 0. */
typedef struct bordered {
    float code[10][10], present[10][10];
} bordered;

static inline void put_voxel(bordered *b, int v, int u, const square *from, unsigned entry)
{
    b->code[v][u] = from->codes[entry];
    b->present[v][u] = (float)(from->present >> entry & 1);
}

static inline void fill_bordered(bordered *b, const square *const around[AROUND])
{
    for (unsigned v = 0; v < 8; v++)
        for (unsigned u = 0; u < 8; u++)
            put_voxel(b, (int)v + 1, (int)u + 1, around[HERE], 8 * v + u);
    for (unsigned i = 0; i < 8; i++) {
        put_voxel(b, (int)i + 1, 0, around[U_BELOW], 8 * i + 7);
        put_voxel(b, (int)i + 1, 9, around[U_ABOVE], 8 * i);
        put_voxel(b, 0, (int)i + 1, around[V_BELOW], 56 + i);
        put_voxel(b, 9, (int)i + 1, around[V_ABOVE], i);
    }
}

/* Returns the difference per distance. `has_lo` and `has_hi` are 1 if a neighbour is present. */
static inline float difference(float here, float lo, float has_lo, float hi, float has_hi,
                               float both, float below, float above)
{
    const float share =
        has_lo * has_hi * both + has_lo * (1 - has_hi) * below + (1 - has_lo) * has_hi * above;
    return (has_hi * (hi - here) - has_lo * (lo - here)) * share;
}

/* The gradients of a square in codes per index along u, v and the list's axis. */
typedef struct gradients {
    float u[64], v[64], sheet[64];
} gradients;

TRIP_ALSO_V3
static void find_gradients(const square *const around[AROUND], const distances along[3],
                           gradients *out)
{
    bordered b;
    const square *lo = around[SHEET_BELOW], *hi = around[SHEET_ABOVE];
    fill_bordered(&b, around);
    for (int v = 0; v < 8; v++)
        for (int u = 0; u < 8; u++) {
            const int n = 8 * v + u;
            const float here = b.code[v + 1][u + 1];
            out->u[n] = difference(here, b.code[v + 1][u], b.present[v + 1][u],
                                   b.code[v + 1][u + 2], b.present[v + 1][u + 2], along[0].both[u],
                                   along[0].below[u], along[0].above[u]);
            out->v[n] = difference(here, b.code[v][u + 1], b.present[v][u + 1],
                                   b.code[v + 2][u + 1], b.present[v + 2][u + 1], along[1].both[v],
                                   along[1].below[v], along[1].above[v]);
            out->sheet[n] = difference(here, lo->codes[n], (float)(lo->present >> n & 1),
                                       hi->codes[n], (float)(hi->present >> n & 1),
                                       along[2].both[0], along[2].below[0], along[2].above[0]);
        }
}

static const square no_values = { 0 };

/* Returns the values of the square with its corner at voxel (u, v). */
static const square *find_square(const trip_computed_normals *n, const level *l, const sheet *s,
                                 int axis, int64_t u, int64_t v)
{
    const unsigned log2 = n->data->header.tile_log2;
    if (!s || u < 0 || v < 0)
        return &no_values;
    const int64_t tile_u = (u >> log2) - l->tiles[axis].first_u,
                  tile_v = (v >> log2) - l->tiles[axis].first_v;
    if (tile_u < 0 || tile_v < 0 || tile_u >= l->tiles[axis].across ||
        tile_v >= l->tiles[axis].down)
        return &no_values;
    const uint32_t tile = s->tile_of[tile_v * l->tiles[axis].across + tile_u];
    if (!tile)
        return &no_values;
    const uint32_t mask = (1u << (log2 - 3)) - 1;
    const uint64_t number = trip_morton((uint32_t)(u >> 3) & mask, (uint32_t)(v >> 3) & mask);
    const uint32_t at = s->squares[((size_t)(tile - 1) << 2 * (log2 - 3)) + number];
    return at ? &s->values[at - 1] : &no_values;
}

/* The sheets around the run whose normals are computed, and the columns of its map to world space.
 */
typedef struct run_work {
    const trip_computed_normals *n;
    const level *l;
    const trip_list *list;
    const trip_run *run;
    const sheet *sheets[3]; /* below, here, above */
    float u[3], v[3], sheet[3];
    distances along[3];
} run_work;

static run_work work_on(const trip_computed_normals *n, const level *l, const trip_list *list,
                        const trip_run *run)
{
    run_work w = { .n = n, .l = l, .list = list, .run = run };
    const double full = n->data->header.gradient_full;
    const double scale = full > 0 ? n->value_per_code / full : 0;
    for (int i = 0; i < 3; i++) {
        const double(*m)[3] = n->to_world[list->level];
        w.sheets[i] = find_sheet(l, run->sheet - 1 + i);
        w.sheet[i] = (float)(scale * m[i][list->axis]);
        w.u[i] = (float)(scale * m[i][(list->axis + 1) % 3]);
        w.v[i] = (float)(scale * m[i][(list->axis + 2) % 3]);
    }
    find_distances(n, list->level, list->axis, list->dims[list->axis], run->sheet, 1, &w.along[2]);
    return w;
}

/* Maps the gradients of a square to world space, in units of the gradient of full shading. */
TRIP_ALSO_V3
static void map_gradients(const run_work *w, const gradients *g, float to[3][64])
{
    for (int i = 0; i < 3; i++)
        for (int n = 0; n < 64; n++)
            to[i][n] = w->u[i] * g->u[n] + w->v[i] * g->v[n] + w->sheet[i] * g->sheet[n];
}

/* Packs the normals of the records of a square to `to`. */
static void put_normals(const run_work *w, const gradients *g, const square *here, uint64_t mask,
                        unsigned char *to)
{
    float world[3][64];
    uint32_t normals[64];
    map_gradients(w, g, world);
    trip_normals_pack_64(world[0], world[1], world[2], normals);
    for (; mask; mask &= mask - 1, to += sizeof *normals) {
        const unsigned entry = entry_of((unsigned)__builtin_ctzll(mask));
        const uint32_t normal = here->present >> entry & 1 ? normals[entry] : 0;
        memcpy(to, &normal, sizeof normal);
    }
}

static void compute_square(run_work *w, const trip_square *at, unsigned char *to)
{
    const uint32_t corner = trip_square_corner(at);
    const int64_t u = w->run->u + (int64_t)trip_voxel_u(corner),
                  v = w->run->v + (int64_t)trip_voxel_v(corner);
    const int axis = w->list->axis, axis_u = (axis + 1) % 3, axis_v = (axis + 2) % 3;
    const trip_computed_normals *n = w->n;
    const square *const around[AROUND] = {
        [HERE] = find_square(n, w->l, w->sheets[1], axis, u, v),
        [U_BELOW] = find_square(n, w->l, w->sheets[1], axis, u - 8, v),
        [U_ABOVE] = find_square(n, w->l, w->sheets[1], axis, u + 8, v),
        [V_BELOW] = find_square(n, w->l, w->sheets[1], axis, u, v - 8),
        [V_ABOVE] = find_square(n, w->l, w->sheets[1], axis, u, v + 8),
        [SHEET_BELOW] = find_square(n, w->l, w->sheets[0], axis, u, v),
        [SHEET_ABOVE] = find_square(n, w->l, w->sheets[2], axis, u, v),
    };
    gradients g;
    find_distances(n, w->list->level, axis_u, w->list->dims[axis_u], u, 8, &w->along[0]);
    find_distances(n, w->list->level, axis_v, w->list->dims[axis_v], v, 8, &w->along[1]);
    find_gradients(around, w->along, &g);
    put_normals(w, &g, around[HERE], at->mask, to + at->first * sizeof(uint32_t));
}

static void compute_run(const trip_computed_normals *n, const trip_run *run)
{
    const trip_list *list = n->pass->selections[run->selection].list;
    const trip_block_form form = trip_block_form_of(&n->data->header, list->kind);
    const trip_block block = trip_block_make(&form, run->count, run->words,
                                             n->blocks + run->at[TRIP_PLANE_VOXELS], NULL);
    run_work w = work_on(n, &n->levels[list->level], list, run);
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    const uint32_t count = trip_block_squares(&block, squares);
    for (uint32_t i = 0; i < count; i++)
        compute_square(&w, &squares[i], n->normals + run->at[TRIP_PLANE_NORMALS]);
}

/* Runs of a batch, for tasks of about the same size. */
typedef struct portions {
    const trip_computed_normals *n;
    size_t first[TASKS_MAX + 1];
} portions;

static void compute_portion(void *context, unsigned number)
{
    const portions *p = context;
    for (size_t i = p->first[number]; i < p->first[number + 1]; i++)
        compute_run(p->n, &p->n->runs[i]);
}

/* Computes the normals of the runs that have none yet. */
static void compute_new(trip_computed_normals *n)
{
    portions p = { .n = n, .first = { n->first_new } };
    unsigned count = 0;
    uint32_t records = 0;
    for (size_t i = n->first_new; i < n->run_count; i++) {
        records += n->runs[i].count;
        if (records < TASK_RECORDS && i + 1 < n->run_count)
            continue;
        p.first[++count] = i + 1;
        records = 0;
    }
    if (count > 0)
        trip_run_tasks(count > 1 ? &n->runner : NULL, compute_portion, &p, count);
    n->first_new = n->run_count;
}

/* ---- batches ---- */

/* Adds a run to the batch. Returns false if the batch is full. */
static bool send_run(trip_computed_normals *n, const drawn *from, const trip_run *run)
{
    const size_t bytes = 8 * (size_t)run->words;
    if (n->records + run->count > OUT_RECORDS || n->block_bytes + bytes > OUT_BYTES ||
        n->run_count == OUT_RUNS)
        return false;
    if (n->skip && n->skip(n->skip_user, &n->pass->selections[run->selection], run)) {
        n->skipped++;
        return true;
    }
    memcpy(n->blocks + n->block_bytes, from->blocks + run->at[TRIP_PLANE_VOXELS], bytes);
    trip_run *to = &n->runs[n->run_count++];
    *to = *run;
    to->at[TRIP_PLANE_VOXELS] = n->block_bytes;
    to->at[TRIP_PLANE_NORMALS] = n->records * sizeof(uint32_t);
    n->block_bytes += bytes;
    n->records += run->count;
    return true;
}

/* Moves the runs of the sheet that is being sent to the batch. Returns false if the batch is full.
 */
static bool send_sheet(trip_computed_normals *n)
{
    drawn *d = n->sending;
    while (d->next_run < d->run_count && send_run(n, d, &d->runs[d->next_run]))
        d->next_run++;
    compute_new(n);
    const bool sent = d->next_run == d->run_count;
    if (sent)
        n->sending = NULL;
    return sent;
}

/* Finds the first sheet with runs to send, before `order`. */
static drawn *find_drawn(trip_computed_normals *n, double order)
{
    drawn *first = NULL;
    for (unsigned i = 0; i < LEVELS; i++)
        for (int s = 0; s < DRAWN && n->levels[i].used; s++) {
            drawn *d = &n->levels[i].drawn[s];
            if (d->next_run < d->run_count && d->order < (first ? first->order : order))
                first = d;
        }
    return first;
}

/* Sends all sheets before `order`. Returns false if the batch is full. */
static bool send_before(trip_computed_normals *n, double order)
{
    while (n->sending || (n->sending = find_drawn(n, order)))
        if (!send_sheet(n))
            return false;
    return true;
}

static void enter_pass(trip_computed_normals *n)
{
    const trip_pass *pass = n->pass = n->added_pass, *around = pass->around;
    clear_levels(n);
    for (unsigned i = 0; i < around->selection_count; i++) {
        n->selection_of[i] = 0;
        for (unsigned k = 0; k < pass->selection_count; k++)
            if (pass->selections[k].list == around->selections[i].list)
                n->selection_of[i] = (uint16_t)(k + 1);
    }
}

/* Takes the runs of the batch that was added. Returns false if a batch is ready. */
static bool take_added(trip_computed_normals *n)
{
    if (n->pass != n->added_pass) {
        if (n->pass && (!send_before(n, HUGE_VAL) || n->run_count > 0))
            return false;
        enter_pass(n);
    }
    for (; n->next_added < n->added->run_count; n->next_added++) {
        const trip_run *run = &n->added->runs[n->next_added];
        const trip_list *list = trip_batch_list(n->added, run);
        /* The sheet before this run now has all its neighbours but this sheet. */
        const int64_t before = n->pass->descending ? run->sheet + 1 : run->sheet - 1;
        if (!send_before(n, order_of(n, list, before)))
            return false;
        put_run(n, run);
    }
    n->added = NULL;
    return true;
}

void trip_computed_normals_add(trip_computed_normals *n, const trip_batch *batch,
                               const trip_pass *pass)
{
    n->added = batch;
    n->added_pass = pass;
    n->next_added = 0;
}

void trip_computed_normals_end(trip_computed_normals *n)
{
    n->ended = true;
}

trip_normals_state trip_computed_normals_work(trip_computed_normals *n)
{
    const uint64_t start = trip_now_ns();
    trip_normals_state state = TRIP_NORMALS_WANT;
    assert(!n->held);
    if (n->added)
        state = take_added(n) ? TRIP_NORMALS_WANT : TRIP_NORMALS_READY;
    else if (n->ended)
        state = !n->pass || (send_before(n, HUGE_VAL) && n->run_count == 0) ? TRIP_NORMALS_OVER
                                                                            : TRIP_NORMALS_READY;
    n->ns += trip_now_ns() - start;
    return state;
}

void trip_computed_normals_take(trip_computed_normals *n, trip_batch *batch)
{
    n->held = true;
    *batch = (trip_batch){
        .pass = n->pass,
        .planes = { n->blocks, n->normals },
        .plane_bytes = { n->block_bytes + OUT_ROOM, n->records * sizeof(uint32_t) + OUT_ROOM },
        .splats = n->records,
        .runs = n->runs,
        .run_count = n->run_count,
    };
}

void trip_computed_normals_release(trip_computed_normals *n)
{
    clear_batch(n);
}

bool trip_computed_normals_is_held(const trip_computed_normals *n)
{
    return n->held;
}

uint64_t trip_computed_normals_skipped(const trip_computed_normals *n)
{
    return n->skipped;
}

uint64_t trip_computed_normals_ns(const trip_computed_normals *n)
{
    return n->ns;
}
