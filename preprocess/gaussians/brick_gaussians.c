#include "brick_gaussians.h"

#include "folder.h"
#include "gaussian_check.h"
#include "gaussian_code.h"
#include "gaussian_sort.h"
#include "gaussian_tree.h"
#include "gaussian_writer.h"
#include "report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    BATCH = 128,
    SPOOL_BYTES = 1 << 17,
    PROGRESS_EVERY = 1 << 14,
};

/* Precision of a brick's centres: the box has 2^21 codes along an axis. A splat is large enough
 * for a box of 2^15 times its class. */
#define BOX_CLASSES 32768.0
/* A gap that divides a brick is at least this part of its box. */
#define GAP_PART 0.25

typedef struct bricker {
    const trip_brick_gaussians_params *p;
    trip_budget *budget;
    trip_gaussian_writer *writer;
    const char *folder;
    size_t stride;
    trip_output spool;
    uint64_t records, dropped, passed;
    uint64_t by_class[TRIP_GAUSSIAN_CLASSES];
    trip_gaussian_sample sample;
    size_t sample_bytes;
    double typical_lo[3], typical_hi[3];
    /* These belong to the axis that is being written. */
    int axis;
    trip_gaussian_tree tree;
    uint64_t leaf;            /* of the gathered splats */
    uint64_t leaf_left;       /* splats of the leaf that are not yet gathered */
    unsigned gathered, piece; /* splats in the buffer, and the number that fills it */
    unsigned char *buffer;
    const unsigned char **splats, **others; /* addresses in the buffer */
    trip_key *keys, *scratch;
} bricker;

static const char *source_name(const bricker *b)
{
    return b->p->source_name ? b->p->source_name : b->p->path;
}

static int fail_memory(const bricker *b)
{
    return trip_fail(TRIP_ERROR, "brick", b->p->path,
                     "bricking needs more memory than --memory allows: raise --memory");
}

static void tell_progress(bricker *b)
{
    if (++b->passed % PROGRESS_EVERY == 0 && b->p->progress)
        b->p->progress(b->p->progress_user, b->passed);
}

/* Makes a splat valid, as far as it has finite values. */
static bool repair(trip_gaussian *g, int degree)
{
    double length = 0;
    bool good = isfinite(g->opacity);
    for (int a = 0; a < 3; a++)
        good = good && fabs(g->centre[a]) <= TRIP_GAUSSIAN_FARTHEST && g->deviations[a] >= 0 &&
               (double)g->deviations[a] <= TRIP_GAUSSIAN_FARTHEST;
    for (int i = 0; i < 4; i++)
        length += (double)g->rotation[i] * (double)g->rotation[i];
    for (int k = 0; k < trip_sh_count(degree); k++)
        for (int c = 0; c < 3; c++)
            good = good && fabsf(g->sh[k][c]) <= TRIP_GAUSSIAN_COEFFICIENT_MAX;
    if (!good || !isfinite(length) || !(length > 0))
        return false;
    for (int i = 0; i < 4; i++)
        g->rotation[i] = (float)((double)g->rotation[i] / sqrt(length));
    g->opacity = fminf(fmaxf(g->opacity, 0), 1);
    return true;
}

static int spool_splat(bricker *b, trip_gaussian *g)
{
    unsigned char spilled[sizeof(trip_spilled) + sizeof *g] = { 0 };
    const trip_spilled head = { .number = b->records };
    tell_progress(b);
    if (!repair(g, b->p->degree)) {
        b->dropped++;
        return TRIP_OK;
    }
    b->by_class[trip_gaussian_size_class(g->deviations) + TRIP_GAUSSIAN_CLASSES / 2]++;
    b->records++;
    memcpy(spilled, &head, sizeof head);
    memcpy(spilled + sizeof head, g, sizeof *g);
    return trip_output_append(&b->spool, spilled, b->stride);
}

static int check_interrupted(const bricker *b)
{
    return trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "brick", source_name(b), "interrupted")
                              : TRIP_OK;
}

static int spool_batches(bricker *b, trip_gaussian *batch)
{
    size_t got = 1;
    int status = TRIP_OK;
    while (got > 0 && status == TRIP_OK) {
        status = b->p->source(b->p->source_user, batch, BATCH, &got);
        for (size_t i = 0; i < got && status == TRIP_OK; i++)
            status = spool_splat(b, &batch[i]);
        if (status == TRIP_OK)
            status = check_interrupted(b);
    }
    return status == TRIP_OK ? trip_output_flush(&b->spool) : status;
}

static int spool_all(bricker *b)
{
    const size_t bytes = BATCH * sizeof(trip_gaussian);
    trip_gaussian *batch = trip_budget_take(b->budget, bytes);
    int status = batch ? trip_output_create(&b->spool,
                                            &(trip_output_params){ .folder = b->folder,
                                                                   .name = TRIP_SPOOL_NAME,
                                                                   .buffer_bytes = SPOOL_BYTES,
                                                                   .unnamed = true },
                                            b->budget)
                       : fail_memory(b);
    if (status == TRIP_OK)
        status = spool_batches(b, batch);
    trip_budget_release(b->budget, batch, bytes);
    if (status == TRIP_OK && b->records == 0)
        return trip_fail(TRIP_ERROR, "brick", source_name(b), "contains no Gaussian to draw");
    if (status == TRIP_OK && b->dropped)
        trip_warn(source_name(b),
                  "%llu of %llu Gaussians have a value that is not finite, or a rotation of zero "
                  "length; they are left out",
                  (unsigned long long)b->dropped, (unsigned long long)(b->dropped + b->records));
    return status;
}

static void add_point(bricker *b, const unsigned char *spilled)
{
    trip_gaussian_point *to = &b->sample.points[b->sample.count++];
    const trip_gaussian *g = (const void *)(spilled + sizeof(trip_spilled));
    memcpy(to->centre, g->centre, sizeof to->centre);
    to->class_index = trip_gaussian_size_class(g->deviations) + TRIP_GAUSSIAN_CLASSES / 2;
}

/* The buffer of bricks serves for reading too. */
static int take_sample(bricker *b)
{
    const uint64_t step = TRIP_GAUSSIAN_BRICK_RECORDS_MAX;
    int status = TRIP_OK;
    b->sample_bytes = trip_gaussian_sample_room(b->records) * sizeof *b->sample.points;
    b->sample.points = trip_budget_take(b->budget, b->sample_bytes);
    if (!b->sample.points)
        return fail_memory(b);
    for (uint64_t first = 0; first < b->records && status == TRIP_OK; first += step) {
        const uint64_t left = b->records - first, count = left < step ? left : step;
        status = trip_output_read(&b->spool, first * b->stride, b->buffer, count * b->stride);
        for (uint64_t i = 0; i < count && status == TRIP_OK; i++)
            if (trip_gaussian_is_sampled(first + i, b->records))
                add_point(b, b->buffer + i * b->stride);
        if (status == TRIP_OK)
            status = check_interrupted(b);
    }
    return status;
}

/* Finds the bounds of the centres without the outer hundredth at each side. */
static int find_typical(bricker *b)
{
    const uint64_t count = b->sample.count;
    const size_t bytes = 2 * (count + 1) * sizeof(trip_key);
    trip_key *keys = trip_budget_take(b->budget, bytes);
    if (!keys)
        return fail_memory(b);
    for (int a = 0; a < 3 && count > 0; a++) {
        for (uint64_t i = 0; i < count; i++)
            keys[i] = (trip_key){ trip_key_of(b->sample.points[i].centre[a]), i };
        trip_key_sort(keys, keys + count + 1, count);
        b->typical_lo[a] = b->sample.points[keys[count / 100].number].centre[a];
        b->typical_hi[a] = b->sample.points[keys[count - 1 - count / 100].number].centre[a];
    }
    trip_budget_release(b->budget, keys, bytes);
    return TRIP_OK;
}

static double centre_of(const unsigned char *splat, int axis)
{
    return ((const trip_gaussian *)(const void *)splat)->centre[axis];
}

/* Returns whether a box is too long along an axis for precise codes, and has a wide gap. Sets
 * *from to the first coordinate behind the gap. */
static bool find_gap(const bricker *b, const unsigned char **splats, unsigned count, int axis,
                     double size, double *from)
{
    double lo = INFINITY, hi = -INFINITY, widest = 0;
    for (unsigned i = 0; i < count; i++) {
        lo = fmin(lo, centre_of(splats[i], axis));
        hi = fmax(hi, centre_of(splats[i], axis));
    }
    if (!(hi - lo > BOX_CLASSES * size))
        return false;
    for (unsigned i = 0; i < count; i++)
        b->keys[i] = (trip_key){ trip_key_of(centre_of(splats[i], axis)), i };
    trip_key_sort(b->keys, b->scratch, count);
    for (unsigned i = 1; i < count; i++) {
        const double at = centre_of(splats[b->keys[i].number], axis);
        const double gap = at - centre_of(splats[b->keys[i - 1].number], axis);
        if (gap > widest)
            widest = gap, *from = at;
    }
    return widest > GAP_PART * (hi - lo);
}

/* Moves the splats behind a gap to the end and keeps the order. Returns the number before it. */
static unsigned divide(const bricker *b, const unsigned char **splats, unsigned count, int axis,
                       double from)
{
    unsigned left = 0, right = 0;
    for (unsigned i = 0; i < count; i++)
        if (centre_of(splats[i], axis) < from)
            splats[left++] = splats[i];
        else
            b->others[right++] = splats[i];
    memcpy(splats + left, b->others, right * sizeof *splats);
    return left;
}

/* Writes splats as a brick. Strays get bricks of their own, so that no other loses precision. */
static int write_brick(bricker *b, const unsigned char **splats, unsigned count)
{
    const int size_class = b->tree.leaves[b->leaf].class_index - TRIP_GAUSSIAN_CLASSES / 2;
    double from = 0;
    for (int axis = 0; axis < 3; axis++)
        if (find_gap(b, splats, count, axis, ldexp(1, 2 * size_class), &from)) {
            const unsigned left = divide(b, splats, count, axis, from);
            const int status = write_brick(b, splats, left);
            return status == TRIP_OK ? write_brick(b, splats + left, count - left) : status;
        }
    return trip_gaussian_writer_append(b->writer, b->axis, size_class, splats, count);
}

static int write_gathered(bricker *b)
{
    const unsigned count = b->gathered;
    for (unsigned i = 0; i < count; i++)
        b->splats[i] = b->buffer + i * b->stride + sizeof(trip_spilled);
    b->gathered = 0;
    return count ? write_brick(b, b->splats, count) : TRIP_OK;
}

/* A leaf with too many splats becomes several bricks with equal numbers. */
static unsigned piece_of(uint64_t left)
{
    const uint64_t pieces =
        (left + TRIP_GAUSSIAN_BRICK_RECORDS_MAX - 1) / TRIP_GAUSSIAN_BRICK_RECORDS_MAX;
    return (unsigned)((left + pieces - 1) / pieces);
}

static int gather(void *user, const unsigned char *spilled)
{
    bricker *b = user;
    const uint64_t leaf = ((const trip_spilled *)(const void *)spilled)->leaf;
    if (b->gathered == 0) {
        if (b->leaf_left == 0)
            b->leaf_left = b->tree.leaves[leaf].records;
        b->leaf = leaf;
        b->piece = piece_of(b->leaf_left);
    }
    memcpy(b->buffer + b->gathered++ * b->stride, spilled, b->stride);
    b->leaf_left--;
    tell_progress(b);
    return b->gathered == b->piece ? write_gathered(b) : TRIP_OK;
}

static int write_axis(bricker *b, int axis)
{
    b->axis = axis;
    b->leaf_left = 0;
    if (!trip_gaussian_tree_build(&b->tree, &b->sample, axis, b->by_class, b->budget))
        return fail_memory(b);
    const int status = trip_gaussian_sort(&(trip_gaussian_sort_params){ .spool = &b->spool,
                                                                        .records = b->records,
                                                                        .degree = b->p->degree,
                                                                        .axis = axis,
                                                                        .tree = &b->tree,
                                                                        .folder = b->folder,
                                                                        .path = b->p->path,
                                                                        .emit = gather,
                                                                        .user = b },
                                          b->budget);
    trip_gaussian_tree_free(&b->tree);
    return status;
}

static int run_bricker(bricker *b)
{
    const trip_brick_gaussians_params *p = b->p;
    int status = trip_gaussian_writer_open(&b->writer,
                                           &(trip_gaussian_writer_params){ .path = p->path,
                                                                           .replace = p->replace,
                                                                           .degree = p->degree,
                                                                           .flags = p->flags,
                                                                           .text = p->text },
                                           b->budget);
    if (status < 0)
        return status;
    b->folder = p->temporary ? p->temporary : trip_gaussian_writer_folder(b->writer);
    status = spool_all(b);
    if (status == TRIP_OK)
        status = take_sample(b);
    if (status == TRIP_OK)
        status = find_typical(b);
    for (int axis = 0; axis < 3 && status == TRIP_OK; axis++)
        status = write_axis(b, axis);
    trip_output_close(&b->spool);
    return status == TRIP_OK ? trip_gaussian_writer_finish(b->writer, b->typical_lo, b->typical_hi)
                             : status;
}

static size_t room_bytes(const bricker *b)
{
    return TRIP_GAUSSIAN_BRICK_RECORDS_MAX *
           (b->stride + 2 * sizeof(unsigned char *) + 2 * sizeof(trip_key));
}

/* Divides one block of memory into the tables of a brick. */
static void set_room(bricker *b, unsigned char *room)
{
    const size_t count = TRIP_GAUSSIAN_BRICK_RECORDS_MAX;
    b->buffer = room;
    b->keys = (void *)(room + count * b->stride);
    b->scratch = b->keys + count;
    b->splats = (void *)(b->scratch + count);
    b->others = b->splats + count;
}

int trip_brick_gaussians(const trip_brick_gaussians_params *params, trip_budget *budget,
                         trip_brick_gaussians_result *result)
{
    bricker *b = calloc(1, sizeof *b);
    if (!b)
        return trip_fail(TRIP_ERROR, "brick", params->path, "out of memory");
    b->p = params;
    b->budget = budget;
    b->stride = trip_spilled_bytes(params->degree);
    b->spool.fd = -1;
    unsigned char *room = trip_budget_take(budget, room_bytes(b));
    if (room)
        set_room(b, room);
    const int status = room ? run_bricker(b) : fail_memory(b);
    if (result)
        *result = (trip_brick_gaussians_result){ b->records, b->dropped };
    trip_gaussian_writer_close(b->writer);
    if (b->sample.points)
        trip_budget_release(budget, b->sample.points, b->sample_bytes);
    if (room)
        trip_budget_release(budget, room, room_bytes(b));
    free(b);
    return status;
}
