#include "point_tiles.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "folder.h"
#include "near_search.h"
#include "report.h"

/* Positions near a tile, at most, for the fast searches. */
enum { CANDIDATES_MAX = 4 * TRIP_POINT_TILE_MAX };

/* A tile of so many points ends at the border of an octant, one of twice as many at the border of
 * an octant of half the size. */
enum { TILE_SMALL = 1536, OCTANTS = 2, PLACE_BITS = 24, HALVINGS = 8, TILES_FIRST = 64 };

enum { FAN = 8, LEVELS_MAX = 24, SLOTS_MAX = 4096, SORTED_BYTES = 1 << 17, TELL_EVERY = 1 << 14 };

/* Candidates are this many times as far outside of a tile as neighbours are in it. */
#define MARGIN 3.5

typedef struct box {
    double lo[3], hi[3];
} box;

/* A tile in memory. */
typedef struct slot {
    uint64_t tile;
    uint64_t used; /* number of the last search that used it */
    unsigned users;
    bool filled, loading, planting; /* positions are there; they or the tree are being made */
    int status;
    uint32_t count;
    double (*positions)[3];
    trip_neighbour_tree *tree;
} slot;

enum { NEAR_MAX = 64 };

typedef struct near_tile {
    box box;
    uint64_t tile;
} near_tile;

/* Lists the tiles near a tile: the bounds of both are at most a distance apart. */
typedef struct near_tiles {
    bool known;
    uint64_t of;
    double distance2; /* below 0: too many tiles are near */
    unsigned count;
    near_tile tiles[NEAR_MAX];
} near_tiles;

struct trip_point_tiles {
    trip_point_tiles_params params;
    trip_budget *budget;
    trip_output rows; /* sorted */
    trip_point_tile *tiles;
    size_t tiles_bytes, tile_room;
    uint64_t tile_count;
    uint64_t leaf; /* of the last row, and its place in the leaf */
    uint32_t place;
    uint64_t passed;
    /* Boxes of FAN consecutive tiles, of FAN such boxes, and so on up to one box. */
    box *boxes;
    size_t boxes_bytes;
    uint64_t level_at[LEVELS_MAX], level_count[LEVELS_MAX];
    unsigned levels;
    /* Searches. The lock guards the slots and slot_of. */
    pthread_mutex_t lock;
    pthread_cond_t loaded;
    slot *slots;
    unsigned slot_count, threads;
    uint32_t *slot_of; /* 1 + the slot of a tile; 0: none */
    uint64_t searches;
    trip_point_row *rooms;   /* for the rows of a tile, one for each thread */
    near_tiles *near;        /* one for each thread */
    trip_near_search **fast; /* the same, and whether they hold a tile */
    bool *prepared;
};

static int fail_memory(const trip_point_tiles *t)
{
    return trip_fail(TRIP_ERROR, "brick", t->params.name,
                     "the search for neighbours needs more memory than --memory allows: raise "
                     "--memory");
}

/* ---- sorting ---- */

/* Takes room for twice as many tiles. */
static int add_room(trip_point_tiles *t)
{
    const size_t room = t->tile_room ? 2 * t->tile_room : TILES_FIRST;
    trip_point_tile *tiles = trip_budget_take(t->budget, room * sizeof *tiles);
    if (!tiles)
        return fail_memory(t);
    if (t->tiles) {
        memcpy(tiles, t->tiles, t->tile_count * sizeof *tiles);
        trip_budget_release(t->budget, t->tiles, t->tiles_bytes);
    }
    t->tiles = tiles;
    t->tile_room = room;
    t->tiles_bytes = room * sizeof *tiles;
    return 0;
}

static int begin_tile(trip_point_tiles *t, const trip_point_row *row)
{
    const int status = t->tile_count == t->tile_room ? add_room(t) : 0;
    if (status < 0)
        return status;
    trip_point_tile *tile = &t->tiles[t->tile_count++];
    *tile = (trip_point_tile){ .first = t->passed };
    memcpy(tile->lo, row->position, sizeof tile->lo);
    memcpy(tile->hi, row->position, sizeof tile->hi);
    return 0;
}

/* Whether a tile ends before a row. It lies in one leaf of the octree. It ends at the border of an
 * octant of the leaf if it is not small, and so on for smaller octants. */
static bool ends_before(const trip_point_tiles *t, uint64_t leaf, uint32_t place)
{
    const uint32_t count = t->tiles[t->tile_count - 1].count;
    if (leaf != t->leaf || count == TRIP_POINT_TILE_MAX)
        return true;
    for (unsigned depth = 1; depth <= OCTANTS; depth++)
        if (place >> (PLACE_BITS - 3 * depth) != t->place >> (PLACE_BITS - 3 * depth))
            return count >= (uint32_t)TILE_SMALL << (depth - 1);
    return false;
}

static int add_row(void *user, const unsigned char *spilled)
{
    trip_point_tiles *t = user;
    const trip_point_row *row = (const void *)spilled;
    const uint32_t place = (uint32_t)row->head.at;
    int status = 0;
    if (t->tile_count == 0 || ends_before(t, row->head.group, place))
        status = begin_tile(t, row);
    if (status < 0)
        return status;
    trip_point_tile *tile = &t->tiles[t->tile_count - 1];
    t->leaf = row->head.group;
    t->place = place;
    for (int a = 0; a < 3; a++) {
        const double at = row->position[a];
        tile->lo[a] = at < tile->lo[a] ? at : tile->lo[a];
        tile->hi[a] = at > tile->hi[a] ? at : tile->hi[a];
    }
    tile->count++;
    if (++t->passed % TELL_EVERY == 0 && t->params.progress)
        t->params.progress(t->params.user, t->passed);
    return trip_output_append(&t->rows, row, sizeof *row);
}

static void place_row(void *user, const trip_gaussian *row, trip_spilled *head)
{
    const trip_point_tiles *t = user;
    trip_octree_set_place(t->params.octree, row->centre, head);
}

static int sort(trip_point_tiles *t)
{
    const trip_point_tiles_params *p = &t->params;
    int status = trip_output_create(&t->rows,
                                    &(trip_output_params){ .folder = p->folder,
                                                           .name = TRIP_SPOOL_NAME,
                                                           .buffer_bytes = SORTED_BYTES,
                                                           .unnamed = true },
                                    t->budget);
    if (status == 0)
        status = add_room(t);
    if (status == 0)
        status = trip_gaussian_sort(&(trip_gaussian_sort_params){ .spool = p->spool,
                                                                  .closes = p->spool,
                                                                  .workers = p->workers,
                                                                  .records = p->records,
                                                                  .bytes = sizeof(trip_point_row),
                                                                  .place = place_row,
                                                                  .folder = p->folder,
                                                                  .path = p->name,
                                                                  .emit = add_row,
                                                                  .user = t },
                                    t->budget);
    return status == 0 ? trip_output_flush(&t->rows) : status;
}

/* ---- boxes ---- */

static void widen(box *b, const double lo[3], const double hi[3], bool first)
{
    for (int a = 0; a < 3; a++) {
        b->lo[a] = first ? lo[a] : fmin(b->lo[a], lo[a]);
        b->hi[a] = first ? hi[a] : fmax(b->hi[a], hi[a]);
    }
}

static int make_boxes(trip_point_tiles *t)
{
    uint64_t all = 0;
    for (uint64_t n = t->tile_count; t->levels == 0 || n > 1;) {
        n = (n + FAN - 1) / FAN;
        t->level_at[t->levels] = all;
        t->level_count[t->levels++] = n;
        all += n;
    }
    t->boxes_bytes = all * sizeof *t->boxes;
    t->boxes = trip_budget_take(t->budget, t->boxes_bytes);
    if (!t->boxes)
        return fail_memory(t);
    for (uint64_t i = 0; i < t->tile_count; i++)
        widen(&t->boxes[i / FAN], t->tiles[i].lo, t->tiles[i].hi, i % FAN == 0);
    for (unsigned l = 1; l < t->levels; l++)
        for (uint64_t i = 0; i < t->level_count[l - 1]; i++) {
            const box *below = &t->boxes[t->level_at[l - 1] + i];
            widen(&t->boxes[t->level_at[l] + i / FAN], below->lo, below->hi, i % FAN == 0);
        }
    return 0;
}

int trip_point_tiles_make(trip_point_tiles **out, const trip_point_tiles_params *params,
                          trip_budget *budget)
{
    trip_point_tiles *t = calloc(1, sizeof *t);
    *out = t;
    if (!t)
        return trip_fail(TRIP_ERROR, "brick", params->name, "out of memory");
    t->params = *params;
    t->budget = budget;
    t->rows.fd = -1;
    pthread_mutex_init(&t->lock, NULL);
    pthread_cond_init(&t->loaded, NULL);
    int status = sort(t);
    if (status == 0)
        status = make_boxes(t);
    if (status < 0) {
        trip_point_tiles_free(t);
        *out = NULL;
    }
    return status;
}

uint64_t trip_point_tiles_count(const trip_point_tiles *t)
{
    return t->tile_count;
}

const trip_point_tile *trip_point_tiles_at(const trip_point_tiles *t, uint64_t tile)
{
    return &t->tiles[tile];
}

int trip_point_tiles_read(const trip_point_tiles *t, uint64_t tile, trip_point_row *rows)
{
    const trip_point_tile *at = &t->tiles[tile];
    return trip_output_read(&t->rows, at->first * sizeof *rows, rows, at->count * sizeof *rows);
}

/* ---- tiles in memory ---- */

static const size_t room_bytes = TRIP_POINT_TILE_MAX * sizeof(trip_point_row);

static size_t positions_bytes(void)
{
    return TRIP_POINT_TILE_MAX * 3 * sizeof(double);
}

static size_t slot_bytes(void)
{
    return positions_bytes() + trip_neighbour_tree_bytes(TRIP_POINT_TILE_MAX) + sizeof(slot);
}

static int take_slots(trip_point_tiles *t, unsigned count)
{
    t->slots = calloc(count, sizeof *t->slots);
    t->slot_of = trip_budget_take(t->budget, t->tile_count * sizeof *t->slot_of);
    t->rooms = trip_budget_take(t->budget, t->threads * room_bytes);
    t->near = calloc(t->threads, sizeof *t->near);
    t->fast = calloc(t->threads, sizeof *t->fast);
    t->prepared = calloc(t->threads, sizeof *t->prepared);
    if (!t->slots || !t->slot_of || !t->rooms || !t->near || !t->fast || !t->prepared)
        return fail_memory(t);
    for (unsigned i = 0; i < t->threads; i++) {
        void *memory = trip_budget_take(t->budget, trip_near_search_bytes(CANDIDATES_MAX));
        if (!memory)
            return fail_memory(t);
        t->fast[i] = trip_near_search_make(memory, CANDIDATES_MAX);
    }
    for (; t->slot_count < count; t->slot_count++) {
        slot *s = &t->slots[t->slot_count];
        const size_t beside = slot_bytes() - positions_bytes();
        if (!trip_budget_charge(t->budget, beside))
            return fail_memory(t);
        s->positions = trip_budget_take(t->budget, positions_bytes());
        if (!s->positions) {
            trip_budget_discharge(t->budget, beside);
            return fail_memory(t);
        }
    }
    return 0;
}

int trip_point_tiles_begin_searches(trip_point_tiles *t, unsigned threads)
{
    const unsigned least = 2 * threads + 1; /* a thread uses one and loads another */
    const uint64_t wanted = trip_budget_left_bytes(t->budget) / 2 / slot_bytes();
    uint64_t count = t->tile_count < wanted ? t->tile_count : wanted;
    count = count < least ? least : count > SLOTS_MAX ? SLOTS_MAX : count;
    t->threads = threads;
    return take_slots(t, (unsigned)count);
}

/* Returns a slot that no thread uses, the one that was used longest ago. */
static slot *oldest(trip_point_tiles *t)
{
    slot *found = NULL;
    for (unsigned i = 0; i < t->slot_count; i++) {
        slot *s = &t->slots[i];
        if (!s->filled && !s->loading)
            return s;
        if (s->users == 0 && (!found || s->used < found->used))
            found = s;
    }
    return found;
}

static int load(trip_point_tiles *t, unsigned thread, slot *s)
{
    trip_point_row *rows = t->rooms + thread * TRIP_POINT_TILE_MAX;
    const int status = trip_point_tiles_read(t, s->tile, rows);
    if (status < 0)
        return status;
    s->count = t->tiles[s->tile].count;
    for (uint32_t i = 0; i < s->count; i++)
        memcpy(s->positions[i], rows[i].position, sizeof s->positions[i]);
    return 0;
}

/* Empties a slot for a tile. The lock is held. */
static slot *claim(trip_point_tiles *t, uint64_t tile)
{
    slot *s = oldest(t);
    if (s->filled)
        t->slot_of[s->tile] = 0;
    s->tile = tile;
    s->filled = false;
    s->loading = true;
    t->slot_of[tile] = (uint32_t)(s - t->slots) + 1;
    return s;
}

static void end_loading(trip_point_tiles *t, slot *s, int status)
{
    pthread_mutex_lock(&t->lock);
    s->status = status;
    s->loading = false;
    s->filled = true;
    pthread_cond_broadcast(&t->loaded);
    pthread_mutex_unlock(&t->lock);
}

/* Returns the slot of a tile, which stays until let_go(). */
static slot *hold(trip_point_tiles *t, unsigned thread, uint64_t tile)
{
    pthread_mutex_lock(&t->lock);
    const bool found = t->slot_of[tile] != 0;
    slot *s = found ? &t->slots[t->slot_of[tile] - 1] : claim(t, tile);
    s->users++;
    s->used = ++t->searches;
    while (found && s->loading)
        pthread_cond_wait(&t->loaded, &t->lock);
    pthread_mutex_unlock(&t->lock);
    if (!found) {
        trip_neighbour_tree_free(s->tree);
        s->tree = NULL;
        end_loading(t, s, load(t, thread, s));
    }
    return s;
}

/* Makes the tree of a slot that the thread holds, unless it is there. */
static int plant(trip_point_tiles *t, slot *s)
{
    pthread_mutex_lock(&t->lock);
    while (s->planting)
        pthread_cond_wait(&t->loaded, &t->lock);
    const bool wanted = !s->tree;
    s->planting = wanted;
    pthread_mutex_unlock(&t->lock);
    if (!wanted)
        return 0;
    trip_neighbour_tree *tree =
        trip_neighbour_tree_make((const double(*)[3])s->positions, s->count);
    pthread_mutex_lock(&t->lock);
    s->tree = tree;
    s->planting = false;
    pthread_cond_broadcast(&t->loaded);
    pthread_mutex_unlock(&t->lock);
    return tree ? 0 : trip_fail(TRIP_ERROR, "brick", t->params.name, "out of memory");
}

static void let_go(trip_point_tiles *t, slot *s)
{
    pthread_mutex_lock(&t->lock);
    s->users--;
    pthread_mutex_unlock(&t->lock);
}

static int search_tile(trip_point_tiles *t, unsigned thread, uint64_t tile, trip_neighbours *n)
{
    slot *s = hold(t, thread, tile);
    int status = s->status;
    if (status == 0)
        status = plant(t, s);
    if (status == 0)
        trip_neighbour_tree_search(s->tree, n);
    let_go(t, s);
    return status;
}

/* ---- searches ---- */

static double distance2(const double lo[3], const double hi[3], const double p[3])
{
    double sum = 0;
    for (int a = 0; a < 3; a++) {
        const double below = lo[a] - p[a], above = p[a] - hi[a];
        const double d = below > above ? below : above;
        sum += d > 0 ? d * d : 0;
    }
    return sum;
}

static double apart2(const double lo[3], const double hi[3], const trip_point_tile *tile)
{
    double sum = 0;
    for (int a = 0; a < 3; a++) {
        const double below = lo[a] - tile->hi[a], above = tile->lo[a] - hi[a];
        const double d = below > above ? below : above;
        sum += d > 0 ? d * d : 0;
    }
    return sum;
}

typedef struct child {
    uint64_t at;
    double distance2;
} child;

/* Lists the children of a box by distance. Children of level 0 are tiles. */
static unsigned list_children(const trip_point_tiles *t, unsigned level, uint64_t at,
                              const double p[3], child out[FAN])
{
    const uint64_t end = level ? t->level_count[level - 1] : t->tile_count;
    unsigned count = 0;
    for (uint64_t i = at * FAN; i < (at + 1) * FAN && i < end; i++) {
        const box *b = level ? &t->boxes[t->level_at[level - 1] + i] : NULL;
        const double d2 =
            b ? distance2(b->lo, b->hi, p) : distance2(t->tiles[i].lo, t->tiles[i].hi, p);
        unsigned to = count++;
        for (; to > 0 && out[to - 1].distance2 > d2; to--)
            out[to] = out[to - 1];
        out[to] = (child){ i, d2 };
    }
    return count;
}

/* Searches all tiles but `own` below a box. */
static int descend(trip_point_tiles *t, unsigned thread, unsigned level, uint64_t at, uint64_t own,
                   trip_neighbours *n)
{
    child children[FAN];
    const unsigned count = list_children(t, level, at, n->position, children);
    int status = 0;
    for (unsigned i = 0; i < count && status == 0; i++) {
        if (children[i].distance2 > trip_neighbours_reach2(n))
            return 0;
        if (level > 0)
            status = descend(t, thread, level - 1, children[i].at, own, n);
        else if (children[i].at != own)
            status = search_tile(t, thread, children[i].at, n);
    }
    return status;
}

/* Lists the tiles below a box that are near. Returns false if there are too many. */
static bool list_near(const trip_point_tiles *t, unsigned level, uint64_t at, near_tiles *near)
{
    const trip_point_tile *of = &t->tiles[near->of];
    const uint64_t end = level ? t->level_count[level - 1] : t->tile_count;
    for (uint64_t i = at * FAN; i < (at + 1) * FAN && i < end; i++) {
        const box *b = level ? &t->boxes[t->level_at[level - 1] + i] : NULL;
        const trip_point_tile *tile = level ? NULL : &t->tiles[i];
        if (apart2(b ? b->lo : tile->lo, b ? b->hi : tile->hi, of) > near->distance2)
            continue;
        if (level > 0) {
            if (!list_near(t, level - 1, i, near))
                return false;
        } else if (i != near->of) {
            if (near->count == NEAR_MAX)
                return false;
            near_tile *to = &near->tiles[near->count++];
            to->tile = i;
            widen(&to->box, tile->lo, tile->hi, true);
        }
    }
    return true;
}

/* Lists the tiles within a quarter of the tile's extent, or within less if there are too many. */
static const near_tiles *find_near(const trip_point_tiles *t, unsigned thread, uint64_t tile)
{
    enum { TRIES = 8 };
    near_tiles *near = &t->near[thread];
    const trip_point_tile *of = &t->tiles[tile];
    double extent2 = 0;
    if (near->known && near->of == tile)
        return near;
    for (int a = 0; a < 3; a++)
        extent2 += (of->hi[a] - of->lo[a]) * (of->hi[a] - of->lo[a]);
    near->known = true;
    near->of = tile;
    near->distance2 = extent2 / 16;
    for (int i = 0; i < TRIES; i++, near->distance2 /= 4) {
        near->count = 0;
        if (list_near(t, t->levels - 1, 0, near))
            return near;
    }
    near->distance2 = -1;
    return near;
}

int trip_point_tiles_search(trip_point_tiles *t, unsigned thread, uint64_t tile, trip_neighbours *n)
{
    if (t->prepared[thread] && trip_near_search_find(t->fast[thread], n))
        return 0;
    const near_tiles *near = find_near(t, thread, tile);
    int status = search_tile(t, thread, tile, n);
    if (status < 0 || !(trip_neighbours_reach2(n) <= near->distance2))
        return status < 0 ? status : descend(t, thread, t->levels - 1, 0, tile, n);
    for (unsigned i = 0; i < near->count && status == 0; i++)
        if (distance2(near->tiles[i].box.lo, near->tiles[i].box.hi, n->position) <=
            trip_neighbours_reach2(n))
            status = search_tile(t, thread, near->tiles[i].tile, n);
    return status;
}

/* ---- fast searches ---- */

/* Returns how many halvings of the leaf the places of two rows have in common. */
static unsigned common_halvings(const trip_point_row *one, const trip_point_row *other)
{
    const uint32_t differ = (uint32_t)one->head.at ^ (uint32_t)other->head.at;
    return differ ? ((unsigned)__builtin_clz(differ) - (32 - PLACE_BITS)) / 3 : HALVINGS;
}

/* Returns about the distance of the last of `wanted` neighbours in a tile. That is the width of
 * cells that hold wanted / pi points each, if their points lie on a surface. The rows are in the
 * order of the octree, so the points of a cell follow each other. */
static double reach_in(const trip_point_tiles *t, const trip_point_tile *tile,
                       const trip_point_row *rows, unsigned wanted)
{
    const trip_octree *o = t->params.octree;
    const double aim = wanted / M_PI;
    uint32_t borders[HALVINGS + 1] = { 0 };
    double cells = 1, above = tile->count,
           width = ldexp(o->side, -(int)o->nodes[rows->head.group].depth);
    for (uint32_t i = 1; i < tile->count; i++)
        borders[common_halvings(&rows[i - 1], &rows[i])]++;
    for (int d = 0; d < HALVINGS; d++) {
        cells += borders[d];
        width /= 2;
        const double held = tile->count / cells;
        if (held <= aim)
            return above > aim ? width * exp2(log(aim / held) / log(above / held)) : 2 * width;
        above = held;
    }
    return width * sqrt(aim / above);
}

static int add_candidates(trip_point_tiles *t, unsigned thread, uint64_t tile,
                          trip_near_search *fast, bool *whole)
{
    slot *s = hold(t, thread, tile);
    for (uint32_t i = 0; i < s->count && s->status == 0 && *whole; i++)
        *whole = trip_near_search_add(fast, s->positions[i]);
    const int status = s->status;
    let_go(t, s);
    return status;
}

/* Collects the candidates at most `margin` outside of a tile. Sets *whole to false if there are too
 * many. */
static int collect(trip_point_tiles *t, unsigned thread, const trip_point_row *rows, double margin,
                   double reach, bool *whole)
{
    const near_tiles *near = &t->near[thread];
    const trip_point_tile *of = &t->tiles[near->of];
    trip_near_search *fast = t->fast[thread];
    int status = 0;
    *whole = true;
    trip_near_search_begin(fast, of->lo, of->hi, margin, reach);
    for (uint32_t i = 0; i < of->count && *whole; i++)
        *whole = trip_near_search_add(fast, rows[i].position);
    for (unsigned i = 0; i < near->count && status == 0 && *whole; i++)
        if (apart2(near->tiles[i].box.lo, near->tiles[i].box.hi, of) <= margin * margin)
            status = add_candidates(t, thread, near->tiles[i].tile, fast, whole);
    return status;
}

int trip_point_tiles_prepare(trip_point_tiles *t, unsigned thread, uint64_t tile,
                             const trip_point_row *rows, unsigned wanted)
{
    enum { TRIES = 4 };
    const trip_point_tile *of = &t->tiles[tile];
    const near_tiles *near = find_near(t, thread, tile);
    const double reach = reach_in(t, of, rows, wanted);
    double margin = fmin(MARGIN * reach, sqrt(fmax(0, near->distance2)));
    bool whole = false;
    int status = 0;
    for (int i = 0; i < TRIES && near->distance2 >= 0 && status == 0 && !whole; i++, margin /= 2)
        status = collect(t, thread, rows, margin, reach, &whole);
    t->prepared[thread] = status == 0 && whole;
    if (t->prepared[thread])
        trip_near_search_sort(t->fast[thread]);
    return status;
}

static unsigned list_around(const trip_point_tiles *t, unsigned level, uint64_t at,
                            const double p[3], uint64_t *out, unsigned count, unsigned room)
{
    child children[FAN];
    const unsigned all = list_children(t, level, at, p, children);
    for (unsigned i = 0; i < all && children[i].distance2 <= 0; i++)
        if (level > 0)
            count = list_around(t, level - 1, children[i].at, p, out, count, room);
        else if (count < room)
            out[count++] = children[i].at;
    return count;
}

unsigned trip_point_tiles_around(const trip_point_tiles *t, const double position[3], uint64_t *out,
                                 unsigned room)
{
    return list_around(t, t->levels - 1, 0, position, out, 0, room);
}

void trip_point_tiles_free(trip_point_tiles *t)
{
    if (!t)
        return;
    for (unsigned i = 0; i < t->slot_count; i++) {
        trip_neighbour_tree_free(t->slots[i].tree);
        trip_budget_release(t->budget, t->slots[i].positions, positions_bytes());
        trip_budget_discharge(t->budget, slot_bytes() - positions_bytes());
    }
    for (unsigned i = 0; t->fast && i < t->threads; i++)
        if (t->fast[i])
            trip_budget_release(t->budget, t->fast[i], trip_near_search_bytes(CANDIDATES_MAX));
    free(t->fast);
    free(t->prepared);
    free(t->slots);
    free(t->near);
    if (t->slot_of)
        trip_budget_release(t->budget, t->slot_of, t->tile_count * sizeof *t->slot_of);
    if (t->rooms)
        trip_budget_release(t->budget, t->rooms, t->threads * room_bytes);
    if (t->boxes)
        trip_budget_release(t->budget, t->boxes, t->boxes_bytes);
    if (t->tiles)
        trip_budget_release(t->budget, t->tiles, t->tiles_bytes);
    trip_output_close(&t->rows);
    pthread_cond_destroy(&t->loaded);
    pthread_mutex_destroy(&t->lock);
    free(t);
}
