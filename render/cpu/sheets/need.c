#include "cpu/sheets/cpu_sheets_state.h"

#include "cpu/kernels/kernel_sheets.h"
#include "report.h"

typedef struct sheet {
    uint64_t rasters, runs, words;
} sheet;

/* The latest sheets, in order. */
typedef struct row {
    sheet sheets[TRIP_CPU_AT_HAND_MAX];
    int count;
} row;

static uint64_t greater(uint64_t a, uint64_t b)
{
    return a > b ? a : b;
}

/* Appends a sheet to the row, drops the oldest one, and updates the maxima. */
static void add_sheet(trip_cpu_need *need, row *held_sheets, sheet next)
{
    uint64_t rasters = 0;
    for (int i = 0; i < held_sheets->count; i++) {
        held_sheets->sheets[i] = i + 1 < held_sheets->count ? held_sheets->sheets[i + 1] : next;
        rasters += held_sheets->sheets[i].rasters;
    }
    need->rasters = greater(need->rasters, rasters);
    need->of_sheet = greater(need->of_sheet, next.rasters);
    need->runs = greater(need->runs, next.runs);
    need->words = greater(need->words, next.words);
}

static uint64_t rasters_of_tile(const trip_pass *pass)
{
    unsigned log2 = pass->selections->data->header.tile_log2;
    return log2 > TRIP_CPU_RASTER_LOG2 ? UINT64_C(1) << 2 * (log2 - TRIP_CPU_RASTER_LOG2) : 1;
}

static void add_pass(trip_cpu_need *need, const trip_pass *pass, trip_pass_cursor *cursors,
                     uint64_t rasters, int count, bool blurs)
{
    row held_sheets = { .count = count };
    sheet now = { 0 };
    const uint64_t of_tile = rasters_of_tile(pass);
    trip_pass_iterator it = trip_pass_begin(pass, cursors);
    int32_t number = 0;
    for (trip_run run; trip_pass_next(&it, &run);) {
        if (now.runs > 0 && run.sheet != number) {
            add_sheet(need, &held_sheets, now);
            now = (sheet){ 0 };
        }
        number = run.sheet;
        now.runs++;
        now.words += run.words + (blurs ? trip_cpu_deviation_words(run.count) : 0);
        now.rasters += now.rasters + of_tile <= rasters ? of_tile : rasters - now.rasters;
    }
    for (int i = 0; i < count; i++, now = (sheet){ 0 })
        add_sheet(need, &held_sheets, now);
}

int trip_cpu_need_find(trip_cpu_need *need, const trip_plan_layer *layer, uint64_t rasters,
                       int held_sheets, bool blurs, trip_budget *budget)
{
    *need = (trip_cpu_need){ 0 };
    for (int i = 0; i < layer->pass_count; i++) {
        const trip_pass *pass = &layer->passes[i].pass;
        size_t bytes = pass->selection_count * sizeof(trip_pass_cursor);
        trip_pass_cursor *cursors = trip_budget_take(budget, bytes);
        if (!cursors)
            return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                             "%u lists do not fit the memory given; raise --memory",
                             pass->selection_count);
        add_pass(need, pass, cursors, rasters, held_sheets, blurs);
        trip_budget_release(budget, cursors, bytes);
    }
    return 0;
}
