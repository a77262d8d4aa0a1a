#include "gaussian_stream.h"

#include "gaussian_code.h"
#include "key_sort.h"
#include "report.h"

#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    READ_AHEAD = 16, /* bricks that the system is asked to read before their turn */
    CHUNK_KEYS = 15,
    NONE = -1,
    PREFETCH = 12, /* splats to be delivered, ahead of their turn */
};

/* A footprint reaches so far beyond its ellipsoid: 3.33 times the root of 0.3 square pixels. */
#define FOOTPRINT_PX (TRIP_GAUSSIAN_REACH * 0.5477225575051661)
#define CLAMP 1.3

/* A brick that will be read. */
typedef struct step {
    double lo, hi; /* bounds of the keys */
    uint64_t brick;
    float share; /* of the optical depth of its splats */
    bool is_coarse;
} step;

/* A splat in the window. The bytes of the record and of its coefficients follow. */
typedef struct slot {
    double key;
    uint32_t brick; /* index in the steps */
    uint32_t index; /* in the brick */
} slot;

/* Some of the slots that become final before the same step. A list of chunks holds them all. */
typedef struct chunk {
    int64_t next;
    uint64_t count;
    trip_key keys[CHUNK_KEYS];
} chunk;

/* The steps of a stream and the tables for sorting them. */
typedef struct steps {
    step *sorted; /* by ascending lo */
    uint64_t count;
    unsigned char *memory;
    size_t bytes;
} steps;

struct trip_gaussian_stream {
    const trip_gaussian_set *set;
    const trip_gaussian_list *list;
    trip_gaussian_stream_params params;
    trip_budget *budget;
    trip_gaussian_plan plan;
    trip_gaussian_progress progress;
    steps steps;
    int degree;
    unsigned plane_count;
    unsigned char *memory;
    size_t memory_bytes;
    unsigned char *slots;
    size_t slot_bytes;
    int64_t *firsts; /* firsts[i]: list of chunks of slots that are final before step i is read */
    chunk *chunks;
    int64_t *free_slots; /* free_count numbers; the last is used first */
    uint64_t free_count;
    int64_t free_chunk;        /* list */
    trip_key *ready, *scratch; /* the slots to deliver next, by key */
    size_t ready_count, ready_next;
    unsigned char *planes[TRIP_GAUSSIAN_PLANES]; /* the bytes of a brick */
    uint64_t next;                               /* step to read */
    bool collected; /* the slots that are final before the next step have become ready */
    bool failed;
};

double trip_gaussian_key_of(const trip_gaussian_key *key, const double centre[3])
{
    return key->direction[0] * centre[0] + key->direction[1] * centre[1] +
           key->direction[2] * centre[2] + key->offset;
}

/* Returns the key of the corner of a box with the least key, or with the greatest. Rounding is
 * monotonic, so no centre in the box has a lesser or greater key. */
static double corner_key(const trip_gaussian_key *key, const trip_file_gaussian_brick *b,
                         bool greatest)
{
    double corner[3];
    for (int a = 0; a < 3; a++)
        corner[a] = (key->direction[a] > 0) == greatest ? b->centre_hi[a] : b->centre_lo[a];
    return trip_gaussian_key_of(key, corner);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* A half picture grows by the pixels that a footprint gains. The reach grows by the Jacobian's
 * row: f / z * (1, 0, -x / z), with x / z clamped. */
static void set_side(const trip_gaussian_view *v, const double axis[3], double sign, double half,
                     unsigned px, trip_gaussian_plane *plane)
{
    const double wide = half * (1 + 2 * (FOOTPRINT_PX + 1) / px);
    for (int a = 0; a < 3; a++)
        plane->normal[a] = sign * axis[a] + (v->parallel ? 0 : wide * v->forward[a]);
    plane->offset = (v->parallel ? wide : 0) - dot(plane->normal, v->eye);
    plane->reach = v->parallel ? 1 : sqrt(1 + CLAMP * half * CLAMP * half);
    plane->reach *= 1 + 1e-6;
}

void trip_gaussian_view_planes(const trip_gaussian_view *view,
                               trip_gaussian_plane planes[TRIP_GAUSSIAN_SIDES])
{
    set_side(view, view->right, 1, view->half_width, view->width_px, &planes[0]);
    set_side(view, view->right, -1, view->half_width, view->width_px, &planes[1]);
    set_side(view, view->down, 1, view->half_height, view->height_px, &planes[2]);
    set_side(view, view->down, -1, view->half_height, view->height_px, &planes[3]);
}

static bool is_behind(const trip_gaussian_plane *p, const trip_file_gaussian_brick *b)
{
    const double radius = TRIP_GAUSSIAN_REACH * exp((double)b->log_hi) * (1 + 1e-6);
    const trip_gaussian_key key = { { p->normal[0], p->normal[1], p->normal[2] }, p->offset };
    return corner_key(&key, b, true) + p->reach * radius < 0;
}

/* Returns the keys of a brick's centres minus the keys of its splats. */
static double lead_of(const trip_gaussian_stream_params *p, const trip_file_gaussian_brick *b)
{
    return p->reach > 0
               ? p->reach * exp((double)b->log_hi) + fmax(0, corner_key(&p->spread, b, true))
               : 0;
}

static bool has_keys(const trip_gaussian_stream_params *p)
{
    return p->key_min != 0 || p->key_max != 0;
}

static bool is_wanted(const trip_gaussian_stream_params *p, const trip_file_gaussian_brick *b,
                      const step *s)
{
    if (has_keys(p) && (s->hi < p->key_min || s->lo > p->key_max))
        return false;
    for (unsigned i = 0; i < p->plane_count; i++)
        if (is_behind(&p->planes[i], b))
            return false;
    return true;
}

/* Returns the share of a node with nodes inside it. It is 0 if the voxels are too wide, and 1 if
 * they are narrower by a quarter of an octave. */
static double share_of(const trip_gaussian_lod *lod, const trip_file_gaussian_node *n)
{
    const double octaves = 0.25;
    double square = 0;
    if (!(lod->voxel_px > 0))
        return 0;
    for (int a = 0; a < 3; a++) {
        const double away = fmax(0, fmax(n->lo[a] - lod->eye[a], lod->eye[a] - n->hi[a]));
        square += away * away;
    }
    const double width = n->width * lod->px / (lod->parallel ? 1 : sqrt(square));
    return width < lod->voxel_px ? fmin(1, log2(lod->voxel_px / width) / octaves) : 0;
}

bool trip_gaussian_walk_next(const trip_gaussian_set *set, const trip_gaussian_lod *lod,
                             trip_gaussian_walk *walk)
{
    while (walk->next < set->header.node_count) {
        const trip_file_gaussian_node *n = &set->nodes[walk->next];
        const double rest = walk->next < walk->end ? walk->rest : 1;
        const double share = n->nodes > 1 ? share_of(lod, n) : 1;
        walk->node = walk->next;
        walk->next += share < 1 && rest == 1 ? 1 : share > 0 ? n->nodes : 1;
        walk->share = rest < 1 ? rest : share;
        if (!(share > 0))
            continue;
        if (share < 1 && rest == 1) {
            walk->end = walk->node + n->nodes;
            walk->rest = 1 - share;
        }
        return true;
    }
    return false;
}

/* Adds the bricks of a node that are wanted. */
static void add_node(steps *s, step *found, trip_key *keys, const trip_gaussian_set *set,
                     const trip_gaussian_stream_params *p, const trip_gaussian_walk *walk)
{
    const trip_file_gaussian_node *n = &set->nodes[walk->node];
    const uint64_t first = n->first_brick[p->axis];
    for (uint64_t i = first; i < first + n->brick_count[p->axis]; i++) {
        const trip_file_gaussian_brick *b = &set->lists[p->axis].bricks[i];
        const double lead = lead_of(p, b);
        const step here = { corner_key(&p->key, b, false) - lead,
                            corner_key(&p->key, b, true) - lead, i, (float)walk->share,
                            n->nodes > 1 };
        if (!is_wanted(p, b, &here))
            continue;
        keys[s->count] = (trip_key){ trip_key_of(here.lo), s->count };
        found[s->count++] = here;
    }
}

/* Finds the bricks to read and sorts them by their least keys. */
static int make_steps(steps *s, const trip_gaussian_set *set, const trip_gaussian_stream_params *p,
                      trip_budget *budget)
{
    const trip_gaussian_list *list = &set->lists[p->axis];
    const uint64_t room = list->brick_count;
    s->count = 0;
    s->bytes = room * (2 * sizeof *s->sorted + 2 * sizeof(trip_key));
    s->memory = trip_budget_take(budget, s->bytes);
    if (!s->memory)
        return trip_fail(TRIP_ERROR, "read", set->path,
                         "no memory for the order of its %llu bricks; raise --memory",
                         (unsigned long long)room);
    s->sorted = (void *)s->memory;
    step *found = s->sorted + room;
    trip_key *keys = (void *)(found + room), *scratch = keys + room;
    trip_gaussian_walk walk = { 0 };
    while (trip_gaussian_walk_next(set, &p->lod, &walk))
        add_node(s, found, keys, set, p, &walk);
    trip_key_sort(keys, scratch, s->count);
    for (uint64_t i = 0; i < s->count; i++)
        s->sorted[i] = found[keys[i].number];
    return TRIP_OK;
}

static void free_steps(steps *s, trip_budget *budget)
{
    trip_budget_release(budget, s->memory, s->bytes);
}

static size_t slot_size(const trip_file_gaussian_header *h, int degree)
{
    size_t bytes = sizeof(slot);
    for (unsigned n = 0; n < trip_gaussian_plane_count(h, degree); n++)
        bytes += trip_gaussian_plane_bytes(h, n);
    return (bytes + 7) & ~(size_t)7;
}

static int degree_of(const trip_gaussian_set *set, const trip_gaussian_stream_params *p)
{
    const int most = (int)set->header.degree;
    return p->degree < 0 ? 0 : p->degree < most ? p->degree : most;
}

static size_t planes_size(const trip_file_gaussian_header *h, int degree)
{
    size_t bytes = 0;
    for (unsigned n = 0; n < trip_gaussian_plane_count(h, degree); n++)
        bytes += (size_t)TRIP_GAUSSIAN_BRICK_RECORDS_MAX * trip_gaussian_plane_bytes(h, n);
    return bytes;
}

/* Returns the greatest number of splats in the window. A brick may have splats in it until a brick
 * is read with a least key above its own greatest key. Bricks leave in the order of their greatest
 * keys. */
static uint64_t window_of(const steps *s, const trip_gaussian_list *list)
{
    uint64_t held = 0, most = 0, gone = 0;
    trip_key *leaving = (void *)(s->sorted + 2 * list->brick_count);
    trip_key *scratch = leaving + list->brick_count;
    for (uint64_t i = 0; i < s->count; i++)
        leaving[i] = (trip_key){ trip_key_of(s->sorted[i].hi), i };
    trip_key_sort(leaving, scratch, s->count);
    for (uint64_t i = 0; i < s->count; i++) {
        const uint64_t lo = trip_key_of(s->sorted[i].lo);
        for (; leaving[gone].key < lo; gone++)
            held -= list->bricks[s->sorted[leaving[gone].number].brick].records;
        held += list->bricks[s->sorted[i].brick].records;
        most = held > most ? held : most;
    }
    return most;
}

/* Returns the greatest number of splats that meet a plane while it makes a step. */
static uint64_t held_of(const steps *s, const trip_gaussian_list *list,
                        const trip_gaussian_stream_params *p)
{
    uint64_t held = 0, most = 0, gone = 0;
    trip_key *leaving = (void *)(s->sorted + 2 * list->brick_count);
    trip_key *scratch = leaving + list->brick_count;
    for (uint64_t i = 0; i < s->count; i++) {
        const double lead = lead_of(p, &list->bricks[s->sorted[i].brick]);
        leaving[i] = (trip_key){ trip_key_of(s->sorted[i].hi + 2 * lead + p->hold), i };
    }
    trip_key_sort(leaving, scratch, s->count);
    for (uint64_t i = 0; i < s->count; i++) {
        const uint64_t lo = trip_key_of(s->sorted[i].lo);
        for (; leaving[gone].key < lo; gone++)
            held -= list->bricks[s->sorted[leaving[gone].number].brick].records;
        held += list->bricks[s->sorted[i].brick].records;
        most = held > most ? held : most;
    }
    return most;
}

/* Each step may have a chunk that is not full. */
static uint64_t chunk_count(uint64_t bricks, uint64_t window)
{
    return window / CHUNK_KEYS + bricks + 1;
}

/* Returns the memory beside the steps. */
static size_t memory_of(const trip_file_gaussian_header *h, const steps *s, uint64_t window,
                        int degree)
{
    return window * (slot_size(h, degree) + 2 * sizeof(trip_key) + sizeof(int64_t)) +
           chunk_count(s->count, window) * sizeof(chunk) + (s->count + 1) * sizeof(int64_t) +
           planes_size(h, degree);
}

/* The budget counts whole pages of memory. */
static uint64_t whole_pages(uint64_t bytes)
{
    return (bytes + 4095) / 4096 * 4096;
}

static trip_gaussian_plan plan_of(const steps *s, const trip_gaussian_set *set,
                                  const trip_gaussian_stream_params *p)
{
    const trip_file_gaussian_header *h = &set->header;
    const trip_gaussian_list *list = &set->lists[p->axis];
    const int degree = degree_of(set, p);
    trip_gaussian_plan plan = { .bricks = s->count,
                                .window_records = window_of(s, list),
                                .held_records = p->reach > 0 ? held_of(s, list, p) : 0 };
    for (uint64_t i = 0; i < s->count; i++) {
        const uint32_t records = list->bricks[s->sorted[i].brick].records;
        plan.records += records;
        plan.coarse_records += s->sorted[i].is_coarse ? records : 0;
    }
    for (unsigned n = 0; n < trip_gaussian_plane_count(h, degree); n++)
        plan.read_bytes += plan.records * trip_gaussian_plane_bytes(h, n);
    plan.bytes = whole_pages(s->bytes) + whole_pages(memory_of(h, s, plan.window_records, degree));
    return plan;
}

int trip_gaussian_stream_plan(const trip_gaussian_set *set,
                              const trip_gaussian_stream_params *params, trip_budget *budget,
                              trip_gaussian_plan *plan)
{
    steps s;
    const int status = make_steps(&s, set, params, budget);
    if (status == TRIP_OK)
        *plan = plan_of(&s, set, params);
    free_steps(&s, budget);
    return status;
}

static slot *slot_at(const trip_gaussian_stream *s, int64_t i)
{
    return (void *)(s->slots + (size_t)i * s->slot_bytes);
}

static void release_slot(trip_gaussian_stream *s, int64_t i)
{
    s->free_slots[s->free_count++] = i;
}

static void release_chunk(trip_gaussian_stream *s, int64_t i)
{
    s->chunks[i].next = s->free_chunk;
    s->free_chunk = i;
}

/* Divides the memory. */
static void set_memory(trip_gaussian_stream *s)
{
    const uint64_t window = s->plan.window_records;
    const uint64_t chunks = chunk_count(s->steps.count, window);
    s->chunks = (void *)s->memory;
    s->ready = (void *)(s->chunks + chunks);
    s->scratch = s->ready + window;
    s->firsts = (void *)(s->scratch + window);
    s->free_slots = s->firsts + s->steps.count + 1;
    s->slots = (void *)(s->free_slots + window);
    s->planes[0] = s->slots + window * s->slot_bytes;
    for (unsigned n = 1; n < s->plane_count; n++)
        s->planes[n] = s->planes[n - 1] + (size_t)TRIP_GAUSSIAN_BRICK_RECORDS_MAX *
                                              trip_gaussian_plane_bytes(&s->set->header, n - 1);
    for (uint64_t i = 0; i <= s->steps.count; i++)
        s->firsts[i] = NONE;
    s->free_chunk = NONE;
    for (uint64_t i = window; i > 0; i--)
        release_slot(s, (int64_t)i - 1);
    for (uint64_t i = chunks; i > 0; i--)
        release_chunk(s, (int64_t)i - 1);
}

static bool is_needed(const trip_gaussian_stream *s, const trip_file_gaussian_brick *b)
{
    const trip_gaussian_need *need = &s->params.need;
    return !need->is_needed || need->is_needed(need->context, b->centre_lo, b->centre_hi,
                                               exp((double)b->log_hi) * (1 + 1e-6));
}

/* Asks the system to read a brick soon. */
static void read_ahead(const trip_gaussian_stream *s, uint64_t i)
{
    if (i >= s->steps.count)
        return;
    const trip_file_gaussian_brick *b = &s->list->bricks[s->steps.sorted[i].brick];
    if (!is_needed(s, b))
        return;
    for (unsigned n = 0; n < s->plane_count; n++) {
        const off_t record = (off_t)trip_gaussian_plane_bytes(&s->set->header, n);
        posix_fadvise(s->list->fd[n], (off_t)b->first_record * record, (off_t)b->records * record,
                      POSIX_FADV_WILLNEED);
    }
}

static int take_memory(trip_gaussian_stream *s)
{
    char needed[32], left[32];
    s->memory_bytes = memory_of(&s->set->header, &s->steps, s->plan.window_records, s->degree);
    s->memory = trip_budget_take(s->budget, s->memory_bytes);
    if (s->memory)
        return TRIP_OK;
    return trip_fail(TRIP_ERROR, "read", s->set->path,
                     "this view needs %s for the %llu Gaussians whose order is open at a time, and "
                     "--memory leaves %s: raise --memory",
                     trip_format_bytes(s->memory_bytes, needed),
                     (unsigned long long)s->plan.window_records,
                     trip_format_bytes(trip_budget_left_bytes(s->budget), left));
}

int trip_gaussian_stream_open(trip_gaussian_stream **out, const trip_gaussian_set *set,
                              const trip_gaussian_stream_params *params, trip_budget *budget)
{
    trip_gaussian_stream *s = *out = calloc(1, sizeof *s);
    if (!s)
        return trip_fail(TRIP_ERROR, "read", set->path, "out of memory");
    s->set = set;
    s->list = &set->lists[params->axis];
    s->params = *params;
    s->params.planes = NULL; /* they may not outlive this call */
    s->budget = budget;
    s->degree = degree_of(set, params);
    s->slot_bytes = slot_size(&set->header, s->degree);
    s->plane_count = trip_gaussian_plane_count(&set->header, s->degree);
    int status = make_steps(&s->steps, set, params, budget);
    if (status == TRIP_OK) {
        s->plan = plan_of(&s->steps, set, params);
        status = take_memory(s);
    }
    if (status < 0) {
        trip_gaussian_stream_close(s);
        *out = NULL;
        return status;
    }
    set_memory(s);
    for (uint64_t i = 0; i < READ_AHEAD; i++)
        read_ahead(s, i);
    return TRIP_OK;
}

const trip_gaussian_plan *trip_gaussian_stream_planned(const trip_gaussian_stream *s)
{
    return &s->plan;
}

trip_gaussian_progress trip_gaussian_stream_progress(const trip_gaussian_stream *s)
{
    return s->progress;
}

void trip_gaussian_stream_close(trip_gaussian_stream *s)
{
    if (!s)
        return;
    trip_budget_release(s->budget, s->memory, s->memory_bytes);
    free_steps(&s->steps, s->budget);
    free(s);
}

/* Returns the first step behind step i with a least key above `key`, or the number of steps. */
static uint64_t final_before(const trip_gaussian_stream *s, uint64_t i, double key)
{
    uint64_t lo = i + 1, hi = s->steps.count;
    while (lo < hi) {
        const uint64_t middle = lo + (hi - lo) / 2;
        if (s->steps.sorted[middle].lo > key)
            hi = middle;
        else
            lo = middle + 1;
    }
    return lo;
}

/* Adds a slot to the list of a step. */
static void add_key(trip_gaussian_stream *s, int64_t *first, trip_key key)
{
    if (*first == NONE || s->chunks[*first].count == CHUNK_KEYS) {
        const int64_t fresh = s->free_chunk;
        s->free_chunk = s->chunks[fresh].next;
        s->chunks[fresh].next = *first;
        s->chunks[fresh].count = 0;
        *first = fresh;
    }
    chunk *c = &s->chunks[*first];
    c->keys[c->count++] = key;
}

static void put(trip_gaussian_stream *s, uint64_t i, uint32_t index, double key)
{
    const int64_t at = s->free_slots[--s->free_count];
    slot *to = slot_at(s, at);
    unsigned char *bytes = (unsigned char *)(to + 1);
    *to = (slot){ .key = key, .brick = (uint32_t)i, .index = index };
    memcpy(bytes, s->planes[0] + (size_t)index * TRIP_GAUSSIAN_RECORD_BYTES,
           TRIP_GAUSSIAN_RECORD_BYTES);
    bytes += TRIP_GAUSSIAN_RECORD_BYTES;
    for (unsigned n = 1; n < s->plane_count; n++) {
        const size_t record = trip_gaussian_plane_bytes(&s->set->header, n);
        memcpy(bytes, s->planes[n] + index * record, record);
        bytes += record;
    }
    add_key(s, &s->firsts[final_before(s, i, key)], (trip_key){ trip_key_of(key), (uint64_t)at });
}

static int read_step(trip_gaussian_stream *s, uint64_t i)
{
    const uint64_t brick = s->steps.sorted[i].brick;
    const trip_file_gaussian_brick *b = &s->list->bricks[brick];
    const double lead = lead_of(&s->params, b);
    int status = TRIP_OK;
    read_ahead(s, i + READ_AHEAD);
    if (!is_needed(s, b)) {
        s->progress.unneeded_records += b->records;
        return TRIP_OK;
    }
    for (unsigned n = 0; n < s->plane_count && status == TRIP_OK; n++) {
        status = trip_gaussian_set_read(s->set, s->params.axis, brick, n, s->planes[n]);
        s->progress.bytes += (uint64_t)b->records * trip_gaussian_plane_bytes(&s->set->header, n);
    }
    s->progress.bricks++;
    s->progress.records += b->records;
    for (uint32_t j = 0; j < b->records && status == TRIP_OK; j++) {
        double centre[3];
        trip_gaussian_decode_centre(b, s->planes[0] + (size_t)j * TRIP_GAUSSIAN_RECORD_BYTES,
                                    centre);
        const double key = trip_gaussian_key_of(&s->params.key, centre) - lead;
        if (!has_keys(&s->params) || (key >= s->params.key_min && key <= s->params.key_max))
            put(s, i, j, key);
    }
    return status;
}

static uint64_t position(const trip_gaussian_stream *s, uint64_t slot_number)
{
    const slot *at = slot_at(s, (int64_t)slot_number);
    return s->list->bricks[s->steps.sorted[at->brick].brick].first_record + at->index;
}

/* Sorts splats with equal keys by their position in the list. */
static void sort_equal(trip_gaussian_stream *s)
{
    for (size_t i = 0, end; i < s->ready_count; i = end) {
        for (end = i + 1; end < s->ready_count && s->ready[end].key == s->ready[i].key;)
            end++;
        if (end - i < 2)
            continue;
        for (size_t j = i; j < end; j++)
            s->ready[j].key = position(s, s->ready[j].number);
        trip_key_sort(s->ready + i, s->scratch, end - i);
    }
}

/* Makes the splats ready that are final before step i is read. */
static void collect(trip_gaussian_stream *s, uint64_t i)
{
    s->ready_count = s->ready_next = 0;
    for (int64_t at = s->firsts[i], next; at != NONE; at = next) {
        const chunk *c = &s->chunks[at];
        memcpy(s->ready + s->ready_count, c->keys, c->count * sizeof *c->keys);
        s->ready_count += c->count;
        next = c->next;
        release_chunk(s, at);
    }
    trip_key_sort(s->ready, s->scratch, s->ready_count);
    sort_equal(s);
}

/* Makes splats ready, unless the stream is at its end. */
static int advance(trip_gaussian_stream *s)
{
    s->ready_count = s->ready_next = 0;
    for (;;) {
        if (!s->collected)
            collect(s, s->next);
        s->collected = true;
        if (s->ready_count > s->ready_next || s->next == s->steps.count)
            return TRIP_OK;
        const int status = trip_interrupted()
                               ? trip_fail(TRIP_INTERRUPTED, "read", s->set->path, "interrupted")
                               : read_step(s, s->next);
        if (status < 0)
            return status;
        s->next++;
        s->collected = false;
    }
}

/* Returns the entry of the palette for two bytes of a record. A number above the palette's can only
 * come from a writer that is wrong; it has the last entry. */
static const unsigned char *entry_of(const trip_gaussian_stream *s, const unsigned char *bytes)
{
    const trip_file_gaussian_header *h = &s->set->header;
    const uint64_t number = trip_gaussian_entry_number(bytes), last = h->palette_count - 1;
    return s->set->palette +
           (number < last ? number : last) * trip_gaussian_entry_bytes((int)h->degree);
}

static void deliver(trip_gaussian_stream *s, trip_gaussian *out, double *key)
{
    const int64_t at = (int64_t)s->ready[s->ready_next++].number;
    if (s->ready_next + PREFETCH < s->ready_count)
        __builtin_prefetch(slot_at(s, (int64_t)s->ready[s->ready_next + PREFETCH].number));
    const slot *from = slot_at(s, at);
    const unsigned char *record = (const unsigned char *)(from + 1);
    const unsigned char *harmonics = record + TRIP_GAUSSIAN_RECORD_BYTES;
    const bool palette = s->set->palette != NULL;
    trip_gaussian_decode(&s->list->bricks[s->steps.sorted[from->brick].brick], record, harmonics,
                         palette ? 0 : s->degree, out);
    if (palette && s->degree > 0)
        trip_gaussian_decode_entry(entry_of(s, harmonics), s->degree, out->sh);
    const step *of = &s->steps.sorted[from->brick];
    out->merged = of->is_coarse;
    if (of->share < 1)
        out->opacity = 1 - powf(1 - fminf(out->opacity, 0.99f), of->share);
    if (key)
        *key = from->key;
    release_slot(s, at);
}

int trip_gaussian_stream_next(trip_gaussian_stream *s, trip_gaussian *out, double *keys,
                              size_t room, size_t *got)
{
    *got = 0;
    if (s->failed)
        return TRIP_ERROR;
    while (*got < room) {
        if (s->ready_next == s->ready_count) {
            const int status = advance(s);
            s->failed = status < 0;
            if (status < 0)
                return status;
            if (s->ready_next == s->ready_count)
                return TRIP_OK;
        }
        deliver(s, &out[*got], keys ? &keys[*got] : NULL);
        ++*got;
    }
    return TRIP_OK;
}
