#include "walk.h"

#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "report.h"

/* Portions of sparse formats are small; a batch has work for all threads. */
enum { BATCH_PORTIONS = 512 };
#define BATCH_VOXELS (UINT64_C(1) << 21)

typedef struct batch {
    trip_volume_portion portions[BATCH_PORTIONS];
    uint64_t first_box[BATCH_PORTIONS +
                       1]; /* number of each portion's first box, then the number of all boxes */
    size_t count;
    uint64_t voxels;
} batch;

typedef struct walk {
    const trip_walk_params *params;
    trip_volume *volume;
    const batch *current;
    uint64_t done, voxels; /* position up to which the volume was read */
} walk;

/* Returns the number of parts into which a grid with distance `step` cuts [lo, lo + size). */
static int64_t cuts(int64_t lo, int64_t size, int64_t step)
{
    return (lo + size - 1) / step - lo / step + 1;
}

static int64_t step_along(const trip_walk_params *p, int axis)
{
    return axis == 2 ? p->height : p->edge;
}

static uint64_t boxes_of(const trip_walk_params *p, const trip_volume_portion *b)
{
    uint64_t count = 1;
    for (int a = 0; a < 3; a++)
        count *= (uint64_t)cuts(b->origin[a], b->size[a], step_along(p, a));
    return count;
}

/* Sets the box to part `index` of the portion along an axis. */
static void cut(const trip_walk_params *p, const trip_volume_portion *b, int axis, int64_t index,
                trip_box *box)
{
    int64_t step = step_along(p, axis);
    int64_t begin = b->origin[axis], end = begin + b->size[axis];
    int64_t from = (begin / step + index) * step, to = from + step;
    box->lo[axis] = from > begin ? from : begin;
    box->size[axis] = (to < end ? to : end) - box->lo[axis];
}

static int do_box(void *user, unsigned thread, uint64_t item)
{
    const walk *w = user;
    const batch *b = w->current;
    size_t low = 0, high = b->count; /* find the portion with first_box <= item < next first_box */
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (b->first_box[middle] <= item)
            low = middle;
        else
            high = middle;
    }
    trip_box box = { .volume = w->volume, .portion = &b->portions[low] };
    uint64_t index = item - b->first_box[low];
    for (int a = 0; a < 3; a++) {
        uint64_t n =
            (uint64_t)cuts(box.portion->origin[a], box.portion->size[a], step_along(w->params, a));
        cut(w->params, box.portion, a, (int64_t)(index % n), &box);
        index /= n;
    }
    return w->params->box(w->params->user, thread, &box);
}

static void release(walk *w, batch *b)
{
    for (size_t i = 0; i < b->count; i++)
        trip_portion_release(w->volume, &b->portions[i]);
    b->count = 0;
}

static bool has_slices(const walk *w)
{
    return !trip_volume_get_info(w->volume)->sparse;
}

/* Reads a batch, which is empty at the end of the volume. In dense volumes it is one portion of at
 * most `slices`. */
static int read_batch(walk *w, batch *b, int64_t slices)
{
    bool dense = has_slices(w);
    int more = 1;
    b->voxels = 0;
    b->count = 0;
    b->first_box[0] = 0;
    while (b->count < (dense ? 1 : BATCH_PORTIONS) && b->voxels < BATCH_VOXELS) {
        trip_volume_portion *portion = &b->portions[b->count];
        more = trip_volume_next(w->volume, slices, portion);
        if (more <= 0)
            break;
        b->count++;
        b->first_box[b->count] = b->first_box[b->count - 1] + boxes_of(w->params, portion);
        b->voxels += (uint64_t)(portion->size[0] * portion->size[1] * portion->size[2]);
    }
    if (more < 0)
        release(w, b);
    if (b->count > 0)
        w->done += dense ? (uint64_t)b->portions[0].size[2] : 1;
    w->voxels += b->voxels;
    return more < 0 ? more : 0;
}

static int check_interrupted(void)
{
    return trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "brick", "", "interrupted") : 0;
}

static void start(walk *w, trip_workers *workers, const batch *b)
{
    w->current = b;
    trip_workers_start(workers, do_box, w, b->first_box[b->count]);
}

/* Skips slices without reading them if the format allows it. Then sets *count to 0. */
static int skip_slices(walk *w, uint64_t *count)
{
    const int64_t *dims = trip_volume_get_info(w->volume)->dims;
    int64_t slices = trip_volume_skip(w->volume, *count < INT64_MAX ? (int64_t)*count : INT64_MAX);
    if (slices <= 0)
        return (int)slices;
    w->done += (uint64_t)slices;
    w->voxels += (uint64_t)(slices * dims[0] * dims[1]);
    *count = 0;
    return 0;
}

/* Skips `count` slices of a dense volume or batches of a sparse volume. */
static int skip_batches(walk *w, batch *b, uint64_t count)
{
    int64_t slices = w->params->slices < 1 ? 1 : w->params->slices;
    int status = count && has_slices(w) ? skip_slices(w, &count) : 0;
    while (count > 0 && status == 0) {
        uint64_t before = w->done;
        status = read_batch(w, b, (uint64_t)slices < count ? slices : (int64_t)count);
        if (b->count == 0)
            break;
        count -= w->done - before;
        release(w, b);
        if (status == 0)
            status = check_interrupted();
    }
    return status;
}

/* Skips the batches between two processed ones. */
static int skip_stride(walk *w, batch *b)
{
    uint64_t count = w->params->stride > 1 ? w->params->stride - 1 : 0;
    uint64_t slices = w->params->slices < 1 ? 1 : (uint64_t)w->params->slices;
    if (has_slices(w) && __builtin_mul_overflow(count, slices, &count))
        count = UINT64_MAX;
    return skip_batches(w, b, count);
}

static int read_next(walk *w, batch *b)
{
    double begin = trip_now_seconds();
    int status = skip_stride(w, b);
    if (w->params->skip_seconds)
        *w->params->skip_seconds += trip_now_seconds() - begin;
    return status == 0 ? read_batch(w, b, w->params->slices) : status;
}

/* Processes one batch on the workers while reading the next. */
static int walk_batches(walk *w, trip_workers *workers, batch *now, batch *ahead)
{
    const trip_walk_params *p = w->params;
    int status = skip_batches(w, now, p->skip);
    if (status == 0)
        status = read_batch(w, now, p->slices);
    while (status == 0 && now->count > 0) {
        uint64_t done = w->done, voxels = w->voxels;
        int read = 0;
        ahead->count = 0;
        start(w, workers, now);
        if (p->read_ahead)
            read = read_next(w, ahead);
        trip_workers_wait(workers, 0, &status);
        release(w, now);
        if (status == 0)
            status = p->batch(p->user, done, voxels);
        if (status == 0 && !p->read_ahead)
            read = read_next(w, ahead);
        if (status == 0)
            status = read;
        if (status == 0)
            status = check_interrupted();
        batch *other = now;
        now = ahead;
        ahead = other;
    }
    release(w, now);
    release(w, ahead);
    return status;
}

int trip_walk(trip_volume *volume, trip_workers *workers, const trip_walk_params *params)
{
    walk w = { .params = params, .volume = volume };
    batch *batches = calloc(2, sizeof *batches);
    if (!batches)
        return trip_fail(TRIP_ERROR, "brick", "portions", "out of memory");
    int status = walk_batches(&w, workers, &batches[0], &batches[1]);
    free(batches);
    return status;
}
