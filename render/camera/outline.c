#include "outline.h"

#include <float.h>

#include "mean.h"
#include "report.h"

enum {
    AXIS = 2,         /* the list to read; all lists of a level hold the same voxels */
    MAX_VOXELS = 128, /* maximum along each side of the level */
    PIXELS = 128,     /* pixels along the longer side */
    CODES = 65536,
};

#define UNIT 4294967296.0   /* unit of optical depth */
#define MAX_OF_A_VOXEL 16.0 /* limit per voxel, so that sums stay within 64 bits */

typedef struct pixel {
    uint64_t depth; /* optical depth, in 1 / UNIT */
    float nearest, farthest;
} pixel;

/* An affine function of the list's indices. */
typedef struct form {
    double i, j, k, constant;
} form;

struct trip_outline {
    trip_budget *budget;
    const trip_affine *map;            /* of level 0 */
    trip_vec3 middle;                  /* centre of the box, in level 0's index space */
    trip_vec3 eye, right, up, forward; /* world directions; eye relative to the middle */
    bool parallel;
    double origin[2], pixel; /* of the picture: tangents, or lengths in parallel views */
    int size[2];
    uint64_t splats;
    pixel pixels[PIXELS + 1][PIXELS + 1]; /* [y][x] */
};

/* State of summing a list. */
typedef struct summing {
    trip_outline *outline;
    const trip_outline_params *params;
    const trip_list *list;
    form x, y, z;
    double width[2]; /* size of a voxel along right and up */
    uint32_t voxels[TRIP_RUN_RECORDS_MAX];
    double mass[CODES]; /* by code: opacity times area of a voxel */
} summing;

/* Returns the finest level that is small enough. It depends only on the grid, because data sets
 * with coarse levels have them down to one brick. */
static const trip_list *coarse_list(const trip_dataset *data)
{
    unsigned level = 0;
    if (trip_coordinates_uneven(&data->coordinates))
        return NULL;
    for (int a = 0; a < 3; a++)
        while ((data->header.dims[a] - 1) >> level >= MAX_VOXELS)
            level++;
    const trip_list *values =
        trip_dataset_find(data, AXIS, level, level ? TRIP_KIND_VALUES : TRIP_KIND_VOXELS);
    return values ? values : trip_dataset_find(data, AXIS, level, TRIP_KIND_MEANS);
}

static trip_vec3 column(const trip_affine *m, int axis)
{
    return trip_v3(m->m[0][axis], m->m[1][axis], m->m[2][axis]);
}

static void set_view(trip_outline *o, const trip_outline_params *p)
{
    const trip_camera_params *view = p->view;
    o->budget = p->budget;
    o->map = &p->data->index_to_world;
    o->middle = trip_v3(0.5 * p->lo[0] + 0.5 * p->hi[0], 0.5 * p->lo[1] + 0.5 * p->hi[1],
                        0.5 * p->lo[2] + 0.5 * p->hi[2]);
    o->eye = trip_sub(view->eye, trip_affine_point(o->map, o->middle));
    o->forward = trip_normalize(trip_sub(view->look, view->eye));
    o->right = trip_normalize(trip_cross(o->forward, view->up));
    o->up = trip_cross(o->right, o->forward);
    o->parallel = view->ortho_height > 0;
}

/* Returns the picture position of a point relative to the eye. */
static void project(const trip_outline *o, trip_vec3 p, double at[2])
{
    double scale = o->parallel ? 1 : 1 / trip_dot(o->forward, p);
    at[0] = trip_dot(o->right, p) * scale;
    at[1] = trip_dot(o->up, p) * scale;
}

/* Sizes the picture for the box plus one voxel of the list around it. */
static void set_picture(trip_outline *o, const trip_outline_params *p, double voxel)
{
    double lo[2] = { INFINITY, INFINITY }, hi[2] = { -INFINITY, -INFINITY };
    for (int corner = 0; corner < 8; corner++) {
        double c[3], at[2];
        for (int a = 0; a < 3; a++)
            c[a] = corner >> a & 1 ? p->hi[a] + voxel : p->lo[a] - voxel;
        trip_vec3 from_middle = trip_sub(trip_v3(c[0], c[1], c[2]), o->middle);
        project(o, trip_sub(trip_affine_vector(o->map, from_middle), o->eye), at);
        for (int a = 0; a < 2; a++) {
            lo[a] = fmin(lo[a], at[a]);
            hi[a] = fmax(hi[a], at[a]);
        }
    }
    o->pixel = fmax(hi[0] - lo[0], hi[1] - lo[1]) / PIXELS;
    for (int a = 0; a < 2; a++) {
        o->origin[a] = lo[a];
        o->size[a] = (int)fmin(PIXELS, ceil((hi[a] - lo[a]) / o->pixel));
    }
}

/* Returns the coordinate along a world direction, relative to the eye, as a function of the list's
 * indices. */
static form make_form(const summing *s, trip_vec3 axis)
{
    const trip_affine *m = &s->list->index_to_world;
    const trip_outline *o = s->outline;
    double first = s->list->sheet_first, step = s->list->sheet_step;
    form f = { trip_dot(axis, column(m, 0)), trip_dot(axis, column(m, 1)),
               trip_dot(axis, column(m, 2)), -trip_dot(axis, o->eye) };
    f.constant -= f.i * (o->middle.x - first) / step + f.j * (o->middle.y - first) / step +
                  f.k * (o->middle.z - first) / step;
    return f;
}

static double size_of(const form *f)
{
    return sqrt(f->i * f->i + f->j * f->j + f->k * f->k);
}

static void fill_masses(summing *s)
{
    const trip_affine *m = &s->list->index_to_world;
    const trip_file_header *h = &s->params->data->header;
    const trip_mean_scale scale =
        trip_mean_scale_make(h->typical_min, h->typical_max, &s->params->data->codes);
    const double length = trip_length(column(m, AXIS));
    const double area = fabs(trip_affine_determinant(m)) / length;
    double extinctions[TRIP_MEAN_SHARES];
    for (unsigned code = 0; code < CODES; code += TRIP_MEAN_SHARES) {
        const double of_mean = (double)s->params->table[trip_mean_value(&scale, code)].extinction;
        if (s->list->kind == TRIP_KIND_MEANS)
            trip_mean_extinctions(of_mean, length, extinctions);
        for (unsigned i = 0; i < TRIP_MEAN_SHARES; i++) {
            if (s->list->kind != TRIP_KIND_MEANS)
                extinctions[i] = (double)s->params->table[code + i].extinction;
            s->mass[code + i] = extinctions[i] > 0 ? -expm1(-extinctions[i] * length) * area : 0;
        }
    }
}

static bool some_has_mass(const summing *s, const trip_file_brick *b)
{
    for (unsigned code = b->code_min; code <= b->code_max; code++)
        if (s->mass[code] > 0)
            return true;
    return false;
}

/* Returns the share of the pixel at `at` that [lo, hi] covers. */
static inline double part_in(int at, double lo, double hi)
{
    const double past = hi < at + 1 ? hi : at + 1, from = lo > at ? lo : at;
    return (past - from) / (hi - lo);
}

static inline void add_to(pixel *p, double optical, float z)
{
    p->depth += (uint64_t)((optical < MAX_OF_A_VOXEL ? optical : MAX_OF_A_VOXEL) * UNIT);
    p->nearest = z < p->nearest ? z : p->nearest;
    p->farthest = z > p->farthest ? z : p->farthest;
}

/* Draws a voxel as a rectangle of its size. */
static void add_voxel(summing *s, double x, double y, double z, double mass)
{
    trip_outline *o = s->outline;
    const double scale = (o->parallel ? 1 : 1 / z) / o->pixel;
    const double at[2] = { x, y };
    double lo[2], hi[2], columns[PIXELS];
    int first[2], last[2];
    if (!o->parallel && !(z > 0))
        return;
    for (int a = 0; a < 2; a++) {
        double middle = at[a] * scale - o->origin[a] / o->pixel;
        double half = 0.5 * s->width[a] * scale;
        half = half > 1e-6 ? half : 1e-6;
        lo[a] = middle - half;
        hi[a] = middle + half;
        first[a] = lo[a] > 0 ? lo[a] < PIXELS ? (int)lo[a] : PIXELS : 0;
        last[a] = hi[a] < 0 ? -1 : hi[a] < o->size[a] - 1 ? (int)hi[a] : o->size[a] - 1;
    }
    mass *= scale * scale;
    for (int u = first[0]; u <= last[0]; u++)
        columns[u] = part_in(u, lo[0], hi[0]);
    for (int v = first[1]; v <= last[1]; v++) {
        double row = mass * part_in(v, lo[1], hi[1]);
        for (int u = first[0]; u <= last[0]; u++)
            add_to(&o->pixels[v][u], row * columns[u], (float)z);
    }
}

static void add_run(summing *s, const trip_batch *batch, const trip_run *run)
{
    const trip_block block = trip_block_of(batch, run);
    const double k = run->sheet;
    trip_block_voxels(&block, 0, run->count, s->voxels);
    s->outline->splats += run->count;
    for (uint32_t n = 0; n < run->count; n++) {
        double mass = s->mass[trip_voxel_code(s->voxels[n])];
        if (!(mass > 0))
            continue;
        double i = run->u + (double)trip_voxel_u(s->voxels[n]);
        double j = run->v + (double)trip_voxel_v(s->voxels[n]);
        add_voxel(s, s->x.i * i + s->x.j * j + (s->x.k * k + s->x.constant),
                  s->y.i * i + s->y.j * j + (s->y.k * k + s->y.constant),
                  s->z.i * i + s->z.j * j + (s->z.k * k + s->z.constant), mass);
    }
}

static int read_selected(summing *s, const trip_selection *selection)
{
    trip_reader *reader = s->params->reader;
    trip_batch batch;
    const trip_pass pass = trip_pass_of(selection);
    int status = trip_reader_begin(reader, &pass);
    while (!status && (status = trip_reader_next(reader, &batch)) > 0) {
        for (size_t i = 0; i < batch.run_count; i++)
            add_run(s, &batch, &batch.runs[i]);
        trip_reader_release(reader, &batch);
        status =
            trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "render", "view", "interrupted") : 0;
    }
    trip_reader_begin(reader, NULL);
    return status;
}

static int sum_list(summing *s)
{
    const trip_outline_params *p = s->params;
    trip_selection selection;
    int status =
        trip_selection_create(&selection, p->data, s->list, false, 0, INT32_MAX, p->budget);
    if (status)
        return status;
    for (uint64_t b = 0; b < s->list->brick_count; b++)
        if (some_has_mass(s, &s->list->bricks[b]))
            trip_selection_add(&selection, b);
    status = read_selected(s, &selection);
    trip_selection_destroy(&selection, p->budget);
    return status;
}

/* Adds up the voxels of all joined data sets. */
static int sum(summing *s)
{
    const trip_list *list = s->list;
    int status = 0;
    for (; list && !status;
         list = trip_dataset_next(s->params->data, list, AXIS, list->level, list->kind)) {
        s->list = list;
        status = sum_list(s);
    }
    return status;
}

static bool shows(const pixel *p)
{
    return (double)p->depth >= -log1p(-TRIP_OUTLINE_OPACITY) * UNIT;
}

static bool some_shows(const trip_outline *o)
{
    for (int v = 0; v < o->size[1]; v++)
        for (int u = 0; u < o->size[0]; u++)
            if (shows(&o->pixels[v][u]))
                return true;
    return false;
}

static int make(trip_outline *o, summing *s, const trip_outline_params *p, const trip_list *list)
{
    s->outline = o;
    s->params = p;
    s->list = list;
    o->splats = 0;
    for (int v = 0; v <= PIXELS; v++)
        for (int u = 0; u <= PIXELS; u++)
            o->pixels[v][u] = (pixel){ 0, FLT_MAX, -FLT_MAX };
    set_view(o, p);
    set_picture(o, p, list->sheet_step);
    s->x = make_form(s, o->right);
    s->y = make_form(s, o->up);
    s->z = make_form(s, o->forward);
    s->width[0] = size_of(&s->x);
    s->width[1] = size_of(&s->y);
    fill_masses(s);
    return sum(s);
}

int trip_outline_make(trip_outline **out, const trip_outline_params *params)
{
    const trip_list *list = coarse_list(params->data);
    int status = 0;
    *out = NULL;
    if (!list)
        return 0;
    trip_outline *o = trip_budget_take(params->budget, sizeof *o);
    summing *s = trip_budget_take(params->budget, sizeof *s);
    if (o && s)
        status = make(o, s, params, list);
    else
        status = trip_fail(TRIP_ERROR, "render", "view",
                           "the outline of the visible part does not fit the memory given; raise "
                           "--memory");
    if (s)
        trip_budget_release(params->budget, s, sizeof *s);
    if (o && (status || !some_shows(o)))
        trip_budget_release(params->budget, o, sizeof *o);
    else
        *out = o;
    return status;
}

void trip_outline_destroy(trip_outline *o)
{
    if (o)
        trip_budget_release(o->budget, o, sizeof *o);
}

/* Returns the centre of a pixel at a depth, relative to the centre of the box. */
static trip_vec3 point_at(const trip_outline *o, int u, int v, double z)
{
    double across = o->parallel ? 1 : z;
    trip_vec3 x = trip_scale(o->right, across * (o->origin[0] + o->pixel * (u + 0.5)));
    trip_vec3 y = trip_scale(o->up, across * (o->origin[1] + o->pixel * (v + 0.5)));
    return trip_add(o->eye, trip_add(trip_scale(o->forward, z), trip_add(x, y)));
}

void trip_outline_reach(const trip_outline *o, const trip_reach_origin *origin,
                        const trip_reach *wanted, int count, double *values)
{
    trip_vec3 from = trip_affine_vector(o->map, trip_sub(origin->index, o->middle));
    for (int n = 0; n < count; n++)
        values[n] = -INFINITY;
    for (int i = 0; i < 2 * o->size[0] * o->size[1]; i++) {
        int u = i / 2 % o->size[0], v = i / 2 / o->size[0];
        const pixel *at = &o->pixels[v][u];
        if (!shows(at))
            continue;
        trip_vec3 p = point_at(o, u, v, (double)(i % 2 ? at->nearest : at->farthest));
        p = trip_sub(p, from);
        for (int n = 0; n < count; n++) {
            double around = wanted[n].around;
            if (around > 0)
                around *= trip_length(trip_cross(origin->axis, p));
            values[n] = fmax(values[n], trip_dot(wanted[n].along, p) + around);
        }
    }
}

uint64_t trip_outline_splats(const trip_outline *o)
{
    return o->splats;
}
