#include "harmonics_palette.h"

#include <math.h>
#include <string.h>

#include "gaussian_code.h"

/* Vectors lo to hi of the order. */
typedef struct part {
    uint32_t lo, hi, dimension;
    int32_t node; /* the node around it; -1 for the root */
    bool right;
    double error, value; /* sum of squares from the mean; where the part is divided */
} part;

typedef struct build {
    trip_palette *p;
    const float *vectors;
    unsigned size;
    uint32_t *order;
    part *parts; /* a heap: the largest error first */
    uint64_t part_count, most;
} build;

static const float *vector(const build *b, uint32_t i)
{
    return b->vectors + (size_t)b->order[i] * b->size;
}

static void measure(const build *b, part *t)
{
    double sums[3 * TRIP_SH_MAX] = { 0 }, squares[3 * TRIP_SH_MAX] = { 0 }, widest = 0;
    const double count = t->hi - t->lo;
    t->error = 0;
    for (uint32_t i = t->lo; i < t->hi; i++)
        for (unsigned d = 0; d < b->size; d++)
            sums[d] += (double)vector(b, i)[d];
    for (uint32_t i = t->lo; i < t->hi; i++)
        for (unsigned d = 0; d < b->size; d++) {
            const double apart = (double)vector(b, i)[d] - sums[d] / count;
            squares[d] += apart * apart;
        }
    for (unsigned d = 0; d < b->size; d++) {
        t->error += squares[d];
        if (squares[d] > widest) {
            widest = squares[d];
            t->dimension = d;
            t->value = sums[d] / count;
        }
    }
}

static bool is_worse(const part *a, const part *b)
{
    return a->error != b->error ? a->error > b->error : a->lo < b->lo;
}

static void swap_parts(build *b, uint64_t i, uint64_t j)
{
    const part t = b->parts[i];
    b->parts[i] = b->parts[j];
    b->parts[j] = t;
}

static void push(build *b, part t)
{
    uint64_t at = b->part_count++;
    measure(b, &t);
    b->parts[at] = t;
    for (; at && is_worse(&b->parts[at], &b->parts[(at - 1) / 2]); at = (at - 1) / 2)
        swap_parts(b, at, (at - 1) / 2);
}

static part pop(build *b)
{
    const part top = b->parts[0];
    b->parts[0] = b->parts[--b->part_count];
    for (uint64_t at = 0;;) {
        uint64_t most = at;
        for (uint64_t child = 2 * at + 1; child <= 2 * at + 2 && child < b->part_count; child++)
            if (is_worse(&b->parts[child], &b->parts[most]))
                most = child;
        if (most == at)
            return top;
        swap_parts(b, at, most);
        at = most;
    }
}

/* Moves the vectors below the value to the front. Returns the first behind them. */
static uint32_t divide(build *b, const part *t)
{
    uint32_t lo = t->lo;
    for (uint32_t i = t->lo; i < t->hi; i++)
        if ((double)vector(b, i)[t->dimension] < t->value) {
            const uint32_t other = b->order[i];
            b->order[i] = b->order[lo];
            b->order[lo++] = other;
        }
    return lo;
}

static void link_child(build *b, int32_t node, bool right, int32_t child)
{
    if (node >= 0)
        *(right ? &b->p->nodes[node].right : &b->p->nodes[node].left) = child;
}

static void grow(build *b, uint32_t count)
{
    push(b, (part){ .hi = count, .node = -1 });
    while (b->part_count < b->most && b->parts[0].error > 0) {
        part t = pop(b);
        const uint32_t middle = divide(b, &t);
        if (middle == t.lo || middle == t.hi) { /* by rounding */
            t.error = 0;
            b->parts[b->part_count++] = t;
            continue;
        }
        const int32_t node = (int32_t)b->p->node_count++;
        b->p->nodes[node] = (trip_palette_node){ .value = t.value, .number = (int32_t)t.dimension };
        link_child(b, t.node, t.right, node);
        push(b, (part){ .lo = t.lo, .hi = middle, .node = node });
        push(b, (part){ .lo = middle, .hi = t.hi, .node = node, .right = true });
    }
}

static void make_entries(build *b)
{
    const unsigned bytes = trip_gaussian_entry_bytes(b->p->degree);
    b->p->count = b->part_count;
    for (uint64_t i = 0; i < b->part_count; i++) {
        const part *t = &b->parts[i];
        float mean[TRIP_SH_MAX][3] = { { 0 } };
        for (unsigned d = 0; d < b->size; d++) {
            double sum = 0;
            for (uint32_t k = t->lo; k < t->hi; k++)
                sum += (double)vector(b, k)[d];
            mean[1 + d / 3][d % 3] = (float)(sum / (t->hi - t->lo));
        }
        trip_gaussian_encode_entry(mean, b->p->degree, b->p->entries + i * bytes);
        link_child(b, t->node, t->right, ~(int32_t)i);
    }
}

/* The harmonics are orthonormal, so the mean square over all directions is the sum of squares
 * divided by 4 pi. */
static double error_of(const trip_palette *p, const float *v)
{
    float sh[TRIP_SH_MAX][3] = { { 0 } }, found[TRIP_SH_MAX][3];
    double sum = 0;
    memcpy(sh[1], v, trip_palette_size(p->degree) * sizeof *v);
    trip_gaussian_decode_entry(p->entries +
                                   trip_palette_find(p, sh) * trip_gaussian_entry_bytes(p->degree),
                               p->degree, found);
    for (int k = 1; k < trip_sh_count(p->degree); k++)
        for (int c = 0; c < 3; c++)
            sum +=
                ((double)sh[k][c] - (double)found[k][c]) * ((double)sh[k][c] - (double)found[k][c]);
    return sqrt(sum / (3 * 4 * M_PI));
}

static size_t entries_bytes(const trip_palette *p, uint64_t most)
{
    return most * (trip_gaussian_entry_bytes(p->degree) + sizeof *p->nodes);
}

bool trip_palette_build(trip_palette *p, const float *vectors, uint64_t count, int degree,
                        uint64_t most, trip_budget *budget)
{
    const bool tested = count > most;
    const size_t bytes = count * sizeof(uint32_t) + (most + 1) * sizeof(part);
    *p = (trip_palette){ .degree = degree, .budget = budget, .room = most };
    p->nodes = trip_budget_take(budget, entries_bytes(p, most));
    part *parts = trip_budget_take(budget, bytes);
    if (p->nodes && parts) {
        build b = { p, vectors, trip_palette_size(degree), (void *)(parts + most + 1), parts,
                    0, most };
        uint32_t used = 0;
        uint64_t measured = 0;
        p->entries = (void *)(p->nodes + most);
        for (uint32_t i = 0; i < count; i++)
            if (!tested || i % TRIP_PALETTE_TESTED)
                b.order[used++] = i;
        grow(&b, used);
        make_entries(&b);
        for (uint32_t i = 0; i < count; i += tested ? TRIP_PALETTE_TESTED : 1, measured++)
            p->error += error_of(p, vectors + (size_t)i * b.size);
        p->error /= (double)measured;
    }
    trip_budget_release(budget, parts, bytes);
    if (!p->entries)
        trip_palette_free(p);
    return p->entries != NULL;
}

unsigned trip_palette_find(const trip_palette *p, const float sh[TRIP_SH_MAX][3])
{
    int32_t at = p->node_count ? 0 : ~0;
    while (at >= 0) {
        const trip_palette_node *n = &p->nodes[at];
        const double value = (double)sh[1 + n->number / 3][n->number % 3];
        at = value < n->value ? n->left : n->right;
    }
    return (unsigned)~at;
}

void trip_palette_free(trip_palette *p)
{
    if (p->nodes)
        trip_budget_release(p->budget, p->nodes, entries_bytes(p, p->room));
    *p = (trip_palette){ .nodes = NULL };
}
