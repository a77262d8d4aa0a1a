#include "tree.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "geometry.h"
#include "interrupt.h"
#include "new_file.h"
#include "report.h"
#include "scatter.h"

enum { WAYS = 3, PARTS_MAX = 32768, BATCH = 4096 };

/* A branch or a leaf. */
typedef struct part {
    trip_vec3 from, along; /* a branch: its axis; a leaf: its middle and half its length */
    trip_vec3 across;      /* a leaf: half its width */
    double thick, thin;    /* a branch: radii at its ends; a leaf: 0 */
    double area_before;    /* of the parts before this one, and this one */
} part;

typedef struct tree {
    part parts[PARTS_MAX];
    unsigned count;
    double area;
} tree;

#pragma pack(push, 1)
typedef struct record {
    float position[3], normal[3];
    uint8_t colour[3];
} record;
#pragma pack(pop)

/* ---- growth ---- */

/* Returns a unit vector that is perpendicular to a unit vector. */
static trip_vec3 perpendicular(trip_vec3 v)
{
    const trip_vec3 other = fabs(v.x) < 0.6 ? trip_v3(1, 0, 0) : trip_v3(0, 0, 1);
    return trip_normalize(trip_cross(v, other));
}

static void add_part(tree *t, part p)
{
    const double length = trip_length(p.along);
    t->area +=
        p.thick > 0 ? M_PI * (p.thick + p.thin) * length : M_PI * length * trip_length(p.across);
    p.area_before = t->area;
    t->parts[t->count++] = p;
}

static void add_leaves(tree *t, trip_vec3 from, trip_vec3 along)
{
    const trip_vec3 axis = trip_normalize(along);
    for (unsigned i = 0; i < TRIP_TREE_LEAVES; i++) {
        const uint64_t n = t->count;
        const trip_vec3 side = trip_turned(perpendicular(axis), axis, 2.4 * i + trip_scatter(n, 0));
        const trip_vec3 to =
            trip_normalize(trip_add(trip_add(side, trip_scale(axis, 0.5)), trip_v3(0, -0.4, 0)));
        const double half = 0.010 + 0.008 * trip_scatter(n, 1);
        const trip_vec3 at = trip_add(from, trip_scale(along, (i + 1.0) / TRIP_TREE_LEAVES));
        add_part(t, (part){ .from = trip_add(at, trip_scale(to, 1.5 * half)),
                            .along = trip_scale(to, half),
                            .across = trip_scale(
                                trip_turned(perpendicular(to), to, 2 * M_PI * trip_scatter(n, 2)),
                                0.5 * half) });
    }
}

static void grow(tree *t, trip_vec3 from, trip_vec3 along, double thick, int forks)
{
    const uint64_t n = t->count;
    const trip_vec3 axis = trip_normalize(along), to = trip_add(from, along);
    add_part(t, (part){ .from = from, .along = along, .thick = thick, .thin = 0.7 * thick });
    if (forks == 0) {
        add_leaves(t, from, along);
        return;
    }
    for (unsigned i = 0; i < WAYS; i++) {
        const double angle = 2 * M_PI * (i + 0.5 * trip_scatter(n, 2 * i)) / WAYS;
        const double spread = 0.35 + 0.5 * trip_scatter(n, 2 * i + 1);
        const trip_vec3 side = trip_turned(perpendicular(axis), axis, angle + forks);
        const trip_vec3 way = trip_normalize(
            trip_add(trip_add(trip_scale(axis, cos(spread)), trip_scale(side, sin(spread))),
                     trip_v3(0, 0.08, 0)));
        grow(t, to, trip_scale(way, (0.66 + 0.16 * trip_scatter(n, 6 + i)) * trip_length(along)),
             0.62 * thick, forks - 1);
    }
}

/* ---- points ---- */

static const part *part_at(const tree *t, double area)
{
    unsigned from = 0, to = t->count - 1;
    while (from < to) {
        const unsigned middle = (from + to) / 2;
        if (t->parts[middle].area_before > area)
            to = middle;
        else
            from = middle + 1;
    }
    return &t->parts[from];
}

static void set_point(record *r, trip_vec3 position, trip_vec3 normal, const double colour[3],
                      double light)
{
    for (int a = 0; a < 3; a++) {
        r->position[a] = (float)trip_component(position, a);
        r->normal[a] = (float)trip_component(normal, a);
        r->colour[a] = (uint8_t)lrint(255 * fmin(1, colour[a] * light));
    }
}

/* The area of a tapered branch per length falls as its radius. */
static void put_on_branch(record *r, const part *p, uint64_t n)
{
    static const double bark[3] = { 0.36, 0.27, 0.20 };
    const double u = trip_scatter(n, 1), angle = 2 * M_PI * trip_scatter(n, 2);
    const double radius = sqrt(p->thick * p->thick * (1 - u) + p->thin * p->thin * u);
    const double share = (p->thick - radius) / (p->thick - p->thin);
    const trip_vec3 axis = trip_normalize(p->along);
    const trip_vec3 out = trip_turned(perpendicular(axis), axis, angle);
    set_point(r, trip_add(trip_add(p->from, trip_scale(p->along, share)), trip_scale(out, radius)),
              out, bark, 0.8 + 0.4 * trip_scatter(n, 3));
}

static void put_on_leaf(record *r, const part *p, uint64_t n)
{
    static const double green[3] = { 0.27, 0.45, 0.13 };
    const double far = sqrt(trip_scatter(n, 1)), angle = 2 * M_PI * trip_scatter(n, 2);
    const trip_vec3 at =
        trip_add(trip_scale(p->along, far * cos(angle)), trip_scale(p->across, far * sin(angle)));
    const uint64_t leaf = (uint64_t)(p->area_before * 1e9);
    set_point(r, trip_add(p->from, at), trip_normalize(trip_cross(p->along, p->across)), green,
              0.7 + 0.6 * trip_scatter(leaf, 3) + 0.1 * trip_scatter(n, 3));
}

static void put_point(record *r, const tree *t, uint64_t n)
{
    const part *p = part_at(t, t->area * trip_scatter(n, 0));
    if (p->thick > 0)
        put_on_branch(r, p, n);
    else
        put_on_leaf(r, p, n);
}

static int write_points(const tree *t, FILE *file, const char *output, uint64_t count)
{
    static record batch[BATCH];
    fprintf(file,
            "ply\nformat binary_little_endian 1.0\ncomment generated by triptych-generate\n"
            "element vertex %llu\n",
            (unsigned long long)count);
    for (int i = 0; i < 6; i++)
        fprintf(file, "property float %s%c\n", i < 3 ? "" : "n", 'x' + i % 3);
    fprintf(file, "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n");
    for (uint64_t from = 0; from < count;) {
        size_t used = 0;
        if (trip_interrupted())
            return trip_fail(TRIP_INTERRUPTED, "generate", output, "interrupted");
        for (; used < BATCH && from < count; used++, from++)
            put_point(&batch[used], t, from);
        if (fwrite(batch, sizeof *batch, used, file) != used)
            return trip_fail_errno("generate", output, "cannot write");
    }
    return 0;
}

static int write_file(const tree *t, const char *path, const char *output, uint64_t count)
{
    FILE *file = fopen(path, "wb");
    if (!file)
        return trip_fail_errno("generate", output, "cannot create");
    int status = write_points(t, file, output, count);
    if (fclose(file) != 0 && !status)
        status = trip_fail_errno("generate", output, "cannot write");
    return status;
}

int trip_tree_write(const char *output, uint64_t count)
{
    trip_new_file file;
    tree *t = calloc(1, sizeof *t);
    if (!t)
        return trip_fail(TRIP_ERROR, "generate", output, "out of memory");
    grow(t, trip_v3(0, 0, 0), trip_v3(0, 0.3, 0), 0.03, TRIP_TREE_FORKS);
    int status = trip_new_file_begin(&file, "generate", output);
    if (!status) {
        status = write_file(t, file.temporary, output, count);
        if (!status)
            status = trip_new_file_finish(&file);
        else
            trip_new_file_abandon(&file);
    }
    free(t);
    return status;
}
