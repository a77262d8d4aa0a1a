/* Gaussian scenes: opening, views and frames (triptych.h). */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "framing.h"
#include "gaussian_frame.h"
#include "gaussian_set.h"
#include "library_context.h"
#include "normalise.h"
#include "placed_stream.h"
#include "report.h"
#include "scene_file.h"
#include "shade.h"

static const char *name_of(const triptych_object *o)
{
    return o->name ? o->name : o->path;
}

/* Opens the set of object `i`, unless an earlier object has the same path. */
static int open_set(triptych *t, const triptych_object *objects, unsigned i)
{
    trip_gaussian_set *set = NULL;
    int status = 0;
    for (unsigned k = 0; k < i && !t->placed[i].set; k++)
        if (!strcmp(objects[k].path, objects[i].path))
            t->placed[i].set = t->placed[k].set;
    if (!t->placed[i].set) {
        status = trip_gaussian_set_open(&set, objects[i].path, t->session.budget);
        t->placed[i].set = status ? NULL : set;
    }
    if (i == 0)
        t->scene = set;
    return status;
}

static int place_set(trip_placed_set *p, const triptych_object *o)
{
    return trip_gaussian_transform_make(&p->placement, o->matrix) && p->placement.even
               ? 0
               : trip_fail(TRIP_USAGE, "render", name_of(o),
                           "is a Gaussian scene: its matrix must move, turn and scale it evenly, "
                           "without mirroring");
}

int trip_context_open_scenes(triptych *t, const triptych_object *objects, unsigned count,
                             uint64_t memory_bytes)
{
    t->session = (session){ .input = t->name };
    int status = trip_budget_create(&t->session.budget, memory_bytes);
    t->placed = status ? NULL : calloc(count + 1, sizeof *t->placed);
    t->placed_drawn = status ? NULL : calloc(count + 1, sizeof *t->placed_drawn);
    if (!status && (!t->placed || !t->placed_drawn))
        status = trip_fail(TRIP_ERROR, "render", t->name, "out of memory");
    for (unsigned i = 0; i < count && !status; i++) {
        t->placed_count = i + 1;
        status = place_set(&t->placed[i], &objects[i]);
        if (!status)
            status = open_set(t, objects, i);
    }
    return status;
}

/* Whether an earlier object has the same set. */
static bool is_shared(const triptych *t, unsigned i)
{
    bool shared = false;
    for (unsigned k = 0; k < i && !shared; k++)
        shared = t->placed[k].set == t->placed[i].set;
    return shared;
}

void trip_context_close_scene(triptych *t)
{
    trip_context_end_scene(t);
    trip_surfel_history_drop(&t->surfel_history, t->session.budget);
    trip_context_drop_openness(t);
    for (unsigned i = t->placed_count; i > 0; i--)
        if (t->placed[i - 1].set && !is_shared(t, i - 1))
            trip_gaussian_set_close(t->placed[i - 1].set);
    free(t->placed);
    free(t->placed_drawn);
    t->placed = NULL;
    t->placed_drawn = NULL;
    t->placed_count = 0;
    t->scene = NULL;
}

int trip_context_verify_scenes(const triptych *t)
{
    int status = 0;
    for (unsigned i = 0; i < t->placed_count && !status; i++)
        if (!is_shared(t, i))
            status = trip_gaussian_set_verify(t->placed[i].set, t->session.budget);
    return status;
}

unsigned triptych_get_objects(const triptych *t, const uint64_t **drawn)
{
    if (drawn)
        *drawn = t->placed_drawn;
    return t->placed_count;
}

int trip_context_check_volume(const triptych *t)
{
    int status = trip_context_check_open(t);
    return !status && trip_context_draws_scene(t)
               ? trip_fail(TRIP_USAGE, "render", t->name,
                           "is a Gaussian scene; this applies to volumes only")
               : status;
}

/* Adds the corners of a placed box to bounds. */
static void add_box(const trip_gaussian_transform *t, const double from_lo[3],
                    const double from_hi[3], double lo[3], double hi[3])
{
    for (int i = 0; i < 8; i++)
        for (int a = 0; a < 3; a++) {
            double at = t->m[a][3];
            for (int k = 0; k < 3; k++)
                at += t->m[a][k] * (i >> k & 1 ? from_hi[k] : from_lo[k]);
            if (t->identity) /* exact */
                at = i >> a & 1 ? from_hi[a] : from_lo[a];
            lo[a] = fmin(lo[a], at);
            hi[a] = fmax(hi[a], at);
        }
}

/* Clouds alone have light. */
static draw_kind kind_of(const triptych *t)
{
    bool clouds = true;
    if (t->mixed)
        return DRAW_KIND_OBJECTS;
    for (unsigned i = 0; i < t->placed_count; i++)
        clouds &= (t->placed[i].set->header.flags & TRIP_GAUSSIAN_CLOUD) != 0;
    return clouds ? DRAW_KIND_CLOUD : DRAW_KIND_SCENE;
}

/* Whether light shades a cloud without a light that is given. */
static bool is_lit(const triptych *t)
{
    bool lit = false;
    for (unsigned i = 0; i < t->placed_count; i++)
        lit |= (t->placed[i].set->header.flags & TRIP_GAUSSIAN_SHADED) != 0;
    return lit;
}

/* Adds a scene to the description of all. */
static void add_to_scene(const triptych *t, unsigned i, triptych_scene *out)
{
    const trip_placed_set *p = &t->placed[i];
    const trip_file_gaussian_header *h = &p->set->header;
    for (int a = 0; a < 3 && !i; a++) {
        out->lo[a] = out->typical_lo[a] = INFINITY;
        out->hi[a] = out->typical_hi[a] = -INFINITY;
    }
    add_box(&p->placement, h->centre_lo, h->centre_hi, out->lo, out->hi);
    add_box(&p->placement, h->typical_lo, h->typical_hi, out->typical_lo, out->typical_hi);
    out->gaussians += h->records;
    out->coarse += h->list_records - h->records;
    out->degree = (int)h->degree > out->degree ? (int)h->degree : out->degree;
    out->antialiased &= (h->flags & TRIP_GAUSSIAN_ANTIALIASED) != 0;
    out->flat &= (h->flags & TRIP_GAUSSIAN_FLAT) != 0;
    if (is_shared(t, i))
        return;
    out->bytes += p->set->bytes;
    for (int a = 0; a < 3; a++)
        out->bricks += h->brick_count[a];
}

/* Whether the picture shows one scene where it lies. */
static bool is_alone(const triptych *t)
{
    return t->placed_count == 1 && t->placed->placement.identity && !t->mixed;
}

int triptych_get_scene(triptych *t, triptych_scene *out)
{
    trip_scope *before = trip_context_enter(t);
    int status = trip_context_check_open(t);
    *out = (triptych_scene){ 0 };
    if (!status && !trip_context_draws_scene(t))
        status = trip_fail(TRIP_USAGE, "render", t->name, "is not a Gaussian scene");
    if (status)
        return trip_context_leave(before, status);
    if (t->scene)
        *out = (triptych_scene){ .antialiased = 1, .flat = 1, .notes = t->scene->text };
    out->y_down = t->scene && t->scene->header.flags & TRIP_GAUSSIAN_Y_DOWN;
    out->z_up = t->scene && t->scene->header.flags & TRIP_GAUSSIAN_Z_UP;
    out->volumes = trip_context_count_mixed(t);
    out->clouds = kind_of(t) == DRAW_KIND_CLOUD;
    out->lit = out->clouds && is_lit(t);
    out->objects = t->placed_count + out->volumes;
    out->moved = !is_alone(t);
    for (unsigned i = 0; i < t->placed_count; i++)
        add_to_scene(t, i, out);
    const trip_view_object object = trip_context_scene_object(t);
    if (!t->placed_count) {
        memcpy(out->lo, object.lo, sizeof object.lo);
        memcpy(out->hi, object.hi, sizeof object.hi);
    }
    memcpy(out->typical_lo, object.lo, sizeof object.lo);
    memcpy(out->typical_hi, object.hi, sizeof object.hi);
    return trip_context_leave(before, 0);
}

int triptych_is_scene(const triptych *t)
{
    return trip_context_draws_scene(t);
}

/* ---- views ---- */

/* A cloud has no strays if its bounds exceed the typical bounds by at most this factor. The view
 * then fits the whole cloud. */
#define CLOUD_EXTENT 2

static bool is_without_strays(const trip_file_gaussian_header *h)
{
    bool near = (h->flags & TRIP_GAUSSIAN_CLOUD) != 0;
    for (int a = 0; a < 3; a++)
        near &= h->centre_hi[a] - h->centre_lo[a] <=
                CLOUD_EXTENT * (h->typical_hi[a] - h->typical_lo[a]);
    return near;
}

/* Sets the box of all scenes: of most centres, or of everything that the Gaussians reach. */
static void add_scenes(const triptych *t, bool reach, trip_view_object *o)
{
    for (int a = 0; a < 3; a++) {
        o->lo[a] = INFINITY;
        o->hi[a] = -INFINITY;
    }
    for (unsigned i = 0; i < t->placed_count; i++) {
        const trip_gaussian_set *set = t->placed[i].set;
        const trip_file_gaussian_header *of = &set->header;
        const bool whole = reach || is_without_strays(of);
        add_box(&t->placed[i].placement, whole ? set->finest_lo : of->typical_lo,
                whole ? set->finest_hi : of->typical_hi, o->lo, o->hi);
    }
}

trip_view_object trip_context_scene_object(const triptych *t)
{
    const trip_file_gaussian_header none = { 0 }, *h = t->scene ? &t->scene->header : &none;
    trip_view_object o = { .index_to_world = trip_affine_identity() };
    const bool y_down = h->flags & TRIP_GAUSSIAN_Y_DOWN;
    o.up = y_down ? trip_v3(0, -1, 0) : trip_v3(0, 1, 0);
    o.front = y_down ? trip_v3(0, 0, -1) : trip_v3(0, 0, 1);
    if (h->flags & TRIP_GAUSSIAN_Z_UP) {
        o.up = trip_v3(0, 0, 1);
        o.front = trip_v3(0, -1, 0);
    }
    add_scenes(t, false, &o);
    if (!t->mixed && o.lo[0] >= o.hi[0] && o.lo[1] >= o.hi[1] && o.lo[2] >= o.hi[2])
        add_scenes(t, true, &o); /* the centres are one point */
    if (t->mixed)
        trip_context_add_mixed(t, &o);
    return o;
}

/* ---- frames ---- */

/* Gaussians wider than a pixel are drawn as they are. */
#define DEFAULT_LOD_PX 1.0

static bool has_front_sides(const triptych *t)
{
    return t->given.scene.sides == TRIPTYCH_SIDES_FRONT;
}

/* Returns whether settings are given that only blending has. Front sides only exist without. */
static bool blends(const triptych *t)
{
    return t->given.splat.footprint || t->given.all.early_termination != 0 ||
           (t->scene_opacity > 0 && t->scene_opacity != 1 && !has_front_sides(t));
}

/* Returns whether all objects are surfels, not ellipsoids. */
static bool is_flat(const triptych *t)
{
    bool flat = true;
    for (unsigned i = 0; i < t->placed_count; i++)
        flat &= (t->placed[i].set->header.flags & TRIP_GAUSSIAN_FLAT) != 0;
    return flat;
}

/* Returns the order that is drawn. */
static triptych_order order_of(const triptych *t)
{
    const triptych_renderer r = t->resources.renderer;
    const bool defers = kind_of(t) == DRAW_KIND_CLOUD && is_flat(t) &&
                        r != TRIPTYCH_RENDERER_INTEGRAL && !blends(t);
    return t->given.scene.order ? t->given.scene.order
           : defers             ? TRIPTYCH_ORDER_DEFERRED
                                : TRIPTYCH_ORDER_DEPTH;
}

static bool has_lists(const triptych *t)
{
    const triptych_order order = order_of(t);
    return order == TRIPTYCH_ORDER_LISTS || order == TRIPTYCH_ORDER_SHEETS;
}

/* Returns half the diagonal of the typical bounds, or of one Gaussian. */
static double radius_of(const triptych *t)
{
    const trip_view_object o = trip_context_scene_object(t);
    double sum = 0;
    for (int a = 0; a < 3; a++)
        sum += (o.hi[a] - o.lo[a]) * (o.hi[a] - o.lo[a]);
    return sum > 0 ? sqrt(sum) / 2 : 1;
}

/* Returns the thickness of the sheets, or 0 for other orders. */
static double sheet_of(const triptych *t)
{
    enum { SHEETS_IN_RADIUS = 1024 };
    if (t->given.scene.order != TRIPTYCH_ORDER_SHEETS)
        return 0;
    return t->given.scene.sheet > 0 ? t->given.scene.sheet : radius_of(t) / SHEETS_IN_RADIUS;
}

/* So thin sheets would take hours and show nothing more. */
static int check_sheet(const triptych *t)
{
    enum { SHEETS_MAX = 1 << 17 };
    const double least = radius_of(t) / SHEETS_MAX, sheet = sheet_of(t);
    return sheet > 0 && sheet < least
               ? trip_fail(TRIP_USAGE, "usage", "--sheet",
                           "%g is too thin for this scene; give at least %.3g", sheet, least)
               : 0;
}

static int check_sheets(const triptych *t)
{
    return is_alone(t) || t->given.scene.order != TRIPTYCH_ORDER_SHEETS
               ? check_sheet(t)
               : trip_option_fail("--order", "sheets draws one scene alone, where it lies");
}

static int check(const triptych *t)
{
    triptych_renderer r = t->resources.renderer;
    if (!t->mixed && r == TRIPTYCH_RENDERER_INTEGRAL && draw_settings_check(&t->given, &r, false))
        return TRIP_USAGE;
    const int status = draw_settings_check_kind(&t->given, &t->resources, kind_of(t));
    if (!status && t->given.scene.order == TRIPTYCH_ORDER_DEFERRED && !is_flat(t))
        return trip_option_fail("--order", "deferred requires clouds of surfels, not ellipsoids");
    if (!status && has_front_sides(t) && order_of(t) != TRIPTYCH_ORDER_DEFERRED)
        return trip_option_fail("--sides", "front requires --order deferred");
    return status ? status : check_sheets(t);
}

static int make_camera(triptych *t, int side)
{
    const trip_affine identity = trip_affine_identity();
    trip_camera_params view = t->turned;
    view.width *= side;
    view.height *= side;
    return trip_camera_make(&t->camera, &view, &identity);
}

static trip_gaussian_shape shape_of(triptych_footprint footprint)
{
    return footprint == TRIPTYCH_FOOTPRINT_EXACT ? TRIP_GAUSSIAN_EXACT
           : footprint == TRIPTYCH_FOOTPRINT_EWA ? TRIP_GAUSSIAN_EWA
                                                 : TRIP_GAUSSIAN_PROJECTED;
}

/* Returns the highest degree of the scenes. */
static int degree_of(const triptych *t)
{
    int degree = 0;
    for (unsigned i = 0; i < t->placed_count; i++) {
        const int own = (int)t->placed[i].set->header.degree;
        degree = own > degree ? own : degree;
    }
    return degree;
}

static trip_gaussian_settings settings_of(const triptych *t)
{
    const draw_settings *g = &t->given;
    trip_gaussian_settings out = {
        .degree = g->scene.harmonics ? (int)g->scene.harmonics - 1 : TRIP_SH_DEGREE_MAX,
        .antialiased = true,
        .shape = shape_of(g->splat.footprint),
        .opacity_scale = t->scene_opacity,
        .early_termination = g->all.early_termination == TRIPTYCH_ZERO ? DBL_MIN /* never */
                                                                       : g->all.early_termination,
        .clip = trip_context_clip(t),
        .light = t->lit ? &t->drawn_settings : NULL,
        .depth = g->all.depth || t->mixed || t->levels,
        .front = has_front_sides(t),
    };
    for (unsigned i = 0; i < t->placed_count; i++)
        out.antialiased &= (t->placed[i].set->header.flags & TRIP_GAUSSIAN_ANTIALIASED) != 0;
    if (out.degree > degree_of(t))
        out.degree = degree_of(t);
    if (!t->mixed && !t->levels && !t->given.all.normalise) /* it comes behind everything */
        memcpy(out.background, t->settings.background, sizeof out.background);
    return out;
}

/* Sets the light on surfels. Colours of a camera have a light of their own, and get another only if
 * one is given. */
static int choose_light(triptych *t)
{
    const triptych_light *given = &t->given.light;
    const trip_affine identity = trip_affine_identity();
    trip_settings *s = &t->drawn_settings;
    const bool lit = given->kind != TRIPTYCH_LIGHT_DEFAULT || is_lit(t);
    t->lit = lit && s->shading && kind_of(t) == DRAW_KIND_CLOUD;
    if (given->kind == TRIPTYCH_LIGHT_VIEW)
        s->light_direction = trip_normalize(trip_camera_direction(
            &t->camera, given->toward[0], given->toward[1], given->toward[2]));
    s->headlight &= given->kind != TRIPTYCH_LIGHT_VIEW;
    return t->lit ? trip_light_check(s, &identity) : 0;
}

/* Takes the picture of several rays per pixel. */
static int take_fine(triptych *t, int side)
{
    t->before_bytes = (size_t)t->camera.width * (size_t)t->camera.height * 4 * sizeof *t->before;
    t->before = side > 1 ? trip_budget_take(t->session.budget, t->before_bytes) : NULL;
    if (side == 1)
        t->before_bytes = 0;
    if (side == 1 || t->before)
        return 0;
    t->before_bytes = 0;
    return trip_fail(TRIP_ERROR, "render", "samples",
                     "a picture %d times as wide and high does not fit in memory; raise --memory "
                     "or lower --samples",
                     side);
}

static bool draws_by_gl(const triptych *t)
{
    return t->resources.renderer == TRIPTYCH_RENDERER_GL;
}

/* Makes the renderer that lends its device, if the scene needs one. */
static int make_device(triptych *t)
{
    return !draws_by_gl(t) || t->device_renderer
               ? 0
               : trip_renderer_create(&t->device_renderer, TRIP_RENDERER_GL, t->resources.threads,
                                      t->session.budget);
}

/* Returns the device that composites, or NULL. */
static const trip_tile_device *device_of(const triptych *t)
{
    return t->device_renderer ? t->device_renderer->ops->tile_device(t->device_renderer) : NULL;
}

/* Returns the device for deferred pictures, or NULL. */
static const trip_surfel_device *surfel_device_of(const triptych *t)
{
    return t->device_renderer ? t->device_renderer->ops->surfel_device(t->device_renderer) : NULL;
}

/* Returns the width of voxels in pixels that coarse Gaussians may stand for. */
static double lod_of(const triptych *t)
{
    const double given = t->given.lod.voxel_px;
    return given == TRIPTYCH_ZERO ? 0 : given > 0 ? given : DEFAULT_LOD_PX;
}

int trip_context_begin_scene(triptych *t)
{
    const triptych_renderer r = t->resources.renderer;
    const bool integrates = r == TRIPTYCH_RENDERER_INTEGRAL;
    const int side = t->given.all.samples > 0 ? t->given.all.samples : 1;
    int status = trip_context_check_idle(t, true);
    if (!status)
        status = check(t);
    if (!status && !t->has_view)
        status = trip_context_find_view(t, &(triptych_view){ 0 });
    if (!status && !t->renderer) /* lends its threads */
        status = trip_cpu_create(&t->renderer, t->session.budget, t->resources.threads);
    if (!status)
        status = make_device(t);
    if (!status)
        status = make_camera(t, side);
    if (!status)
        status = take_fine(t, side);
    if (status)
        return status;
    t->drawn_settings = t->settings;
    t->drawn_settings.classify = TRIP_CLASSIFY_PRE; /* h of splats */
    t->drawn_settings.samples = side;
    t->begun_ms = trip_now_ms();
    status = choose_light(t);
    if (!status)
        status = trip_context_begin_scene_effects(t);
    if (status) {
        trip_context_end_scene(t);
        return status;
    }
    memset(t->placed_drawn, 0, t->placed_count * sizeof *t->placed_drawn);
    const trip_gaussian_frame_params params = {
        .sets = t->placed,
        .set_count = t->placed_count,
        .drawn = t->placed_drawn,
        .camera = &t->camera,
        .settings = settings_of(t),
        .lod_px = lod_of(t) * side,
        .by_lists = has_lists(t) ? &t->drawn_settings : NULL,
        .sheet = sheet_of(t),
        .reference = r == TRIPTYCH_RENDERER_REFERENCE || (integrates && t->mixed),
        .integral = integrates && !t->mixed,
        .deferred = order_of(t) == TRIPTYCH_ORDER_DEFERRED,
        .history = &t->surfel_history,
        .tolerance = t->given.integral.tolerance,
        .device = device_of(t),
        .surfel_device = surfel_device_of(t),
        .budget = t->session.budget,
        .runner = trip_renderer_runner(t->renderer),
    };
    status = t->scene ? trip_gaussian_frame_begin(&t->scene_frame, &params) : 0;
    if (!status && t->mixed)
        status = trip_context_begin_mixed(t, side);
    t->begun = t->drawn = !status;
    t->scene_done = false;
    if (status)
        trip_context_end_scene(t);
    return status;
}

static const char *renderer_name(triptych_renderer r)
{
    return r == TRIPTYCH_RENDERER_REFERENCE  ? "reference"
           : r == TRIPTYCH_RENDERER_INTEGRAL ? "integral"
           : r == TRIPTYCH_RENDERER_GL       ? "gl"
                                             : "cpu";
}

static trip_gaussian_frame_stats stats_of_frame(const triptych *t)
{
    return t->scene_frame ? trip_gaussian_frame_get_stats(t->scene_frame)
                          : (trip_gaussian_frame_stats){ 0 };
}

static triptych_frame_stats stats_of(const triptych *t)
{
    const trip_gaussian_frame_stats s = stats_of_frame(t);
    const trip_gaussian_settings settings = settings_of(t);
    const triptych_renderer r = t->resources.renderer;
    return (triptych_frame_stats){
        .ms = trip_now_ms() - t->begun_ms,
        .wait_ms = s.read_ms,
        .draw_ms = s.draw_ms,
        .merge_ms = s.merge_ms,
        .splats = s.gaussians,
        .lod_px = lod_of(t),
        .bytes_read = s.bytes_read,
        .reads = s.bricks,
        .memory_bytes = trip_budget_limit_bytes(t->session.budget),
        .peak_memory_bytes = trip_budget_peak_bytes(t->session.budget),
        .renderer = renderer_name(r),
        .device = r == TRIPTYCH_RENDERER_REFERENCE ? "CPU, double precision, 1 thread" : t->device,
        .engine = "pread",
        .ring = order_of(t) == TRIPTYCH_ORDER_DEFERRED
                    ? "not used: surfels come from bricks, the nearest first"
                    : "not used: Gaussians come from windows",
        .classify = TRIPTYCH_CLASSIFY_PRE,
        .footprint = t->given.splat.footprint,
        .early_termination =
            order_of(t) == TRIPTYCH_ORDER_DEFERRED ? -1 : trip_gaussian_termination(&settings),
        .rays = t->drawn_settings.samples,
        .expected_error = -1,
        .order = order_of(t),
        .surfels_planned = s.surfels.planned,
        .surfels_away = s.surfels.away,
        .surfels_unread = s.surfels.unread,
        .surfels_outside = s.surfels.outside,
        .surfels_hidden = s.surfels.hidden,
        .surfels_visible = s.surfels.visible,
        .objects_in_view = s.surfels.objects,
    };
}

/* Drawing reports its progress in steps of this time. */
enum { REPORT_NS = 50000000 };

int trip_context_step_scene(triptych *t, uint64_t deadline_ns)
{
    int status = t->mixed ? trip_context_step_mixed(t, deadline_ns)
                          : trip_context_step_scene_effects(t, deadline_ns);
    if (!t->mixed && status == TRIP_FRAME_DONE)
        status = TRIP_FRAME_MORE; /* the frame is next */
    else if (!t->mixed)
        return status;
    while (!t->mixed && status == TRIP_FRAME_MORE) {
        const uint64_t next_ns = trip_now_ns() + REPORT_NS;
        const bool reports = t->show && next_ns < deadline_ns;
        status = trip_gaussian_frame_step(t->scene_frame, reports ? next_ns : deadline_ns);
        if (t->show && status >= 0) {
            uint64_t all = 0;
            for (unsigned i = 0; i < t->placed_count; i++)
                all += t->placed[i].set->header.records;
            const double done = trip_gaussian_frame_get_stats(t->scene_frame).done;
            trip_context_show_stage(t, "splat", (uint64_t)(done * (double)all), all);
        }
        if (!reports)
            break;
    }
    t->scene_done = status == TRIP_FRAME_DONE;
    return status;
}

int trip_context_take_scene(triptych *t, float *rgba, float *depth)
{
    const int side = t->drawn_settings.samples;
    float *picture = side > 1 ? t->before : rgba;
    float *distances = depth ? depth : t->levels;
    int status = t->mixed ? trip_context_take_mixed(t, picture, depth)
                          : trip_gaussian_frame_picture(t->scene_frame, picture, distances);
    if (!status && t->levels)
        trip_context_apply_scene_effects(t, picture, distances);
    if (!status && t->levels && !t->given.all.normalise)
        trip_put_behind(picture, (size_t)t->camera.width * (size_t)t->camera.height,
                        t->settings.background);
    if (!status && side > 1)
        trip_context_take_means(picture, side, t->turned.width, t->turned.height, rgba);
    if (!status && t->given.all.normalise)
        trip_normalise(rgba, (size_t)t->turned.width * (size_t)t->turned.height,
                       t->settings.background);
    if (!status && t->scene_done) {
        const trip_renderer *r = draws_by_gl(t) ? t->device_renderer : t->renderer;
        snprintf(t->device, sizeof t->device, "%s", r->ops->device(r));
        t->stats = stats_of(t);
        trip_context_add_scene_effects(t, &t->stats);
        if (t->mixed)
            trip_context_add_mixed_stats(t, &t->stats);
        t->has_stats = true;
    }
    return status;
}

void trip_context_end_scene(triptych *t)
{
    trip_gaussian_frame_end(t->scene_frame);
    t->scene_frame = NULL;
    if (t->mixed)
        trip_context_end_mixed(t);
    trip_context_end_scene_effects(t);
    trip_budget_release(t->session.budget, t->before, t->before_bytes);
    t->before = NULL;
    t->before_bytes = 0;
    t->begun = t->drawn = false;
}

void trip_context_explain_scene(const triptych *t, FILE *out)
{
    const trip_gaussian_frame_stats s = stats_of_frame(t);
    const trip_gaussian_settings settings = settings_of(t);
    const bool integral = t->resources.renderer == TRIPTYCH_RENDERER_INTEGRAL && !t->mixed;
    for (unsigned i = 0; i < t->placed_count; i++) {
        const trip_file_gaussian_header *h = &t->placed[i].set->header;
        const int own = (int)h->degree;
        unsigned times = 0;
        if (is_shared(t, i))
            continue;
        for (unsigned k = i; k < t->placed_count; k++)
            times += t->placed[k].set == t->placed[i].set;
        fprintf(out, "scene       %llu Gaussians, harmonics up to degree %d of %d",
                (unsigned long long)h->records, own < settings.degree ? own : settings.degree, own);
        if (times > 1)
            fprintf(out, ", in %u places", times);
        fprintf(out, "\n");
    }
    if (t->mixed)
        trip_context_explain_mixed(t, out);
    if (integral)
        fprintf(out, "order       none: the integral of overlapping Gaussians along each ray\n");
    else if (sheet_of(t) > 0)
        fprintf(out,
                "order       by sheets %.4g thick, in %u passes: at most %llu Gaussians meet a "
                "sheet at a time\n",
                sheet_of(t), s.layers, (unsigned long long)s.window_records);
    else if (order_of(t) == TRIPTYCH_ORDER_DEFERRED)
        fprintf(out,
                "order       deferred: %llu surfels of %u objects in view, nearest bricks first\n",
                (unsigned long long)s.planned, s.surfels.objects);
    else if (has_lists(t))
        fprintf(out, "order       by lists: %u of 3 have weight in the picture\n", s.layers);
    else
        fprintf(out, "order       by depth: at most %llu Gaussians wait in the window\n",
                (unsigned long long)s.window_records);
    if (lod_of(t) > 0)
        fprintf(out, "levels      coarse Gaussians for voxels of at most %g pixels: %llu of %llu\n",
                lod_of(t), (unsigned long long)s.coarse, (unsigned long long)s.planned);
    else
        fprintf(out, "levels      the Gaussians of the scene alone\n");
    if (order_of(t) == TRIPTYCH_ORDER_DEFERRED) {
        fprintf(out, "footprint   discs%s, with a filter of 0.48 square pixels (EWA)\n",
                has_front_sides(t) ? " seen from their front sides" : "");
    } else {
        fprintf(out, "footprint   %s%s\n",
                settings.shape == TRIP_GAUSSIAN_EXACT ? "exact, along each pixel's ray"
                : settings.shape == TRIP_GAUSSIAN_EWA
                    ? "EWA, projected at the centre without limits"
                    : "projected at the centre, as in training",
                settings.antialiased ? "; opacity compensated for the blur of pixels" : "");
    }
    trip_context_explain_scene_effects(t, out);
}

/* ---- scene files ---- */

int triptych_is_scene_file(const char *path)
{
    return trip_scene_file_is(path);
}

int triptych_read_scene_file(triptych *t, const char *path, triptych_object **objects,
                             unsigned *count)
{
    trip_scope *before = trip_context_enter_anew(t);
    return trip_context_leave(before, trip_scene_file_read(path, objects, count));
}

void triptych_free_objects(triptych_object *objects, unsigned count)
{
    trip_scene_file_free(objects, count);
}
