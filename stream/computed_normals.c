#include "computed_normals.h"

#include <assert.h>
#include <string.h>

#include "clock.h"
#include "dataset_normals.h"
#include "normal_sheets.h"
#include "report.h"
#include "sheet_room.h"

/* Limits of a batch that is handed out. */
enum { OUT_RECORDS = 1 << 16, OUT_BYTES = 1 << 19, OUT_RUNS = 1 << 12, OUT_ROOM = 64 };
/* Number of sheets of a level with runs that wait for the next sheet. */
enum { DRAWN = 2 };
/* Number of records that one task computes, at least a run. */
enum { TASK_RECORDS = 4096, TASKS_MAX = OUT_RECORDS / TASK_RECORDS * 2 + 2 };

/* The runs of a sheet that are drawn. */
typedef struct drawn {
    double order;  /* in the order of the pass */
    int64_t index; /* sheet */
    trip_run *runs;
    unsigned char *blocks;
    size_t run_count, next_run; /* the runs before next_run were handed out */
    size_t bytes;
} drawn;

struct trip_computed_normals {
    const trip_dataset *data;
    trip_budget *budget;
    trip_task_runner runner;
    bool (*skip)(void *user, const trip_selection *s, const trip_run *run);
    void *skip_user;
    trip_normal_sheets *sheets;
    trip_sheet_room rooms[TRIP_SHEET_LEVELS];
    drawn drawn[TRIP_SHEET_LEVELS][DRAWN];
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

/* Lays out the memory at `base` and returns its size in bytes. */
static size_t lay_out(trip_computed_normals *n, unsigned char *base)
{
    size_t used = 0;
    n->selection_of =
        trip_sheet_room_carve(base, &used, n->data->list_count, sizeof *n->selection_of);
    n->blocks = trip_sheet_room_carve(base, &used, OUT_BYTES + OUT_ROOM, 1);
    n->normals = trip_sheet_room_carve(base, &used, OUT_RECORDS + OUT_ROOM, sizeof(uint32_t));
    n->runs = trip_sheet_room_carve(base, &used, OUT_RUNS, sizeof *n->runs);
    for (unsigned i = 0; i < TRIP_SHEET_LEVELS; i++)
        for (int s = 0; s < DRAWN && n->rooms[i].used; s++) {
            drawn *d = &n->drawn[i][s];
            d->runs = trip_sheet_room_carve(base, &used, n->rooms[i].runs, sizeof *d->runs);
            d->blocks = trip_sheet_room_carve(base, &used, n->rooms[i].block_bytes, 1);
        }
    return used;
}

uint64_t trip_computed_normals_bytes(const trip_dataset *d)
{
    trip_computed_normals n = { .data = d };
    const bool found = trip_sheet_rooms_find(d, n.rooms, d->budget) == TRIP_OK;
    return found ? sizeof n + lay_out(&n, NULL) + trip_normal_sheets_bytes(d) : 0;
}

static int take_memory(trip_computed_normals *n)
{
    n->bytes = lay_out(n, NULL);
    n->memory = trip_budget_take(n->budget, n->bytes);
    if (!n->memory)
        return trip_fail(TRIP_ERROR, "read", n->data->path,
                         "%zu bytes to compute normals do not fit the memory given; raise "
                         "--memory, brick with --normals stored, or use --no-shading",
                         n->bytes);
    lay_out(n, n->memory);
    return TRIP_OK;
}

int trip_computed_normals_create(trip_computed_normals **out, const trip_dataset *d,
                                 const trip_computed_normals_params *params, trip_budget *budget)
{
    trip_computed_normals *n = *out = trip_budget_take(budget, sizeof *n);
    if (!n)
        return trip_fail(TRIP_ERROR, "read", d->path, "no memory for normals; raise --memory");
    n->data = d;
    n->budget = budget;
    n->runner = params->runner;
    n->skip = params->skip;
    n->skip_user = params->skip_user;
    int status = trip_normal_sheets_create(&n->sheets, d, budget);
    if (status == TRIP_OK)
        status = trip_sheet_rooms_find(d, n->rooms, budget);
    if (status == TRIP_OK)
        status = take_memory(n);
    if (status < 0) {
        trip_computed_normals_destroy(n);
        *out = NULL;
    }
    return status;
}

void trip_computed_normals_destroy(trip_computed_normals *n)
{
    if (!n)
        return;
    trip_normal_sheets_destroy(n->sheets);
    trip_budget_release(n->budget, n->memory, n->memory ? n->bytes : 0);
    trip_budget_release(n->budget, n, sizeof *n);
}

/* ---- runs ---- */

static void clear_sheets(trip_computed_normals *n)
{
    trip_normal_sheets_clear(n->sheets);
    for (unsigned i = 0; i < TRIP_SHEET_LEVELS; i++)
        for (int s = 0; s < DRAWN; s++)
            n->drawn[i][s].run_count = n->drawn[i][s].next_run = 0;
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
    clear_sheets(n);
    clear_batch(n);
    n->pass = n->added_pass = NULL;
    n->added = NULL;
    n->ended = false;
    n->skipped = n->ns = 0;
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
static void put_drawn(trip_computed_normals *n, const trip_list *list, const trip_run *run,
                      int selection, const void *block)
{
    drawn *d = &n->drawn[list->level][run->sheet % DRAWN];
    if (d->next_run == d->run_count) {
        d->run_count = d->next_run = d->bytes = 0;
        d->index = run->sheet;
        d->order = order_of(n, list, run->sheet);
    }
    assert(d->index == run->sheet && d->run_count < n->rooms[list->level].runs);
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
    const int selection = drawn_selection(n, run);
    const trip_block_form form = trip_block_form_of(&n->data->header, list->kind);
    const void *from = n->added->planes[TRIP_PLANE_VOXELS] + run->at[TRIP_PLANE_VOXELS];
    const trip_block block = trip_block_make(&form, run->count, run->words, from, NULL);
    if (trip_dataset_has_gradients_of(n->data, list))
        trip_normal_sheets_put(n->sheets, list, run, &block);
    if (selection >= 0)
        put_drawn(n, list, run, selection, from);
}

/* ---- normals ---- */

static void compute_run(const trip_computed_normals *n, const trip_run *run)
{
    const trip_list *list = n->pass->selections[run->selection].list;
    const trip_block_form form = trip_block_form_of(&n->data->header, list->kind);
    const trip_block block = trip_block_make(&form, run->count, run->words,
                                             n->blocks + run->at[TRIP_PLANE_VOXELS], NULL);
    trip_normal_sheets_compute(n->sheets, list, run, &block,
                               n->normals + run->at[TRIP_PLANE_NORMALS]);
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
    for (unsigned i = 0; i < TRIP_SHEET_LEVELS; i++)
        for (int s = 0; s < DRAWN && n->rooms[i].used; s++) {
            drawn *d = &n->drawn[i][s];
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
    clear_sheets(n);
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
