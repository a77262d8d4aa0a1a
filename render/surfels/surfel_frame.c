#include "surfel_frame.h"

#include <fcntl.h>
#include <math.h>
#include <string.h>

#include "clock.h"
#include "gaussian_code.h"
#include "renderer.h"
#include "surfels_cpu.h"
#include "surfels_reference.h"

enum {
    READ_AHEAD = 16,       /* bricks that the system is asked to read before their turn */
    BATCH_BRICKS = 16,     /* at most in a batch */
    BATCH_RECORDS = 32768, /* surfels of a batch, if there is memory */
};

/* A brick in the buffer. */
typedef struct part {
    const trip_surfel_brick *brick;
    const trip_file_gaussian_brick *from;
    const trip_placed_set *set;
    int degree; /* of the harmonics that are read */
    const unsigned char *planes[TRIP_GAUSSIAN_PLANES];
    size_t end; /* surfels of the batch up to its last one */
} part;

struct trip_surfel_frame {
    trip_surfel_frame_params params;
    trip_surfel_plan plan;
    size_t next;   /* in the order of the plan */
    bool blending; /* the second time */
    trip_surfels_cpu *cpu;
    trip_surfels_reference *reference;
    unsigned char *buffer;
    size_t buffer_records, record_bytes;
    part parts[BATCH_BRICKS];
    unsigned part_count;
    bool kept; /* this picture has replaced the history */
    trip_surfel_frame_stats stats;
};

/* ---- beginning ---- */

static int degree_of(const trip_surfel_frame *f, const trip_gaussian_set *set)
{
    const int most = (int)set->header.degree, wanted = f->params.settings.degree;
    return wanted < 0 ? 0 : wanted < most ? wanted : most;
}

/* Returns the most bytes of a surfel in the planes that are read. */
static size_t most_bytes(const trip_surfel_frame *f)
{
    size_t most = 0;
    for (unsigned i = 0; i < f->params.set_count; i++) {
        const trip_gaussian_set *set = f->params.sets[i].set;
        const unsigned count = trip_gaussian_plane_count(&set->header, degree_of(f, set));
        size_t bytes = 0;
        for (unsigned n = 0; n < count; n++)
            bytes += trip_gaussian_plane_bytes(&set->header, n);
        most = bytes > most ? bytes : most;
    }
    return most;
}

/* Takes the buffer of a batch: a brick at least. */
static int take_buffer(trip_surfel_frame *f)
{
    f->record_bytes = most_bytes(f);
    f->buffer_records = BATCH_RECORDS;
    f->buffer = trip_budget_take(f->params.budget, f->buffer_records * f->record_bytes);
    if (!f->buffer) {
        f->buffer_records = TRIP_GAUSSIAN_BRICK_RECORDS_MAX;
        f->buffer = trip_budget_take(f->params.budget, f->buffer_records * f->record_bytes);
    }
    return f->buffer ? 0
                     : trip_fail(TRIP_ERROR, "render", "memory",
                                 "no memory for a brick; raise --memory or draw a smaller picture");
}

static int begin_picture(trip_surfel_frame *f)
{
    const trip_surfel_frame_params *p = &f->params;
    if (p->reference)
        return trip_surfels_reference_begin(&f->reference, p->camera, &p->settings, p->budget);
    return trip_surfels_cpu_begin(&f->cpu,
                                  &(trip_surfels_cpu_params){ .camera = p->camera,
                                                              .settings = &p->settings,
                                                              .budget = p->budget,
                                                              .runner = &p->runner,
                                                              .device = p->device,
                                                              .unselected = p->unselected });
}

static int make_plan(trip_surfel_frame *f)
{
    const trip_surfel_frame_params *p = &f->params;
    const int status = trip_surfel_plan_make(
        &f->plan, &(trip_surfel_plan_params){ .sets = p->sets,
                                              .set_count = p->set_count,
                                              .camera = p->camera,
                                              .clip = &p->settings.clip,
                                              .lod_px = p->lod_px,
                                              .front = p->settings.front && !p->reference,
                                              .history = p->history,
                                              .budget = p->budget });
    f->stats.objects = f->plan.objects;
    f->stats.planned = f->plan.records + f->plan.away_records;
    f->stats.away = f->plan.away_records;
    f->stats.coarse = f->plan.coarse_records;
    return status;
}

int trip_surfel_frame_begin(trip_surfel_frame **out, const trip_surfel_frame_params *params)
{
    trip_surfel_frame *f = *out = trip_budget_take(params->budget, sizeof *f);
    if (!f)
        return trip_fail(TRIP_ERROR, "render", "memory", "the frame does not fit; raise --memory");
    f->params = *params;
    int status = make_plan(f);
    if (!status)
        status = begin_picture(f);
    if (!status)
        status = take_buffer(f);
    if (!status)
        return 0;
    trip_surfel_frame_end(f);
    *out = NULL;
    return status;
}

void trip_surfel_frame_end(trip_surfel_frame *f)
{
    if (!f)
        return;
    trip_budget *budget = f->params.budget;
    trip_surfels_cpu_end(f->cpu);
    trip_surfels_reference_end(f->reference);
    trip_surfel_plan_drop(&f->plan, budget);
    trip_budget_release(budget, f->buffer, f->buffer_records * f->record_bytes);
    trip_budget_release(budget, f, sizeof *f);
}

/* ---- reading ---- */

static bool is_hidden(const trip_surfel_frame *f, const trip_surfel_brick *b)
{
    double lo[2], hi[2], depth;
    return f->cpu && trip_surfel_plan_bounds(&f->plan, f->params.camera, b, lo, hi, &depth) &&
           trip_surfels_cpu_hides(f->cpu, lo, hi, depth);
}

static const trip_surfel_brick *brick_at(const trip_surfel_frame *f, size_t i)
{
    return &f->plan.bricks[f->plan.order[i].number];
}

/* Asks the system to read a brick soon. */
static void read_ahead(const trip_surfel_frame *f, size_t i)
{
    if (i >= f->plan.count)
        return;
    const trip_surfel_brick *b = brick_at(f, i);
    const trip_gaussian_set *set = f->params.sets[b->object].set;
    const trip_file_gaussian_brick *from = trip_surfel_plan_brick(&f->plan, b);
    const unsigned count = trip_gaussian_plane_count(&set->header, degree_of(f, set));
    if (is_hidden(f, b))
        return;
    for (unsigned n = 0; n < count; n++) {
        const off_t record = (off_t)trip_gaussian_plane_bytes(&set->header, n);
        posix_fadvise(set->lists[b->axis].fd[n], (off_t)from->first_record * record,
                      (off_t)from->records * record, POSIX_FADV_WILLNEED);
    }
}

/* Reads a brick to the end of the batch. */
static int read_brick(trip_surfel_frame *f, const trip_surfel_brick *b, size_t begin)
{
    part *p = &f->parts[f->part_count++];
    const trip_placed_set *set = &f->params.sets[b->object];
    *p = (part){ .brick = b,
                 .from = trip_surfel_plan_brick(&f->plan, b),
                 .set = set,
                 .degree = degree_of(f, set->set) };
    p->end = begin + p->from->records;
    unsigned char *to = f->buffer + begin * f->record_bytes;
    const unsigned count = trip_gaussian_plane_count(&set->set->header, p->degree);
    int status = 0;
    for (unsigned n = 0; n < count && !status; n++) {
        const size_t bytes = p->from->records * trip_gaussian_plane_bytes(&set->set->header, n);
        status = trip_gaussian_set_read(set->set, b->axis, b->brick, n, to);
        p->planes[n] = to;
        to += bytes;
        f->stats.bytes_read += bytes;
    }
    f->stats.bricks++;
    f->stats.read += p->from->records;
    if (f->params.drawn)
        f->params.drawn[b->object] += p->from->records;
    return status;
}

/* Reads the next bricks that are not hidden. Sets *count to the surfels of the batch. */
static int read_batch(trip_surfel_frame *f, size_t *count)
{
    const double begun = trip_now_ms();
    int status = 0;
    *count = 0;
    f->part_count = 0;
    while (!status && f->next < f->plan.count && f->part_count < BATCH_BRICKS) {
        const trip_surfel_brick *b = brick_at(f, f->next);
        const uint32_t records = trip_surfel_plan_brick(&f->plan, b)->records;
        const bool hidden = is_hidden(f, b);
        if (!hidden && *count + records > f->buffer_records)
            break;
        read_ahead(f, f->next + READ_AHEAD);
        f->next++;
        if (hidden) {
            f->stats.unread += records;
            continue;
        }
        status = read_brick(f, b, *count);
        *count += records;
    }
    f->stats.read_ms += trip_now_ms() - begun;
    return status;
}

/* ---- decoding ---- */

static void decode_palette(const part *p, const unsigned char *bytes, trip_gaussian *out)
{
    const trip_file_gaussian_header *h = &p->set->set->header;
    const uint64_t number = trip_gaussian_entry_number(bytes), last = h->palette_count - 1;
    trip_gaussian_decode_entry(p->set->set->palette + (number < last ? number : last) *
                                                          trip_gaussian_entry_bytes((int)h->degree),
                               p->degree, out->sh);
}

static void decode(const part *p, size_t i, trip_gaussian *out)
{
    const trip_file_gaussian_header *h = &p->set->set->header;
    const unsigned char *record = p->planes[0] + i * TRIP_GAUSSIAN_RECORD_BYTES;
    unsigned char harmonics[64], *to = harmonics;
    const bool palette = p->set->set->palette != NULL;
    const unsigned count = trip_gaussian_plane_count(h, p->degree);
    for (unsigned n = 1; n < count; n++) {
        const size_t bytes = trip_gaussian_plane_bytes(h, n);
        memcpy(to, p->planes[n] + i * bytes, bytes);
        to += bytes;
    }
    trip_gaussian_decode(p->from, record, harmonics, palette ? 0 : p->degree, out);
    if (palette && p->degree > 0)
        decode_palette(p, harmonics, out);
}

/* Gets a surfel of the batch: decoded, with the share of its level, and placed. */
static uint32_t get_surfel(const void *context, size_t i, trip_gaussian *out)
{
    const trip_surfel_frame *f = context;
    const part *p = f->parts;
    size_t begin = 0;
    for (; i >= p->end; p++)
        begin = p->end;
    decode(p, i - begin, out);
    out->merged = p->brick->is_coarse;
    out->hyperline = (p->set->set->header.flags & TRIP_GAUSSIAN_HYPERLINES) != 0;
    if (p->brick->share < 1)
        out->opacity = 1 - powf(1 - fminf(out->opacity, 0.99f), p->brick->share);
    trip_gaussian_change_apply(&p->set->change, out);
    trip_gaussian_transform_apply(&p->set->placement, p->degree, out);
    return p->brick->first + (uint32_t)(i - begin);
}

/* ---- drawing ---- */

static int draw_in_reference(trip_surfel_frame *f, size_t count)
{
    int status = 0;
    for (size_t i = 0; i < count && !status; i++) {
        trip_gaussian surfel;
        const uint32_t number = get_surfel(f, i, &surfel);
        status = trip_surfels_reference_add(f->reference, &surfel, 1, number);
        if (!status && i % 64 == 63)
            status = trip_frame_poll();
    }
    return status;
}

static int draw_batch(trip_surfel_frame *f)
{
    size_t count;
    int status = read_batch(f, &count);
    const double begun = trip_now_ms();
    if (!status)
        status = !f->cpu       ? draw_in_reference(f, count)
                 : f->blending ? trip_surfels_cpu_blend_from(f->cpu, get_surfel, f, count)
                               : trip_surfels_cpu_add_from(f->cpu, get_surfel, f, count);
    *(f->blending ? &f->stats.blend_ms : &f->stats.project_ms) += trip_now_ms() - begun;
    const double planned = (double)f->stats.planned;
    f->stats.done =
        planned > 0 ? (double)(f->stats.read + f->stats.unread + f->stats.away) / planned : 1;
    return status;
}

int trip_surfel_frame_step(trip_surfel_frame *f, uint64_t deadline_ns)
{
    int status = trip_frame_poll();
    while (!status && f->next < f->plan.count) {
        status = draw_batch(f);
        if (!status && f->params.unselected && !f->blending && f->next == f->plan.count) {
            f->blending = true;
            f->next = 0;
        }
        if (!status)
            status = trip_frame_poll();
        if (!status && f->next < f->plan.count && trip_now_ns() >= deadline_ns)
            return TRIP_FRAME_MORE;
    }
    return status ? status : TRIP_FRAME_DONE;
}

/* ---- results ---- */

typedef struct marking {
    trip_surfel_plan *plan;
    size_t last; /* the brick that was marked last */
} marking;

static bool holds(const trip_surfel_plan *plan, size_t i, uint32_t number)
{
    return plan->bricks[i].first <= number &&
           (i + 1 == plan->count || number < plan->bricks[i + 1].first);
}

static void mark_brick(void *context, uint32_t number)
{
    marking *m = context;
    size_t lo = 0, hi = m->plan->count;
    if (!holds(m->plan, m->last, number)) {
        while (hi - lo > 1) {
            const size_t middle = lo + (hi - lo) / 2;
            if (m->plan->bricks[middle].first <= number)
                lo = middle;
            else
                hi = middle;
        }
        m->last = lo;
    }
    m->plan->bricks[m->last].is_visible = true;
}

/* Keeps the visible bricks for the next picture. */
static void keep_history(trip_surfel_frame *f)
{
    marking m = { &f->plan, 0 };
    if (!f->params.history || !f->cpu || f->kept || f->next < f->plan.count || !f->plan.count)
        return;
    trip_surfels_cpu_each_visible(f->cpu, mark_brick, &m);
    trip_surfel_plan_keep_visible(&f->plan, f->params.history, f->params.budget);
    f->kept = true;
}

int trip_surfel_frame_picture(trip_surfel_frame *f, float *rgba, float *depth)
{
    const double begun = trip_now_ms();
    int status = 0;
    if (f->cpu)
        status = trip_surfels_cpu_picture(f->cpu, rgba, depth);
    else
        trip_surfels_reference_picture(f->reference, rgba, f->params.settings.depth ? depth : NULL);
    if (!status)
        keep_history(f);
    f->stats.blend_ms += trip_now_ms() - begun;
    return status;
}

trip_surfel_frame_stats trip_surfel_frame_get_stats(const trip_surfel_frame *f)
{
    trip_surfel_frame_stats stats = f->stats;
    if (f->cpu) {
        const trip_surfels_cpu_stats cpu = trip_surfels_cpu_get_stats(f->cpu);
        stats.outside = cpu.outside;
        stats.hidden = cpu.hidden;
        stats.visible = cpu.visible;
    }
    return stats;
}
