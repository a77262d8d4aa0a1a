#include "gaussian_sort.h"

#include "folder.h"
#include "key_sort.h"
#include "report.h"

#include <stdlib.h>
#include <string.h>

enum {
    OUTPUT_BYTES = 1 << 16,
    WRITE_BYTES = 1 << 15,    /* of the buffer of a run that is spilled */
    READ_BYTES_MIN = 1 << 14, /* of the buffer of a run that is merged */
    READ_BYTES_MAX = 1 << 20,
    RECORDS_MIN = 1024,    /* of a run */
    READ_SPLATS = 1024,    /* are read at once */
    CHECK_EVERY = 1 << 14, /* splats between two checks for an interruption */
    AHEAD = 8,             /* splats that are fetched before their turn */
};

/* A run that is merged. It lies in memory, sorted by keys, or in the file of runs. */
typedef struct run {
    const unsigned char *head; /* the next splat; NULL at the end */
    unsigned char *buffer;
    const trip_key *keys; /* of the splats that are left in memory; NULL for the file */
    size_t left;
    uint64_t at, end; /* bytes of the file that are not yet in the buffer */
    size_t next, filled;
} run;

/* The area has a slice for each run that is sorted at the same time: splats, two tables of keys,
 * and a buffer if the run is spilled. */
typedef struct sorter {
    const trip_gaussian_sort_params *p;
    trip_budget *budget;
    size_t stride;
    unsigned char *area;
    size_t area_bytes, slice_bytes;
    unsigned slices;   /* 1, or one for each worker */
    size_t run_splats; /* the most splats of a run */
    trip_output file;  /* of the runs; closed if all fit into the area */
    uint64_t *ends;    /* of the runs in the file */
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

static void fetch(const unsigned char *spilled, size_t bytes)
{
    enum { CACHE_LINE = 64 };
    for (size_t at = 0; at < bytes; at += CACHE_LINE)
        __builtin_prefetch(spilled + at);
}

/* ---- runs ---- */

static size_t run_length(const sorter *s, uint64_t number)
{
    const uint64_t left = s->p->records - number * s->run_splats;
    return left < s->run_splats ? (size_t)left : s->run_splats;
}

static trip_key *keys_of(const sorter *s, unsigned char *slice)
{
    return (void *)(slice + s->run_splats * s->stride);
}

static void count_groups(const sorter *s, const trip_key *keys, size_t count)
{
    for (size_t i = 0, first = 0; i < count; first = i) {
        while (i < count && keys[i].key == keys[first].key)
            i++;
        s->p->count(s->p->user, keys[first].key, i - first);
    }
}

/* Reads a run into a slice in parts, and makes keys of the coordinates. */
static int read_run(const sorter *s, uint64_t number, unsigned char *slice, trip_key *keys)
{
    const size_t count = run_length(s, number);
    const uint64_t at = (s->p->first + number * s->run_splats) * s->stride;
    int status = TRIP_OK;
    for (size_t i = 0; i < count && status == TRIP_OK;) {
        const size_t end = count - i < READ_SPLATS ? count : i + READ_SPLATS;
        unsigned char *spilled = slice + i * s->stride;
        status = trip_output_read(s->p->spool, at + i * s->stride, spilled, (end - i) * s->stride);
        for (; i < end && status == TRIP_OK; i++, spilled += s->stride) {
            s->p->place(s->p->user, splat(spilled), (void *)spilled);
            keys[i] = (trip_key){ trip_key_of(head(spilled)->at), i };
        }
        if (status == TRIP_OK)
            status = check_interrupted(s);
    }
    return status;
}

/* Sorts a run in a slice by keys. */
static int sort_run(const sorter *s, uint64_t number, unsigned char *slice)
{
    const size_t count = run_length(s, number);
    trip_key *keys = keys_of(s, slice), *scratch = keys + s->run_splats;
    const int status = read_run(s, number, slice, keys);
    if (status < 0)
        return status;
    trip_key_sort(keys, scratch, count);
    for (size_t i = 0; i < count; i++) {
        if (i + AHEAD < count)
            __builtin_prefetch(slice + keys[i + AHEAD].number * s->stride);
        keys[i].key = head(slice + keys[i].number * s->stride)->group;
    }
    trip_key_sort(keys, scratch, count);
    if (s->p->count)
        count_groups(s, keys, count);
    return check_interrupted(s);
}

/* Writes a sorted run to its place in the file. */
static int spill_run(const sorter *s, uint64_t number, unsigned char *slice)
{
    const size_t count = run_length(s, number), most = WRITE_BYTES / s->stride;
    const trip_key *keys = keys_of(s, slice);
    unsigned char *buffer = slice + s->slice_bytes - WRITE_BYTES;
    uint64_t at = number * s->run_splats * s->stride;
    int status = TRIP_OK;
    for (size_t i = 0; i < count && status == TRIP_OK;) {
        size_t n = 0;
        for (; n < most && i < count; n++, i++) {
            if (i + AHEAD < count)
                fetch(slice + keys[i + AHEAD].number * s->stride, s->stride);
            memcpy(buffer + n * s->stride, slice + keys[i].number * s->stride, s->stride);
        }
        status = trip_output_patch(&s->file, at, buffer, n * s->stride);
        at += n * s->stride;
    }
    s->ends[number] = at;
    return status;
}

/* Each worker has a slice. Runs that stay in memory have a slice each. */
static int make_run(void *user, unsigned thread, uint64_t number)
{
    const sorter *s = user;
    unsigned char *slice = s->area + (s->ends ? thread : number) * s->slice_bytes;
    const int status = sort_run(s, number, slice);
    return status == TRIP_OK && s->ends ? spill_run(s, number, slice) : status;
}

static int make_runs(sorter *s)
{
    int status = TRIP_OK;
    if (s->slices > 1)
        status = trip_workers_run(s->p->workers, make_run, s, s->run_count);
    for (uint64_t i = 0; i < s->run_count && s->slices == 1 && status == TRIP_OK; i++)
        status = make_run(s, 0, i);
    if (s->p->closes)
        trip_output_close(s->p->closes);
    return status;
}

/* ---- merging ---- */

/* Whether the next splat of run a comes before the next of run b. */
static bool is_before(const run *a, const run *b)
{
    const trip_spilled *x = head(a->head), *y = head(b->head);
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
    r->head = r->filled ? r->buffer : NULL;
    trip_output_announce_read(&s->file, r->at, r->end - r->at < room ? r->end - r->at : room);
    return status;
}

static int advance(const sorter *s, run *r, size_t room)
{
    if (r->keys) {
        r->keys++;
        if (r->left > AHEAD)
            fetch(r->buffer + r->keys[AHEAD - 1].number * s->stride, s->stride);
        r->head = --r->left ? r->buffer + r->keys->number * s->stride : NULL;
        return TRIP_OK;
    }
    r->next += s->stride;
    r->head = r->buffer + r->next;
    return r->next == r->filled ? fill(s, r, room) : TRIP_OK;
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

/* Merges open runs into `to`, or emits them if `to` is NULL. */
static int merge_open(const sorter *s, run **heap, size_t open, size_t room, trip_output *to)
{
    int status = TRIP_OK;
    for (size_t i = open; i > 0; i--)
        sift(heap, open, i - 1);
    for (uint64_t n = 0; open > 0 && status == TRIP_OK; n++) {
        run *r = heap[0];
        status = to ? trip_output_append(to, r->head, s->stride) : s->p->emit(s->p->user, r->head);
        if (status == TRIP_OK)
            status = advance(s, r, room);
        if (!r->head)
            heap[0] = heap[--open];
        sift(heap, open, 0);
        if (status == TRIP_OK && n % CHECK_EVERY == 0)
            status = check_interrupted(s);
    }
    return status;
}

/* Merges runs first to first + count of the file. */
static int merge(const sorter *s, uint64_t first, size_t count, trip_output *to)
{
    const size_t tables = count * (sizeof(run) + sizeof(run *));
    const size_t share = (s->area_bytes - tables) / count;
    const size_t room =
        (share < READ_BYTES_MAX ? share : (size_t)READ_BYTES_MAX) / s->stride * s->stride;
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
    return status == TRIP_OK ? merge_open(s, heap, open, room, to) : status;
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

static size_t most_ways(const sorter *s)
{
    return s->area_bytes / (READ_BYTES_MIN + sizeof(run) + sizeof(run *));
}

static int sort_externally(sorter *s)
{
    const size_t ways = most_ways(s), ends_bytes = s->run_count * sizeof *s->ends;
    s->ends = trip_budget_take(s->budget, ends_bytes);
    int status = s->ends && ways >= 2 ? create_file(s, &s->file) : fail_memory(s);
    if (status == TRIP_OK)
        status = trip_output_reserve(&s->file, s->p->records * s->stride);
    if (status == TRIP_OK)
        status = make_runs(s);
    while (status == TRIP_OK && s->run_count > ways)
        status = merge_groups(s, ways);
    if (status == TRIP_OK)
        status = merge(s, 0, (size_t)s->run_count, NULL);
    trip_budget_release(s->budget, s->ends, ends_bytes);
    trip_output_close(&s->file);
    return status;
}

/* Sorts one run in each slice. */
static int sort_in_memory(sorter *s)
{
    const size_t count = (size_t)s->run_count, bytes = count * (sizeof(run) + sizeof(run *));
    run *runs = trip_budget_take(s->budget, bytes), **heap = runs ? (void *)(runs + count) : NULL;
    int status = runs ? TRIP_OK : fail_memory(s);
    for (size_t i = 0; i < count && status == TRIP_OK; i++)
        heap[i] = &runs[i];
    if (status == TRIP_OK)
        status = make_runs(s);
    for (size_t i = 0; i < count && status == TRIP_OK; i++) {
        runs[i] = (run){ .buffer = s->area + i * s->slice_bytes, .left = run_length(s, i) };
        runs[i].keys = keys_of(s, runs[i].buffer);
        runs[i].head = runs[i].buffer + runs[i].keys->number * s->stride;
    }
    if (status == TRIP_OK)
        status = merge_open(s, heap, count, 0, NULL);
    trip_budget_release(s->budget, runs, bytes);
    return status;
}

/* ---- sizes ---- */

/* Divides `bytes` of memory into slices. Returns false if they are too small. */
static bool set_slices(sorter *s, unsigned slices, uint64_t bytes)
{
    const size_t each = s->stride + 2 * sizeof(trip_key);
    s->slices = slices;
    s->slice_bytes = (size_t)(bytes / slices) & ~(size_t)7;
    if (s->slice_bytes < WRITE_BYTES + RECORDS_MIN * each)
        return false;
    s->run_splats = (s->slice_bytes - WRITE_BYTES) / each;
    s->area_bytes = slices * s->slice_bytes;
    s->run_count = (s->p->records + s->run_splats - 1) / s->run_splats;
    return slices == 1 || s->run_count <= most_ways(s);
}

/* Returns whether all splats fit into `bytes` of memory. Each slice then has one run. */
static bool fits_memory(sorter *s, uint64_t bytes)
{
    const size_t each = s->stride + 2 * sizeof(trip_key);
    const unsigned workers = trip_workers_count(s->p->workers);
    s->slices = s->p->records / RECORDS_MIN >= workers ? workers : 1;
    if (bytes / each < s->p->records + s->slices)
        return false;
    s->run_splats = (size_t)((s->p->records + s->slices - 1) / s->slices);
    s->run_count = (s->p->records + s->run_splats - 1) / s->run_splats;
    s->slice_bytes = s->run_splats * each;
    s->area_bytes = s->slices * s->slice_bytes;
    return true;
}

int trip_gaussian_sort(const trip_gaussian_sort_params *params, trip_budget *budget)
{
    sorter s = { .p = params,
                 .budget = budget,
                 .stride = params->bytes ? params->bytes : trip_spilled_bytes(params->degree),
                 .file = { .fd = -1 } };
    /* The files of runs and their ends need memory beside the area. */
    const uint64_t left = trip_budget_left_bytes(budget), beside = 4 * OUTPUT_BYTES + left / 16;
    const uint64_t bytes = left > beside ? left - beside : 0;
    const bool fits = fits_memory(&s, bytes);
    if (!fits && !set_slices(&s, trip_workers_count(params->workers), bytes) &&
        !set_slices(&s, 1, bytes))
        return fail_memory(&s);
    s.area = trip_budget_take(budget, s.area_bytes);
    if (!s.area)
        return fail_memory(&s);
    const int status = fits ? sort_in_memory(&s) : sort_externally(&s);
    trip_budget_release(budget, s.area, s.area_bytes);
    return status;
}
