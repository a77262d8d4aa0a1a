#include "near_search.h"

#include <math.h>
#include <string.h>

#include "clones.h"

enum {
    CELLS_OF_CANDIDATE = 4, /* at most */
    CELLS_LEAST = 64,
    KEPT_MAX = 64, /* candidates within the radius that are ranked; more are inserted */
    TRIES = 6,     /* radii before all candidates are compared */
    LANES = 4,
    FLAT_CELLS = 6, /* height of a cell in a flat box */
};

/* Radii grow by this factor over the radius of the last search. */
#define BEYOND 1.25
/* A bound for the rounding of distances. */
#define ROUNDING 1e-9

/* LANES values. The compiler divides them for processors with shorter registers. */
typedef double doubles __attribute__((vector_size(32)));
typedef int64_t numbers __attribute__((vector_size(32)));

typedef struct grid {
    double origin, inverse; /* of the size of a cell */
    uint32_t count;
    int axis;
} grid;

struct trip_near_search {
    uint32_t room, count, cells_max;
    double lo[3], hi[3]; /* with the margin */
    double spacing;
    double radius2; /* that the next search tries */
    grid grids[3];  /* the last one varies fastest along the cells */
    double *unsorted[3], *sorted[3], *distances;
    uint32_t *cell_of, *starts, *kept;
};

static size_t align(size_t bytes)
{
    return (bytes + 63) & ~(size_t)63;
}

static uint32_t most_cells(uint32_t candidates)
{
    return CELLS_OF_CANDIDATE * candidates + CELLS_LEAST;
}

static size_t doubles_bytes(uint32_t candidates)
{
    return align((candidates + LANES) * sizeof(double));
}

static size_t numbers_bytes(uint32_t candidates)
{
    return align((candidates + LANES) * sizeof(uint32_t));
}

size_t trip_near_search_bytes(uint32_t candidates)
{
    return align(sizeof(trip_near_search)) + 7 * doubles_bytes(candidates) +
           2 * numbers_bytes(candidates) + numbers_bytes(most_cells(candidates) + 1);
}

trip_near_search *trip_near_search_make(void *memory, uint32_t candidates)
{
    trip_near_search *s = memory;
    unsigned char *at = (unsigned char *)memory + align(sizeof *s);
    double **const tables[] = { &s->unsorted[0], &s->unsorted[1], &s->unsorted[2], &s->sorted[0],
                                &s->sorted[1],   &s->sorted[2],   &s->distances };
    s->room = candidates;
    s->cells_max = most_cells(candidates);
    for (size_t i = 0; i < sizeof tables / sizeof *tables; i++, at += doubles_bytes(candidates))
        *tables[i] = (void *)at;
    s->cell_of = (void *)at;
    s->kept = (void *)(at += numbers_bytes(candidates));
    s->starts = (void *)(at + numbers_bytes(candidates));
    return s;
}

/* ---- candidates ---- */

/* Sets cells of about the spacing that suits a search. They are higher where the box is flat, so
 * that a search meets few cells. */
static void set_grids(trip_near_search *s, double size)
{
    int order[3] = { 0, 1, 2 };
    double extent[3], sizes[3];
    for (int a = 0; a < 3; a++)
        extent[a] = s->hi[a] - s->lo[a];
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2 - i; j++)
            if (extent[order[j]] > extent[order[j + 1]]) {
                const int other = order[j];
                order[j] = order[j + 1];
                order[j + 1] = other;
            }
    for (;;) {
        double cells = 1;
        for (int i = 0; i < 3; i++) {
            const bool flat = i == 0 && extent[order[0]] < extent[order[1]] / 4;
            sizes[i] = flat ? FLAT_CELLS * size : size;
            cells *= floor(extent[order[i]] / sizes[i]) + 1;
        }
        if (cells <= s->cells_max)
            break;
        size *= 1.25;
    }
    for (int i = 0; i < 3; i++)
        s->grids[i] = (grid){ .origin = s->lo[order[i]],
                              .inverse = 1 / sizes[i],
                              .count = (uint32_t)(extent[order[i]] / sizes[i]) + 1,
                              .axis = order[i] };
}

void trip_near_search_begin(trip_near_search *s, const double lo[3], const double hi[3],
                            double margin, double spacing)
{
    double most = 0;
    for (int a = 0; a < 3; a++) {
        s->lo[a] = lo[a] - margin;
        s->hi[a] = hi[a] + margin;
        most = fmax(most, s->hi[a] - s->lo[a]);
    }
    s->count = 0;
    s->spacing = fmax(spacing, most / s->cells_max);
    s->radius2 = BEYOND * spacing * spacing;
    if (s->spacing > 0)
        set_grids(s, s->spacing);
}

bool trip_near_search_add(trip_near_search *s, const double p[3])
{
    for (int a = 0; a < 3; a++)
        if (!(p[a] >= s->lo[a] && p[a] <= s->hi[a]))
            return true;
    if (s->count == s->room)
        return false;
    for (int a = 0; a < 3; a++)
        s->unsorted[a][s->count] = p[a];
    s->count++;
    return true;
}

static uint32_t cell_along(const grid *g, double at)
{
    const double cell = (at - g->origin) * g->inverse;
    const double last = g->count - 1;
    return cell > 0 ? (uint32_t)(cell < last ? cell : last) : 0;
}

static uint32_t row_of_cells(const trip_near_search *s, uint32_t i, uint32_t j)
{
    return (i * s->grids[1].count + j) * s->grids[2].count;
}

void trip_near_search_sort(trip_near_search *s)
{
    if (!(s->spacing > 0))
        return;
    const uint32_t cells = row_of_cells(s, s->grids[0].count, 0);
    memset(s->starts, 0, (cells + 1) * sizeof *s->starts);
    for (uint32_t i = 0; i < s->count; i++) {
        uint32_t at[3];
        for (int g = 0; g < 3; g++)
            at[g] = cell_along(&s->grids[g], s->unsorted[s->grids[g].axis][i]);
        s->cell_of[i] = row_of_cells(s, at[0], at[1]) + at[2];
        s->starts[s->cell_of[i] + 1]++;
    }
    for (uint32_t c = 0; c < cells; c++)
        s->starts[c + 1] += s->starts[c];
    /* The starts move to the ends, and so to the starts of the cells that follow. */
    for (uint32_t i = 0; i < s->count; i++) {
        const uint32_t to = s->starts[s->cell_of[i]]++;
        for (int a = 0; a < 3; a++)
            s->sorted[a][to] = s->unsorted[a][i];
    }
    memmove(s->starts + 1, s->starts, cells * sizeof *s->starts);
    s->starts[0] = 0;
}

/* ---- searches ---- */

/* Returns a distance within which all positions are candidates. */
static double known_distance(const trip_near_search *s, const double p[3])
{
    double least = INFINITY;
    for (int a = 0; a < 3; a++) {
        const double below = p[a] - s->lo[a], above = s->hi[a] - p[a];
        const double d = below < above ? below : above;
        least = d < least ? d : least;
    }
    return least * (1 - ROUNDING);
}

static inline void load(doubles *d, const double *from)
{
    memcpy(d, from, sizeof *d);
}

/* Keeps the candidates of a run of cells that are within the radius. Returns their number. */
static inline uint32_t keep_run(const trip_near_search *s, uint32_t first, uint32_t end,
                                const double p[3], double radius2, uint32_t kept)
{
    for (uint32_t i = first; i < end; i += LANES) {
        doubles x, y, z;
        load(&x, s->sorted[0] + i);
        load(&y, s->sorted[1] + i);
        load(&z, s->sorted[2] + i);
        x = p[0] - x, y = p[1] - y, z = p[2] - z;
        const doubles d = x * x + y * y + z * z;
        const numbers near = (d <= radius2) & (d > 0); /* -1 for each */
        for (uint32_t l = 0; l < LANES; l++) {
            s->distances[kept] = d[l];
            s->kept[kept] = i + l;
            kept += (uint32_t)-near[l] & (i + l < end);
        }
    }
    return kept;
}

/* Keeps all candidates within a radius, except those at the position. Returns their number. */
static inline uint32_t keep_near(const trip_near_search *s, const double p[3], double radius2)
{
    const double radius = sqrt(radius2) * (1 + ROUNDING);
    uint32_t lo[3], hi[3], kept = 0;
    for (int g = 0; g < 3; g++) {
        lo[g] = cell_along(&s->grids[g], p[s->grids[g].axis] - radius);
        hi[g] = cell_along(&s->grids[g], p[s->grids[g].axis] + radius);
    }
    for (uint32_t i = lo[0]; i <= hi[0]; i++)
        for (uint32_t j = lo[1]; j <= hi[1]; j++) {
            const uint32_t row = row_of_cells(s, i, j);
            kept =
                keep_run(s, s->starts[row + lo[2]], s->starts[row + hi[2] + 1], p, radius2, kept);
        }
    return kept;
}

static inline void position_of(const trip_near_search *s, uint32_t i, double p[3])
{
    for (int a = 0; a < 3; a++)
        p[a] = s->sorted[a][i];
}

/* Puts the nearest kept candidates in order by their ranks. Returns false if two have the same
 * distance. */
static inline bool rank_kept(const trip_near_search *s, uint32_t kept, trip_neighbours *n)
{
    const double *d = s->distances;
    uint32_t at[TRIP_NEIGHBOURS_MAX];
    uint64_t filled = 0;
    for (uint32_t i = kept; i < kept + LANES; i++)
        s->distances[i] = INFINITY;
    for (uint32_t i = 0; i < kept; i++) {
        numbers nearer = { 0 }; /* -1 for each */
        for (uint32_t j = 0; j < kept; j += LANES) {
            doubles other;
            load(&other, d + j);
            nearer += other < d[i];
        }
        const int64_t rank = -(nearer[0] + nearer[1] + nearer[2] + nearer[3]);
        if (rank >= n->wanted)
            continue;
        if (filled >> rank & 1)
            return false;
        filled |= UINT64_C(1) << rank;
        at[rank] = i;
    }
    for (uint32_t i = 0; i < n->wanted; i++) {
        if (!(filled >> i & 1))
            return false;
        n->nearest[i].distance2 = d[at[i]];
        position_of(s, s->kept[at[i]], n->nearest[i].position);
    }
    n->count = n->wanted;
    return true;
}

static void insert_kept(const trip_near_search *s, uint32_t kept, trip_neighbours *n)
{
    for (uint32_t i = 0; i < kept; i++) {
        double p[3];
        if (s->distances[i] > trip_neighbours_reach2(n))
            continue;
        position_of(s, s->kept[i], p);
        trip_neighbours_add(n, s->distances[i], p);
    }
}

TRIP_ALSO_V3
bool trip_near_search_find(trip_near_search *s, trip_neighbours *n)
{
    const double known = known_distance(s, n->position), known2 = known > 0 ? known * known : 0;
    double radius2 = s->radius2;
    n->count = 0;
    if (!(s->spacing > 0))
        return false;
    for (int i = 0; i < TRIES; i++) {
        const bool last = !(radius2 < known2);
        if (last)
            radius2 = known2;
        const uint32_t kept = keep_near(s, n->position, radius2);
        if (kept >= n->wanted && (kept > KEPT_MAX || !rank_kept(s, kept, n)))
            insert_kept(s, kept, n);
        if (n->count == n->wanted) {
            s->radius2 = BEYOND * n->nearest[n->count - 1].distance2;
            return true;
        }
        n->count = 0;
        if (last)
            return false;
        radius2 *= kept < n->wanted / 4 ? 4 : BEYOND * n->wanted / (kept + 1) + 0.5;
    }
    return false;
}
