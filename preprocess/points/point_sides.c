#include "point_sides.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "folder.h"
#include "report.h"

enum {
    EDGES = TRIP_POINT_SIDES_EDGES,
    PARTS = TRIP_POINT_SIDES_PARTS,
    TILE = TRIP_POINT_TILE_MAX,
    STEPS = 256,
    NEAR = 16, /* tiles that may hold a position */
    NONE = 0xffff,
    SLOTS = 1 << 14,
    SPOOL_BYTES = 1 << 15,
};

/* Sums over the points of a part, by area. Positions count from the middle. */
typedef struct part {
    double area, square; /* of 1 and of the squared position */
    double position[3], normal[3];
    double outward; /* of n . p */
} part;

/* A point with a neighbour in another tile. */
typedef struct crossing {
    uint64_t row; /* in its tile */
    double neighbour[3];
} crossing;

/* Where the neighbour of a crossing may be. */
typedef struct candidate {
    uint64_t tile;
    uint32_t crossing;
} candidate;

/* The rows of a tile by position. */
typedef struct places {
    uint16_t slots[SLOTS];
} places;

/* A tile in hand: joined, or voted on. */
typedef struct room {
    trip_point_row *rows;
    uint32_t count, crossing_count, part_count;
    union {
        uint16_t edges[TILE][EDGES];
        candidate candidates[TILE];
    };
    places places; /* of the tile in hand, or of the other tile of a vote */
    crossing crossings[TILE];
    part parts[PARTS];
} room;

/* Work of a thread: a forest of rows, and the edges by cost. */
typedef struct bench {
    uint16_t parent[TILE];
    uint8_t turned[TILE]; /* against the parent */
    uint8_t cost[TILE * EDGES];
    uint16_t part_of[TILE]; /* of a root */
    uint32_t order[TILE * EDGES], steps[STEPS + 1];
} bench;

typedef struct tile_parts {
    uint64_t first_row, first_part, first_crossing;
} tile_parts;

typedef struct vote {
    uint32_t parts[2];
    float sum;
} vote;

struct trip_point_sides {
    trip_point_sides_params params;
    trip_budget *budget;
    room *rooms;
    bench *benches;
    tile_parts *tiles; /* one more than there are tiles */
    size_t rooms_bytes, benches_bytes, tiles_bytes, part_bytes, parent_bytes, turned_bytes;
    uint64_t tile_count, tile, row; /* tiles that are kept; the tile and the row that come next */
    trip_output crossings, parts, votes;
    uint64_t part_count, vote_count;
    part *part; /* all parts, with a forest */
    uint32_t *parent;
    uint8_t *turned;
};

static int fail_memory(const trip_point_sides *s)
{
    return trip_fail(TRIP_ERROR, "brick", s->params.name,
                     "the sides of normals need more memory than --memory allows: raise --memory");
}

/* ---- memory ---- */

static int create_output(const trip_point_sides *s, trip_output *o)
{
    return trip_output_create(o,
                              &(trip_output_params){ .folder = s->params.folder,
                                                     .name = TRIP_SPOOL_NAME,
                                                     .buffer_bytes = SPOOL_BYTES,
                                                     .unnamed = true },
                              s->budget);
}

int trip_point_sides_create(trip_point_sides **out, const trip_point_sides_params *params,
                            trip_budget *budget)
{
    trip_point_sides *s = *out = calloc(1, sizeof *s);
    if (!s)
        return trip_fail(TRIP_ERROR, "brick", params->name, "out of memory");
    s->params = *params;
    s->budget = budget;
    s->crossings.fd = s->parts.fd = s->votes.fd = -1;
    s->rooms_bytes = params->rooms * sizeof *s->rooms;
    s->benches_bytes = params->threads * sizeof *s->benches;
    s->tiles_bytes = (trip_point_tiles_count(params->tiles) + 1) * sizeof *s->tiles;
    s->rooms = trip_budget_take(budget, s->rooms_bytes);
    s->benches = trip_budget_take(budget, s->benches_bytes);
    s->tiles = trip_budget_take(budget, s->tiles_bytes);
    if (!s->rooms || !s->benches || !s->tiles)
        return fail_memory(s);
    s->tiles[0] = (tile_parts){ .first_row = 0 };
    int status = create_output(s, &s->crossings);
    if (status == 0)
        status = create_output(s, &s->parts);
    return status == 0 ? create_output(s, &s->votes) : status;
}

static void release(const trip_point_sides *s, void *memory, size_t bytes)
{
    if (memory)
        trip_budget_release(s->budget, memory, bytes);
}

static void release_rooms(trip_point_sides *s)
{
    release(s, s->rooms, s->rooms_bytes);
    release(s, s->benches, s->benches_bytes);
    s->rooms = NULL;
    s->benches = NULL;
}

void trip_point_sides_free(trip_point_sides *s)
{
    if (!s)
        return;
    release_rooms(s);
    release(s, s->tiles, s->tiles_bytes);
    release(s, s->part, s->part_bytes);
    release(s, s->parent, s->parent_bytes);
    release(s, s->turned, s->turned_bytes);
    trip_output_close(&s->crossings);
    trip_output_close(&s->parts);
    trip_output_close(&s->votes);
    free(s);
}

/* ---- the edges of a tile ---- */

static uint32_t slot_of(const double position[3])
{
    uint64_t hash = 0;
    for (int a = 0; a < 3; a++) {
        const double at = position[a] + 0.0; /* one zero */
        uint64_t bits;
        memcpy(&bits, &at, sizeof bits);
        hash = (hash ^ bits) * UINT64_C(0x9e3779b97f4a7c15);
        hash ^= hash >> 32;
    }
    return (uint32_t)(hash % SLOTS);
}

static bool is_at(const trip_point_row *row, const double position[3])
{
    return row->position[0] == position[0] && row->position[1] == position[1] &&
           row->position[2] == position[2];
}

/* Returns the slot of a position: it holds the first row there, or NONE. */
static uint16_t *find_slot(places *p, const trip_point_row *rows, const double position[3])
{
    uint32_t slot = slot_of(position);
    while (p->slots[slot] != NONE && !is_at(&rows[p->slots[slot]], position))
        slot = (slot + 1) % SLOTS;
    return &p->slots[slot];
}

static void list_places(places *p, const trip_point_row *rows, uint32_t count)
{
    memset(p->slots, 0xff, sizeof p->slots);
    for (uint32_t i = 0; i < count; i++) {
        uint16_t *slot = find_slot(p, rows, rows[i].position);
        *slot = *slot == NONE ? (uint16_t)i : *slot;
    }
}

void trip_point_sides_begin(trip_point_sides *s, unsigned number, trip_point_row *rows,
                            uint32_t count)
{
    room *r = &s->rooms[number];
    r->rows = rows;
    r->count = count;
    r->crossing_count = r->part_count = 0;
    list_places(&r->places, rows, count);
}

void trip_point_sides_note(trip_point_sides *s, unsigned number, uint32_t row,
                           const trip_neighbours *n)
{
    room *r = &s->rooms[number];
    bool crosses = false;
    for (unsigned i = 0; i < EDGES; i++) {
        const double *at = i < n->count ? n->nearest[i].position : NULL;
        const uint16_t to = at ? *find_slot(&r->places, r->rows, at) : NONE;
        r->edges[row][i] = to;
        if (to != NONE || !at || crosses)
            continue;
        crossing *c = &r->crossings[r->crossing_count++];
        c->row = row;
        memcpy(c->neighbour, at, sizeof c->neighbour);
        crosses = true;
    }
}

/* ---- joining the rows of a tile ---- */

static double dot(const float a[3], const float b[3])
{
    return (double)a[0] * (double)b[0] + (double)a[1] * (double)b[1] + (double)a[2] * (double)b[2];
}

/* Lists the edges by cost. */
static uint32_t sort_edges(bench *b, const room *r)
{
    uint32_t count = 0, *steps = b->steps;
    memset(steps, 0, sizeof b->steps);
    for (uint32_t i = 0; i < r->count; i++)
        for (unsigned e = 0; e < EDGES; e++) {
            const uint16_t to = r->edges[i][e];
            if (to == NONE)
                continue;
            const double same = fmin(1, fabs(dot(r->rows[i].normal, r->rows[to].normal)));
            const unsigned step = (unsigned)((1 - same) * (STEPS - 1));
            b->cost[i * EDGES + e] = (uint8_t)step;
            steps[step + 1]++;
            count++;
        }
    for (int i = 0; i < STEPS; i++)
        steps[i + 1] += steps[i];
    for (uint32_t i = 0; i < r->count * EDGES; i++)
        if (r->edges[i / EDGES][i % EDGES] != NONE)
            b->order[steps[b->cost[i]]++] = i;
    return count;
}

/* Returns the root of a row. Sets *turned if the row is turned against it. */
static uint16_t find_root(bench *b, uint16_t row, uint8_t *turned)
{
    uint16_t root = row;
    uint8_t all = 0;
    while (b->parent[root] != root) {
        all ^= b->turned[root];
        root = b->parent[root];
    }
    *turned = all;
    while (b->parent[row] != root && row != root) { /* shortens the path */
        const uint16_t next = b->parent[row];
        const uint8_t step = b->turned[row];
        b->parent[row] = root;
        b->turned[row] = all;
        all ^= step;
        row = next;
    }
    return root;
}

static void join_rows(bench *b, const room *r)
{
    for (uint32_t i = 0; i < r->count; i++) {
        b->parent[i] = (uint16_t)i;
        b->turned[i] = 0;
        b->part_of[i] = NONE;
    }
    const uint32_t count = sort_edges(b, r);
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t from = b->order[i] / EDGES;
        const uint16_t to = r->edges[from][b->order[i] % EDGES];
        uint8_t of_from, of_to;
        const uint16_t one = find_root(b, (uint16_t)from, &of_from);
        const uint16_t two = find_root(b, to, &of_to);
        if (one == two)
            continue;
        const uint16_t below = one < two ? two : one;
        b->parent[below] = one < two ? one : two;
        b->turned[below] = of_from ^ of_to ^ (dot(r->rows[from].normal, r->rows[to].normal) < 0);
    }
}

static void add_row(const trip_point_sides *s, part *p, const trip_point_row *row)
{
    const double area = (double)row->radius * (double)row->radius;
    p->area += area;
    for (int a = 0; a < 3; a++) {
        const double at = row->position[a] - s->params.middle[a], n = (double)row->normal[a];
        p->square += area * at * at;
        p->position[a] += area * at;
        p->normal[a] += area * n;
        p->outward += area * n * at;
    }
}

void trip_point_sides_join(trip_point_sides *s, unsigned thread, unsigned number)
{
    room *r = &s->rooms[number];
    bench *b = &s->benches[thread];
    join_rows(b, r);
    for (uint32_t i = 0; i < r->count; i++) {
        uint8_t turned;
        trip_point_row *row = &r->rows[i];
        const uint16_t root = find_root(b, (uint16_t)i, &turned);
        if (b->part_of[root] == NONE && r->part_count < PARTS) {
            r->parts[r->part_count] = (part){ .area = 0 };
            b->part_of[root] = (uint16_t)r->part_count++;
        }
        row->part = b->part_of[root] == NONE ? PARTS : b->part_of[root];
        if (b->part_of[root] == NONE)
            continue;
        for (int a = 0; a < 3 && turned; a++)
            row->normal[a] = -row->normal[a];
        add_row(s, &r->parts[b->part_of[root]], row);
    }
}

int trip_point_sides_keep(trip_point_sides *s, unsigned number)
{
    const room *r = &s->rooms[number];
    tile_parts *next = &s->tiles[++s->tile_count];
    *next = next[-1];
    next->first_row += r->count;
    next->first_part += r->part_count;
    next->first_crossing += r->crossing_count;
    int status =
        trip_output_append(&s->crossings, r->crossings, r->crossing_count * sizeof *r->crossings);
    if (status == 0)
        status = trip_output_append(&s->parts, r->parts, r->part_count * sizeof *r->parts);
    return status;
}

/* ---- votes ---- */

/* Votes on pairs of parts, before they are written. */
typedef struct ballot {
    vote votes[64];
    unsigned count;
} ballot;

static int flush_votes(trip_point_sides *s, ballot *b)
{
    const int status = trip_output_append(&s->votes, b->votes, b->count * sizeof *b->votes);
    s->vote_count += b->count;
    b->count = 0;
    return status;
}

static int add_vote(trip_point_sides *s, ballot *b, uint64_t one, uint64_t two, double value)
{
    unsigned i = 0;
    while (i < b->count && (b->votes[i].parts[0] != one || b->votes[i].parts[1] != two))
        i++;
    if (i == sizeof b->votes / sizeof *b->votes) {
        const int status = flush_votes(s, b);
        if (status < 0)
            return status;
        i = 0;
    }
    if (i == b->count)
        b->votes[b->count++] = (vote){ .parts = { (uint32_t)one, (uint32_t)two } };
    b->votes[i].sum += (float)value;
    return 0;
}

static uint32_t rows_in(const trip_point_sides *s, uint64_t tile)
{
    return (uint32_t)(s->tiles[tile + 1].first_row - s->tiles[tile].first_row);
}

static int read_rows(const trip_point_sides *s, const trip_output *from, uint64_t tile,
                     trip_point_row *rows)
{
    return trip_output_read(from, s->tiles[tile].first_row * sizeof *rows, rows,
                            rows_in(s, tile) * sizeof *rows);
}

static int by_tile(const void *a, const void *b)
{
    const candidate *one = a, *two = b;
    if (one->tile != two->tile)
        return one->tile < two->tile ? -1 : 1;
    return one->crossing < two->crossing ? -1 : one->crossing > two->crossing;
}

/* Lists the crossings of a tile by the tiles that may hold their neighbours. */
static uint32_t list_candidates(const trip_point_sides *s, uint64_t tile, room *r)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < r->crossing_count; i++) {
        uint64_t found[NEAR];
        const unsigned tiles =
            trip_point_tiles_around(s->params.tiles, r->crossings[i].neighbour, found, NEAR);
        for (unsigned t = 0; t < tiles && count < TILE; t++)
            if (found[t] != tile)
                r->candidates[count++] = (candidate){ found[t], i };
    }
    qsort(r->candidates, count, sizeof *r->candidates, by_tile);
    return count;
}

static int vote_of_tile(trip_point_sides *s, const trip_output *from, uint64_t tile,
                        trip_point_row *own, trip_point_row *others)
{
    room *r = s->rooms;
    const uint64_t first = s->tiles[tile].first_crossing;
    ballot b = { .count = 0 };
    r->crossing_count = (uint32_t)(s->tiles[tile + 1].first_crossing - first);
    if (r->crossing_count == 0)
        return 0;
    int status = trip_output_read(&s->crossings, first * sizeof *r->crossings, r->crossings,
                                  r->crossing_count * sizeof *r->crossings);
    if (status == 0)
        status = read_rows(s, from, tile, own);
    const uint32_t count = status == 0 ? list_candidates(s, tile, r) : 0;
    for (uint32_t i = 0; i < count && status == 0; i++) {
        const uint64_t other = r->candidates[i].tile;
        const crossing *c = &r->crossings[r->candidates[i].crossing];
        if (i == 0 || other != r->candidates[i - 1].tile) {
            status = read_rows(s, from, other, others);
            if (status == 0)
                list_places(&r->places, others, rows_in(s, other));
        }
        if (status < 0)
            break;
        const uint16_t at = *find_slot(&r->places, others, c->neighbour);
        if (at == NONE || own[c->row].part >= PARTS || others[at].part >= PARTS)
            continue;
        status = add_vote(s, &b, s->tiles[tile].first_part + (uint64_t)own[c->row].part,
                          s->tiles[other].first_part + (uint64_t)others[at].part,
                          dot(own[c->row].normal, others[at].normal));
    }
    return status == 0 ? flush_votes(s, &b) : status;
}

/* ---- joining the parts ---- */

static int by_votes(const void *a, const void *b)
{
    const vote *one = a, *two = b;
    const float first = fabsf(one->sum), second = fabsf(two->sum);
    if (first != second)
        return first > second ? -1 : 1;
    for (int i = 0; i < 2; i++)
        if (one->parts[i] != two->parts[i])
            return one->parts[i] < two->parts[i] ? -1 : 1;
    return 0;
}

static uint32_t find_group(trip_point_sides *s, uint32_t number, uint8_t *turned)
{
    uint32_t root = number;
    *turned = 0;
    while (s->parent[root] != root) {
        *turned ^= s->turned[root];
        root = s->parent[root];
    }
    uint8_t all = *turned;
    while (s->parent[number] != root && number != root) {
        const uint32_t next = s->parent[number];
        const uint8_t step = s->turned[number];
        s->parent[number] = root;
        s->turned[number] = all;
        all ^= step;
        number = next;
    }
    return root;
}

/* Adds a part to its group's sums. */
static void add_part(part *to, const part *p, bool turned)
{
    const double sign = turned ? -1 : 1;
    to->area += p->area;
    to->square += p->square;
    to->outward += sign * p->outward;
    for (int a = 0; a < 3; a++) {
        to->position[a] += p->position[a];
        to->normal[a] += sign * p->normal[a];
    }
}

/* Whether a group must turn round. */
static bool must_turn(const trip_point_sides *s, const part *p)
{
    double outward = p->outward, spread = p->square, up = 0;
    if (!(p->area > 0))
        return false;
    for (int a = 0; a < 3; a++) {
        outward -= p->position[a] / p->area * p->normal[a];
        spread -= p->position[a] * p->position[a] / p->area;
        up += s->params.up[a] * p->normal[a];
    }
    const double most = sqrt(fmax(0, spread) * p->area); /* of `outward` */
    return fabs(up) * most > fabs(outward) * p->area ? up < 0 : outward < 0;
}

static int take_parts(trip_point_sides *s)
{
    s->part_count = s->tiles[s->tile_count].first_part;
    s->part_bytes = s->part_count * sizeof *s->part;
    s->parent_bytes = s->part_count * sizeof *s->parent;
    s->turned_bytes = s->part_count * sizeof *s->turned;
    if (s->part_count > UINT32_MAX)
        return fail_memory(s);
    s->part = trip_budget_take(s->budget, s->part_bytes);
    s->parent = trip_budget_take(s->budget, s->parent_bytes);
    s->turned = trip_budget_take(s->budget, s->turned_bytes);
    if (!s->part || !s->parent || !s->turned)
        return fail_memory(s);
    for (uint32_t i = 0; i < s->part_count; i++) {
        s->parent[i] = i;
        s->turned[i] = 0;
    }
    return trip_output_read(&s->parts, 0, s->part, s->part_bytes);
}

static void join_parts(trip_point_sides *s, const vote *votes)
{
    for (uint64_t i = 0; i < s->vote_count; i++) {
        uint8_t of_one, of_two;
        const uint32_t one = find_group(s, votes[i].parts[0], &of_one);
        const uint32_t two = find_group(s, votes[i].parts[1], &of_two);
        if (one == two)
            continue;
        const uint32_t below = one < two ? two : one;
        s->parent[below] = one < two ? one : two;
        s->turned[below] = of_one ^ of_two ^ (votes[i].sum < 0);
    }
}

/* Turns whole groups. */
static void turn_groups(trip_point_sides *s)
{
    for (uint32_t i = 0; i < s->part_count; i++) {
        uint8_t turned;
        const uint32_t root = find_group(s, i, &turned);
        if (root != i)
            add_part(&s->part[root], &s->part[i], turned);
    }
    for (uint32_t i = 0; i < s->part_count; i++)
        if (s->parent[i] == i)
            s->turned[i] = must_turn(s, &s->part[i]);
    for (uint32_t i = 0; i < s->part_count; i++)
        if (s->parent[i] != i) /* paths have one step now */
            s->turned[i] ^= s->turned[s->parent[i]];
}

int trip_point_sides_choose(trip_point_sides *s, const trip_output *rows, trip_point_row *two_tiles)
{
    int status = trip_output_flush(&s->crossings);
    if (status == 0)
        status = trip_output_flush(&s->parts);
    for (uint64_t t = 0; t < s->tile_count && status == 0; t++)
        status = vote_of_tile(s, rows, t, two_tiles, two_tiles + TILE);
    if (status == 0)
        status = trip_output_flush(&s->votes);
    release_rooms(s);
    if (status == 0)
        status = take_parts(s);
    const size_t bytes = s->vote_count * sizeof(vote);
    vote *votes = status == 0 && bytes ? trip_budget_take(s->budget, bytes) : NULL;
    if (status == 0 && bytes && !votes)
        status = fail_memory(s);
    if (status == 0 && bytes)
        status = trip_output_read(&s->votes, 0, votes, bytes);
    if (status == 0 && bytes) {
        qsort(votes, s->vote_count, sizeof *votes, by_votes);
        join_parts(s, votes);
    }
    release(s, votes, bytes);
    if (status == 0)
        turn_groups(s);
    return status;
}

void trip_point_sides_turn(trip_point_sides *s, trip_point_row *row)
{
    while (s->row >= s->tiles[s->tile + 1].first_row)
        s->tile++;
    s->row++;
    if (row->part >= PARTS || !s->turned[s->tiles[s->tile].first_part + (uint64_t)row->part])
        return;
    for (int a = 0; a < 3; a++)
        row->normal[a] = -row->normal[a];
}
