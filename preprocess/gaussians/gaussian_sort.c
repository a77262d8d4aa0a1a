#include "gaussian_sort.h"

#include "folder.h"
#include "key_sort.h"
#include "report.h"

#include <stdlib.h>
#include <string.h>

enum {
    OUTPUT_BYTES = 1 << 16,
    READ_BYTES_MIN = 1 << 14, /* of the buffer of a run that is merged */
    RECORDS_MIN = 1024,       /* of a run */
    CHECK_EVERY = 1 << 14,    /* splats between two checks for an interruption */
};

typedef struct run {
    uint64_t at, end; /* bytes of the file that are not yet in the buffer */
    unsigned char *buffer;
    size_t next, filled;
} run;

typedef struct sorter {
    const trip_gaussian_sort_params *p;
    trip_budget *budget;
    size_t stride;
    unsigned char *area; /* all memory but the outputs' buffers */
    size_t area_bytes;
    trip_output file; /* of the runs */
    uint64_t *ends;   /* of the runs in the file */
    uint64_t run_count;
} sorter;

size_t trip_spilled_bytes(int degree)
{
    const size_t bytes = sizeof(trip_spilled) + offsetof(trip_gaussian, sh) +
                         (size_t)trip_sh_count(degree) * 3 * sizeof(float);
    return (bytes + 7) & ~(size_t)7;
}

static int fail_memory(const sorter *s)
{
    return trip_fail(TRIP_ERROR, "brick", s->p->path,
                     "sorting needs more memory than --memory allows: raise --memory");
}

static int check_interrupted(const sorter *s)
{
    return trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "brick", s->p->path, "interrupted")
                              : TRIP_OK;
}

static const trip_spilled *head(const unsigned char *spilled)
{
    return (const void *)spilled;
}

static const trip_gaussian *splat(const unsigned char *spilled)
{
    return (const void *)(spilled + sizeof(trip_spilled));
}

/* Reads splats into the area and sorts them by keys behind them. */
static int sort_run(sorter *s, uint64_t first, size_t count, size_t capacity, trip_key **sorted)
{
    trip_key *keys = (void *)(s->area + capacity * s->stride), *scratch = keys + capacity;
    const int status = trip_output_read(s->p->spool, first * s->stride, s->area, count * s->stride);
    if (status < 0)
        return status;
    for (size_t i = 0; i < count; i++) {
        unsigned char *spilled = s->area + i * s->stride;
        s->p->place(s->p->user, splat(spilled), (void *)spilled);
        keys[i] = (trip_key){ trip_key_of(head(spilled)->at), i };
    }
    trip_key_sort(keys, scratch, count);
    for (size_t i = 0; i < count; i++)
        keys[i].key = head(s->area + keys[i].number * s->stride)->group;
    trip_key_sort(keys, scratch, count);
    *sorted = keys;
    return check_interrupted(s);
}

static int emit_run(const sorter *s, const trip_key *keys, size_t count)
{
    int status = TRIP_OK;
    for (size_t i = 0; i < count && status == TRIP_OK; i++) {
        status = s->p->emit(s->p->user, s->area + keys[i].number * s->stride);
        if (status == TRIP_OK && i % CHECK_EVERY == 0)
            status = check_interrupted(s);
    }
    return status;
}

static int spill_run(sorter *s, const trip_key *keys, size_t count)
{
    int status = TRIP_OK;
    for (size_t i = 0; i < count && status == TRIP_OK; i++)
        status = trip_output_append(&s->file, s->area + keys[i].number * s->stride, s->stride);
    s->ends[s->run_count++] = s->file.bytes;
    return status;
}

static int create_file(const sorter *s, trip_output *o)
{
    return trip_output_create(o,
                              &(trip_output_params){ .folder = s->p->folder,
                                                     .name = TRIP_SPOOL_NAME,
                                                     .buffer_bytes = OUTPUT_BYTES,
                                                     .unnamed = true },
                              s->budget);
}

static int make_runs(sorter *s, size_t capacity)
{
    int status = create_file(s, &s->file);
    for (uint64_t first = 0; first < s->p->records && status == TRIP_OK; first += capacity) {
        const uint64_t left = s->p->records - first;
        const size_t count = left < capacity ? (size_t)left : capacity;
        trip_key *keys;
        status = sort_run(s, first, count, capacity, &keys);
        if (status == TRIP_OK)
            status = spill_run(s, keys, count);
    }
    return status == TRIP_OK ? trip_output_flush(&s->file) : status;
}

/* Whether the next splat of run a comes before the next of run b. */
static bool is_before(const run *a, const run *b)
{
    const trip_spilled *x = head(a->buffer + a->next), *y = head(b->buffer + b->next);
    if (x->group != y->group)
        return x->group < y->group;
    return x->at != y->at ? x->at < y->at : x->number < y->number;
}

static int fill(const sorter *s, run *r, size_t room)
{
    const uint64_t left = r->end - r->at;
    r->filled = left < room ? (size_t)left : room;
    r->next = 0;
    const int status =
        r->filled ? trip_output_read(&s->file, r->at, r->buffer, r->filled) : TRIP_OK;
    r->at += r->filled;
    return status;
}

static void sift(run **heap, size_t count, size_t at)
{
    for (;;) {
        size_t least = at;
        for (size_t child = 2 * at + 1; child <= 2 * at + 2 && child < count; child++)
            if (is_before(heap[child], heap[least]))
                least = child;
        if (least == at)
            return;
        run *other = heap[at];
        heap[at] = heap[least];
        heap[least] = other;
        at = least;
    }
}

/* Merges runs first to first + count into `to`, or emits them if `to` is NULL. */
static int merge(sorter *s, uint64_t first, size_t count, trip_output *to)
{
    const size_t tables = count * (sizeof(run) + sizeof(run *));
    const size_t room = (s->area_bytes - tables) / count / s->stride * s->stride;
    run **heap = (void *)s->area, *runs = (void *)(heap + count);
    unsigned char *buffers = (void *)(runs + count);
    size_t open = 0;
    int status = TRIP_OK;
    for (size_t i = 0; i < count && status == TRIP_OK; i++) {
        const uint64_t at = first + i ? s->ends[first + i - 1] : 0;
        runs[i] = (run){ .at = at, .end = s->ends[first + i], .buffer = buffers + i * room };
        status = fill(s, &runs[i], room);
        if (runs[i].filled)
            heap[open++] = &runs[i];
    }
    for (size_t i = open; i > 0; i--)
        sift(heap, open, i - 1);
    for (uint64_t n = 0; open > 0 && status == TRIP_OK; n++) {
        run *r = heap[0];
        const unsigned char *next = r->buffer + r->next;
        status = to ? trip_output_append(to, next, s->stride) : s->p->emit(s->p->user, next);
        r->next += s->stride;
        if (status == TRIP_OK && r->next == r->filled)
            status = fill(s, r, room);
        if (!r->filled)
            heap[0] = heap[--open];
        sift(heap, open, 0);
        if (status == TRIP_OK && n % CHECK_EVERY == 0)
            status = check_interrupted(s);
    }
    return status;
}

/* Merges groups of runs into longer runs. */
static int merge_groups(sorter *s, size_t ways)
{
    trip_output longer;
    uint64_t made = 0;
    int status = create_file(s, &longer);
    if (status < 0)
        return status;
    for (uint64_t first = 0; first < s->run_count && status == TRIP_OK; first += ways, made++) {
        const uint64_t left = s->run_count - first;
        const size_t count = left < ways ? (size_t)left : ways;
        status = merge(s, first, count, &longer);
        s->ends[made] = s->ends[first + count - 1];
    }
    if (status == TRIP_OK)
        status = trip_output_flush(&longer);
    trip_output_close(&s->file);
    s->file = longer;
    s->run_count = made;
    return status;
}

static int sort_externally(sorter *s, size_t capacity)
{
    const size_t run_bytes = READ_BYTES_MIN + sizeof(run) + sizeof(run *);
    const size_t ways = s->area_bytes / run_bytes;
    const uint64_t runs = (s->p->records + capacity - 1) / capacity;
    const size_t ends_bytes = runs * sizeof *s->ends;
    s->ends = trip_budget_take(s->budget, ends_bytes);
    int status = s->ends && ways >= 2 ? make_runs(s, capacity) : fail_memory(s);
    while (status == TRIP_OK && s->run_count > ways)
        status = merge_groups(s, ways);
    if (status == TRIP_OK)
        status = merge(s, 0, (size_t)s->run_count, NULL);
    trip_budget_release(s->budget, s->ends, ends_bytes);
    trip_output_close(&s->file);
    return status;
}

static int sort_in_memory(sorter *s)
{
    const size_t count = (size_t)s->p->records;
    trip_key *keys;
    const int status = sort_run(s, 0, count, count, &keys);
    return status == TRIP_OK ? emit_run(s, keys, count) : status;
}

int trip_gaussian_sort(const trip_gaussian_sort_params *params, trip_budget *budget)
{
    sorter s = { .p = params,
                 .budget = budget,
                 .stride = trip_spilled_bytes(params->degree),
                 .file = { .fd = -1 } };
    const size_t each = s.stride + 2 * sizeof(trip_key);
    /* The files of runs and their ends need memory beside the area. */
    const uint64_t left = trip_budget_left_bytes(budget), beside = 4 * OUTPUT_BYTES + left / 16;
    uint64_t capacity = left > beside ? (left - beside) / each : 0;
    if (capacity > params->records)
        capacity = params->records;
    if (capacity < params->records && capacity < RECORDS_MIN)
        return fail_memory(&s);
    s.area_bytes = capacity * each;
    s.area = trip_budget_take(budget, s.area_bytes);
    if (!s.area)
        return fail_memory(&s);
    const int status =
        capacity == params->records ? sort_in_memory(&s) : sort_externally(&s, (size_t)capacity);
    trip_budget_release(budget, s.area, s.area_bytes);
    return status;
}
