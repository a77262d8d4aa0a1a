#include "visible.h"

#include <string.h>

#include "brick_box.h"
#include "report.h"

enum { AXIS = 2 }; /* the list to read; all lists hold the same voxels */

#define MIN_OPACITY (1.0 / 255.0)
#define SHARE_OF_DEPTH (1.0 / 16.0)
#define MIN_ALONE 0.1

/* A function to maximise, in index space:
 *     normal . p + offset + around |(across[0] . p + from[0], across[1] . p + from[1])| */
typedef struct form {
    trip_vec3 normal;
    double offset, around;
    double per_voxel;            /* its maximum growth */
    double slack;                /* covers rounding in a bound; 0 for exact bounds */
    double best;                 /* result so far, or the caller's start value */
    bool found;                  /* a voxel has this result */
    trip_visible_position where; /* the voxel */
    double step;                 /* bricks are read in steps, the farthest first */
    double left;                 /* maximum bound of the unread bricks */
    double from;                 /* minimum bound of the bricks to read next */
} form;

typedef struct trip_visible_search {
    trip_visible *visible;
    const trip_list *list;     /* the list being read */
    trip_selection open;       /* its unread bricks that may change the result */
    trip_selection *selection; /* its bricks to read next */
    trip_vec3 across[2];
    double from[2];
    int count;
    form forms[TRIP_REACHES_MAX];
    trip_square squares[TRIP_BLOCK_SQUARES_MAX]; /* of one run */
} search;

/* Returns the minimum extinction of a visible voxel, per world unit. */
static double min_extinction(const trip_visible *v, bool alone)
{
    const trip_affine *m = &v->data->index_to_world;
    if (alone)
        return -log1p(-MIN_ALONE) / cbrt(fabs(trip_affine_determinant(m)));
    trip_vec3 diagonal =
        trip_v3(v->hi[0] - v->lo[0] + 1, v->hi[1] - v->lo[1] + 1, v->hi[2] - v->lo[2] + 1);
    return -log1p(-MIN_OPACITY) / (SHARE_OF_DEPTH * trip_length(trip_affine_vector(m, diagonal)));
}

/* Sets the codes of the voxels to search for. */
static void choose_codes(trip_visible *v, double min)
{
    trip_code_set_make(&v->codes, v->table, min);
    trip_code_set_keep(&v->codes, trip_outline_codes(v->data, v->table, min));
}

void trip_visible_start(trip_visible *v, const double lo[3], const double hi[3])
{
    memcpy(v->lo, lo, sizeof v->lo);
    memcpy(v->hi, hi, sizeof v->hi);
    choose_codes(v, min_extinction(v, false));
}

void trip_visible_end(trip_visible *v)
{
    trip_outline_destroy(v->outline);
}

/* Computes a linear form. Every operation rounds monotonically in x, y and z alone, so the corners
 * of a box also bound the rounded values. */
static inline double linear(const form *f, double x, double y, double z)
{
    return f->normal.x * x + (f->normal.y * y + (f->normal.z * z + f->offset));
}

static double value_at(const search *s, const form *f, double x, double y, double z)
{
    double value = linear(f, x, y, z);
    if (f->around == 0)
        return value;
    double a = trip_dot(s->across[0], trip_v3(x, y, z)) + s->from[0];
    double b = trip_dot(s->across[1], trip_v3(x, y, z)) + s->from[1];
    return value + f->around * sqrt(a * a + b * b);
}

/* Returns a bound over a box. A convex function is greatest at a corner. */
static double bound(const search *s, const form *f, const trip_brick_box *b)
{
    double max = -INFINITY;
    if (f->around == 0)
        return linear(f, f->normal.x > 0 ? b->hi[0] : b->lo[0],
                      f->normal.y > 0 ? b->hi[1] : b->lo[1], f->normal.z > 0 ? b->hi[2] : b->lo[2]);
    for (int i = 0; i < 8; i++)
        max = fmax(max, value_at(s, f, i & 1 ? b->hi[0] : b->lo[0], i & 2 ? b->hi[1] : b->lo[1],
                                 i & 4 ? b->hi[2] : b->lo[2]));
    return max + f->slack;
}

/* Returns the maximum length of the image of a unit vector under the two rows. */
static double longest(trip_vec3 a, trip_vec3 b)
{
    double aa = trip_dot(a, a), bb = trip_dot(b, b), ab = trip_dot(a, b);
    return sqrt(0.5 * (aa + bb) + hypot(0.5 * (aa - bb), ab));
}

/* Sets two unit vectors across the axis. */
static void set_across(search *s, const trip_reach_origin *origin)
{
    const trip_affine *m = &s->visible->data->index_to_world;
    trip_vec3 axis = origin->axis;
    trip_vec3 other = fabs(axis.x) < 0.9 ? trip_v3(1, 0, 0) : trip_v3(0, 1, 0);
    trip_vec3 a = trip_normalize(trip_cross(axis, other)), b = trip_cross(axis, a);
    s->across[0] = trip_affine_transpose_vector(m, a);
    s->across[1] = trip_affine_transpose_vector(m, b);
    for (int i = 0; i < 2; i++)
        s->from[i] = -trip_dot(s->across[i], origin->index);
}

static form make_form(const search *s, trip_vec3 normal, double offset, double around)
{
    double turning = around > 0 ? around * longest(s->across[0], s->across[1]) : 0;
    double per_voxel = trip_length(normal) + turning;
    return (form){
        .normal = normal,
        .offset = offset,
        .around = around,
        .per_voxel = per_voxel,
        .slack = around > 0 ? 1e-5 * per_voxel : 0,
        .best = -INFINITY,
    };
}

/* Computes the bounds of an open brick. Closes it and returns false if it reaches no farther than
 * the result so far. */
static bool bound_brick(search *s, uint64_t index, const trip_file_slab *slab, double *bounds)
{
    const trip_brick_box position =
        trip_brick_box_of(&s->visible->data->header, slab, &s->list->bricks[index]);
    bool open = false;
    for (int i = 0; i < s->count; i++) {
        bounds[i] = bound(s, &s->forms[i], &position);
        open |= bounds[i] > s->forms[i].best;
    }
    if (!open)
        trip_selection_remove(&s->open, index);
    return open;
}

/* Calls `each` for all open bricks. */
static void each_open(search *s, void (*each)(search *s, uint64_t index, const double *bounds))
{
    const trip_list *list = s->list;
    double bounds[TRIP_REACHES_MAX];
    for (const trip_file_slab *slab = list->slabs; slab < list->slabs + list->slab_count; slab++)
        for (uint64_t b = slab->first_brick; b < slab->first_brick + slab->brick_count; b++)
            if (trip_selection_has(&s->open, b) && bound_brick(s, b, slab, bounds))
                each(s, b, bounds);
}

static void look_ahead_at(search *s, uint64_t index, const double *bounds)
{
    (void)index;
    for (int i = 0; i < s->count; i++)
        s->forms[i].left = fmax(s->forms[i].left, bounds[i]);
}

static void select_brick(search *s, uint64_t index, const double *bounds)
{
    bool wanted = false;
    for (int i = 0; i < s->count; i++)
        wanted |= bounds[i] >= s->forms[i].from;
    if (!wanted)
        return;
    trip_selection_add(s->selection, index);
    trip_selection_remove(&s->open, index);
}

/* Selects the open bricks that reach farthest. Returns false if none can exceed the result so far.
 */
static bool select_bricks(search *s, trip_selection *selection)
{
    const double tile = (double)(1u << s->visible->data->header.tile_log2);
    bool some = false;
    for (int i = 0; i < s->count; i++)
        s->forms[i].left = -INFINITY;
    each_open(s, look_ahead_at);
    for (int i = 0; i < s->count; i++) {
        form *f = &s->forms[i];
        f->from = fmax(f->left - f->step, nextafter(f->best, INFINITY));
        f->step = f->step > 0 ? 2 * f->step : f->per_voxel * tile;
        some |= f->left > f->best;
    }
    s->selection = selection;
    if (some)
        each_open(s, select_brick);
    return some;
}

/* Returns the forms that may exceed their result in the box, a bit each. */
static unsigned forms_beyond(const search *s, const trip_brick_box *position)
{
    unsigned beyond = 0;
    for (int i = 0; i < s->count; i++)
        if (bound(s, &s->forms[i], position) > s->forms[i].best)
            beyond |= 1u << i;
    return beyond;
}

/* Returns the box of a brick's voxels in one sheet. */
static trip_brick_box run_box(const trip_list *list, const trip_run *run)
{
    const trip_file_brick *b = &list->bricks[run->brick];
    return (trip_brick_box){ { run->u + b->u_min, run->v + b->v_min, run->sheet },
                             { run->u + b->u_max, run->v + b->v_max, run->sheet } };
}

static trip_brick_box square_box(const trip_run *run, const trip_square *square)
{
    const uint32_t corner = trip_square_corner(square);
    const double u = run->u + (double)trip_voxel_u(corner);
    const double v = run->v + (double)trip_voxel_v(corner);
    return (trip_brick_box){ { u, v, run->sheet }, { u + 7, v + 7, run->sheet } };
}

static void look_at_voxel(search *s, unsigned forms, const trip_visible_position *at)
{
    for (; forms; forms &= forms - 1) {
        form *f = &s->forms[__builtin_ctz(forms)];
        const double value = value_at(s, f, at->u, at->v, at->sheet);
        if (value > f->best) {
            f->best = value;
            f->found = true;
            f->where = *at;
        }
    }
}

static void look_at_square(search *s, const trip_run *run, const trip_square *square,
                           unsigned forms)
{
    uint32_t voxels[64];
    trip_square_voxels(square, voxels);
    s->visible->splats += square->count;
    for (uint32_t n = 0; n < square->count; n++) {
        const trip_visible_position at = { run->u + (double)trip_voxel_u(voxels[n]),
                                           run->v + (double)trip_voxel_v(voxels[n]), run->sheet,
                                           trip_voxel_code(voxels[n]) };
        if (trip_code_set_has(&s->visible->codes, at.code))
            look_at_voxel(s, forms, &at);
    }
}

/* Examines a run. Most squares cannot exceed the result so far and are skipped. */
static void look_at_run(search *s, const trip_batch *batch, const trip_run *run)
{
    const trip_brick_box all = run_box(s->list, run);
    if (!forms_beyond(s, &all))
        return;
    const trip_block block = trip_block_of(batch, run);
    const uint32_t count = trip_block_squares(&block, s->squares);
    for (uint32_t i = 0; i < count; i++) {
        const trip_brick_box position = square_box(run, &s->squares[i]);
        const unsigned forms = forms_beyond(s, &position);
        if (forms)
            look_at_square(s, run, &s->squares[i], forms);
    }
}

bool trip_visible_skip(void *user, const trip_selection *selection, const trip_run *run)
{
    const search *s = ((const trip_visible *)user)->search;
    if (!s)
        return false;
    const trip_brick_box position = run_box(selection->list, run);
    return !forms_beyond(s, &position);
}

static int read_selected(search *s, const trip_selection *selection)
{
    trip_reader *reader = s->visible->reader;
    trip_batch batch;
    const trip_pass pass = trip_pass_of(selection);
    int status = trip_reader_begin(reader, &pass);
    while (!status && (status = trip_reader_next(reader, &batch)) > 0) {
        for (size_t i = 0; i < batch.run_count; i++)
            look_at_run(s, &batch, &batch.runs[i]);
        trip_reader_release(reader, &batch);
        status =
            trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "render", "view", "interrupted") : 0;
    }
    return status;
}

static int open_bricks(search *s, const trip_list *list)
{
    const trip_visible *v = s->visible;
    int status = trip_selection_create(&s->open, v->data, list, false, 0, INT32_MAX, v->budget);
    for (uint64_t b = 0; b < list->brick_count && !status; b++)
        if (trip_code_set_has_some(&v->codes, list->bricks[b].code_min, list->bricks[b].code_max))
            trip_selection_add(&s->open, b);
    return status;
}

/* Searches a list. It reads the bricks that reach farthest first, alone: their voxels usually
 * exceed the bounds of most other bricks. */
static int find_in_list(search *s, const trip_list *list)
{
    const trip_visible *v = s->visible;
    trip_selection selection;
    s->list = list;
    for (int i = 0; i < s->count; i++)
        s->forms[i].step = 0;
    int status = open_bricks(s, list);
    for (bool more = true; more && !status;) {
        status = trip_selection_create(&selection, v->data, list, false, 0, INT32_MAX, v->budget);
        if (status)
            break;
        more = select_bricks(s, &selection);
        if (more)
            status = read_selected(s, &selection);
        trip_reader_begin(v->reader, NULL); /* ends the pass early */
        trip_selection_destroy(&selection, v->budget);
    }
    trip_selection_destroy(&s->open, v->budget);
    return status;
}

static void begin_with_positions(search *s)
{
    const trip_visible *v = s->visible;
    for (unsigned i = 0; i < v->position_count && i < TRIP_VISIBLE_POSITIONS; i++)
        if (trip_code_set_has(&v->codes, v->positions[i].code))
            look_at_voxel(s, (1u << s->count) - 1, &v->positions[i]);
}

static void keep_positions(const search *s)
{
    trip_visible *v = s->visible;
    for (int i = 0; i < s->count; i++)
        if (s->forms[i].found)
            v->positions[v->position_count++ % TRIP_VISIBLE_POSITIONS] = s->forms[i].where;
}

/* Searches all lists, starting from earlier results. The result of one list limits the search in
 * the next. */
static int find(search *s)
{
    const trip_list *list = NULL;
    int status = 0;
    begin_with_positions(s);
    s->visible->search = s;
    while (!status && (list = trip_dataset_next(s->visible->data, list, AXIS, 0, TRIP_KIND_VOXELS)))
        status = find_in_list(s, list);
    s->visible->search = NULL;
    keep_positions(s);
    return status;
}

/* Returns the result. If no voxel is visible together with others, returns the bound of all splats.
 */
static double result(const search *s, const form *f)
{
    const trip_visible *v = s->visible;
    const trip_brick_box all = { { v->lo[0], v->lo[1], v->lo[2] },
                                 { v->hi[0], v->hi[1], v->hi[2] } };
    return f->best > -INFINITY ? f->best : bound(s, f, &all);
}

int trip_visible_bounds(trip_visible *v, double lo[3], double hi[3])
{
    search s = { .visible = v, .count = 6 };
    for (int i = 0; i < 6; i++) {
        double sign = i < 3 ? -1 : 1;
        trip_vec3 normal =
            trip_v3(i % 3 == 0 ? sign : 0, i % 3 == 1 ? sign : 0, i % 3 == 2 ? sign : 0);
        s.forms[i] = make_form(&s, normal, 0, 0);
    }
    int status = find(&s);
    for (int a = 0; a < 3 && !status; a++) {
        lo[a] = -result(&s, &s.forms[a]);
        hi[a] = result(&s, &s.forms[a + 3]);
    }
    return status;
}

static search make_search(trip_visible *v, const trip_reach_origin *origin,
                          const trip_reach *wanted, int count)
{
    search s = { .visible = v, .count = count };
    set_across(&s, origin);
    for (int i = 0; i < count; i++) {
        trip_vec3 n = trip_affine_transpose_vector(&v->data->index_to_world, wanted[i].along);
        s.forms[i] = make_form(&s, n, -trip_dot(n, origin->index), wanted[i].around);
    }
    return s;
}

/* Adds the reach of the kernel beyond a voxel. */
static double with_kernel(const trip_visible *v, const form *f, double value)
{
    return value + v->kernel_radius * f->per_voxel;
}

int trip_visible_outline(trip_visible *v)
{
    int status = trip_outline_make(&v->outline, &(trip_outline_params){
                                                    .data = v->data,
                                                    .reader = v->reader,
                                                    .budget = v->budget,
                                                    .table = v->table,
                                                    .min_extinction = min_extinction(v, false),
                                                });
    if (!v->outline)
        return status;
    v->splats += trip_outline_splats(v->outline);
    choose_codes(v, min_extinction(v, true));
    return 0;
}

/* Starts from the values of the outline: voxels that reach no farther are not searched. */
static void begin_with_outline(search *s, const trip_reach_origin *origin, const trip_reach *wanted,
                               double *values)
{
    const trip_visible *v = s->visible;
    trip_outline_reach(v->outline, origin, wanted, s->count, values);
    for (int i = 0; i < s->count; i++) {
        form *f = &s->forms[i];
        f->best = values[i] - v->kernel_radius * f->per_voxel;
        while (with_kernel(v, f, f->best) > values[i]) /* rounding */
            f->best = nextafter(f->best, -INFINITY);
    }
}

int trip_visible_reach(trip_visible *v, const trip_reach_origin *origin, const trip_reach *wanted,
                       int count, double *values)
{
    search s = make_search(v, origin, wanted, count);
    if (v->outline)
        begin_with_outline(&s, origin, wanted, values);
    int status = find(&s);
    for (int i = 0; i < count; i++) {
        const form *f = &s.forms[i];
        if (!v->outline)
            values[i] = with_kernel(v, f, result(&s, f));
        else if (f->found)
            values[i] = fmax(values[i], with_kernel(v, f, f->best));
    }
    return status;
}
