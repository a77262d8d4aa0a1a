/* Fuzzes index.trip. The input gets valid checksums and sizes, so that the fuzzer reaches the code
 * behind these checks. An accepted index must be safe to iterate, and its counts must be
 * consistent. */
#include "fuzz.h"

#include "dataset_check.h"
#include "selection.h"

#include <string.h>
#include <xxhash.h>

/* Makes an index of the input. Appends the checksums and sets their offset in the header.
 */
static unsigned char *seal(const uint8_t *data, size_t size, size_t *bytes)
{
    size_t content = size & ~(size_t)7;
    const trip_file_header *given = (const void *)data;
    unsigned log2 = given->page_log2 >= 12 && given->page_log2 <= 24 ? given->page_log2 : 12;
    size_t page = (size_t)1 << log2, pages = (content - TRIP_HEADER_BYTES + page - 1) / page;
    unsigned char *index = malloc(content + 8 * pages);
    memcpy(index, data, content);
    trip_file_header *h = (trip_file_header *)(void *)index;
    memcpy(h->magic, TRIP_MAGIC, sizeof h->magic);
    h->version = given->version == TRIP_FORMAT_OLDEST ? TRIP_FORMAT_OLDEST : TRIP_FORMAT_VERSION;
    h->header_bytes = TRIP_HEADER_BYTES;
    h->checksums_offset = content;
    *bytes = content;
    for (size_t at = TRIP_HEADER_BYTES; at < content; at += page, *bytes += 8) {
        uint64_t sum = XXH64(index + at, content - at < page ? content - at : page, 0);
        memcpy(index + *bytes, &sum, sizeof sum);
    }
    h->index_bytes = *bytes;
    h->checksums_checksum = XXH64(index + content, *bytes - content, 0);
    h->header_checksum = 0;
    h->header_checksum = XXH64(h, sizeof *h, 0);
    return index;
}

static void set_list(trip_dataset *d, unsigned i, const unsigned char *index)
{
    const trip_file_list *f = (const void *)(index + d->header.lists_offset);
    f += i;
    d->lists[i] =
        (trip_list){ .index = i,
                     .axis = (int)f->axis,
                     .planes = f->planes,
                     .dims = { (int64_t)f->dims[0], (int64_t)f->dims[1], (int64_t)f->dims[2] },
                     .sheet_first = f->sheet_first,
                     .sheet_step = f->sheet_step,
                     .records = f->records,
                     .plane_bytes = { f->plane_bytes[0], f->plane_bytes[1], f->plane_bytes[2] },
                     .slab_count = f->slab_count,
                     .brick_count = f->brick_count,
                     .slabs = (const void *)(index + f->slabs_offset),
                     .bricks = (const void *)(index + f->bricks_offset),
                     .runs = (const void *)(index + f->runs_offset) };
}

static void check_run(const trip_list *l, unsigned tile_log2, const trip_run *run)
{
    const trip_file_brick *b = &l->bricks[run->brick];
    FUZZ_PROMISE(run->count > 0 && run->first + run->count <= l->records);
    FUZZ_PROMISE(run->at[0] + 8 * (uint64_t)run->words <= l->plane_bytes[0]);
    FUZZ_PROMISE(run->count <= 1u << 2 * tile_log2);
    if (l->planes >> TRIP_PLANE_DEVIATIONS & 1)
        FUZZ_PROMISE(run->at[TRIP_PLANE_DEVIATIONS] + run->count <=
                     l->plane_bytes[TRIP_PLANE_DEVIATIONS]);
    FUZZ_PROMISE(run->sheet < l->dims[l->axis]);
    FUZZ_PROMISE((int64_t)run->u + b->u_max < l->dims[(l->axis + 1) % 3]);
    FUZZ_PROMISE((int64_t)run->v + b->v_max < l->dims[(l->axis + 2) % 3]);
}

static void walk_list(const trip_dataset *d, const trip_list *l, bool descending,
                      trip_budget *budget)
{
    trip_selection s;
    trip_run run;
    uint64_t next = descending ? l->records : 0, at = descending ? l->plane_bytes[0] : 0;
    FUZZ_PROMISE(trip_selection_create_whole(&s, d, l, descending, budget) == TRIP_OK);
    for (trip_run_iterator it = trip_run_begin(&s); trip_run_next(&it, &run);) {
        uint64_t bytes = 8 * (uint64_t)run.words;
        check_run(l, d->header.tile_log2, &run);
        FUZZ_PROMISE(descending ? run.first + run.count == next : run.first == next);
        FUZZ_PROMISE(descending ? run.at[0] + bytes == at : run.at[0] == at);
        next = descending ? run.first : run.first + run.count;
        at = descending ? run.at[0] : run.at[0] + bytes;
    }
    FUZZ_PROMISE(next == (descending ? 0 : l->records));
    FUZZ_PROMISE(at == (descending ? 0 : l->plane_bytes[0]));
    trip_selection_destroy(&s, budget);
}

static void walk(const trip_file_header *h, const unsigned char *index)
{
    trip_list *lists = calloc(h->list_count, sizeof *lists);
    trip_dataset d = { .header = *h, .lists = lists, .list_count = h->list_count };
    trip_budget *budget;
    char path[] = "fuzz";
    d.path = path;
    FUZZ_PROMISE(trip_budget_create(&budget, 1 << 26) == TRIP_OK);
    for (unsigned i = 0; i < h->list_count; i++) {
        set_list(&d, i, index);
        walk_list(&d, &lists[i], false, budget);
        walk_list(&d, &lists[i], true, budget);
    }
    trip_budget_destroy(budget);
    free(lists);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < TRIP_HEADER_BYTES)
        return 0;
    size_t bytes;
    unsigned char *index = seal(data, size, &bytes);
    trip_file_header header;
    memcpy(&header, index, sizeof header);
    if (trip_dataset_check_header(&header, bytes, "fuzz") == TRIP_OK) {
        FUZZ_PROMISE(trip_dataset_check_pages(index, &header, "fuzz") == TRIP_OK);
        if (trip_dataset_check_tables(index, &header, "fuzz") == TRIP_OK)
            walk(&header, index);
    }
    free(index);
    return 0;
}
