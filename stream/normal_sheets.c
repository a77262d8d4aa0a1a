#include "normal_sheets.h"

#include <string.h>

#include "clones.h"
#include "dataset_normals.h"
#include "mean.h"
#include "normal.h"
#include "report.h"
#include "sheet_room.h"

/* Number of sheets with values in memory. */
enum { SHEETS = 3 };
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

/* A level that has splats. Memory suffices for each axis. */
typedef struct level {
    struct {
        int64_t first_u, first_v, across, down; /* tiles with bricks */
    } tiles[3];                                 /* by axis */
    sheet sheets[SHEETS];
} level;

struct trip_normal_sheets {
    const trip_dataset *data;
    trip_budget *budget;
    trip_mean_scale means;
    float *values; /* with a table of codes, a value for each code; otherwise NULL */
    double value_per_code, to_world[TRIP_SHEET_LEVELS][3][3]; /* for gradients of each level */
    trip_sheet_room rooms[TRIP_SHEET_LEVELS];
    level levels[TRIP_SHEET_LEVELS];
    unsigned char *memory;
    size_t bytes;
};

/* ---- memory ---- */

static void find_tiles(level *l, const trip_dataset *d, unsigned number, int axis)
{
    int64_t lo[2] = { INT64_MAX, INT64_MAX }, hi[2] = { -1, -1 };
    for (unsigned i = 0; i < d->list_count; i++) {
        const trip_list *list = &d->lists[i];
        if (list->level != number || list->axis != axis)
            continue;
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

/* Lays out the memory at `base` and returns its size in bytes. */
static size_t lay_out(trip_normal_sheets *n, unsigned char *base)
{
    const size_t squares = (size_t)1 << 2 * (n->data->header.tile_log2 - 3);
    size_t used = 0;
    if (!trip_codes_even(&n->data->codes))
        n->values = trip_sheet_room_carve(base, &used, TRIP_CODES, sizeof *n->values);
    for (unsigned i = 0; i < TRIP_SHEET_LEVELS; i++) {
        level *l = &n->levels[i];
        const trip_sheet_room *room = &n->rooms[i];
        for (int s = 0; s < SHEETS && room->used; s++) {
            sheet *to = &l->sheets[s];
            to->tile_of = trip_sheet_room_carve(base, &used, tiles_of(l), sizeof *to->tile_of);
            to->tile_at = trip_sheet_room_carve(base, &used, room->tiles, sizeof *to->tile_at);
            to->squares =
                trip_sheet_room_carve(base, &used, room->tiles * squares, sizeof *to->squares);
            to->values = trip_sheet_room_carve(base, &used, room->squares, sizeof *to->values);
        }
    }
    return used;
}

/* Finds the sizes of all levels. */
static int measure(trip_normal_sheets *n)
{
    bool fits = true;
    int status = trip_sheet_rooms_find(n->data, n->rooms, n->budget);
    for (unsigned i = 0; i < TRIP_SHEET_LEVELS && status == TRIP_OK; i++) {
        for (int axis = 0; axis < 3; axis++)
            find_tiles(&n->levels[i], n->data, i, axis);
        fits = fits && tiles_of(&n->levels[i]) <= (uint64_t)TILES_MAX;
    }
    if (status == TRIP_OK && !fits)
        return trip_fail(TRIP_ERROR, "read", n->data->path,
                         "has more than %lld tiles in a sheet, too many to compute normals; "
                         "brick it with --normals stored or larger tiles",
                         (long long)TILES_MAX);
    n->bytes = status == TRIP_OK ? lay_out(n, NULL) : 0;
    return status;
}

uint64_t trip_normal_sheets_bytes(const trip_dataset *d)
{
    trip_normal_sheets *n = trip_budget_take(d->budget, sizeof *n);
    if (!n)
        return 0;
    n->data = d;
    n->budget = d->budget;
    const uint64_t bytes = measure(n) == TRIP_OK ? sizeof *n + n->bytes : 0;
    trip_budget_release(d->budget, n, sizeof *n);
    return bytes;
}

/* Fills in the values of all codes. Differences from the typical minimum keep their precision as
 * floats where values are dense. */
static void fill_values(trip_normal_sheets *n)
{
    const double from = n->data->header.typical_min;
    for (unsigned code = 0; n->values && code < TRIP_CODES; code++)
        n->values[code] = (float)(trip_codes_value(&n->data->codes, code) - from);
}

static int take_memory(trip_normal_sheets *n)
{
    char text[32];
    n->memory = trip_budget_take(n->budget, n->bytes);
    if (!n->memory)
        return trip_fail(TRIP_ERROR, "read", n->data->path,
                         "three sheets of values to compute normals take %s, which does not fit "
                         "the memory given; raise --memory, brick with --normals stored, or use "
                         "--no-shading",
                         trip_format_bytes(n->bytes, text));
    lay_out(n, n->memory);
    fill_values(n);
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
static void make_maps(trip_normal_sheets *n)
{
    const trip_dataset *d = n->data;
    const bool even = trip_codes_even(&d->codes);
    n->value_per_code = even ? (d->codes.hi - d->codes.lo) / (TRIP_CODES - 1) : 1;
    n->means = trip_mean_scale_make(d->header.value_min, d->header.value_max, &d->codes);
    for (unsigned i = 0; i < TRIP_SHEET_LEVELS; i++) {
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

int trip_normal_sheets_create(trip_normal_sheets **out, const trip_dataset *d, trip_budget *budget)
{
    trip_normal_sheets *n = *out = trip_budget_take(budget, sizeof *n);
    if (!n)
        return trip_fail(TRIP_ERROR, "read", d->path, "no memory for normals; raise --memory");
    n->data = d;
    n->budget = budget;
    make_maps(n);
    int status = measure(n);
    if (status == TRIP_OK)
        status = take_memory(n);
    if (status == TRIP_OK) {
        trip_normal_sheets_clear(n);
    } else {
        trip_normal_sheets_destroy(n);
        *out = NULL;
    }
    return status;
}

void trip_normal_sheets_destroy(trip_normal_sheets *n)
{
    if (!n)
        return;
    trip_budget_release(n->budget, n->memory, n->memory ? n->bytes : 0);
    trip_budget_release(n->budget, n, sizeof *n);
}

/* ---- values ---- */

static void clear_sheet(sheet *s)
{
    for (uint32_t i = 0; i < s->tile_count; i++)
        s->tile_of[s->tile_at[i]] = 0;
    s->tile_count = s->square_count = 0;
    s->index = -1;
}

void trip_normal_sheets_clear(trip_normal_sheets *n)
{
    for (unsigned i = 0; i < TRIP_SHEET_LEVELS; i++)
        for (int s = 0; s < SHEETS && n->rooms[i].used; s++)
            clear_sheet(&n->levels[i].sheets[s]);
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
static uint32_t *open_tile(const trip_normal_sheets *n, const level *l, sheet *s, int axis,
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

static void put_square(const trip_normal_sheets *n, square *to, const trip_square *from, bool means)
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

void trip_normal_sheets_put(trip_normal_sheets *n, const trip_list *list, const trip_run *run,
                            const trip_block *block)
{
    level *l = &n->levels[list->level];
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
static double position_of(const trip_normal_sheets *n, unsigned number, int axis, int64_t at)
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
static void find_distances(const trip_normal_sheets *n, unsigned number, int axis, int64_t voxels,
                           int64_t first, int count, distances *d)
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

/* Codes or values with a border of one voxel, and 1 where a voxel is present, otherwise 0. */
typedef struct bordered {
    float code[10][10], present[10][10];
} bordered;

/* Returns the value of a code, or the code if codes are even. */
static inline float value_of(const float *values, uint16_t code)
{
    return values ? values[code] : code;
}

static inline void put_voxel(bordered *b, int v, int u, const square *from, unsigned entry,
                             const float *values)
{
    b->code[v][u] = value_of(values, from->codes[entry]);
    b->present[v][u] = (float)(from->present >> entry & 1);
}

static inline void fill_bordered(bordered *b, const square *const around[AROUND],
                                 const float *values)
{
    for (unsigned v = 0; v < 8; v++)
        for (unsigned u = 0; u < 8; u++)
            put_voxel(b, (int)v + 1, (int)u + 1, around[HERE], 8 * v + u, values);
    for (unsigned i = 0; i < 8; i++) {
        put_voxel(b, (int)i + 1, 0, around[U_BELOW], 8 * i + 7, values);
        put_voxel(b, (int)i + 1, 9, around[U_ABOVE], 8 * i, values);
        put_voxel(b, 0, (int)i + 1, around[V_BELOW], 56 + i, values);
        put_voxel(b, 9, (int)i + 1, around[V_ABOVE], i, values);
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

/* The gradients of a square in codes or values per index along u, v and the list's axis. */
typedef struct gradients {
    float u[64], v[64], sheet[64];
} gradients;

static inline __attribute__((always_inline)) void gradients_of(const square *const around[AROUND],
                                                               const distances along[3],
                                                               const float *values, gradients *out)
{
    bordered b;
    const square *lo = around[SHEET_BELOW], *hi = around[SHEET_ABOVE];
    fill_bordered(&b, around, values);
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
            out->sheet[n] =
                difference(here, value_of(values, lo->codes[n]), (float)(lo->present >> n & 1),
                           value_of(values, hi->codes[n]), (float)(hi->present >> n & 1),
                           along[2].both[0], along[2].below[0], along[2].above[0]);
        }
}

TRIP_ALSO_V3
static void find_gradients(const square *const around[AROUND], const distances along[3],
                           gradients *out)
{
    gradients_of(around, along, NULL, out);
}

/* Finds the gradients of values, for codes with a table. */
static void find_gradients_of_values(const square *const around[AROUND], const distances along[3],
                                     const float *values, gradients *out)
{
    gradients_of(around, along, values, out);
}

static const square no_values = { 0 };

/* Returns the values of the square with its corner at voxel (u, v). */
static const square *find_square(const trip_normal_sheets *n, const level *l, const sheet *s,
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

/* The sheets around a run, and the columns of the map of gradients to world space. */
typedef struct run_work {
    const trip_normal_sheets *n;
    const level *l;
    const trip_list *list;
    const trip_run *run;
    const sheet *sheets[3]; /* below, here, above */
    float u[3], v[3], sheet[3];
    distances along[3];
} run_work;

static run_work work_on(const trip_normal_sheets *n, const level *l, const trip_list *list,
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
    const trip_normal_sheets *n = w->n;
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
    if (n->values)
        find_gradients_of_values(around, w->along, n->values, &g);
    else
        find_gradients(around, w->along, &g);
    put_normals(w, &g, around[HERE], at->mask, to + at->first * sizeof(uint32_t));
}

void trip_normal_sheets_compute(const trip_normal_sheets *n, const trip_list *list,
                                const trip_run *run, const trip_block *block,
                                unsigned char *normals)
{
    run_work w = work_on(n, &n->levels[list->level], list, run);
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    const uint32_t count = trip_block_squares(block, squares);
    for (uint32_t i = 0; i < count; i++)
        compute_square(&w, &squares[i], normals);
}
