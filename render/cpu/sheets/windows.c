#include "cpu/sheets/cpu_sheets_state.h"

#include <string.h>

#include "report.h"

/* ---- memory ---- */

static int64_t lesser(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static int64_t greater(int64_t a, int64_t b)
{
    return a > b ? a : b;
}

static size_t sheet_bytes(const trip_cpu_need *need)
{
    return (size_t)(need->runs * sizeof(trip_cpu_kept_run) + need->words * 8);
}

/* Returns the rasters that a window of the given size keeps in memory, as a rectangle at 0. */
static trip_cpu_rasters held_rasters(const trip_cpu_rasters *all, const int64_t size[2],
                                     int64_t reach)
{
    trip_cpu_rasters b = { .first = { 0, 0 } };
    for (int a = 0; a < 2; a++)
        b.last[a] = lesser(size[a] + 2 * reach, all->last[a] - all->first[a] + 1) - 1;
    return b;
}

static uint64_t rasters_of(const trip_cpu_rasters *b, int sheets_and_samples)
{
    return (uint64_t)((b->last[0] - b->first[0] + 1) * (b->last[1] - b->first[1] + 1)) *
           (uint64_t)sheets_and_samples;
}

static uint64_t bytes_of(const trip_cpu_rasters *all, const int64_t size[2], int64_t reach,
                         int sheets, int samples_per_sheet, bool blurs)
{
    trip_cpu_rasters b = held_rasters(all, size, reach);
    return trip_cpu_store_bytes(&b, (unsigned)sheets, (unsigned)samples_per_sheet,
                                rasters_of(&b, sheets + samples_per_sheet), blurs);
}

static uint64_t kept_bytes(const trip_cpu_need *need, int sheets)
{
    return (uint64_t)sheets * sheet_bytes(need);
}

uint64_t trip_cpu_windows_min_bytes(const trip_cpu_rasters *all, int64_t reach,
                                    const trip_cpu_need *need, int sheets, int samples_per_sheet,
                                    bool blurs)
{
    const int64_t one[2] = { 1, 1 };
    return kept_bytes(need, sheets) + bytes_of(all, one, reach, sheets, samples_per_sheet, blurs);
}

static bool take_runs(trip_cpu_windows *w, const trip_cpu_need *need, trip_budget *budget)
{
    trip_cpu_windows_release(w, budget);
    w->bytes = kept_bytes(need, w->room);
    w->memory = trip_budget_take(budget, w->bytes);
    if (!w->memory)
        w->bytes = 0;
    for (int i = 0; i < w->room && w->memory; i++) {
        void *sheet = w->memory + (size_t)i * sheet_bytes(need);
        w->sheets[i] = (trip_cpu_kept_sheet){ .words = sheet };
        void *runs = w->sheets[i].words + need->words;
        w->sheets[i].runs = runs;
    }
    return w->memory != NULL;
}

void trip_cpu_windows_release(trip_cpu_windows *w, trip_budget *budget)
{
    trip_budget_release(budget, w->memory, w->bytes);
    w->memory = NULL;
    w->bytes = 0;
}

bool trip_cpu_windows_fit(trip_cpu_sheets *s, const trip_cpu_rasters *all, int64_t reach,
                          const trip_cpu_need *need, uint64_t room)
{
    trip_cpu_windows *w = &s->windows;
    const int samples_per_sheet = s->of->frame->settings->samples_per_sheet;
    const int sheets = trip_cpu_sheets_held(s->of->frame);
    const uint64_t kept = kept_bytes(need, sheets);
    if (trip_cpu_windows_min_bytes(all, reach, need, sheets, samples_per_sheet, s->store.blurs) >
        room)
        return false;
    w->room = sheets;
    w->about = trip_cpu_sheets_about(s->of->frame);
    w->all = *all;
    w->reach = reach;
    w->count = w->from = 0;
    for (int a = 0; a < 2; a++)
        w->size[a] = all->last[a] - all->first[a] + 1;
    while (bytes_of(all, w->size, reach, sheets, samples_per_sheet, s->store.blurs) > room - kept) {
        int longer = w->size[0] > w->size[1] ? 0 : 1;
        w->size[longer] = (w->size[longer] + 1) / 2;
    }
    trip_cpu_rasters hand = held_rasters(all, w->size, reach);
    uint64_t rasters = rasters_of(&hand, sheets + samples_per_sheet);
    w->used = take_runs(w, need, s->store.budget) &&
              trip_cpu_store_fit(&s->store, &hand, (unsigned)sheets, (unsigned)samples_per_sheet,
                                 rasters, rasters, room - kept);
    return w->used;
}

/* ---- a window ---- */

/* A job that decodes runs of a kept sheet into a sheet of the store. */
typedef struct decoding {
    const trip_cpu_sheets *s;
    const trip_cpu_kept_run *runs;
    const uint64_t *words; /* words of all runs of the sheet */
    const trip_cpu_sheet *to;
} decoding;

static int64_t raster_of(int64_t voxel)
{
    return voxel >> TRIP_CPU_RASTER_LOG2;
}

static void decode_run(void *context, unsigned task, unsigned thread)
{
    const decoding *d = context;
    const trip_cpu_kept_run *kept = &d->runs[task];
    const trip_block_form form =
        trip_block_form_of(&d->s->of->frame->data->header, (trip_kind)kept->kind);
    (void)thread;
    trip_block block = trip_block_make(&form, kept->count, kept->words, d->words + kept->at, NULL);
    if (kept->has_deviations)
        block.deviations = (const uint8_t *)(d->words + kept->at + kept->words);
    trip_cpu_store_decode(&d->s->store, d->to, &block, &(trip_run){ .u = kept->u, .v = kept->v });
}

/* Takes rasters for a run's voxels inside the rectangle `hand`. */
static void take_rasters(trip_cpu_sheets *s, trip_cpu_sheet *sheet, const trip_cpu_kept_run *run,
                         const trip_cpu_rasters *hand)
{
    const int64_t last = (1 << s->of->frame->data->header.tile_log2) - 1;
    for (int64_t v = raster_of(run->v); v <= raster_of(run->v + last); v++)
        for (int64_t u = raster_of(run->u); u <= raster_of(run->u + last); u++)
            if (trip_cpu_rasters_have(hand, u, v)) {
                size_t at = trip_cpu_store_at(&s->store, u, v);
                if (!sheet->rasters[at] && trip_cpu_store_take(&s->store, sheet, at))
                    trip_cpu_store_clear(&s->store, sheet->rasters[at]);
            }
}

/* Returns whether a run of a kept sheet may have voxels inside the rectangle `hand`. */
static bool is_held(const trip_cpu_sheets *s, const trip_cpu_kept_sheet *sheet,
                    const trip_cpu_rasters *hand)
{
    const int64_t last = (1 << s->of->frame->data->header.tile_log2) - 1;
    for (size_t n = 0; n < sheet->run_count; n++) {
        const trip_cpu_kept_run *run = &sheet->runs[n];
        if (raster_of(run->u) <= hand->last[0] && raster_of(run->u + last) >= hand->first[0] &&
            raster_of(run->v) <= hand->last[1] && raster_of(run->v + last) >= hand->first[1])
            return true;
    }
    return false;
}

/* Decodes the runs from `first` on that belong to one data set, because such runs share no voxel.
 * Returns the index behind the last of them. */
static size_t decode_part(const trip_cpu_sheets *s, const trip_cpu_kept_sheet *from, size_t first,
                          const trip_cpu_sheet *to)
{
    size_t end = first + 1;
    while (end < from->run_count && from->runs[end].part == from->runs[first].part)
        end++;
    decoding d = { s, from->runs + first, from->words, to };
    trip_cpu_job job = { .run = decode_run, .context = &d, .tasks = (unsigned)(end - first) };
    trip_cpu_pool_start(s->of->pool, &job);
    trip_cpu_pool_wait(s->of->pool, &job);
    return end;
}

static void load_sheet(trip_cpu_sheets *s, int i, const trip_cpu_rasters *hand)
{
    const trip_cpu_kept_sheet *from = &s->windows.sheets[i];
    trip_cpu_sheet *to = &s->store.sheets[i];
    to->number = from->number;
    for (size_t n = 0; n < from->run_count; n++)
        take_rasters(s, to, &from->runs[n], hand);
    for (size_t n = 0; n < from->run_count;)
        n = decode_part(s, from, n, to);
}

/* first_about() and last_about() return the first and last kept sheet that is at most `beyond`
 * sheets outside the interval. */
static int first_about(const trip_cpu_windows *w, int beyond)
{
    return (int)greater(0, w->from - beyond);
}

static int last_about(const trip_cpu_windows *w, int beyond)
{
    return (int)lesser(w->count - 1, w->from + 1 + beyond);
}

/* Finds the squares and cells that may be visible in the interval, and the gradients that the
 * interval needs. */
static void find_interval(trip_cpu_sheets *s)
{
    const trip_cpu_windows *w = &s->windows;
    const bool up = s->way > 0;
    const int taken = w->about - 1, last = last_about(w, taken), last_loaded = w->count - 1;
    trip_cpu_sheet *sheets = s->store.sheets, *a = &sheets[w->from];
    trip_cpu_sheet_work work[TRIP_CPU_AT_HAND_MAX] = { 0 };
    unsigned count = 0;
    for (int i = first_about(w, taken); i <= last; i++) {
        const trip_cpu_sheet *before = i > 0 ? &sheets[i - 1] : NULL;
        const trip_cpu_sheet *behind = i < last_loaded ? &sheets[i + 1] : NULL;
        work[count++] = (trip_cpu_sheet_work){
            .sheet = &sheets[i],
            .other = up ? before : behind,
            .third = up ? behind : before,
            .kernel = s->view.kernel,
        };
    }
    trip_cpu_store_prepare(&s->store, work, count);
    const trip_cpu_sheet_work cells = {
        .sheet = a,
        .other = a + 1,
        .before = taken > 0 && w->from > 0 ? a - 1 : NULL,
        .behind = taken > 0 && w->from + 1 < last_loaded ? a + 2 : NULL,
        .kernel = s->view.kernel,
        .everywhere = trip_cpu_sheets_leap(s),
    };
    trip_cpu_store_find_visible(&s->store, &cells, 1, s->function);
    trip_cpu_sheets_find_gradients(s, work, count);
}

/* Sets the window of the group. Rays that start outside all windows belong to the nearest outer
 * window. */
static void set_window(trip_cpu_sheets *s, const trip_cpu_rasters *inner)
{
    const trip_cpu_rasters *all = &s->windows.all;
    const int64_t origin[2] = { s->store.first_u, s->store.first_v };
    for (int a = 0; a < 2; a++) {
        int64_t lo = (inner->first[a] - origin[a]) * TRIP_CPU_RASTER;
        int64_t hi = (inner->last[a] + 1 - origin[a]) * TRIP_CPU_RASTER;
        s->group.lo[a] = inner->first[a] == all->first[a] ? INT32_MIN : (int32_t)lo;
        s->group.hi[a] = inner->last[a] == all->last[a] ? INT32_MAX : (int32_t)hi;
    }
}

static int draw_window(trip_cpu_sheets *s, const trip_cpu_rasters *inner)
{
    const trip_cpu_windows *w = &s->windows;
    trip_cpu_rasters hand;
    for (int a = 0; a < 2; a++) {
        hand.first[a] = greater(inner->first[a] - w->reach, w->all.first[a]);
        hand.last[a] = lesser(inner->last[a] + w->reach, w->all.last[a]);
    }
    if (!is_held(s, &w->sheets[w->from], &hand) || !is_held(s, &w->sheets[w->from + 1], &hand))
        return 0;
    trip_cpu_store_move(&s->store, &hand);
    for (int i = first_about(w, w->about); i <= last_about(w, w->about); i++) {
        load_sheet(s, i, &hand);
        s->held[i] = i;
    }
    find_interval(s);
    s->front = w->from;
    s->count = w->count;
    set_window(s, inner);
    trip_cpu_sheets_draw_some(s, w->from + 1);
    s->count = s->front = 0;
    return trip_frame_poll();
}

/* ---- sheets ---- */

/* Draws the interval that begins at `from`. The sheets behind it on which it depends are complete.
 */
static int draw_interval(trip_cpu_sheets *s)
{
    trip_cpu_windows *w = &s->windows;
    int status = 0;
    if (trip_cpu_sheets_are_ahead(s, w->sheets[w->from + 1].number))
        for (int64_t v = w->all.first[1]; v <= w->all.last[1] && !status; v += w->size[1])
            for (int64_t u = w->all.first[0]; u <= w->all.last[0] && !status; u += w->size[0])
                status = draw_window(
                    s,
                    &(trip_cpu_rasters){ .first = { u, v },
                                         .last = { lesser(u + w->size[0] - 1, w->all.last[0]),
                                                   lesser(v + w->size[1] - 1, w->all.last[1]) } });
    if (w->from == w->about) {
        trip_cpu_kept_sheet first = w->sheets[0];
        w->count--;
        memmove(w->sheets, w->sheets + 1, (size_t)w->count * sizeof first);
        w->sheets[w->count] = first;
    } else {
        w->from++;
    }
    return status;
}

int trip_cpu_windows_finish_row(trip_cpu_sheets *s)
{
    trip_cpu_windows *w = &s->windows;
    int status = 0;
    while (w->from + 1 < w->count && !status)
        status = draw_interval(s);
    w->count = w->from = 0;
    return status;
}

/* Begins a kept sheet for the next runs. All sheets before it are complete. */
static int begin_sheet(trip_cpu_sheets *s, int64_t number)
{
    trip_cpu_windows *w = &s->windows;
    int status = 0;
    if (w->count > 0 && w->sheets[w->count - 1].number + s->way != number)
        status = trip_cpu_windows_finish_row(s);
    else if (w->from + 1 + w->about < w->count)
        status = draw_interval(s);
    if (status)
        return status;
    trip_cpu_kept_sheet *sheet = &w->sheets[w->count++];
    sheet->number = number;
    sheet->run_count = sheet->word_count = 0;
    return 0;
}

int trip_cpu_windows_add_run(trip_cpu_sheets *s, const trip_run *run)
{
    trip_cpu_windows *w = &s->windows;
    int status = 0;
    if (w->count == 0 || w->sheets[w->count - 1].number != run->sheet)
        status = begin_sheet(s, run->sheet);
    if (status)
        return status;
    const trip_list *list = trip_batch_list(s->batch, run);
    trip_cpu_kept_sheet *sheet = &w->sheets[w->count - 1];
    const unsigned char *from = s->batch->planes[TRIP_PLANE_VOXELS] + run->at[TRIP_PLANE_VOXELS];
    const trip_block block = trip_block_of(s->batch, run);
    const bool deviations = s->store.blurs && block.deviations;
    sheet->runs[sheet->run_count++] = (trip_cpu_kept_run){ .u = run->u,
                                                           .v = run->v,
                                                           .kind = (uint16_t)list->kind,
                                                           .part = (uint16_t)list->part,
                                                           .count = run->count,
                                                           .words = run->words,
                                                           .has_deviations = deviations,
                                                           .at = sheet->word_count };
    memcpy(sheet->words + sheet->word_count, from, (size_t)run->words * 8);
    sheet->word_count += run->words;
    if (deviations) {
        memcpy(sheet->words + sheet->word_count, block.deviations, run->count);
        sheet->word_count += trip_cpu_deviation_words(run->count);
    }
    return 0;
}
