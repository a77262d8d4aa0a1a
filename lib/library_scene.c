/* Gaussian scenes: opening, views and frames (triptych.h). */
#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "framing.h"
#include "gaussian_frame.h"
#include "gaussian_set.h"
#include "library_context.h"
#include "normalise.h"
#include "report.h"
#include "shade.h"

int trip_context_open_scene(triptych *t, const char *path, uint64_t memory_bytes)
{
    t->session = (session){ .input = t->name };
    int status = trip_budget_create(&t->session.budget, memory_bytes);
    return status ? status : trip_gaussian_set_open(&t->scene, path, t->session.budget);
}

void trip_context_close_scene(triptych *t)
{
    trip_context_end_scene(t);
    trip_gaussian_set_close(t->scene);
    t->scene = NULL;
}

int trip_context_check_volume(const triptych *t)
{
    int status = trip_context_check_open(t);
    return !status && t->scene ? trip_fail(TRIP_USAGE, "render", t->name,
                                           "is a Gaussian scene; this applies to volumes only")
                               : status;
}

int triptych_get_scene(triptych *t, triptych_scene *out)
{
    trip_scope *before = trip_context_enter(t);
    int status = trip_context_check_open(t);
    *out = (triptych_scene){ 0 };
    if (!status && !t->scene)
        status = trip_fail(TRIP_USAGE, "render", t->name, "is not a Gaussian scene");
    if (status)
        return trip_context_leave(before, status);
    const trip_file_gaussian_header *h = &t->scene->header;
    *out = (triptych_scene){
        .gaussians = h->records,
        .degree = (int)h->degree,
        .antialiased = h->flags & TRIP_GAUSSIAN_ANTIALIASED,
        .flat = (h->flags & TRIP_GAUSSIAN_FLAT) != 0,
        .y_down = (h->flags & TRIP_GAUSSIAN_Y_DOWN) != 0,
        .z_up = (h->flags & TRIP_GAUSSIAN_Z_UP) != 0,
        .bytes = t->scene->bytes,
        .notes = t->scene->text,
    };
    for (int a = 0; a < 3; a++) {
        out->lo[a] = h->centre_lo[a];
        out->hi[a] = h->centre_hi[a];
        out->typical_lo[a] = h->typical_lo[a];
        out->typical_hi[a] = h->typical_hi[a];
        out->bricks += h->brick_count[a];
    }
    return trip_context_leave(before, 0);
}

int triptych_is_scene(const triptych *t)
{
    return t->scene != NULL;
}

/* ---- views ---- */

/* A cloud has no strays if its bounds exceed the typical bounds by at most this factor. The view
 * then fits the whole cloud. */
#define CLOUD_EXTENT 2

trip_view_object trip_context_scene_object(const triptych *t)
{
    const trip_file_gaussian_header *h = &t->scene->header;
    trip_view_object o = { .index_to_world = trip_affine_identity() };
    const bool y_down = h->flags & TRIP_GAUSSIAN_Y_DOWN;
    o.up = y_down ? trip_v3(0, -1, 0) : trip_v3(0, 1, 0);
    o.front = y_down ? trip_v3(0, 0, -1) : trip_v3(0, 0, 1);
    if (h->flags & TRIP_GAUSSIAN_Z_UP) {
        o.up = trip_v3(0, 0, 1);
        o.front = trip_v3(0, -1, 0);
    }
    bool whole = true, near = (h->flags & TRIP_GAUSSIAN_CLOUD) != 0;
    for (int a = 0; a < 3; a++) {
        const double typical = h->typical_hi[a] - h->typical_lo[a];
        whole &= !(typical > 0);
        near &= h->centre_hi[a] - h->centre_lo[a] <= CLOUD_EXTENT * typical;
    }
    for (int a = 0; a < 3; a++) {
        o.lo[a] = whole || near ? h->reach_lo[a] : h->typical_lo[a];
        o.hi[a] = whole || near ? h->reach_hi[a] : h->typical_hi[a];
    }
    return o;
}

/* ---- frames ---- */

static int check(const triptych *t, bool *reference)
{
    const triptych_renderer r = t->resources.renderer;
    *reference = r == TRIPTYCH_RENDERER_REFERENCE;
    if (r == TRIPTYCH_RENDERER_GL || r == TRIPTYCH_RENDERER_INTEGRAL)
        return trip_fail(TRIP_USAGE, "render", t->name,
                         "is a Gaussian scene; use --renderer cpu or reference");
    if (t->given.splat.footprint == TRIPTYCH_FOOTPRINT_FIXED)
        return trip_option_fail("--kernel", "fixed does not apply to Gaussian scenes");
    if (t->given.all.method == TRIPTYCH_METHOD_IMAGE)
        return trip_option_fail("--method", "image does not apply to Gaussian scenes");
    return draw_settings_check_kind(&t->given, t->scene->header.flags & TRIP_GAUSSIAN_CLOUD
                                                   ? DRAW_KIND_CLOUD
                                                   : DRAW_KIND_SCENE);
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

static trip_gaussian_settings settings_of(const triptych *t)
{
    const draw_settings *g = &t->given;
    trip_gaussian_settings out = {
        .degree = g->scene.harmonics ? (int)g->scene.harmonics - 1 : TRIP_SH_DEGREE_MAX,
        .antialiased = t->scene->header.flags & TRIP_GAUSSIAN_ANTIALIASED,
        .shape = shape_of(g->splat.footprint),
        .opacity_scale = t->scene_opacity,
        .early_termination = g->all.early_termination == TRIPTYCH_ZERO ? DBL_MIN /* never */
                                                                       : g->all.early_termination,
        .clip = trip_context_clip(t),
        .depth = g->all.depth,
    };
    if (out.degree > (int)t->scene->header.degree)
        out.degree = (int)t->scene->header.degree;
    memcpy(out.background, t->settings.background, sizeof out.background);
    return out;
}

/* Sets the light on surfels. Colours of a camera have a light of their own, and get another only if
 * one is given. */
static bool choose_light(triptych *t)
{
    const uint32_t flags = t->scene->header.flags;
    const triptych_light *given = &t->given.light;
    trip_settings *s = &t->drawn_settings;
    if (given->kind == TRIPTYCH_LIGHT_VIEW)
        s->light_direction = trip_normalize(trip_camera_direction(
            &t->camera, given->toward[0], given->toward[1], given->toward[2]));
    s->headlight &= given->kind != TRIPTYCH_LIGHT_VIEW;
    return flags & TRIP_GAUSSIAN_CLOUD && s->shading &&
           (flags & TRIP_GAUSSIAN_SHADED || given->kind != TRIPTYCH_LIGHT_DEFAULT);
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

int trip_context_begin_scene(triptych *t)
{
    bool reference;
    const int side = t->given.all.samples > 0 ? t->given.all.samples : 1;
    int status = trip_context_check_idle(t, true);
    if (!status)
        status = check(t, &reference);
    if (!status && !t->has_view)
        status = trip_context_find_view(t, &(triptych_view){ 0 });
    if (!status && !t->renderer) /* lends its threads */
        status = trip_cpu_create(&t->renderer, t->session.budget, t->resources.threads);
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
    const bool lit = choose_light(t);
    const trip_affine identity = trip_affine_identity();
    status = lit ? trip_light_check(&t->drawn_settings, &identity) : 0;
    if (status) {
        trip_context_end_scene(t);
        return status;
    }
    const trip_gaussian_frame_params params = {
        .set = t->scene,
        .camera = &t->camera,
        .settings = settings_of(t),
        .by_lists = t->given.scene.order == TRIPTYCH_ORDER_LISTS ? &t->drawn_settings : NULL,
        .light = lit ? &t->drawn_settings : NULL,
        .reference = reference,
        .budget = t->session.budget,
        .runner = trip_renderer_runner(t->renderer),
    };
    status = trip_gaussian_frame_begin(&t->scene_frame, &params);
    t->begun = t->drawn = !status;
    if (status)
        trip_context_end_scene(t);
    return status;
}

static triptych_frame_stats stats_of(const triptych *t)
{
    const trip_gaussian_frame_stats s = trip_gaussian_frame_get_stats(t->scene_frame);
    const trip_gaussian_settings settings = settings_of(t);
    const bool reference = t->resources.renderer == TRIPTYCH_RENDERER_REFERENCE;
    return (triptych_frame_stats){
        .ms = trip_now_ms() - t->begun_ms,
        .wait_ms = s.read_ms,
        .draw_ms = s.draw_ms,
        .merge_ms = s.merge_ms,
        .splats = s.gaussians,
        .bytes_read = s.bytes_read,
        .reads = s.bricks,
        .memory_bytes = trip_budget_limit_bytes(t->session.budget),
        .peak_memory_bytes = trip_budget_peak_bytes(t->session.budget),
        .renderer = reference ? "reference" : "cpu",
        .device = reference ? "CPU, double precision, 1 thread" : t->device,
        .engine = "pread",
        .ring = "not used: Gaussians come from windows",
        .classify = TRIPTYCH_CLASSIFY_PRE,
        .footprint = t->given.splat.footprint,
        .early_termination = trip_gaussian_termination(&settings),
        .rays = t->drawn_settings.samples,
        .expected_error = -1,
    };
}

int trip_context_take_scene(triptych *t, float *rgba, float *depth)
{
    const int side = t->drawn_settings.samples;
    float *picture = side > 1 ? t->before : rgba;
    int status = trip_gaussian_frame_picture(t->scene_frame, picture, depth);
    if (!status && side > 1)
        trip_context_take_means(picture, side, t->turned.width, t->turned.height, rgba);
    if (!status && t->given.all.normalise)
        trip_normalise(rgba, (size_t)t->turned.width * (size_t)t->turned.height,
                       t->settings.background);
    if (!status) {
        snprintf(t->device, sizeof t->device, "%s", t->renderer->ops->device(t->renderer));
        t->stats = stats_of(t);
        t->has_stats = true;
    }
    return status;
}

void trip_context_end_scene(triptych *t)
{
    trip_gaussian_frame_end(t->scene_frame);
    t->scene_frame = NULL;
    trip_budget_release(t->session.budget, t->before, t->before_bytes);
    t->before = NULL;
    t->before_bytes = 0;
    t->begun = t->drawn = false;
}

void trip_context_explain_scene(const triptych *t, FILE *out)
{
    const trip_gaussian_frame_stats s = trip_gaussian_frame_get_stats(t->scene_frame);
    const trip_gaussian_settings settings = settings_of(t);
    const bool lists = t->given.scene.order == TRIPTYCH_ORDER_LISTS;
    fprintf(out, "scene       %llu Gaussians, harmonics up to degree %d of %u\n",
            (unsigned long long)t->scene->header.records, settings.degree, t->scene->header.degree);
    if (lists)
        fprintf(out, "order       by lists: %u of 3 have weight in the picture\n", s.layers);
    else
        fprintf(out, "order       by depth: at most %llu Gaussians wait in the window\n",
                (unsigned long long)s.window_records);
    fprintf(out, "footprint   %s%s\n",
            settings.shape == TRIP_GAUSSIAN_EXACT ? "exact, along each pixel's ray"
            : settings.shape == TRIP_GAUSSIAN_EWA ? "EWA, projected at the centre without limits"
                                                  : "projected at the centre, as in training",
            settings.antialiased ? "; opacity compensated for the blur of pixels" : "");
}
