/* bench surfels: measures deferred pictures of a cloud with and without the selection of visible
 * surfels. Tables 1 and 2 and Figure 6 of Guennebaud, Barthe & Paulin 2004 stand beside. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench_tables.h"
#include "clock.h"
#include "median.h"
#include "renderer.h"
#include "report.h"
#include "surfel_frame.h"

enum { SCENES = 3, MODES = 2, DYNAMIC_OBJECTS = 200, FOREST_OBJECTS = 6800, REPEAT_MAX = 1000 };

/* Table 1 of the paper: frames a second without and with selection, and the share of points that
 * selection culls. The forest has ranges: their middles. */
static const struct {
    const char *name;
    unsigned objects, columns;
    double paper_without, paper_with, paper_culled;
} scenes[SCENES] = {
    { "single", 1, 1, 34, 39, 0.70 },
    { "dynamic", DYNAMIC_OBJECTS, 20, 11.5, 33.5, 0.90 },
    { "forest", FOREST_OBJECTS, 85, 1.15, 13, 0.94 },
};

static const measure_column selection_columns[] = {
    { "scene", "scene", 0, 0 },
    { "objects", "objects", 0, 0 },
    { "in_view", "in view", 0, 0 },
    { "surfels", "millions of surfels in view", 3, 1e6 },
    { "culled", "culled", 3, 0 },
    { "away", "in bricks facing away", 3, 0 },
    { "without_fps", "frames/s without", 2, 0 },
    { "fps", "with selection", 2, 0 },
    { "speedup", "ratio", 2, 0 },
    { "named", "named by 12 + 20 bits", 3, 0 },
    { "paper_culled", "2004: culled", 2, 0 },
    { "paper_without", "2004: frames/s without", 2, 0 },
    { "paper_with", "2004: with", 2, 0 },
    { "paper_speedup", "2004: ratio", 2, 0 },
};

static const measure_column pass_columns[] = {
    { "scene", "scene", 0, 0 },
    { "selection", "selection", 0, 0 },
    { "ms", "median ms", 1, 0 },
    { "read_ms", "reading", 1, 0 },
    { "project_ms", "visibility, selection", 1, 0 },
    { "blend_ms", "blending", 1, 0 },
    { "project_rate", "millions of surfels/s", 2, 1e6 },
    { "blend_rate", "blended: millions/s", 2, 1e6 },
    { "bytes", "MB read", 1, 1e6 },
};

typedef struct measured {
    double ms[REPEAT_MAX];
    trip_surfel_frame_stats stats;  /* of the last frame */
    uint64_t drawn[FOREST_OBJECTS]; /* surfels read of each object in the last frame */
    double away;                    /* share of its surfels in bricks that face away */
} measured;

typedef struct run {
    const bench_options *o;
    trip_gaussian_set *set;
    trip_budget *budget;
    trip_renderer *cpu; /* lends its threads */
    trip_placed_set *placed;
    float *rgba;
    trip_vec3 up, right, back, centre; /* of the cloud */
    double radius;                     /* half the diagonal of its typical bounds */
} run;

/* ---- scenes ---- */

static void find_shape(run *r)
{
    const trip_file_gaussian_header *h = &r->set->header;
    const bool z_up = h->flags & TRIP_GAUSSIAN_Z_UP, y_down = h->flags & TRIP_GAUSSIAN_Y_DOWN;
    const double *lo = h->typical_lo, *hi = h->typical_hi;
    r->up = z_up ? trip_v3(0, 0, 1) : trip_v3(0, y_down ? -1 : 1, 0);
    r->right = trip_v3(1, 0, 0);
    r->back = trip_cross(r->right, r->up);
    r->centre =
        trip_scale(trip_add(trip_v3(lo[0], lo[1], lo[2]), trip_v3(hi[0], hi[1], hi[2])), 0.5);
    r->radius =
        trip_length(trip_sub(trip_v3(hi[0], hi[1], hi[2]), trip_v3(lo[0], lo[1], lo[2]))) / 2;
}

/* Turns the cloud about its centre and moves it. */
static void place(const run *r, trip_placed_set *p, double angle, trip_vec3 to)
{
    double m[3][4];
    for (int k = 0; k < 3; k++) {
        const trip_vec3 axis = trip_v3(k == 0, k == 1, k == 2);
        const trip_vec3 turned = trip_turned(axis, r->up, angle);
        for (int i = 0; i < 3; i++)
            m[i][k] = trip_component(turned, i);
    }
    const trip_vec3 moved = trip_sub(to, trip_turned(r->centre, r->up, angle));
    for (int i = 0; i < 3; i++)
        m[i][3] = trip_component(moved, i);
    trip_gaussian_transform_make(&p->placement, m);
    p->set = r->set;
}

/* Places the objects of a scene on a lattice, turned as in frame `frame`. The objects of the
 * dynamic scene turn. */
static void place_all(const run *r, int scene, int frame)
{
    const unsigned columns = scenes[scene].columns;
    const double step = 1.6 * r->radius;
    for (unsigned i = 0; i < scenes[scene].objects; i++) {
        const trip_vec3 along = trip_scale(r->right, step * (i % columns));
        const trip_vec3 across = trip_scale(r->back, -step * (double)(i / columns));
        const double angle = scene == 1 ? 2.4 * i + 0.1 * frame : scene == 2 ? 2.4 * i : 0;
        place(r, &r->placed[i], angle, trip_add(along, across));
    }
}

/* Looks at the single object from all sides, at all dynamic ones from above, and into the forest
 * from its edge. */
static int look(const run *r, int scene, int frame, trip_camera *camera)
{
    const double step = 1.6 * r->radius;
    const double wide = step * (scenes[scene].columns - 1) / 2;
    trip_vec3 eye, at;
    if (scene == 0) {
        at = trip_v3(0, 0, 0);
        eye = trip_scale(trip_turned(r->back, r->up, 0.1 * frame), 3.9 * r->radius);
        eye = trip_add(eye, trip_scale(r->up, 0.6 * r->radius));
    } else {
        const double rows = (double)scenes[scene].objects / scenes[scene].columns;
        const double away = scene == 1 ? 1.3 * wide : 2 * step,
                     high = scene == 1 ? wide : 1.5 * step;
        at = trip_add(trip_scale(r->right, wide), trip_scale(r->back, -step * rows / 2));
        eye = trip_add(trip_scale(r->right, wide + 0.2 * step * frame), trip_scale(r->back, away));
        eye = trip_add(eye, trip_scale(r->up, high));
    }
    const trip_affine identity = trip_affine_identity();
    const trip_camera_params params = { .eye = eye,
                                        .look = at,
                                        .up = r->up,
                                        .fov_degrees = scene == 0 ? 30 : 50,
                                        .width = r->o->sizes[0][0],
                                        .height = r->o->sizes[0][1] };
    return trip_camera_make(camera, &params, &identity);
}

/* ---- frames ---- */

static int draw(const run *r, int scene, bool selects, const trip_camera *camera,
                trip_surfel_history *history, measured *to, int frame)
{
    trip_surfel_frame *f;
    const double begun = trip_now_ms();
    memset(to->drawn, 0, sizeof to->drawn);
    const trip_surfel_frame_params params = {
        .sets = r->placed,
        .set_count = scenes[scene].objects,
        .drawn = to->drawn,
        .camera = camera,
        .settings = { .background = { 0, 0, 0, 1 } },
        .lod_px = 1,
        .unselected = !selects,
        .history = selects ? history : NULL,
        .budget = r->budget,
        .runner = trip_renderer_runner(r->cpu),
    };
    int status = trip_surfel_frame_begin(&f, &params);
    if (status)
        return status;
    do
        status = trip_surfel_frame_step(f, UINT64_MAX);
    while (status == TRIP_FRAME_MORE);
    if (!status)
        status = trip_surfel_frame_picture(f, r->rgba, NULL);
    to->stats = trip_surfel_frame_get_stats(f);
    trip_surfel_frame_end(f);
    if (frame >= 0)
        to->ms[frame] = trip_now_ms() - begun;
    return status;
}

/* Finds the share of surfels that front sides alone would leave out by bricks. */
static int find_away(const run *r, int scene, const trip_camera *camera, double *share)
{
    const trip_clip none = { .count = 0 };
    trip_surfel_plan plan;
    const int status =
        trip_surfel_plan_make(&plan, &(trip_surfel_plan_params){ .sets = r->placed,
                                                                 .set_count = scenes[scene].objects,
                                                                 .camera = camera,
                                                                 .clip = &none,
                                                                 .lod_px = 1,
                                                                 .front = true,
                                                                 .budget = r->budget });
    *share = (double)plan.away_records / (double)(plan.records + plan.away_records);
    trip_surfel_plan_drop(&plan, r->budget);
    return status;
}

/* Draws an untimed frame, then timed ones, with and without selection in turns. */
static int measure_scene(const run *r, int scene, measured to[MODES])
{
    trip_surfel_history history = { 0 };
    int status = 0;
    for (int frame = -1; frame < r->o->repeat && !status; frame++) {
        trip_camera camera;
        place_all(r, scene, frame);
        status = look(r, scene, frame, &camera);
        for (int selects = 0; selects < MODES && !status; selects++) {
            measure_progress_step(r->o->progress, scenes[scene].name);
            status = draw(r, scene, selects, &camera, &history, &to[selects], frame);
        }
        if (!status)
            status = find_away(r, scene, &camera, &to[1].away);
    }
    trip_surfel_history_drop(&history, r->budget);
    return status;
}

/* ---- tables ---- */

/* Returns the share of surfels that the paper's identifiers of 32 bits tell apart (section 4.2):
 * they have 12 bits for the object and 20 for its surfel. */
static double named_share(const measured *m)
{
    enum { OBJECTS = 1 << 12, SURFELS = 1 << 20 };
    uint64_t named = 0, all = 0;
    unsigned objects = 0;
    for (unsigned i = 0; i < FOREST_OBJECTS; i++) {
        all += m->drawn[i];
        if (m->drawn[i] && objects++ < OBJECTS)
            named += m->drawn[i] < SURFELS ? m->drawn[i] : SURFELS;
    }
    return all ? (double)named / (double)all : 1;
}

static void add_selection(const run *r, int scene, measured to[MODES], cJSON *rows)
{
    const trip_surfel_frame_stats *s = &to[1].stats;
    const double without = measure_median(to[0].ms, r->o->repeat);
    const double with = measure_median(to[1].ms, r->o->repeat);
    cJSON *row = measure_new_row(rows);
    cJSON_AddStringToObject(row, "scene", scenes[scene].name);
    measure_add(row, { "objects", scenes[scene].objects }, { "in_view", s->objects },
                { "surfels", (double)s->planned },
                { "culled", 1 - (double)s->visible / (double)s->planned }, { "away", to[1].away },
                { "without_fps", 1e3 / without }, { "fps", 1e3 / with },
                { "speedup", without / with }, { "named", named_share(&to[1]) },
                { "paper_culled", scenes[scene].paper_culled },
                { "paper_without", scenes[scene].paper_without },
                { "paper_with", scenes[scene].paper_with },
                { "paper_speedup", scenes[scene].paper_with / scenes[scene].paper_without });
}

static void add_passes(const run *r, int scene, measured to[MODES], cJSON *rows)
{
    for (int selects = 0; selects < MODES; selects++) {
        const trip_surfel_frame_stats *s = &to[selects].stats;
        /* Without selection, all surfels are read twice and blended once. */
        const double read = (double)s->read / (selects ? 1 : 2);
        cJSON *row = measure_new_row(rows);
        cJSON_AddStringToObject(row, "scene", scenes[scene].name);
        cJSON_AddStringToObject(row, "selection", selects ? "with" : "without");
        measure_add(row, { "ms", measure_median(to[selects].ms, r->o->repeat) },
                    { "read_ms", s->read_ms }, { "project_ms", s->project_ms },
                    { "blend_ms", s->blend_ms }, { "project_rate", read / s->project_ms * 1e3 },
                    { "blend_rate", (selects ? (double)s->visible : read) / s->blend_ms * 1e3 },
                    { "bytes", (double)s->bytes_read });
    }
}

static void describe(const run *r, bench_report *report)
{
    cJSON_AddStringToObject(report->settings, "data_set", r->o->input);
    cJSON_AddNumberToObject(report->settings, "surfels", (double)r->set->header.records);
    bench_report_add_size(report->settings, r->o->sizes[0]);
    cJSON_AddNumberToObject(report->settings, "repeat", r->o->repeat);
    bench_report_limit(report,
                       "single is one cloud, seen from all sides; dynamic are 200 clouds "
                       "that turn; forest are 6800 clouds, seen from their edge. Each frame "
                       "has another view. Bytes come from the system's cache.");
    bench_report_limit(report, "Without selection, all surfels are blended, as in section 3 of the "
                               "paper. They are read twice, and nothing hidden is left out. Both "
                               "draw the levels of detail of the default.");
    bench_report_limit(report, "2004: a head of 285,000 points, 200 figures of 450,000, and 6800 "
                               "trees of 750,000, on a GeForce FX 5900 at 512 x 512. It selects 90 "
                               "to 110 million points a second, and blends 11 to 13 million.");
    bench_report_limit(report, "The passes are those of the last frame. Keys have 32 bits of depth "
                               "and 32 of number. Identifiers of 32 bits, 12 for the object and 20 "
                               "for its surfel, name the share of surfels in the table.");
    bench_report_limit(report, "Bricks facing away are those that --sides front does not read in "
                               "the last frame; here both sides are drawn.");
}

static int measure_all(const run *r, bench_report *report)
{
    measured *to = calloc(SCENES * MODES, sizeof *to);
    int status = to ? 0 : trip_fail(TRIP_ERROR, "bench", r->o->input, "out of memory");
    measure_progress_expect(r->o->progress, SCENES * MODES * (r->o->repeat + 1));
    for (int scene = 0; scene < SCENES && !status; scene++)
        status = measure_scene(r, scene, to + scene * MODES);
    if (!status) {
        cJSON *selection = bench_report_table(
            report, "selection", "Selection of visible surfels (2004, Table 1)", selection_columns);
        for (int scene = 0; scene < SCENES; scene++)
            add_selection(r, scene, to + scene * MODES, selection);
        cJSON *passes = bench_report_table(report, "passes",
                                           "Times of the passes in ms (2004, Table 2 and Figure 6)",
                                           pass_columns);
        for (int scene = 0; scene < SCENES; scene++)
            add_passes(r, scene, to + scene * MODES, passes);
    }
    free(to);
    return status;
}

static int open_all(run *r)
{
    int status = trip_budget_create(&r->budget, r->o->memory_bytes);
    if (!status)
        status = trip_gaussian_set_open(&r->set, r->o->input, r->budget);
    if (!status && !(r->set->header.flags & TRIP_GAUSSIAN_FLAT))
        return trip_fail(TRIP_USAGE, "usage", r->o->input,
                         "is no cloud of surfels, which the table surfels measures");
    if (!status)
        status = trip_cpu_create(&r->cpu, r->budget, (unsigned)r->o->threads[0]);
    r->placed = calloc(FOREST_OBJECTS, sizeof *r->placed);
    r->rgba = malloc(4 * sizeof(float) * (size_t)r->o->sizes[0][0] * (size_t)r->o->sizes[0][1]);
    if (!status && (!r->placed || !r->rgba))
        status = trip_fail(TRIP_ERROR, "bench", r->o->input, "out of memory");
    if (!status)
        find_shape(r);
    return status;
}

int bench_surfels(const session *s, const bench_options *o, bench_report *report)
{
    (void)s;
    run r = { .o = o };
    int status = open_all(&r);
    if (!status)
        describe(&r, report);
    if (!status)
        status = measure_all(&r, report);
    free(r.rgba);
    free(r.placed);
    if (r.cpu)
        r.cpu->ops->destroy(r.cpu);
    trip_gaussian_set_close(r.set);
    trip_budget_destroy(r.budget);
    return status;
}
