#include "writer.h"

#include <stdlib.h>

#include "report.h"
#include "writer_state.h"

struct trip_list_buffer {
    const trip_list_writer
        *list; /* list of the blocks in the buffer, which are bytes [first, past) of the plane */
    uint64_t first, past;
    uint64_t blocks[TRIP_BLOCK_WORDS_MAX];
    unsigned char packed[TRIP_RUN_RECORDS_MAX * sizeof(uint32_t)];
};

/* Stands at a run of a slab. The tables of the current slab are in memory, as during writing. Their
 * length is bounded by the tiles of a sheet. */
struct trip_list_cursor {
    trip_budget *budget;
    const trip_writer *writer;
    trip_list_writer *list;
    bool odd, normals;
    uint64_t next_slab;
    trip_file_slab slab;
    trip_file_brick *bricks; /* of the slab */
    trip_file_run *runs;     /* [brick][sheet] */
    size_t tables_bytes;     /* of bricks and runs together, from the budget */
    uint64_t sheet, brick;   /* next run, within the slab */
    uint64_t at[TRIP_PLANES];
};

static int fail_memory(const trip_writer *w)
{
    return trip_fail(TRIP_ERROR, "brick", w->folder.path,
                     "no memory to read a list back; raise --memory");
}

int trip_list_buffer_create(trip_list_buffer **out, const trip_writer *w, trip_budget *budget)
{
    *out = trip_budget_take(budget, sizeof **out);
    return *out ? TRIP_OK : fail_memory(w);
}

void trip_list_buffer_destroy(trip_list_buffer *b, trip_budget *budget)
{
    if (b)
        trip_budget_release(budget, b, sizeof *b);
}

uint64_t trip_list_buffer_bytes(void)
{
    return sizeof(trip_list_buffer);
}

static int flush_list(trip_writer *w, trip_list_writer *l)
{
    trip_output *const outputs[] = { &l->slabs, &l->bricks, &l->runs, &l->planes[TRIP_PLANE_VOXELS],
                                     &l->planes[TRIP_PLANE_NORMALS] };
    int status = trip_writer_end_slab(w, l);
    for (size_t i = 0; i < sizeof outputs / sizeof *outputs && status == TRIP_OK; i++)
        if (outputs[i]->buffer)
            status = trip_output_flush(outputs[i]);
    return status;
}

int trip_list_cursor_open(trip_list_cursor **out, trip_writer *w, unsigned list, bool odd,
                          bool normals, trip_budget *budget)
{
    trip_list_cursor *c = *out = trip_budget_take(budget, sizeof *c);
    if (!c)
        return fail_memory(w);
    c->budget = budget;
    c->writer = w;
    c->list = &w->lists[list];
    c->odd = odd;
    c->normals = normals && c->list->planes_present >> TRIP_PLANE_NORMALS & 1;
    return flush_list(w, c->list);
}

void trip_list_cursor_close(trip_list_cursor *c)
{
    if (!c)
        return;
    trip_budget_release(c->budget, c->bricks, c->tables_bytes);
    trip_budget_release(c->budget, c, sizeof *c);
}

/* Allocates the tables of the current slab. */
static int fit_tables(trip_list_cursor *c)
{
    size_t runs = (size_t)c->slab.brick_count * c->writer->params.slab_sheets;
    size_t bricks = c->slab.brick_count * sizeof *c->bricks;
    size_t bytes = bricks + runs * sizeof *c->runs;
    if (bytes > c->tables_bytes) {
        trip_budget_release(c->budget, c->bricks, c->tables_bytes);
        c->tables_bytes = 0;
        c->bricks = trip_budget_take(c->budget, bytes);
        if (!c->bricks)
            return fail_memory(c->writer);
        c->tables_bytes = bytes;
    }
    c->runs = (void *)(c->bricks + c->slab.brick_count);
    return TRIP_OK;
}

static int enter_slab(trip_list_cursor *c)
{
    trip_list_writer *l = c->list;
    int status =
        trip_output_read(&l->slabs, c->next_slab * sizeof c->slab, &c->slab, sizeof c->slab);
    if (status == TRIP_OK)
        status = fit_tables(c);
    const uint64_t first = c->slab.first_brick, count = c->slab.brick_count;
    const uint64_t sheets = c->writer->params.slab_sheets;
    if (status == TRIP_OK)
        status = trip_output_read(&l->bricks, first * sizeof *c->bricks, c->bricks,
                                  count * sizeof *c->bricks);
    if (status == TRIP_OK)
        status = trip_output_read(&l->runs, first * sheets * sizeof *c->runs, c->runs,
                                  count * sheets * sizeof *c->runs);
    c->next_slab++;
    c->sheet = c->brick = 0;
    c->at[TRIP_PLANE_VOXELS] = c->slab.first_block;
    c->at[TRIP_PLANE_NORMALS] = c->slab.first_record * l->form.normal_bytes;
    return status;
}

/* Fetches the block of a run, and as much of `words` as fits. */
static int fetch_block(const trip_list_writer *l, const trip_list_position *position,
                       uint64_t words, trip_list_buffer *to, const uint64_t **block)
{
    const uint64_t at = position->at[TRIP_PLANE_VOXELS], own = 8 * (uint64_t)position->run.words;
    int status = TRIP_OK;
    if (to->list != l || at < to->first || at + own > to->past) {
        const uint64_t wanted = 8 * words < sizeof to->blocks ? 8 * words : sizeof to->blocks;
        const uint64_t bytes = wanted > own ? wanted : own;
        status = trip_output_read(&l->planes[TRIP_PLANE_VOXELS], at, to->blocks, bytes);
        to->list = status == TRIP_OK ? l : NULL;
        to->first = at;
        to->past = at + bytes;
    }
    *block = to->blocks + (at - to->first) / 8;
    return status;
}

static int fail_changed(const trip_list_writer *l)
{
    return trip_fail(TRIP_ERROR, "brick", l->planes[TRIP_PLANE_VOXELS].path,
                     "differs from the bytes written; the disk or another program changed it");
}

int trip_list_cursor_read(const trip_list_cursor *c, const trip_list_position *position,
                          uint64_t words, trip_list_buffer *to, trip_block *out)
{
    const trip_list_writer *l = c->list;
    const trip_file_run *r = &position->run;
    const trip_kind_info *kind = trip_kind_of(l->is.kind);
    const bool normals = c->normals;
    const uint64_t *block;
    if (!kind->words_fit(&l->form, r->records,
                         r->words)) /* it would not fit into the buffer either */
        return fail_changed(l);
    int status = fetch_block(l, position, words, to, &block);
    if (status == TRIP_OK && normals)
        status = trip_output_read(&l->planes[TRIP_PLANE_NORMALS], position->at[TRIP_PLANE_NORMALS],
                                  to->packed, (size_t)r->records * l->form.normal_bytes);
    if (status < 0)
        return status;
    *out = trip_block_make(&l->form, r->records, r->words, block, normals ? to->packed : NULL);
    return kind->check(out, &position->brick) ? fail_changed(l) : TRIP_OK;
}

/* Advances to the next run of the slab. Returns true if *position is a wanted run. */
static bool take_run(trip_list_cursor *c, trip_list_position *position)
{
    const uint64_t sheets = c->writer->params.slab_sheets;
    const trip_file_run *r = &c->runs[c->brick * sheets + c->sheet];
    const uint64_t sheet = c->slab.slab * sheets + c->sheet;
    const bool wanted = r->records > 0 && sheet % 2 == c->odd;
    if (wanted)
        *position =
            (trip_list_position){ .sheet = (uint32_t)sheet,
                                  .brick = c->bricks[c->brick],
                                  .run = *r,
                                  .at = { c->at[TRIP_PLANE_VOXELS], c->at[TRIP_PLANE_NORMALS] } };
    c->at[TRIP_PLANE_VOXELS] += 8 * (uint64_t)r->words;
    c->at[TRIP_PLANE_NORMALS] += (uint64_t)r->records * c->list->form.normal_bytes;
    if (++c->brick == c->slab.brick_count) {
        c->brick = 0;
        c->sheet++;
    }
    return wanted;
}

int trip_list_cursor_next(trip_list_cursor *c, trip_list_position *position)
{
    int status = 0;
    while (status == 0) {
        bool in_slab = c->next_slab > 0 && c->sheet < c->writer->params.slab_sheets;
        if (!in_slab && c->next_slab == c->list->slab_count)
            return 0;
        status = in_slab ? take_run(c, position) : enter_slab(c);
    }
    return status;
}
