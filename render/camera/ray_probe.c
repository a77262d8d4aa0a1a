#include "ray_probe.h"

#include <string.h>

#include "brick_box.h"
#include "report.h"

#define NOTHING UINT32_MAX

/* Codes of four voxels in each of the sheets first to first + count - 1; NOTHING where none is. */
typedef struct samples {
    const trip_ray_probe *probe;
    double from, to; /* the part of the ray inside the clipping planes; z */
    int axis;
    int64_t first, count;
    uint32_t *codes;
    uint32_t voxels[TRIP_RUN_RECORDS_MAX]; /* of one run */
} samples;

static int longest_axis(trip_vec3 v)
{
    double x = fabs(v.x), y = fabs(v.y), z = fabs(v.z);
    return x >= y && x >= z ? 0 : y >= z ? 1 : 2;
}

static const trip_coordinates *positions(const samples *s)
{
    return &s->probe->data->coordinates;
}

/* Returns z where the ray meets a sheet. */
static double z_of(const samples *s, double sheet)
{
    const trip_ray_probe *p = s->probe;
    return (trip_coordinates_position(positions(s), s->axis, sheet) -
            trip_component(p->origin, s->axis)) /
           trip_component(p->direction, s->axis);
}

/* Returns the ray's u (`which` is 0) or v (1) at z, in voxels. */
static double across_at(const samples *s, double z, int which)
{
    const trip_ray_probe *p = s->probe;
    const int axis = (s->axis + 1 + which) % 3;
    return trip_coordinates_index(positions(s), axis,
                                  trip_component(p->origin, axis) +
                                      z * trip_component(p->direction, axis));
}

/* Returns u or v at a sheet. */
static double across(const samples *s, double sheet, int which)
{
    return across_at(s, z_of(s, sheet), which);
}

/* Narrows [from, to] to the part where o + z d lies in [lo, hi]. */
static void narrow(double o, double d, double lo, double hi, double *from, double *to)
{
    if (d == 0) {
        if (o < lo || o > hi)
            *to = -INFINITY;
        return;
    }
    double a = (lo - o) / d, b = (hi - o) / d;
    *from = fmax(*from, fmin(a, b));
    *to = fmin(*to, fmax(a, b));
}

/* Finds the sheets that the ray meets inside the grid. The count stays 0 if the ray misses it. */
static void find_sheets(samples *s)
{
    const trip_ray_probe *p = s->probe;
    const trip_list *list = trip_dataset_find(p->data, s->axis, 0, TRIP_KIND_VOXELS);
    double from = 0, to = INFINITY;
    if (!list)
        return;
    for (int a = 0; a < 3; a++)
        narrow(trip_component(p->origin, a), trip_component(p->direction, a),
               trip_coordinates_position(positions(s), a, -0.5),
               trip_coordinates_position(positions(s), a, (double)list->dims[a] - 0.5), &from, &to);
    if (!(from <= to))
        return;
    double o = trip_component(p->origin, s->axis), d = trip_component(p->direction, s->axis);
    double lo = trip_coordinates_index(positions(s), s->axis, fmin(o + from * d, o + to * d));
    double hi = trip_coordinates_index(positions(s), s->axis, fmax(o + from * d, o + to * d));
    const double last = (double)(list->dims[s->axis] - 1);
    s->first = (int64_t)fmin(fmax(round(lo), 0), last);
    s->count = (int64_t)fmin(fmax(round(hi), 0), last) - s->first + 1;
}

static bool overlaps(double a, double b, double lo, double hi)
{
    return fmax(a, b) + 1 >= lo && fmin(a, b) - 1 <= hi;
}

static bool may_hold(const samples *s, const trip_brick_box *box)
{
    double from = fmax(box->lo[2], (double)s->first);
    double to = fmin(box->hi[2], (double)(s->first + s->count - 1));
    return from <= to && overlaps(across(s, from, 0), across(s, to, 0), box->lo[0], box->hi[0]) &&
           overlaps(across(s, from, 1), across(s, to, 1), box->lo[1], box->hi[1]);
}

static bool select_bricks(const samples *s, trip_selection *selection)
{
    const trip_list *list = selection->list;
    bool some = false;
    for (const trip_file_slab *slab = list->slabs; slab < list->slabs + list->slab_count; slab++)
        for (uint64_t b = slab->first_brick; b < slab->first_brick + slab->brick_count; b++) {
            const trip_brick_box box =
                trip_brick_box_of(&s->probe->data->header, slab, &list->bricks[b]);
            if (may_hold(s, &box)) {
                trip_selection_add(selection, b);
                some = true;
            }
        }
    return some;
}

/* Keeps the voxels of a run next to the ray. */
static void take_run(samples *s, const trip_batch *batch, const trip_run *run)
{
    if (run->sheet < s->first || run->sheet >= s->first + s->count)
        return;
    const trip_block block = trip_block_of(batch, run);
    uint32_t *codes = s->codes + 4 * (run->sheet - s->first);
    double u = floor(across(s, run->sheet, 0)) - run->u,
           v = floor(across(s, run->sheet, 1)) - run->v;
    double tile = (double)(1u << s->probe->data->header.tile_log2);
    if (u < -1 || v < -1 || u >= tile || v >= tile)
        return;
    trip_block_voxels(&block, 0, run->count, s->voxels);
    for (uint32_t n = 0; n < run->count; n++) {
        double du = (double)trip_voxel_u(s->voxels[n]) - u;
        double dv = (double)trip_voxel_v(s->voxels[n]) - v;
        if ((du == 0 || du == 1) && (dv == 0 || dv == 1))
            codes[(int)du + 2 * (int)dv] = trip_voxel_code(s->voxels[n]);
    }
}

static int read_selected(samples *s, const trip_selection *selection)
{
    trip_reader *reader = s->probe->reader;
    trip_batch batch;
    const trip_pass pass = trip_pass_of(selection);
    int status = trip_reader_begin(reader, &pass);
    while (!status && (status = trip_reader_next(reader, &batch)) > 0) {
        for (size_t i = 0; i < batch.run_count; i++)
            take_run(s, &batch, &batch.runs[i]);
        trip_reader_release(reader, &batch);
        status =
            trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "render", "probe", "interrupted") : 0;
    }
    trip_reader_begin(reader, NULL);
    return status;
}

static int read_list(samples *s, const trip_list *list)
{
    const trip_ray_probe *p = s->probe;
    trip_selection selection;
    int status = trip_selection_create(&selection, p->data, list, false, 0, INT32_MAX, p->budget);
    if (status)
        return status;
    if (select_bricks(s, &selection))
        status = read_selected(s, &selection);
    trip_selection_destroy(&selection, p->budget);
    return status;
}

static int read_kind(samples *s, trip_kind kind)
{
    const trip_list *list = NULL;
    int status = 0;
    while (!status && (list = trip_dataset_next(s->probe->data, list, s->axis, 0, kind)))
        status = read_list(s, list);
    return status;
}

/* Computes the draw code where the ray meets a sheet, interpolated. Returns false if the nearest
 * voxel is missing.
 */
static bool code_at(const samples *s, int64_t sheet, double *code)
{
    const uint32_t *stored = s->codes + 4 * (sheet - s->first);
    double c[4] = { 0 };
    double u = across(s, (double)sheet, 0), v = across(s, (double)sheet, 1);
    u -= floor(u);
    v -= floor(v);
    const int nearest = (u >= 0.5) + 2 * (v >= 0.5);
    bool all = true;
    for (int n = 0; n < 4; n++) {
        all = all && stored[n] != NOTHING;
        if (stored[n] != NOTHING)
            c[n] = trip_draw_code_exact(&s->probe->draw, stored[n]);
    }
    *code = c[nearest];
    if (all)
        *code = (1 - v) * ((1 - u) * c[0] + u * c[1]) + v * ((1 - u) * c[2] + u * c[3]);
    return stored[nearest] != NOTHING;
}

static double extinction(const trip_tf_entry *table, double code)
{
    code = fmin(65535, fmax(0, code));
    unsigned lower = (unsigned)code;
    unsigned upper = lower < 65535 ? lower + 1 : lower;
    double t = code - lower;
    return (1 - t) * (double)table[lower].extinction + t * (double)table[upper].extinction;
}

/* With the nearest value, the pieces of a sheet are cut at one face along u and one along v. */
enum { NEAREST_PIECES = 3 };

static int64_t pieces_of(const samples *s)
{
    return s->probe->nearest ? s->count * NEAREST_PIECES : s->count;
}

/* A piece of the ray that belongs to a sheet. */
typedef struct piece {
    double from, to, code;
    double depth; /* optical depth */
} piece;

/* Returns u (`which` is 0) or v (1) of the face between the voxels on either side of the point
 * where the ray meets a sheet.
 */
static double face_at(const samples *s, int64_t sheet, int which)
{
    return floor(across(s, (double)sheet, which)) + 0.5;
}

/* Returns z where the ray meets the face, moved into [from, to]. */
static double cut_at(const samples *s, int64_t sheet, int which, double from, double to)
{
    const trip_ray_probe *p = s->probe;
    const int axis = (s->axis + 1 + which) % 3;
    const double d = trip_component(p->direction, axis);
    const double face = trip_coordinates_position(positions(s), axis, face_at(s, sheet, which));
    return d == 0 ? from : fmin(to, fmax(from, (face - trip_component(p->origin, axis)) / d));
}

/* Narrows a sheet's piece to one of its NEAREST_PIECES parts. Returns false if the part is empty or
 * its voxel missing.
 */
static bool narrow_to_box(const samples *s, int64_t sheet, int64_t part, piece *out)
{
    const double u = cut_at(s, sheet, 0, out->from, out->to);
    const double v = cut_at(s, sheet, 1, out->from, out->to);
    const double ends[NEAREST_PIECES + 1] = { out->from, fmin(u, v), fmax(u, v), out->to };
    out->from = ends[part];
    out->to = ends[part + 1];
    if (!(out->from < out->to))
        return false;
    const double middle = 0.5 * (out->from + out->to);
    const int corner = (across_at(s, middle, 0) >= face_at(s, sheet, 0)) +
                       2 * (across_at(s, middle, 1) >= face_at(s, sheet, 1));
    const uint32_t code = s->codes[4 * (sheet - s->first) + corner];
    out->code = code;
    return code != NOTHING;
}

/* Computes the n-th piece, counted from the eye. Returns false if the piece is not visible. */
static bool piece_at(const samples *s, int64_t n, piece *out)
{
    const bool nearest = s->probe->nearest;
    const int64_t at = nearest ? n / NEAREST_PIECES : n;
    bool ascends = trip_component(s->probe->direction, s->axis) > 0;
    int64_t sheet = s->first + (ascends ? at : s->count - 1 - at);
    double a = z_of(s, (double)sheet - 0.5), b = z_of(s, (double)sheet + 0.5);
    *out = (piece){ .from = fmax(s->from, fmin(a, b)), .to = fmin(s->to, fmax(a, b)) };
    if (!(out->from < out->to) || !(nearest ? narrow_to_box(s, sheet, n % NEAREST_PIECES, out)
                                            : code_at(s, sheet, &out->code)))
        return false;
    out->depth =
        extinction(s->probe->table, out->code) * (out->to - out->from) * s->probe->world_per_z;
    return out->depth > 0;
}

static void find_hit(const samples *s, trip_ray_hit *out)
{
    double whole = 0, sum = 0;
    piece p;
    *out = (trip_ray_hit){ 0 };
    for (int64_t n = pieces_of(s) - 1; n >= 0; n--)
        if (piece_at(s, n, &p)) {
            whole += p.depth;
            out->first_z = p.from;
        }
    out->opacity = -expm1(-whole);
    double wanted = -log1p(-out->opacity / 2);
    for (int64_t n = 0; n < pieces_of(s) && sum < wanted; n++)
        if (piece_at(s, n, &p)) {
            out->z = p.from + (p.to - p.from) * fmin(1, (wanted - sum) / p.depth);
            out->code = p.code;
            sum += p.depth;
        }
}

int trip_ray_probe_find(const trip_ray_probe *probe, trip_ray_hit *out)
{
    samples s = { .probe = probe, .to = INFINITY, .axis = longest_axis(probe->direction) };
    *out = (trip_ray_hit){ 0 };
    if (!trip_clip_ray(&probe->clip, probe->origin, probe->direction, &s.from, &s.to))
        return 0;
    find_sheets(&s);
    if (s.count == 0)
        return 0;
    size_t bytes = (size_t)s.count * 4 * sizeof *s.codes;
    s.codes = trip_budget_take(probe->budget, bytes);
    if (!s.codes)
        return trip_fail(TRIP_ERROR, "render", "probe",
                         "the ray does not fit the memory given; raise --memory");
    memset(s.codes, 0xff, bytes);
    int status = read_kind(&s, TRIP_KIND_VOXELS);
    if (!status)
        status = read_kind(&s, TRIP_KIND_HALO);
    if (!status)
        find_hit(&s, out);
    trip_budget_release(probe->budget, s.codes, bytes);
    return status;
}
