#include "cpu/sheets/store.h"

#include <math.h>
#include <string.h>

#include "cpu/layout.h"
#include "cpu/sheets/uneven.h"
#include "cpu/squares.h"
#include "field.h"
#include "report.h"

static size_t raster_bytes(bool blurs)
{
    return sizeof(trip_cpu_voxels) + (blurs ? sizeof(trip_cpu_deviations) : 0);
}

/* ---- memory ---- */

void trip_cpu_store_clear(const trip_cpu_store *s, int32_t raster)
{
    int16_t *codes = s->voxels[raster].codes;
    for (int i = 0; i < TRIP_CPU_RASTER_VOXELS; i++)
        codes[i] = TRIP_CPU_CODE_MISSING;
    if (s->blurs)
        memset(s->deviations[raster], 0, sizeof *s->deviations);
}

static void free_all(trip_cpu_store *s)
{
    s->free_count = 0;
    for (uint32_t i = s->rasters; i-- > 1;)
        s->free[s->free_count++] = (int32_t)i;
}

static void release_voxels(trip_cpu_store *s)
{
    trip_budget_release(s->budget, s->voxels, s->voxels_bytes);
    trip_budget_release(s->budget, s->deviations, s->deviations_bytes);
    trip_budget_release(s->budget, s->free, s->rasters * sizeof *s->free);
    s->voxels = NULL;
    s->deviations = NULL;
    s->deviations_bytes = 0;
    s->free = NULL;
    s->voxels_bytes = 0;
    s->rasters = 0;
}

/* Takes `wanted` rasters. Keeps the present pool if it has at least `min` rasters and half of
 * `wanted`, and deviations if they are needed. Returns false without memory. */
static bool take_voxels(trip_cpu_store *s, uint64_t min, uint64_t wanted)
{
    if (s->rasters >= min && s->rasters >= wanted / 2 && (s->deviations || !s->blurs))
        return true;
    release_voxels(s);
    s->rasters = (uint32_t)wanted;
    s->voxels_bytes = wanted * raster_bytes(false);
    s->deviations_bytes = s->blurs ? wanted * sizeof *s->deviations : 0;
    if (s->blurs)
        s->deviations = trip_budget_take(s->budget, s->deviations_bytes);
    s->voxels = trip_budget_take(s->budget, s->voxels_bytes);
    s->free = trip_budget_take(s->budget, s->rasters * sizeof *s->free);
    if (!s->voxels || !s->free || (s->blurs && !s->deviations))
        release_voxels(s);
    return s->voxels != NULL;
}

static size_t lay_out_on_demand(trip_cpu_on_demand *d, char *memory, size_t at, size_t grid)
{
    d->begun = trip_cpu_take_array(memory, &at, grid * sizeof *d->begun);
    d->made = trip_cpu_take_array(memory, &at, grid * sizeof *d->made);
    return at;
}

static size_t lay_out(trip_cpu_store *s, char *memory)
{
    size_t at = 0, grid = trip_cpu_store_grid(s);
    for (unsigned i = 0; i < s->sheet_room; i++) {
        trip_cpu_sheet *sheet = &s->sheets[i];
        sheet->rasters = trip_cpu_take_array(memory, &at, grid * sizeof *sheet->rasters);
        sheet->ranges = trip_cpu_take_array(memory, &at, grid * sizeof *sheet->ranges);
        sheet->filled = trip_cpu_take_array(memory, &at, grid * sizeof *sheet->filled);
        sheet->visible = trip_cpu_take_array(memory, &at, grid * sizeof *sheet->visible);
        sheet->cells = trip_cpu_take_array(memory, &at, grid * sizeof *sheet->cells);
        sheet->edges = trip_cpu_take_array(memory, &at, grid * sizeof *sheet->edges);
        if (s->blurs)
            sheet->rows = trip_cpu_take_array(memory, &at, grid * sizeof *sheet->rows);
        sheet->needed = trip_cpu_take_array(memory, &at, grid * sizeof *sheet->needed);
        sheet->making.rasters = sheet->rasters;
        at = lay_out_on_demand(&sheet->making.gradients, memory, at, grid);
    }
    for (unsigned i = 0; i < s->sample_room; i++) {
        trip_cpu_sheet *sample = &s->samples[i];
        sample->rasters = trip_cpu_take_array(memory, &at, grid * sizeof *sample->rasters);
        sample->making.rasters = sample->rasters;
        at = lay_out_on_demand(&sample->making.codes, memory, at, grid);
        at = lay_out_on_demand(&sample->making.gradients, memory, at, grid);
    }
    s->some = trip_cpu_take_array(memory, &at, grid * sizeof *s->some);
    s->open = trip_cpu_take_array(memory, &at, grid * sizeof *s->open);
    return at;
}

static void release_grids(trip_cpu_store *s)
{
    trip_budget_release(s->budget, s->grids, s->grids_bytes);
    s->grids = NULL;
    s->grids_bytes = 0;
}

void trip_cpu_store_release(trip_cpu_store *s)
{
    release_grids(s);
    release_voxels(s);
}

static bool take_grids(trip_cpu_store *s)
{
    size_t bytes = lay_out(s, NULL);
    if (bytes > s->grids_bytes) {
        release_grids(s);
        s->grids = trip_budget_take(s->budget, bytes);
        s->grids_bytes = s->grids ? bytes : 0;
    }
    return s->grids != NULL;
}

static bool has_grid(const trip_cpu_rasters *all)
{
    int64_t across = all->last[0] - all->first[0] + 3, down = all->last[1] - all->first[1] + 3;
    return across < (1 << 20) && down < (1 << 20) && across * down < (1 << 24);
}

static void set_grid(trip_cpu_store *s, const trip_cpu_rasters *all)
{
    s->first_u = all->first[0] - 1;
    s->first_v = all->first[1] - 1;
    s->across = (int32_t)(all->last[0] - all->first[0] + 3);
    s->down = (int32_t)(all->last[1] - all->first[1] + 3);
}

void trip_cpu_store_move(trip_cpu_store *s, const trip_cpu_rasters *to)
{
    set_grid(s, to);
    memset(s->grids, 0, lay_out(s, s->grids));
    memset(s->open, 0xff, trip_cpu_store_grid(s) * sizeof *s->open);
    for (unsigned i = 0; i < s->sheet_room; i++)
        s->sheets[i].prepared = s->sheets[i].shaded = false;
    free_all(s);
    trip_cpu_store_clear(s, 0);
}

static uint64_t grid_bytes(const trip_cpu_rasters *all, unsigned sheets, unsigned samples,
                           bool blurs)
{
    trip_cpu_store of = { .sheet_room = sheets, .sample_room = samples, .blurs = blurs };
    set_grid(&of, all);
    return lay_out(&of, NULL);
}

uint64_t trip_cpu_store_bytes(const trip_cpu_rasters *all, unsigned sheets, unsigned samples,
                              uint64_t rasters, bool blurs)
{
    uint64_t grids = has_grid(all) ? grid_bytes(all, sheets, samples, blurs) : UINT64_MAX / 2;
    return grids + (rasters + 1) * (raster_bytes(blurs) + sizeof(int32_t));
}

uint64_t trip_cpu_store_held_bytes(const trip_cpu_store *s)
{
    return s->voxels_bytes + s->deviations_bytes + s->rasters * sizeof *s->free + s->grids_bytes;
}

bool trip_cpu_store_fit(trip_cpu_store *s, const trip_cpu_rasters *all, unsigned sheets,
                        unsigned samples, uint64_t min, uint64_t max, uint64_t room)
{
    const uint64_t greatest = TRIP_CPU_RASTERS_MAX - 1;
    if (min > greatest || !has_grid(all) ||
        trip_cpu_store_bytes(all, sheets, samples, min, s->blurs) > room)
        return false;
    max = max < greatest ? max : greatest;
    uint64_t fit = (room - grid_bytes(all, sheets, samples, s->blurs)) /
                       (raster_bytes(s->blurs) + sizeof *s->free) -
                   1;
    s->sheet_room = sheets;
    s->sample_room = samples;
    set_grid(s, all);
    if (s->rasters > fit + 1)
        release_voxels(s);
    if (!take_grids(s) || !take_voxels(s, 1 + min, 1 + (max < fit ? max : fit)))
        return false;
    trip_cpu_store_move(s, all);
    return true;
}

/* Lets threads make all squares of a raster. */
static void forget_made(const trip_cpu_on_demand *d, size_t at)
{
    if (!d->begun)
        return;
    atomic_store_explicit(&d->begun[at], 0, memory_order_relaxed);
    atomic_store_explicit(&d->made[at], 0, memory_order_relaxed);
}

bool trip_cpu_store_take(trip_cpu_store *s, trip_cpu_sheet *sheet, size_t at)
{
    if (s->free_count == 0)
        return false;
    sheet->rasters[at] = s->free[--s->free_count];
    if (sheet->filled)
        atomic_store_explicit(&sheet->filled[at], 0, memory_order_relaxed);
    forget_made(&sheet->making.codes, at);
    forget_made(&sheet->making.gradients, at);
    return true;
}

void trip_cpu_store_drop(trip_cpu_store *s, trip_cpu_sheet *sheet)
{
    size_t grid = trip_cpu_store_grid(s);
    for (size_t i = 0; i < grid; i++) {
        if (sheet->rasters[i])
            s->free[s->free_count++] = sheet->rasters[i];
        sheet->rasters[i] = 0;
    }
    if (sheet->visible) {
        memset(sheet->visible, 0, grid * sizeof *sheet->visible);
        memset(sheet->edges, 0, grid * sizeof *sheet->edges);
        memset(sheet->needed, 0, grid * sizeof *sheet->needed);
    }
    sheet->prepared = sheet->shaded = false;
    atomic_store_explicit(&sheet->largest_row, 0, memory_order_relaxed);
}

/* ---- from a run to voxels ---- */

/* Writes the draw codes of a square's records, stretched. */
static void square_codes(const trip_cpu_store *s, const trip_square *at, uint16_t codes[64])
{
    const uint32_t count = at->count;
    const trip_cpu_codes stretch = s->codes;
    trip_square_codes(at, codes);
    if (s->draw->of_stored)
        for (uint32_t i = 0; i < count; i++)
            codes[i] = s->draw->of_stored[codes[i]];
    if (stretch.shift > 0)
        for (uint32_t i = 0; i < count; i++)
            codes[i] = trip_cpu_code(stretch, codes[i]);
}

/* Writes the deviations of a square's records, which begin at `from`. */
static void decode_deviations(const trip_cpu_store *s, int16_t *to, const trip_square *at,
                              const uint8_t *from)
{
    uint16_t codes[64];
    uint32_t n = 0;
    if (s->draw->of_stored)
        trip_square_codes(at, codes);
    for (uint64_t rest = at->mask; rest; rest &= rest - 1, n++) {
        int16_t *d = &to[trip_cpu_places[__builtin_ctzll(rest)]];
        *d = (int16_t)(from[n] * TRIP_CPU_DEVIATION_PARTS);
        if (s->draw->of_stored)
            *d = (int16_t)lrint(trip_draw_deviation(s->draw, codes[n], from[n]) *
                                TRIP_CPU_DEVIATION_PARTS);
    }
}

static bool is_within(const trip_cpu_store *s, int64_t u, int64_t v)
{
    return u >= s->first_u && v >= s->first_v && u < s->first_u + s->across &&
           v < s->first_v + s->down;
}

/* Adds squares of a raster to those with voxels. */
static void add_filled(const trip_cpu_sheet *sheet, size_t at, uint64_t squares)
{
    if (squares)
        atomic_fetch_or_explicit(&sheet->filled[at], squares, memory_order_relaxed);
}

void trip_cpu_store_decode(const trip_cpu_store *s, const trip_cpu_sheet *sheet,
                           const trip_block *block, const trip_run *run)
{
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    const uint32_t count = trip_block_squares(block, squares);
    uint16_t codes[64 + 32] = { 0 };
    uint64_t filled = 0; /* squares of raster `last`; an atomic step waits for all stores */
    size_t last = 0;
    for (const trip_square *square = squares; square < squares + count; square++) {
        int u = run->u + 8 * trip_cpu_square_u(square->number);
        int v = run->v + 8 * trip_cpu_square_v(square->number);
        if (!is_within(s, u >> TRIP_CPU_RASTER_LOG2, v >> TRIP_CPU_RASTER_LOG2))
            continue;
        const size_t at =
            trip_cpu_store_at(s, u >> TRIP_CPU_RASTER_LOG2, v >> TRIP_CPU_RASTER_LOG2);
        u &= TRIP_CPU_RASTER - 1;
        v &= TRIP_CPU_RASTER - 1;
        const uint64_t bit = UINT64_C(1) << (v / 8 * TRIP_CPU_SQUARES_ACROSS + u / 8);
        if (!sheet->rasters[at] || !(s->open[at] & bit))
            continue;
        const int first = v * TRIP_CPU_RASTER_STRIDE + u;
        square_codes(s, square, codes);
        s->kernels->sheet_decode(codes, square->mask, s->voxels[sheet->rasters[at]].codes + first);
        if (s->blurs && block->deviations)
            decode_deviations(s, s->deviations[sheet->rasters[at]] + first, square,
                              block->deviations + square->first);
        if (at != last)
            add_filled(sheet, last, filled);
        filled = (at != last ? 0 : filled) | bit;
        last = at;
    }
    add_filled(sheet, last, filled);
}

/* ---- neighbours and visibility ---- */

/* A job with one task for each sheet and row of the grid, except the outermost rows. */
typedef struct work_job {
    trip_cpu_store *store;
    const trip_cpu_sheet_work *work;
    const trip_cpu_tf *function;
    bool either; /* also for rasters that only `other` has */
    /* Called for each present raster. */
    void (*each)(const struct work_job *job, const trip_cpu_sheet_work *w, size_t at);
} work_job;

static void work_row(void *context, unsigned task, unsigned thread)
{
    const work_job *job = context;
    const trip_cpu_store *s = job->store;
    unsigned rows = (unsigned)s->down - 2;
    const trip_cpu_sheet_work *w = &job->work[task / rows];
    (void)thread;
    if (trip_interrupted())
        return;
    for (int32_t u = 1; u < s->across - 1; u++) {
        size_t at = (size_t)(task % rows + 1) * (size_t)s->across + (size_t)u;
        if (w->sheet->rasters[at] || (job->either && w->other->rasters[at]))
            job->each(job, w, at);
    }
}

static void run_work(work_job *job, unsigned count)
{
    trip_cpu_job rows = { .run = work_row,
                          .context = job,
                          .tasks = count * ((unsigned)job->store->down - 2) };
    if (count == 0)
        return;
    trip_cpu_pool_start(job->store->pool, &rows);
    trip_cpu_pool_wait(job->store->pool, &rows);
}

static trip_cpu_voxels *raster_at(const trip_cpu_store *s, const trip_cpu_sheet *sheet, size_t at)
{
    return s->voxels + (sheet ? sheet->rasters[at] : 0);
}

/* Copies the first column of the raster to the right, the first row of the raster below, and the
 * first voxel of the raster diagonally behind. */
static void copy_beside(int16_t *to, const int16_t *right, const int16_t *below,
                        const int16_t *behind)
{
    for (int v = 0; v < TRIP_CPU_RASTER; v++)
        to[v * TRIP_CPU_RASTER_STRIDE + TRIP_CPU_RASTER] = right[v * TRIP_CPU_RASTER_STRIDE];
    int16_t *last = to + TRIP_CPU_RASTER * TRIP_CPU_RASTER_STRIDE;
    memcpy(last, below, TRIP_CPU_RASTER * sizeof *last);
    last[TRIP_CPU_RASTER] = behind[0];
}

static void copy_codes_beside(const work_job *job, const trip_cpu_sheet_work *w, size_t at)
{
    const trip_cpu_store *s = job->store;
    const size_t across = (size_t)s->across;
    copy_beside(raster_at(s, w->sheet, at)->codes, raster_at(s, w->sheet, at + 1)->codes,
                raster_at(s, w->sheet, at + across)->codes,
                raster_at(s, w->sheet, at + across + 1)->codes);
}

static int16_t *deviations_at(const trip_cpu_store *s, const trip_cpu_sheet *sheet, size_t at)
{
    return s->deviations[sheet->rasters[at]];
}

static void find_rows(const trip_cpu_store *s, trip_cpu_sheet *sheet, size_t at, uint64_t filled)
{
    const size_t across = (size_t)s->across;
    unsigned largest = atomic_load_explicit(&sheet->largest_row, memory_order_relaxed);
    copy_beside(deviations_at(s, sheet, at), deviations_at(s, sheet, at + 1),
                deviations_at(s, sheet, at + across), deviations_at(s, sheet, at + across + 1));
    s->kernels->sheet_rows(deviations_at(s, sheet, at), filled, sheet->rows[at]);
    for (int i = 0; i < 64; i++)
        while (sheet->rows[at][i] > largest &&
               !atomic_compare_exchange_weak_explicit(&sheet->largest_row, &largest,
                                                      sheet->rows[at][i], memory_order_relaxed,
                                                      memory_order_relaxed)) {
        }
}

static void copy_gradients_beside(const work_job *job, const trip_cpu_sheet_work *w, size_t at)
{
    const trip_cpu_store *s = job->store;
    size_t across = (size_t)s->across;
    trip_cpu_gradient *to = raster_at(s, w->sheet, at)->gradients;
    const trip_cpu_gradient *right = raster_at(s, w->sheet, at + 1)->gradients;
    const trip_cpu_gradient *below = raster_at(s, w->sheet, at + across)->gradients;
    for (int v = 0; v < TRIP_CPU_RASTER; v++)
        to[v * TRIP_CPU_RASTER_STRIDE + TRIP_CPU_RASTER] = right[v * TRIP_CPU_RASTER_STRIDE];
    trip_cpu_gradient *last = to + TRIP_CPU_RASTER * TRIP_CPU_RASTER_STRIDE;
    memcpy(last, below, TRIP_CPU_RASTER * sizeof *last);
    last[TRIP_CPU_RASTER] = raster_at(s, w->sheet, at + across + 1)->gradients[0];
}

/* Returns the squares with voxels of a present raster. All other squares have an empty range. */
static uint64_t filled_in(const trip_cpu_sheet *sheet, size_t at)
{
    return atomic_load_explicit(&sheet->filled[at], memory_order_relaxed);
}

static void find_ranges(const work_job *job, const trip_cpu_sheet_work *w, size_t at)
{
    const trip_cpu_store *s = job->store;
    copy_codes_beside(job, w, at);
    const uint64_t filled = filled_in(w->sheet, at);
    s->kernels->sheet_ranges(raster_at(s, w->sheet, at), filled, &w->sheet->ranges[at]);
    if (s->blurs)
        find_rows(s, w->sheet, at, filled);
}

void trip_cpu_store_prepare(trip_cpu_store *s, const trip_cpu_sheet_work *work, unsigned count)
{
    run_work(&(work_job){ .store = s, .work = work, .each = find_ranges }, count);
    for (unsigned i = 0; i < count; i++)
        work[i].sheet->prepared = true;
}

/* Returns whether the cell with first voxel `first` may be visible. Used for transfer functions
 * with gaps. */
static bool cell_shows(const trip_cpu_tf *f, const int16_t *from, const int16_t *to, int first)
{
    int16_t min = INT16_MAX, max = INT16_MIN;
    int corners[2] = { 0 };
    for (int k = 0; k < 8; k++) {
        int16_t code =
            (k >> 2 ? to : from)[first + (k >> 1 & 1) * TRIP_CPU_RASTER_STRIDE + (k & 1)];
        if (code == TRIP_CPU_CODE_MISSING)
            continue;
        corners[k >> 2]++;
        min = code < min ? code : min;
        max = code > max ? code : max;
    }
    return (corners[0] == 4 || corners[1] == 4) && trip_cpu_tf_shows(f, min, max);
}

static void find_cells_one_by_one(const trip_cpu_tf *f, const trip_cpu_voxels *from,
                                  const trip_cpu_voxels *to, uint64_t squares, trip_cpu_cells *out)
{
    for (int v = 0; v < TRIP_CPU_RASTER; v++) {
        out->rows[v] = 0;
        for (int u = 0; u < TRIP_CPU_RASTER; u++)
            if (squares >> (v / 8 * TRIP_CPU_SQUARES_ACROSS + u / 8) & 1 &&
                cell_shows(f, from->codes, to->codes, v * TRIP_CPU_RASTER_STRIDE + u))
                out->rows[v] |= UINT64_C(1) << u;
    }
}

/* Returns a biased code moved by `by` and kept within the codes of voxels. */
static int16_t moved(int16_t code, int64_t by)
{
    const int64_t to = code + by;
    return (int16_t)(to < TRIP_CPU_CODE_MIN ? TRIP_CPU_CODE_MIN : to < INT16_MAX ? to : INT16_MAX);
}

/* Finds the cells in the given squares that may be visible with deviations up to a row. */
static void find_cells_of_row(const work_job *job, const trip_cpu_sheet_work *w, size_t at,
                              uint64_t squares, unsigned row, trip_cpu_cells *cells)
{
    const trip_cpu_store *s = job->store;
    const trip_cpu_tf *f = job->function;
    const trip_cpu_voxels *from = raster_at(s, w->sheet, at), *to = raster_at(s, w->other, at);
    const int64_t reach = row ? trip_cpu_tf_reach(f, row) : 0;
    const bool known =
        reach == 0 || (f->visible_below + reach < 0 && f->visible_above - reach > UINT16_MAX);
    if (trip_kernel_is_wide(w->kernel) || (reach > 0 && !(f->in_a_row && known)))
        s->kernels->sheet_cells(from, to, squares, TRIP_CPU_CODE_MIN, INT16_MAX, cells);
    else if (f->in_a_row)
        s->kernels->sheet_cells(from, to, squares, moved(f->first_visible, -reach),
                                moved(f->last_visible, reach), cells);
    else
        find_cells_one_by_one(f, from, to, squares, cells);
}

/* Returns the row that suffices for all segments that meet a square. Their ends may lie in the
 * squares around it, or if rays leap, in any square. */
static unsigned row_about(const trip_cpu_store *s, const trip_cpu_sheet_work *w, size_t at,
                          int square)
{
    enum { ACROSS = TRIP_CPU_SQUARES_ACROSS };
    const trip_cpu_sheet *sheets[2] = { w->sheet, w->other };
    unsigned row = 0;
    for (int k = 0; k < 2; k++) {
        const unsigned largest =
            atomic_load_explicit(&sheets[k]->largest_row, memory_order_relaxed);
        if (w->everywhere || largest <= row) {
            row = largest > row ? largest : row;
            continue;
        }
        for (int n = 0; n < 9; n++) {
            const int u = square % ACROSS + n % 3 - 1, v = square / ACROSS + n / 3 - 1;
            const size_t below = v < 0 ? -(size_t)s->across : v < ACROSS ? 0 : (size_t)s->across;
            const size_t raster = at + below + (u < 0 ? (size_t)-1 : u < ACROSS ? 0 : 1);
            if (!sheets[k]->rasters[raster])
                continue;
            const unsigned there =
                sheets[k]->rows[raster][(v + ACROSS) % ACROSS * ACROSS + (u + ACROSS) % ACROSS];
            row = there > row ? there : row;
        }
    }
    return row;
}

/* Finds the cells that may be visible in the given squares. `rows` has the row of each square, or
 * is NULL if nothing is blurred. */
static void find_cells(const work_job *job, const trip_cpu_sheet_work *w, size_t at,
                       uint64_t squares, const uint8_t *of_squares)
{
    trip_cpu_cells *cells = &w->sheet->cells[at];
    if (!of_squares)
        find_cells_of_row(job, w, at, squares, 0, cells);
    else
        *cells = (trip_cpu_cells){ .rows = { 0 } };
    for (uint64_t rest = of_squares ? squares : 0; rest;) {
        const unsigned row = of_squares[__builtin_ctzll(rest)];
        trip_cpu_cells of_row;
        uint64_t same = 0;
        for (uint64_t left = rest; left; left &= left - 1)
            if (of_squares[__builtin_ctzll(left)] == row)
                same |= left & -left;
        find_cells_of_row(job, w, at, same, row, &of_row);
        for (int v = 0; v < TRIP_CPU_RASTER; v++)
            cells->rows[v] |= of_row.rows[v];
        rest &= ~same;
    }
    const uint64_t *rows = cells->rows;
    for (int v = 0; v < TRIP_CPU_RASTER; v++)
        cells->fours[v] = rows[v];
    for (int n = 1; n < 4; n++)
        for (int v = 0; v < TRIP_CPU_RASTER - n; v++)
            cells->fours[v] |= rows[v + n];
}

/* Returns a byte with one bit for each square that contains a cell of the given row of cells. */
static uint64_t squares_with(uint64_t cells)
{
    cells |= cells >> 4;
    cells |= cells >> 2;
    cells |= cells >> 1;
    return ((cells & TRIP_CPU_COLUMN_0) * UINT64_C(0x0102040810204080)) >> 56;
}

/* Finds the squares with visible cells, and the subsets with such cells near an edge. A segment
 * moves less than a voxel along u and v. So both ends lie in the cell that it meets, or in a cell
 * that touches it. Segments of a cell therefore read voxels from one before the cell to two behind
 * it. */
static void find_edges(trip_cpu_edges edges, const trip_cpu_cells *cells)
{
    for (int i = 0; i < TRIP_CPU_RASTER; i += 8) {
        const uint64_t *row = cells->rows + i, last = row[6] | row[7];
        const uint64_t all = row[0] | row[1] | row[2] | row[3] | row[4] | row[5] | last;
        edges[TRIP_CPU_ALL] |= squares_with(all) << i;
        edges[TRIP_CPU_LEFT] |= squares_with(all & TRIP_CPU_COLUMN_0) << i;
        edges[TRIP_CPU_RIGHT] |= squares_with(all & (TRIP_CPU_COLUMN_7 | TRIP_CPU_COLUMN_7 >> 1))
                                 << i;
        edges[TRIP_CPU_ABOVE] |= squares_with(row[0]) << i;
        edges[TRIP_CPU_BELOW] |= squares_with(last) << i;
    }
}

/* Widens the range by the present voxels of a sheet in a square and its eight neighbours. */
static void add_ranges_about(const trip_cpu_store *s, const trip_cpu_sheet *sheet, size_t at,
                             int square, int16_t range[2])
{
    enum { ACROSS = TRIP_CPU_SQUARES_ACROSS };
    for (int n = 0; n < 9 && sheet; n++) {
        const int u = square % ACROSS + n % 3 - 1, v = square / ACROSS + n / 3 - 1;
        const size_t below = v < 0 ? -(size_t)s->across : v < ACROSS ? 0 : (size_t)s->across;
        const size_t raster = at + below + (u < 0 ? (size_t)-1 : u < ACROSS ? 0 : 1);
        if (!sheet->rasters[raster])
            continue;
        const trip_cpu_square_ranges *r = &sheet->ranges[raster];
        const int i = (v + ACROSS) % ACROSS * ACROSS + (u + ACROSS) % ACROSS;
        range[0] = r->min[i] < range[0] ? r->min[i] : range[0];
        range[1] = r->max[i] > range[1] ? r->max[i] : range[1];
    }
}

/* Returns whether kernels of 64 voxels may interpolate a visible value in the square. */
static bool shows_about(const work_job *job, const trip_cpu_sheet_work *w, size_t at, int square)
{
    const trip_cpu_sheet *about[] = { w->before, w->sheet, w->other, w->behind };
    int16_t range[2] = { INT16_MAX, INT16_MIN };
    double bounds[2];
    for (int i = 0; i < 4; i++)
        add_ranges_about(job->store, about[i], at, square, range);
    if (range[0] > range[1])
        return false;
    /* The weights of a kernel may enlarge deviations. */
    const int64_t reach =
        job->store->blurs ? trip_cpu_tf_reach(job->function, TRIP_CPU_BLURRED_ROWS - 1) : 0;
    trip_field_code_bounds(w->kernel, range[0], range[1], bounds);
    return trip_cpu_tf_shows_within(job->function,
                                    (int16_t)fmax(TRIP_CPU_CODE_MIN, floor(bounds[0])),
                                    (int16_t)fmin(INT16_MAX, ceil(bounds[1])), reach);
}

static void find_visible(const work_job *job, const trip_cpu_sheet_work *w, size_t at)
{
    const trip_cpu_square_ranges *a = &w->sheet->ranges[at], *b = &w->other->ranges[at];
    uint64_t visible = 0, *edges = w->sheet->edges[at];
    const bool blurs = job->store->blurs;
    uint8_t rows[64];
    if (w->other->rasters[at])
        for (uint64_t rest = filled_in(w->sheet, at) & filled_in(w->other, at); rest;
             rest &= rest - 1) {
            const int i = __builtin_ctzll(rest);
            bool any = a->min[i] <= a->max[i] && b->min[i] <= b->max[i];
            int16_t min = a->min[i] < b->min[i] ? a->min[i] : b->min[i];
            int16_t max = a->max[i] > b->max[i] ? a->max[i] : b->max[i];
            if (any && blurs)
                rows[i] = (uint8_t)row_about(job->store, w, at, i);
            if (any &&
                (trip_kernel_is_wide(w->kernel) ? shows_about(job, w, at, i)
                 : blurs                        ? trip_cpu_tf_shows_within(job->function, min, max,
                                                                           trip_cpu_tf_reach(job->function, rows[i]))
                                                : trip_cpu_tf_shows(job->function, min, max)))
                visible |= UINT64_C(1) << i;
        }
    memset(edges, 0, sizeof w->sheet->edges[at]);
    if (visible) {
        find_cells(job, w, at, visible, blurs ? rows : NULL);
        find_edges(edges, &w->sheet->cells[at]);
    }
    w->sheet->visible[at] = edges[TRIP_CPU_ALL];
    for (int k = 0; k < TRIP_CPU_EDGES && w->everywhere; k++)
        edges[k] = edges[TRIP_CPU_ALL];
}

/* Returns a raster's squares with the given edge, and the squares beside them along u that their
 * segments need. */
static uint64_t beside(const trip_cpu_edges *e, int edge)
{
    const uint64_t *here = e[0], *before = e[-1], *behind = e[1];
    return here[edge] | ((here[edge] & here[TRIP_CPU_LEFT]) >> 1 & ~TRIP_CPU_COLUMN_7) |
           ((here[edge] & here[TRIP_CPU_RIGHT]) << 1 & ~TRIP_CPU_COLUMN_0) |
           ((before[edge] & before[TRIP_CPU_RIGHT]) >> 7 & TRIP_CPU_COLUMN_0) |
           ((behind[edge] & behind[TRIP_CPU_LEFT]) << 7 & TRIP_CPU_COLUMN_7);
}

/* Finds the squares from which visible segments read voxels, in either sheet. Outermost rasters
 * have no visible squares, so their edges are empty. With uneven spacing a segment may cross any
 * number of squares, so all are needed. */
static void find_needed(const work_job *job, const trip_cpu_sheet_work *w, size_t at)
{
    const trip_cpu_edges *e = &w->sheet->edges[at];
    const int32_t across = job->store->across;
    w->sheet->needed[at] =
        beside(e, TRIP_CPU_ALL) | beside(e, TRIP_CPU_ABOVE) >> 8 | beside(e, TRIP_CPU_BELOW) << 8 |
        beside(e - across, TRIP_CPU_BELOW) >> 56 | beside(e + across, TRIP_CPU_ABOVE) << 56;
    if (trip_coordinates_uneven(job->store->coordinates))
        w->sheet->needed[at] = UINT64_MAX;
}

void trip_cpu_store_find_visible(trip_cpu_store *s, const trip_cpu_sheet_work *work, unsigned count,
                                 const trip_cpu_tf *f)
{
    run_work(&(work_job){ .store = s, .work = work, .function = f, .each = find_visible }, count);
    run_work(&(work_job){ .store = s, .work = work, .either = true, .each = find_needed }, count);
}

static void find_gradients(const work_job *job, const trip_cpu_sheet_work *w, size_t at)
{
    const trip_cpu_store *s = job->store;
    const size_t across = (size_t)s->across;
    const trip_cpu_uneven_raster r = {
        .raster = raster_at(s, w->sheet, at),
        .left = raster_at(s, w->sheet, at - 1),
        .above = raster_at(s, w->sheet, at - across),
        .sheet_before = raster_at(s, w->other, at),
        .sheet_behind = raster_at(s, w->third, at),
        .first = { (s->first_u + (int64_t)(at % across)) * TRIP_CPU_RASTER,
                   (s->first_v + (int64_t)(at / across)) * TRIP_CPU_RASTER, w->sheet->number },
        .axis = s->axis,
    };
    if (trip_coordinates_uneven(s->coordinates))
        trip_cpu_uneven_gradients(s->coordinates, &r, w->kernel == TRIP_KERNEL_NEAREST);
    else
        s->kernels->sheet_gradients(r.raster, UINT64_MAX, r.left, r.above, r.sheet_before,
                                    r.sheet_behind);
}

void trip_cpu_store_find_gradients(trip_cpu_store *s, const trip_cpu_sheet_work *work,
                                   unsigned count)
{
    run_work(&(work_job){ .store = s, .work = work, .each = find_gradients }, count);
    run_work(&(work_job){ .store = s, .work = work, .each = copy_gradients_beside }, count);
    for (unsigned i = 0; i < count; i++)
        work[i].sheet->shaded = true;
}

bool trip_cpu_store_take_sample(trip_cpu_store *s, const trip_cpu_sheet_work *w)
{
    for (int32_t v = 1; v < s->down - 1; v++)
        for (int32_t u = 1; u < s->across - 1; u++) {
            size_t at = (size_t)v * (size_t)s->across + (size_t)u;
            if (!w->other->rasters[at] || !w->third->rasters[at] || !w->other->needed[at])
                continue;
            if (!trip_cpu_store_take(s, w->sheet, at)) {
                trip_cpu_store_drop(s, w->sheet);
                return false;
            }
        }
    return true;
}

static void clear_raster(const work_job *job, const trip_cpu_sheet_work *w, size_t at)
{
    trip_cpu_store_clear(job->store, w->sheet->rasters[at]);
}

void trip_cpu_store_clear_samples(trip_cpu_store *s, const trip_cpu_sheet_work *work,
                                  unsigned count)
{
    run_work(&(work_job){ .store = s, .work = work, .each = clear_raster }, count);
}

static void cut_raster(const work_job *job, const trip_cpu_sheet_work *w, size_t at)
{
    const trip_cpu_store *s = job->store;
    s->kernels->sheet_between(raster_at(s, w->other, at), raster_at(s, w->third, at), UINT64_MAX,
                              w->sheet->making.weights,
                              TRIP_CPU_PART_CODES |
                                  (w->other->shaded ? TRIP_CPU_PART_GRADIENTS : 0),
                              raster_at(s, w->sheet, at));
    if (s->blurs)
        s->kernels->sheet_deviations_between(
            deviations_at(s, w->other, at), deviations_at(s, w->third, at), UINT64_MAX,
            w->sheet->making.weights, deviations_at(s, w->sheet, at));
}

void trip_cpu_store_cut(trip_cpu_store *s, const trip_cpu_sheet_work *work, unsigned count)
{
    run_work(&(work_job){ .store = s, .work = work, .each = cut_raster }, count);
}
