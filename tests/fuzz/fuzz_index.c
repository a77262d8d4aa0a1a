/* index.trip: the input is given right checksums and sizes, so that what is behind those checks is
 * reached. What is accepted must be safe to walk, and add up. */
#include "fuzz.h"

#include "dataset_check.h"
#include "selection.h"

#include <string.h>
#include <xxhash.h>

/* The input as an index: checksums are appended and the header's places for them set. */
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
    h->version = TRIP_FORMAT_VERSION;
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

static void set_list(trip_dataset *d, int axis, const unsigned char *index)
{
    const trip_file_list *f = (const void *)(index + d->header.lists_offset);
    f += axis;
    d->lists[axis] = (trip_list){ .axis = axis,
                                  .records = f->splats,
                                  .slab_count = f->slab_count,
                                  .brick_count = f->brick_count,
                                  .slabs = (const void *)(index + f->slabs_offset),
                                  .bricks = (const void *)(index + f->bricks_offset),
                                  .counts = (const void *)(index + f->counts_offset) };
}

static void check_run(const trip_dataset *d, int axis, const trip_run *run)
{
    const trip_file_brick *b = &d->lists[axis].bricks[run->brick];
    const uint64_t *dims = d->header.dims;
    FUZZ_PROMISE(run->count > 0 && run->first + run->count <= d->header.kept);
    FUZZ_PROMISE((uint64_t)run->sheet < dims[axis]);
    FUZZ_PROMISE((uint64_t)run->u + b->u_max < dims[(axis + 1) % 3]);
    FUZZ_PROMISE((uint64_t)run->v + b->v_max < dims[(axis + 2) % 3]);
}

static void walk_list(const trip_dataset *d, int axis, bool descending, trip_budget *budget)
{
    trip_selection s;
    trip_run run;
    uint64_t next = descending ? d->header.kept : 0;
    FUZZ_PROMISE(trip_selection_create(&s, d, &d->lists[axis], descending, 0, INT32_MAX, budget) ==
                 TRIP_OK);
    for (uint64_t b = 0; b < d->lists[axis].brick_count; b++)
        trip_selection_add(&s, b);
    for (trip_run_iterator it = trip_run_begin(&s); trip_run_next(&it, &run);) {
        check_run(d, axis, &run);
        FUZZ_PROMISE(descending ? run.first + run.count == next : run.first == next);
        next = descending ? run.first : run.first + run.count;
    }
    FUZZ_PROMISE(next == (descending ? 0 : d->header.kept));
    trip_selection_destroy(&s, budget);
}

static void walk(const trip_file_header *h, const unsigned char *index)
{
    trip_list lists[3];
    trip_dataset d = { .header = *h, .lists = lists, .list_count = 3 };
    trip_budget *budget;
    char path[] = "fuzz";
    d.path = path;
    FUZZ_PROMISE(trip_budget_create(&budget, 1 << 26) == TRIP_OK);
    for (int axis = 0; axis < 3; axis++) {
        set_list(&d, axis, index);
        walk_list(&d, axis, false, budget);
        walk_list(&d, axis, true, budget);
    }
    trip_budget_destroy(budget);
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
