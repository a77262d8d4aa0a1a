#include "selection.h"

#include "report.h"

static size_t bitmap_bytes(const trip_selection *s)
{
    return (s->list->brick_count / 64 + 1) * sizeof(uint64_t);
}

int trip_selection_create(trip_selection *s, const trip_dataset *d, const trip_list *list,
                          bool descending, int64_t sheet_first, int64_t sheet_last,
                          trip_budget *budget)
{
    *s = (trip_selection){ .data = d,
                           .list = list,
                           .descending = descending,
                           .sheet_first = sheet_first,
                           .sheet_last = sheet_last };
    s->bricks = trip_budget_take(budget, bitmap_bytes(s));
    if (!s->bricks)
        return trip_fail(TRIP_ERROR, "plan", d->path,
                         "no memory for a selection of %llu bricks; raise --memory",
                         (unsigned long long)list->brick_count);
    return TRIP_OK;
}

int trip_selection_create_whole(trip_selection *s, const trip_dataset *d, const trip_list *list,
                                bool descending, trip_budget *budget)
{
    int status = trip_selection_create(s, d, list, descending, 0, INT32_MAX, budget);
    for (uint64_t b = 0; b < list->brick_count && status == TRIP_OK; b++)
        trip_selection_add(s, b);
    return status;
}

void trip_selection_destroy(trip_selection *s, trip_budget *budget)
{
    if (s->bricks)
        trip_budget_release(budget, s->bricks, bitmap_bytes(s));
    *s = (trip_selection){ 0 };
}

static const trip_list *list_of(const trip_run_iterator *it)
{
    return it->selection->list;
}

static const trip_file_slab *slab_of(const trip_run_iterator *it)
{
    return &list_of(it)->slabs[it->slab];
}

static int64_t slab_sheets(const trip_run_iterator *it)
{
    return it->selection->data->header.slab_sheets;
}

/* Whether any brick of [first, end) is selected. */
static bool any_selected(const trip_selection *s, uint64_t first, uint64_t end)
{
    while (first < end) {
        uint64_t word = s->bricks[first / 64] >> first % 64;
        uint64_t here = 64 - first % 64;
        if (end - first < here)
            word &= (UINT64_C(1) << (end - first)) - 1;
        if (word)
            return true;
        first += here;
    }
    return false;
}

static bool slab_wanted(const trip_run_iterator *it)
{
    const trip_selection *s = it->selection;
    const trip_file_slab *slab = slab_of(it);
    int64_t first = (int64_t)slab->slab * slab_sheets(it);
    return first <= s->sheet_last && first + slab_sheets(it) > s->sheet_first &&
           any_selected(s, slab->first_brick, slab->first_brick + slab->brick_count);
}

/* Advances to the next slab with selected bricks, `it->slab` included, and to its first run in draw
 * order. Returns false if there is none. */
static bool enter_slab(trip_run_iterator *it)
{
    const trip_list *l = list_of(it);
    bool down = it->selection->descending;
    while (it->slab >= 0 && it->slab < (int64_t)l->slab_count && !slab_wanted(it))
        it->slab += down ? -1 : 1;
    if (it->slab < 0 || it->slab >= (int64_t)l->slab_count)
        return false;
    const trip_file_slab *slab = slab_of(it);
    bool last = it->slab + 1 == (int64_t)l->slab_count;
    it->sheet = down ? slab_sheets(it) - 1 : 0;
    it->brick = down ? (int64_t)slab->brick_count - 1 : 0;
    it->record = !down ? slab->first_record : last ? l->records : slab[1].first_record;
    it->block = !down  ? slab->first_block
                : last ? l->plane_bytes[TRIP_PLANE_VOXELS]
                       : slab[1].first_block;
    return true;
}

trip_run_iterator trip_run_begin(const trip_selection *s)
{
    const trip_list *l = s->list;
    trip_run_iterator it = { .selection = s };
    it.slab = s->descending ? (int64_t)l->slab_count - 1 : 0;
    enter_slab(&it);
    return it;
}

/* Advances to the next sheet or slab after all runs of the current one. Returns false at the end.
 */
static bool find_run(trip_run_iterator *it)
{
    const trip_list *l = list_of(it);
    if (it->slab < 0 || it->slab >= (int64_t)l->slab_count)
        return false;
    if (it->brick >= 0 && it->brick < (int64_t)slab_of(it)->brick_count)
        return true;
    bool down = it->selection->descending;
    it->sheet += down ? -1 : 1;
    it->brick = down ? (int64_t)slab_of(it)->brick_count - 1 : 0;
    if (it->sheet >= 0 && it->sheet < slab_sheets(it))
        return true;
    it->slab += down ? -1 : 1;
    return enter_slab(it);
}

/* Returns the current run, which may be empty, and advances to the next. */
static trip_run take_run(trip_run_iterator *it)
{
    const trip_selection *s = it->selection;
    unsigned log2 = s->data->header.tile_log2;
    uint64_t brick = slab_of(it)->first_brick + (uint64_t)it->brick;
    const trip_file_brick *b = &s->list->bricks[brick];
    const trip_file_run *r =
        &s->list->runs[brick * (uint64_t)slab_sheets(it) + (uint64_t)it->sheet];
    uint64_t bytes = 8 * (uint64_t)r->words;
    uint64_t first = s->descending ? it->record - r->records : it->record;
    uint64_t block = s->descending ? it->block - bytes : it->block;
    it->record = s->descending ? first : first + r->records;
    it->block = s->descending ? block : block + bytes;
    trip_run run = { .first = first,
                     .at = { block, first * s->data->header.normal_bytes, first },
                     .count = r->records,
                     .words = r->words,
                     .brick = (uint32_t)brick,
                     .sheet = (int32_t)((int64_t)slab_of(it)->slab * slab_sheets(it) + it->sheet),
                     .u = (int32_t)(b->tile_u << log2),
                     .v = (int32_t)(b->tile_v << log2) };
    it->brick += s->descending ? -1 : 1;
    return run;
}

bool trip_run_next(trip_run_iterator *it, trip_run *run)
{
    const trip_selection *s = it->selection;
    while (find_run(it)) {
        *run = take_run(it);
        if (run->count > 0 && run->sheet >= s->sheet_first && run->sheet <= s->sheet_last &&
            trip_selection_has(s, run->brick))
            return true;
    }
    return false;
}

static void advance(trip_pass_cursor *c)
{
    c->has_run = trip_run_next(&c->it, &c->run);
    const trip_selection *s = c->it.selection;
    const int64_t ahead = s->descending ? -s->ahead : s->ahead;
    if (c->has_run)
        c->coordinate = trip_list_sheet_coordinate(s->list, c->run.sheet - ahead);
}

trip_pass_iterator trip_pass_begin(const trip_pass *pass, trip_pass_cursor *cursors)
{
    for (unsigned i = 0; i < pass->selection_count; i++) {
        cursors[i] = (trip_pass_cursor){ .it = trip_run_begin(&pass->selections[i]) };
        advance(&cursors[i]);
    }
    return (trip_pass_iterator){ .pass = pass, .cursors = cursors };
}

/* Returns the selection with the next sheet, or NULL at the end. */
static trip_pass_cursor *find_next(const trip_pass_iterator *it)
{
    trip_pass_cursor *best = NULL;
    for (unsigned i = 0; i < it->pass->selection_count; i++) {
        trip_pass_cursor *c = &it->cursors[i];
        if (c->has_run && (!best || (it->pass->descending ? c->coordinate >= best->coordinate
                                                          : c->coordinate < best->coordinate)))
            best = c;
    }
    return best;
}

bool trip_pass_next(trip_pass_iterator *it, trip_run *run)
{
    if (!it->at)
        it->at = find_next(it);
    trip_pass_cursor *c = it->at;
    if (!c)
        return false;
    int32_t sheet = c->run.sheet;
    *run = c->run;
    run->selection = (uint16_t)(c - it->cursors);
    advance(c);
    if (!c->has_run || c->run.sheet != sheet)
        it->at = NULL;
    return true;
}
