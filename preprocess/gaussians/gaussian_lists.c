#include "gaussian_lists.h"

#include <string.h>

#include "clones.h"
#include "gaussian_code.h"
#include "gaussian_piece.h"
#include "gaussian_sort.h"
#include "report.h"

enum {
    ITEMS_OF_WORKER = 4,
    MEMORY_PART = 2,
    ROOM_MIN = 2048,
    CLASS_0 = 128, /* the index of class 0 */
};

/* A piece, its brick, and its first splat in the order of the list. */
typedef struct listed {
    trip_gaussian_piece piece;
    uint64_t first;
    bool divided; /* by a gap: the owner encodes it */
    trip_file_gaussian_brick brick;
} listed;

/* A node in memory. */
typedef struct item {
    trip_listed_node node;
    unsigned char *rows, *codes[3];
    trip_key *keys, *scratch;
    uint32_t *classes; /* of the rows: number of the joined class in a node's groups */
    const unsigned char **splats[3], **others;
    listed *pieces[3];
    uint64_t piece_count[3];
} item;

struct trip_gaussian_lists {
    trip_gaussian_lists_params p;
    trip_budget *budget;
    size_t stride, code_bytes, bytes; /* of a spilled splat, of its codes, of all memory */
    uint64_t room, pieces;            /* of an item: splats, and pieces of a list */
    unsigned half;                    /* items that a loop does at most */
    unsigned filling, filled;         /* first item of the half that is filled, and its items */
    unsigned running;                 /* items of the loop; 0: no loop runs */
    item *loop;                       /* first item of it */
    bool overlaps;                    /* a loop runs while the other half is filled */
    item items[];
};

static size_t up8(size_t bytes)
{
    return (bytes + 7) & ~(size_t)7;
}

/* Each group of a node has a leaf more than its splats fill, and a leaf a piece more. */
static uint64_t most_pieces(const trip_gaussian_lists_params *p, uint64_t room)
{
    return room / TRIP_GAUSSIAN_BRICK_AIM + room / TRIP_GAUSSIAN_BRICK_RECORDS_MAX + p->class_count;
}

static size_t item_bytes(const trip_gaussian_lists *l, uint64_t room)
{
    const size_t each = l->stride + 2 * sizeof(trip_key) + 4 * sizeof(unsigned char *) +
                        sizeof(uint32_t) + 3 * l->code_bytes;
    return room * each + 64 + 3 * most_pieces(&l->p, room) * sizeof(listed) + sizeof(item);
}

/* Divides one block of memory into the tables of an item. */
static void set_item(const trip_gaussian_lists *l, item *n, unsigned char *at)
{
    const uint64_t count = l->room;
    n->keys = (void *)at;
    n->scratch = n->keys + count;
    n->others = (void *)(n->scratch + count);
    n->splats[0] = n->others + count;
    n->splats[1] = n->splats[0] + count;
    n->splats[2] = n->splats[1] + count;
    n->pieces[0] = (void *)(n->splats[2] + count);
    n->pieces[1] = n->pieces[0] + l->pieces;
    n->pieces[2] = n->pieces[1] + l->pieces;
    n->rows = (void *)(n->pieces[2] + l->pieces);
    n->classes = (void *)(n->rows + count * l->stride);
    n->codes[0] = (unsigned char *)n->classes + up8(count * sizeof *n->classes);
    n->codes[1] = n->codes[0] + up8(count * l->code_bytes);
    n->codes[2] = n->codes[1] + up8(count * l->code_bytes);
}

bool trip_gaussian_lists_begin(trip_gaussian_lists **out, const trip_gaussian_lists_params *params,
                               uint64_t wanted, trip_budget *budget)
{
    trip_gaussian_lists sizes = {
        .p = *params,
        .stride = trip_spilled_bytes(params->degree),
        .code_bytes =
            trip_gaussian_writer_codes_bytes(params->writer) / TRIP_GAUSSIAN_BRICK_RECORDS_MAX,
        .room = wanted,
    };
    const uint64_t left = trip_budget_left_bytes(budget) / MEMORY_PART;
    const uint64_t most = 2 * ITEMS_OF_WORKER * (uint64_t)trip_workers_count(params->workers);
    *out = NULL;
    while (sizes.room > ROOM_MIN && item_bytes(&sizes, sizes.room) > left)
        sizes.room = sizes.room / 2 < ROOM_MIN ? ROOM_MIN : sizes.room / 2;
    if (item_bytes(&sizes, sizes.room) > left)
        return false;
    const size_t own = up8(item_bytes(&sizes, sizes.room));
    uint64_t count = left / own;
    count = count > most ? most : count < 1 ? 1 : count;
    sizes.overlaps = count > 1;
    sizes.half = (unsigned)(count > 1 ? count / 2 : 1);
    sizes.pieces = most_pieces(params, sizes.room);
    sizes.budget = budget;
    const unsigned all = sizes.overlaps ? 2 * sizes.half : 1;
    sizes.bytes = sizeof sizes + all * own;
    trip_gaussian_lists *l = *out = trip_budget_take(budget, sizes.bytes);
    if (!l)
        return false;
    memcpy(l, &sizes, sizeof sizes);
    for (unsigned i = 0; i < all; i++)
        set_item(l, &l->items[i], (unsigned char *)(l->items + all) + i * (own - sizeof(item)));
    return true;
}

uint64_t trip_gaussian_lists_room(const trip_gaussian_lists *l)
{
    return l ? l->room : 0;
}

void trip_gaussian_lists_free(trip_gaussian_lists *l)
{
    int status;
    if (!l)
        return;
    if (l->running)
        trip_workers_wait(l->p.workers, 0, &status);
    trip_budget_release(l->budget, l, l->bytes);
}

/* ---- the workers ---- */

static const trip_gaussian *splat_of(const trip_gaussian_lists *l, const item *n, uint64_t i)
{
    return (const void *)(n->rows + i * l->stride + sizeof(trip_spilled));
}

static void find_classes(const trip_gaussian_lists *l, const item *n)
{
    const uint8_t *joined = l->p.joined + n->node.node * l->p.class_count;
    for (uint64_t i = 0; i < n->node.count; i++)
        n->classes[i] = joined[trip_gaussian_size_class(splat_of(l, n, i)->deviations) + CLASS_0 -
                               l->p.class_lo] -
                        (unsigned)l->p.class_lo;
}

/* Sorts the splats of a leaf along the axis. They stand in the keys from `first` on. */
static void sort_leaf(const trip_gaussian_lists *l, const item *n, int axis, uint64_t first,
                      uint64_t count)
{
    trip_key *keys = n->keys + first;
    for (uint64_t i = 0; i < count; i++)
        keys[i].key = trip_key_of(splat_of(l, n, keys[i].number)->centre[axis]);
    trip_key_sort(keys, n->scratch, count);
    for (uint64_t i = 0; i < count; i++)
        n->splats[axis][first + i] = (const unsigned char *)splat_of(l, n, keys[i].number);
}

/* Divides the sorted splats of a leaf into pieces. */
static void add_pieces(const trip_gaussian_lists *l, item *n, int axis, uint64_t first,
                       uint64_t count)
{
    const uint64_t row = (uint64_t)(n->splats[axis][first] - n->rows) / l->stride;
    for (uint64_t end = first + count; first < end;) {
        listed *to = &n->pieces[axis][n->piece_count[axis]++];
        to->first = first;
        to->piece =
            (trip_gaussian_piece){ .axis = axis,
                                   .size_class = (int)n->classes[row] + l->p.class_lo - CLASS_0,
                                   .node = n->node.number,
                                   .count = trip_piece_count(end - first) };
        first += to->piece.count;
    }
}

static void sort_along(const trip_gaussian_lists *l, item *n, int axis)
{
    const trip_gaussian_tree *tree = &l->p.trees[axis];
    const uint64_t count = n->node.count, group = n->node.node * l->p.class_count;
    n->piece_count[axis] = 0;
    for (uint64_t i = 0; i < count; i++)
        n->keys[i] = (trip_key){
            trip_gaussian_tree_leaf(tree, splat_of(l, n, i)->centre, group + n->classes[i]), i
        };
    trip_key_sort(n->keys, n->scratch, count);
    for (uint64_t first = 0, end = 0; first < count; first = end) {
        const uint64_t leaf = n->keys[first].key;
        while (end < count && n->keys[end].key == leaf)
            end++;
        sort_leaf(l, n, axis, first, end - first);
        add_pieces(l, n, axis, first, end - first);
    }
}

static trip_piece_room room_of(const item *n)
{
    return (trip_piece_room){ n->keys, n->scratch, n->others };
}

static void encode_pieces(const trip_gaussian_lists *l, item *n, int axis)
{
    const trip_piece_room room = room_of(n);
    for (uint64_t i = 0; i < n->piece_count[axis]; i++) {
        listed *p = &n->pieces[axis][i];
        const unsigned char **splats = n->splats[axis] + p->first;
        p->divided = trip_piece_has_gap(&p->piece, splats, &room);
        if (!p->divided)
            trip_gaussian_writer_encode(l->p.writer, p->piece.size_class, splats, p->piece.count,
                                        &p->brick, n->codes[axis] + p->first * l->code_bytes);
    }
}

static int do_item(void *user, unsigned thread, uint64_t number)
{
    trip_gaussian_lists *l = user;
    item *n = &l->loop[number];
    (void)thread;
    const int status = trip_output_read(n->node.from, n->node.first * l->stride, n->rows,
                                        n->node.count * l->stride);
    if (status < 0)
        return status;
    find_classes(l, n);
    for (int axis = 0; axis < 3; axis++) {
        sort_along(l, n, axis);
        encode_pieces(l, n, axis);
    }
    return TRIP_OK;
}

/* ---- the owner ---- */

static int write_item(trip_gaussian_lists *l, const item *n)
{
    const trip_piece_room room = room_of(n);
    int status = TRIP_OK;
    for (int axis = 0; axis < 3; axis++)
        for (uint64_t i = 0; i < n->piece_count[axis] && status == TRIP_OK; i++) {
            const listed *p = &n->pieces[axis][i];
            unsigned char *codes = n->codes[axis] + p->first * l->code_bytes;
            status = p->divided ? trip_piece_write_divided(l->p.writer, &p->piece,
                                                           n->splats[axis] + p->first, &room, codes)
                                : trip_gaussian_writer_append(l->p.writer, axis, n->node.number,
                                                              &p->brick, codes);
        }
    return status;
}

static int end_loop(trip_gaussian_lists *l)
{
    const unsigned count = l->running;
    int status = TRIP_OK;
    if (!count)
        return TRIP_OK;
    l->running = 0;
    trip_workers_wait(l->p.workers, 0, &status);
    for (unsigned i = 0; i < count && status == TRIP_OK; i++)
        status = write_item(l, &l->loop[i]);
    return status;
}

/* Starts a loop with the filled items. If the halves overlap, it first waits for the loop before it
 * and writes that one's bricks while this one runs. */
static int start_loop(trip_gaussian_lists *l)
{
    const unsigned before = l->running;
    const item *done = l->loop;
    int status = TRIP_OK;
    if (before)
        trip_workers_wait(l->p.workers, 0, &status);
    l->running = 0;
    if (status == TRIP_OK && l->filled) {
        l->loop = &l->items[l->filling];
        l->running = l->filled;
        trip_workers_start(l->p.workers, do_item, l, l->running);
    }
    l->filled = 0;
    if (l->overlaps)
        l->filling = l->filling ? 0 : l->half;
    for (unsigned i = 0; i < before && status == TRIP_OK; i++)
        status = write_item(l, &done[i]);
    return l->overlaps || status < 0 ? status : end_loop(l);
}

int trip_gaussian_lists_add(trip_gaussian_lists *l, const trip_listed_node *node)
{
    l->items[l->filling + l->filled++].node = *node;
    return l->filled == l->half ? start_loop(l) : TRIP_OK;
}

int trip_gaussian_lists_finish(trip_gaussian_lists *l)
{
    const int status = l ? start_loop(l) : TRIP_OK;
    return l && status == TRIP_OK ? end_loop(l) : status;
}
