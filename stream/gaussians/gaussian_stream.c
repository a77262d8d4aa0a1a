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
    NO_SLOT = -1,
};

/* A footprint reaches so far beyond its ellipsoid: 3.33 times the root of 0.3 square pixels. */
#define FOOTPRINT_PX (TRIP_GAUSSIAN_REACH * 0.5477225575051661)
#define CLAMP 1.3

/* A brick that will be read. */
typedef struct step {
    double lo, hi; /* bounds of the keys */
    uint64_t brick;
} step;

/* A splat in the window. The bytes of the record and of its coefficients follow. */
typedef struct slot {
    double key;
    uint32_t brick; /* index in the steps */
    uint32_t index; /* in the brick */
    int64_t next;   /* slot in the same list */
} slot;

struct trip_gaussian_stream {
    const trip_gaussian_set *set;
    const trip_gaussian_list *list;
    trip_gaussian_stream_params params;
    trip_budget *budget;
    trip_gaussian_plan plan;
    step *steps; /* by ascending lo */
    uint64_t step_count;
    int degree;
    /* Slots that become final before step i is read form the list firsts[i]. */
    int64_t *firsts;
    unsigned char *slots;
    size_t slot_bytes;
    int64_t free; /* list of free slots */
    unsigned char *planes[TRIP_GAUSSIAN_PLANES]; /* the bytes of a brick */
    trip_key *ready, *scratch; /* the final slots, by key */
    size_t ready_count, ready_next;
    uint64_t next; /* step */
    unsigned char *memory;
    size_t memory_bytes;
    size_t step_bytes;
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

static int compare_lo(const void *a, const void *b)
{
    const step *x = a, *y = b;
    if (x->lo != y->lo)
        return x->lo < y->lo ? -1 : 1;
    return x->brick < y->brick ? -1 : x->brick > y->brick;
}

static void sift(double *heap, size_t count, size_t at)
{
    for (;;) {
        size_t least = at;
        for (size_t child = 2 * at + 1; child <= 2 * at + 2 && child < count; child++)
            if (heap[child] < heap[least])
                least = child;
        if (least == at)
            return;
        const double other = heap[at];
        heap[at] = heap[least];
        heap[least] = other;
        at = least;
    }
}
