#include "placed_stream.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"

enum { BATCH = 64 };

#define BATCH_BYTES (BATCH * (sizeof(trip_gaussian) + sizeof(double)))

/* A set that has splats to read. */
typedef struct part {
    unsigned number; /* of the set */
    trip_gaussian_stream_params params;
    trip_gaussian_plane planes[TRIP_GAUSSIAN_PLANES_MAX]; /* in the set's space */
    double lo, hi;                                        /* bounds of the keys */
    const trip_gaussian_transform *placement;
    trip_gaussian_need need; /* in the common space */
    trip_gaussian_plan plan;
    trip_gaussian_stream *stream; /* NULL until the merge reaches `lo`, and after the end */
    trip_gaussian *batch;         /* with the keys behind it */
    double *keys;
    size_t at, count;
} part;

struct trip_placed_stream {
    const trip_placed_set *sets;
    trip_budget *budget;
    uint64_t *drawn;
    part *parts; /* by ascending lo */
    unsigned count, opened;
    part **heap; /* open parts; the first has the least key */
    unsigned heap_count;
    size_t bytes;                    /* of parts and heap */
    trip_gaussian_progress progress; /* of closed parts */
    trip_gaussian_plan plan;
};

/* ---- placement ---- */

void trip_place_function(const trip_gaussian_transform *t, const double from[3], double offset,
                         double direction[3], double *placed_offset)
{
    if (t->identity) {
        memcpy(direction, from, 3 * sizeof *from);
        *placed_offset = offset;
        return;
    }
    *placed_offset = offset;
    for (int i = 0; i < 3; i++) {
        direction[i] = t->m[0][i] * from[0] + t->m[1][i] * from[1] + t->m[2][i] * from[2];
        *placed_offset += from[i] * t->m[i][3];
    }
}

/* Only parallel views have pixels of a length. */
void trip_place_lod(trip_gaussian_lod *lod, const trip_gaussian_transform *t)
{
    double from[3], eye[3] = { 0 };
    if (t->identity)
        return;
    for (int i = 0; i < 3; i++)
        from[i] = lod->eye[i] - t->m[i][3];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            eye[k] += t->m[i][k] * from[i] / (t->scale * t->scale);
    memcpy(lod->eye, eye, sizeof eye);
    if (lod->parallel)
        lod->px *= t->scale;
}

int trip_place_axis(const trip_gaussian_transform *t, int axis)
{
    const double *row = t->m[axis];
    for (int a = 0; a < 3; a++)
        if (fabs(row[a]) > fabs(row[axis]) * (1 + 1e-9))
            axis = a;
    return axis;
}

/* Asks about a box that holds the placed box. */
static bool is_placed_needed(const void *context, const double lo[3], const double hi[3],
                             double deviation)
{
    const part *p = context;
    const trip_gaussian_transform *t = p->placement;
    double from[3], to[3];
    for (int i = 0; i < 3; i++) {
        double middle = t->m[i][3], half = 0;
        for (int k = 0; k < 3; k++) {
            middle += t->m[i][k] * (lo[k] + hi[k]) / 2;
            half += fabs(t->m[i][k]) * (hi[k] - lo[k]) / 2;
        }
        half += 1e-14 * (fabs(middle) + fabs(t->m[i][3]) + half); /* for rounding */
        from[i] = middle - half;
        to[i] = middle + half;
    }
    return p->need.is_needed(p->need.context, from, to, deviation * t->scale * (1 + 1e-6));
}

/* Parts have moved since place_params(). */
static void place_need(part *p)
{
    if (p->need.is_needed && !p->placement->identity)
        p->params.need = (trip_gaussian_need){ is_placed_needed, p };
}

static void place_params(part *p, const trip_gaussian_transform *t,
                         const trip_gaussian_stream_params *from)
{
    p->params = *from;
    trip_place_function(t, from->key.direction, from->key.offset, p->params.key.direction,
                        &p->params.key.offset);
    for (unsigned i = 0; i < from->plane_count; i++) {
        const trip_gaussian_plane *plane = &from->planes[i];
        trip_place_function(t, plane->normal, plane->offset, p->planes[i].normal,
                            &p->planes[i].offset);
        p->planes[i].reach = t->identity ? plane->reach : plane->reach * t->scale;
    }
    p->params.planes = p->planes;
    p->placement = t;
    p->need = from->need;
    trip_place_lod(&p->params.lod, t);
    p->params.axis = trip_place_axis(t, from->axis);
}

/* Sets the bounds of a part's keys from the box of the set's centres. */
static void bound_keys(part *p, const trip_gaussian_set *set)
{
    const trip_gaussian_key *key = &p->params.key;
    double lo[3], hi[3];
    for (int a = 0; a < 3; a++) {
        const bool up = key->direction[a] > 0;
        lo[a] = up ? set->header.centre_lo[a] : set->header.centre_hi[a];
        hi[a] = up ? set->header.centre_hi[a] : set->header.centre_lo[a];
    }
    p->lo = trip_gaussian_key_of(key, lo);
    p->hi = trip_gaussian_key_of(key, hi);
    if (p->params.key_min != 0 || p->params.key_max != 0) {
        p->lo = fmax(p->lo, p->params.key_min);
        p->hi = fmin(p->hi, p->params.key_max);
    }
}

/* ---- opening ---- */

static int by_least_key(const void *a, const void *b)
{
    const part *x = a, *y = b;
    return x->lo < y->lo ? -1 : x->lo > y->lo ? 1 : x->number < y->number ? -1 : 1;
}

static void add_plan(trip_gaussian_plan *sum, const trip_gaussian_plan *p)
{
    sum->bricks += p->bricks;
    sum->records += p->records;
    sum->coarse_records += p->coarse_records;
    sum->read_bytes += p->read_bytes;
}

static size_t bytes_of(const part *p)
{
    return p->plan.bytes + BATCH_BYTES + 4096;
}

/* Finds the most memory and the largest windows that are open together. The heap holds the parts
 * that are open at the least key of each part. */
static void plan_together(trip_placed_stream *s)
{
    trip_gaussian_plan together = { 0 };
    unsigned open = 0;
    for (unsigned i = 0; i < s->count; i++) {
        unsigned kept = 0;
        for (unsigned k = 0; k < open; k++)
            if (s->heap[k]->hi >= s->parts[i].lo) {
                s->heap[kept++] = s->heap[k];
            } else {
                together.bytes -= bytes_of(s->heap[k]);
                together.window_records -= s->heap[k]->plan.window_records;
            }
        s->heap[kept] = &s->parts[i];
        open = kept + 1;
        together.bytes += bytes_of(&s->parts[i]);
        together.window_records += s->parts[i].plan.window_records;
        if (together.bytes > s->plan.bytes)
            s->plan.bytes = together.bytes;
        if (together.window_records > s->plan.window_records)
            s->plan.window_records = together.window_records;
    }
}

static int plan_parts(trip_placed_stream *s, unsigned count,
                      const trip_gaussian_stream_params *params)
{
    int status = 0;
    for (unsigned i = 0; i < count && !status; i++) {
        part *p = &s->parts[s->count];
        p->number = i;
        place_params(p, &s->sets[i].placement, params);
        bound_keys(p, s->sets[i].set);
        status = trip_gaussian_stream_plan(s->sets[i].set, &p->params, s->budget, &p->plan);
        if (status || !p->plan.records)
            continue;
        add_plan(&s->plan, &p->plan);
        s->count++;
    }
    for (unsigned i = 0; i < s->count; i++)
        s->parts[i].params.planes = NULL; /* set again when the part is opened */
    if (s->count > 1)
        qsort(s->parts, s->count, sizeof *s->parts, by_least_key);
    plan_together(s);
    return status;
}

static int check_memory(const trip_placed_stream *s)
{
    char needed[32], left[32];
    if (s->opened || s->plan.bytes <= trip_budget_left_bytes(s->budget))
        return 0;
    return trip_fail(TRIP_ERROR, "read", "scenes",
                     "this view needs %s for the %llu Gaussians whose order is open at a time, and "
                     "--memory leaves %s: raise --memory",
                     trip_format_bytes(s->plan.bytes, needed),
                     (unsigned long long)s->plan.window_records,
                     trip_format_bytes(trip_budget_left_bytes(s->budget), left));
}

/* One set needs no plan beforehand: its stream makes one. */
static int open_alone(trip_placed_stream *s, const trip_gaussian_stream_params *params)
{
    part *p = s->parts;
    place_params(p, &s->sets->placement, params);
    place_need(p);
    const int status = trip_gaussian_stream_open(&p->stream, s->sets->set, &p->params, s->budget);
    s->count = s->opened = 1;
    if (!status)
        s->plan = *trip_gaussian_stream_planned(p->stream);
    return status;
}

int trip_placed_stream_open(trip_placed_stream **out, const trip_placed_set *sets, unsigned count,
                            const trip_gaussian_stream_params *params, uint64_t *drawn,
                            trip_budget *budget)
{
    const size_t bytes = sizeof **out + count * (sizeof(part) + sizeof(part *));
    trip_placed_stream *s = *out = trip_budget_take(budget, bytes);
    if (!s)
        return trip_fail(TRIP_ERROR, "read", "scenes",
                         "no memory for the order of %u scenes; raise --memory", count);
    *s = (trip_placed_stream){ .sets = sets, .budget = budget, .drawn = drawn, .bytes = bytes };
    s->parts = (void *)(s + 1);
    s->heap = (void *)(s->parts + count);
    int status = count == 1 ? open_alone(s, params) : plan_parts(s, count, params);
    if (!status)
        status = check_memory(s);
    if (!status)
        return 0;
    trip_placed_stream_close(s);
    *out = NULL;
    return status;
}

const trip_gaussian_plan *trip_placed_stream_planned(const trip_placed_stream *s)
{
    return &s->plan;
}

static void add_progress(trip_gaussian_progress *sum, const part *p)
{
    if (!p->stream)
        return;
    const trip_gaussian_progress one = trip_gaussian_stream_progress(p->stream);
    sum->bricks += one.bricks;
    sum->records += one.records;
    sum->bytes += one.bytes;
    sum->unneeded_records += one.unneeded_records;
}

trip_gaussian_progress trip_placed_stream_progress(const trip_placed_stream *s)
{
    trip_gaussian_progress sum = s->progress;
    for (unsigned i = 0; i < s->opened; i++)
        add_progress(&sum, &s->parts[i]);
    return sum;
}

static void close_part(trip_placed_stream *s, part *p)
{
    add_progress(&s->progress, p);
    trip_gaussian_stream_close(p->stream);
    trip_budget_release(s->budget, p->batch, BATCH_BYTES);
    p->stream = NULL;
    p->batch = NULL;
}

void trip_placed_stream_close(trip_placed_stream *s)
{
    if (!s)
        return;
    for (unsigned i = 0; i < s->opened; i++)
        close_part(s, &s->parts[i]);
    trip_budget_release(s->budget, s, s->bytes);
}

/* ---- merging ---- */

/* Reads placed splats of a part. */
static int read_part(const trip_placed_stream *s, part *p, trip_gaussian *out, double *keys,
                     size_t room, size_t *got)
{
    const trip_placed_set *set = &s->sets[p->number];
    const trip_file_gaussian_header *h = &set->set->header;
    const int most = (int)h->degree, wanted = p->params.degree;
    const int degree = wanted < 0 ? 0 : wanted < most ? wanted : most;
    const int status = trip_gaussian_stream_next(p->stream, out, keys, room, got);
    for (size_t i = 0; i < *got && !status; i++) {
        out[i].antialiased = (h->flags & TRIP_GAUSSIAN_ANTIALIASED) != 0;
        out[i].from_camera = h->flags & TRIP_GAUSSIAN_FROM_CAMERA && !out[i].merged;
        out[i].hyperline = (h->flags & TRIP_GAUSSIAN_HYPERLINES) != 0;
        trip_gaussian_change_apply(&set->change, &out[i]);
        trip_gaussian_transform_apply(&set->placement, degree, &out[i]);
    }
    if (s->drawn)
        s->drawn[p->number] += *got;
    return status;
}

static bool comes_before(const part *a, const part *b)
{
    const double x = a->keys[a->at], y = b->keys[b->at];
    return x < y || (x <= y && a->number < b->number);
}

static void sift_down(trip_placed_stream *s, unsigned i)
{
    part *p = s->heap[i];
    for (unsigned child; (child = 2 * i + 1) < s->heap_count; i = child) {
        if (child + 1 < s->heap_count && comes_before(s->heap[child + 1], s->heap[child]))
            child++;
        if (!comes_before(s->heap[child], p))
            break;
        s->heap[i] = s->heap[child];
    }
    s->heap[i] = p;
}

static void add_to_heap(trip_placed_stream *s, part *p)
{
    unsigned i = s->heap_count++;
    for (; i > 0 && comes_before(p, s->heap[(i - 1) / 2]); i = (i - 1) / 2)
        s->heap[i] = s->heap[(i - 1) / 2];
    s->heap[i] = p;
}

static int fill(const trip_placed_stream *s, part *p)
{
    p->at = p->count = 0;
    return read_part(s, p, p->batch, p->keys, BATCH, &p->count);
}

static int open_part(trip_placed_stream *s)
{
    part *p = &s->parts[s->opened++];
    const trip_gaussian_set *set = s->sets[p->number].set;
    p->params.planes = p->planes;
    place_need(p);
    int status = trip_gaussian_stream_open(&p->stream, set, &p->params, s->budget);
    if (status)
        return status;
    p->batch = trip_budget_take(s->budget, BATCH_BYTES);
    if (!p->batch)
        return trip_fail(TRIP_ERROR, "read", set->path, "no memory to read it; raise --memory");
    p->keys = (void *)(p->batch + BATCH);
    status = fill(s, p);
    if (!status && p->count)
        add_to_heap(s, p);
    else
        close_part(s, p);
    return status;
}

/* Opens the parts that may have the next splat. */
static int open_due(trip_placed_stream *s)
{
    int status = 0;
    while (!status && s->opened < s->count &&
           (!s->heap_count || s->parts[s->opened].lo <= s->heap[0]->keys[s->heap[0]->at]))
        status = open_part(s);
    return status;
}

/* Takes the next splat of the heap. */
static int take(trip_placed_stream *s, trip_gaussian *out, double *key)
{
    part *p = s->heap[0];
    int status = 0;
    *out = p->batch[p->at];
    *key = p->keys[p->at++];
    if (p->at == p->count)
        status = fill(s, p);
    if (status || !p->count) {
        close_part(s, p);
        s->heap[0] = s->heap[--s->heap_count];
    }
    if (s->heap_count > 0)
        sift_down(s, 0);
    return status;
}

int trip_placed_stream_next(trip_placed_stream *s, trip_gaussian *out, double *keys, size_t room,
                            size_t *got)
{
    int status = 0;
    *got = 0;
    if (s->parts->stream && !s->parts->batch) /* one set alone */
        return read_part(s, s->parts, out, keys, room, got);
    while (!status && *got < room) {
        double key;
        status = open_due(s);
        if (status || !s->heap_count)
            break;
        status = take(s, &out[*got], &key);
        if (keys)
            keys[*got] = key;
        (*got)++;
    }
    return status;
}
