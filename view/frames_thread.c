/* The drawing thread of frames.h. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "frames_state.h"
#include "report.h"
#include "scene.h"

static void wake(trip_frames *f)
{
    f->params.wake(f->params.wake_user);
}

/* Level of detail of moving frames: the maximum width of a coarse level's voxels, in frame pixels.
 */
#define MOVING_LOD_PX 1.0
#define MOVING_SAMPLES 1
/* Moving frames aim at this share of their time on average, because some take longer. They only
 * reduce detail. If a frame would exceed its time by this factor, near parts become coarse too. */
#define MOVING_SHARE 0.85
#define MOVING_MAX 1.5
#define DEFAULT_FPS 30.0
/* A small frame is left out if it takes more than this share of the full frame's time. */
#define LITTLE_SHARE 0.75

/* ---- messages ---- */

static const char prefix[] = "triptych: ";

static const char *without_prefix(const char *line)
{
    return line + (strncmp(line, prefix, sizeof prefix - 1) ? 0 : sizeof prefix - 1);
}

static void say(trip_frames *f, const char *line, bool failed)
{
    pthread_mutex_lock(&f->lock);
    snprintf(f->status.message, sizeof f->status.message, "%.500s", without_prefix(line));
    f->status.failed = failed;
    f->status.messages++;
    pthread_mutex_unlock(&f->lock);
    wake(f);
}

/* Takes the context's warnings and notes. Failures come with the status of the call. */
static void take_line(void *user, const char *line)
{
    const char *text = without_prefix(line);
    if (!strncmp(text, "warning: ", 9) || !strncmp(text, "note: ", 6))
        say(user, line, false);
}

static void take_report(const char *line, void *user)
{
    say(user, line, false);
}

static void take_failure(void *user, int status, const char *line)
{
    if (status != TRIP_INTERRUPTED)
        say(user, line, true);
}

static void show_stage(trip_frames *f, const char *stage, double done)
{
    pthread_mutex_lock(&f->lock);
    snprintf(f->status.stage, sizeof f->status.stage, "%s", stage);
    f->status.done = done;
    pthread_mutex_unlock(&f->lock);
    const double ms = trip_now_ms();
    if (ms - f->woken_ms > 50) {
        f->woken_ms = ms;
        wake(f);
    }
}

static void show_progress(void *user, const char *stage, uint64_t done, uint64_t total)
{
    show_stage(user, stage, total ? (double)done / (double)total : 0);
}

/* ---- the mailbox ---- */

static bool has_newer(trip_frames *f)
{
    pthread_mutex_lock(&f->lock);
    const bool newer = f->quit || f->wanted_count != f->taken;
    pthread_mutex_unlock(&f->lock);
    return newer;
}

/* Returns whether a new wish names another data set or ends the thread. */
static bool has_other(trip_frames *f)
{
    pthread_mutex_lock(&f->lock);
    const bool other = f->quit || f->wanted.document != f->document;
    pthread_mutex_unlock(&f->lock);
    return other;
}

/* Sets whether a new wish cancels the work in progress. */
static void set_ends_early(trip_frames *f, bool ends)
{
    pthread_mutex_lock(&f->lock);
    f->ends_early = ends;
    pthread_mutex_unlock(&f->lock);
}

/* Waits for a wish, or for a picture to save. Returns false at the end of the thread. */
static bool take_wanted(trip_frames *f)
{
    pthread_mutex_lock(&f->lock);
    f->status.stage[0] = 0; /* idle */
    while (!f->quit && f->wanted_count == f->taken && !f->save && !(f->looks && f->whole)) {
        f->status.rests = true;
        pthread_cond_wait(&f->come, &f->lock);
    }
    const bool goes_on = !f->quit;
    if (goes_on)
        trip_scope_renew(&f->scope);
    if (goes_on && f->wanted_count != f->taken) {
        trip_wanted_release(&f->now);
        f->taken = f->wanted_count;
        f->whole = false;
        if (!trip_wanted_copy(&f->now, &f->wanted))
            trip_wanted_release(&f->now);
    }
    pthread_mutex_unlock(&f->lock);
    return goes_on && f->now.input;
}

/* ---- the data set ---- */

static void drop_picture(trip_frames *f)
{
    pthread_mutex_lock(&f->picture_lock);
    f->picture.rgba = NULL;
    pthread_mutex_unlock(&f->picture_lock);
    f->rgba = NULL;
    f->shown = NULL;
    f->width = f->height = 0;
}

static void close_data(trip_frames *f)
{
    drop_picture(f);
    triptych_end(f->t);
    triptych_close(f->t); /* also releases the pictures */
    if (f->source && f->params.release)
        f->params.release(f->params.user);
    f->source = NULL;
    free(f->function);
    f->function = NULL;
    f->has_settings = f->open = f->announced = f->warm = f->other_function = false;
    f->pace = f->whole_pace = (trip_pace){ 0 };
    pthread_mutex_lock(&f->lock);
    f->status.open = false;
    pthread_mutex_unlock(&f->lock);
}

/* If the heat data set fails to open, the data set is drawn without it, with a message. */
static int open_heat(trip_frames *f)
{
    char line[512];
    const int status = triptych_set_heat(f->t, f->now.heat);
    f->cold = status == TRIPTYCH_ERROR;
    if (!f->cold)
        return status;
    snprintf(line, sizeof line, "%s", triptych_error(f->t));
    say(f, line, false);
    return 0;
}

static bool has_levels(triptych *t, triptych_classify classify)
{
    unsigned levels;
    return triptych_count_levels(t, classify, &levels) == 0 && levels > 0;
}

static draw_kind kind_of(triptych *t)
{
    triptych_scene scene;
    if (!triptych_is_scene(t) || triptych_get_scene(t, &scene))
        return DRAW_KIND_VOLUME;
    return scene.volumes ? DRAW_KIND_OBJECTS : scene.clouds ? DRAW_KIND_CLOUD : DRAW_KIND_SCENE;
}

static int open_data(trip_frames *f)
{
    f->frugal &= f->document == f->now.document;
    f->plain &= f->frugal;
    const trip_frames_params *p = &f->params;
    const trip_wanted *w = &f->now;
    int status = 0;
    f->source = w->input;
    f->small = f->cold = false;
    f->document = w->document;
    pthread_mutex_lock(&f->lock);
    f->status = (trip_frames_status){ .document = w->document,
                                      .frames = f->status.frames,
                                      .moving = f->status.moving,
                                      .messages = f->status.messages };
    pthread_mutex_unlock(&f->lock);
    show_stage(f, "open", 0);
    if (p->find)
        status = p->find(p->user, f->t, w->input, w->keep_all, &f->small, &f->source);
    const triptych_resources resources = { .memory_bytes = p->memory_bytes,
                                           .threads = p->threads,
                                           .renderer = p->renderer,
                                           .engine = p->engine,
                                           .keep_pages = !f->frugal,
                                           .choices_folder = p->choices_folder,
                                           .choose_later = 1,
                                           .name = w->input };
    if (!status)
        status = p->open ? p->open(p->user, f->t, f->source, &resources)
                         : triptych_open(f->t, f->source, &resources);
    f->kind = status ? DRAW_KIND_VOLUME : kind_of(f->t);
    if (!status && w->heat && !f->kind)
        status = open_heat(f);
    f->open = status == 0;
    f->by_values = f->open && !f->kind && has_levels(f->t, TRIPTYCH_CLASSIFY_POST) &&
                   !has_levels(f->t, TRIPTYCH_CLASSIFY_PRE);
    return status;
}

/* A scene has colours of its own, and only the factor on its opacity applies. The volumes of a
 * scene file take no edited function. */
static void drop_function_of_scene(trip_frames *f)
{
    if (draw_kind_is_gaussian(f->kind)) {
        free((char *)(uintptr_t)f->now.function);
        f->now.function = NULL;
    }
    free((char *)(uintptr_t)f->now.text);
    f->now.text = NULL;
}

static int use_function(trip_frames *f)
{
    const trip_wanted *w = &f->now;
    char *key = NULL;
    if (asprintf(&key, "%a %s%s", w->opacity_scale, w->text ? "=" : "",
                 w->text       ? w->text
                 : w->function ? w->function
                               : "") < 0)
        return trip_fail(TRIP_ERROR, "view", w->input, "out of memory");
    if (f->function && !strcmp(f->function, key)) {
        free(key);
        return 0;
    }
    triptych_transfer_function wanted = { .name = w->text ? NULL : w->function,
                                          .text = w->text,
                                          .opacity_scale = w->opacity_scale,
                                          .all_values = 1 };
    int status = triptych_set_transfer_function(f->t, &wanted);
    const bool left_out = status == TRIPTYCH_LEFT_OUT;
    wanted.all_values = 0;
    if (left_out) /* the warning names the command to brick again */
        status = triptych_set_transfer_function(f->t, &wanted);
    pthread_mutex_lock(&f->lock);
    f->status.left_out = !status && left_out;
    pthread_mutex_unlock(&f->lock);
    f->other_function |= !status && !w->text && !f->kind;
    free(f->function);
    f->function = status ? NULL : key;
    if (status)
        free(key);
    return status;
}

/* Pictures with volumes beside other objects have no coarse levels by choice. */
static bool draws_levels(const trip_frames *f, const draw_settings *s)
{
    return f->kind != DRAW_KIND_OBJECTS && draw_settings_applies(s, DRAW_LOD, f->kind);
}

/* Returns the wanted settings with levels at least as coarse as lod_px. Short memory keeps the
 * finest level: pictures of several levels take more. */
static draw_settings with_levels(const trip_frames *f, double lod_px, double max_ms)
{
    draw_settings s = f->now.settings;
    if (f->plain || !draws_levels(f, &s))
        return s;
    /* Use post, unless a setting requires splats. */
    if (f->by_values && s.all.classify == TRIPTYCH_CLASSIFY_PRE)
        s.all.classify = TRIPTYCH_CLASSIFY_AUTO;
    s.lod.voxel_px = fmax(s.lod.voxel_px, lod_px);
    if (draw_settings_applies(&s, DRAW_MAX_MS, f->kind))
        s.lod.max_ms = s.lod.max_ms > 0 ? fmin(s.lod.max_ms, max_ms) : max_ms;
    return s;
}

static int use_settings(trip_frames *f, const draw_settings *wanted)
{
    int status = 0;
    if (!f->has_settings || !draw_settings_same(&f->settings, wanted))
        status = draw_settings_use(f->t, wanted);
    f->settings = *wanted;
    f->has_settings = status == 0;
    return status;
}

/* Takes the view that the library found when the data set was opened. */
static int find_navigation(trip_frames *f, trip_navigation *out)
{
    const trip_wanted *w = &f->now;
    triptych_view view = w->start ? *w->start : (triptych_view){ 0 };
    triptych_camera camera;
    if (w->has_navigation) {
        *out = w->navigation;
        return 0;
    }
    view.width = w->width;
    view.height = w->height;
    int status = triptych_set_view(f->t, &view);
    if (!status)
        status = triptych_get_camera(f->t, &camera);
    if (!status)
        *out = trip_navigation_from_camera(&camera, NULL);
    return status;
}

/* Converts the transfer function to data units for the editor. Some cannot be converted. */
static char *text_of_function(trip_frames *f)
{
    char *text = NULL;
    if (triptych_convert(f->t, &(triptych_conversion){ .function = f->now.function }, &text))
        return NULL;
    return text;
}

static int describe_scene(trip_frames *f, trip_opened *o)
{
    int status = triptych_get_scene(f->t, &o->scene);
    o->scene.notes = NULL;
    o->info = trip_scene_bounds(&o->scene);
    o->kind = f->kind;
    o->source = strdup(f->source);
    return status;
}

static int describe(trip_frames *f, trip_opened *o)
{
    if (f->kind)
        return describe_scene(f, o);
    int status = triptych_get_info(f->t, &o->info);
    if (status)
        return status;
    o->info.notes = NULL;
    status = triptych_get_histogram(f->t, &o->histogram);
    o->source = strdup(f->source);
    return status;
}

/* Merges news with news that the window has not taken yet. */
static void post(trip_frames *f, trip_opened *o)
{
    trip_opened *to = &f->opened;
    if (f->has_opened && to->document == o->document && !o->first) {
        to->navigation = o->navigation;
        if (o->function) {
            free(to->function);
            to->function = o->function;
        }
    } else {
        trip_opened_free(to);
        *to = *o;
    }
    f->has_opened = true;
}

static int announce(trip_frames *f)
{
    trip_opened o = {
        .document = f->now.document, .first = !f->announced, .small = f->small, .cold = f->cold
    };
    int status = find_navigation(f, &o.navigation);
    if (!status && o.first)
        status = describe(f, &o);
    if (status)
        return status;
    if (f->other_function)
        o.function = text_of_function(f);
    f->other_function = false;
    f->now.navigation = o.navigation;
    f->now.has_navigation = f->announced = true;
    pthread_mutex_lock(&f->lock);
    post(f, &o);
    f->status.open = true;
    pthread_mutex_unlock(&f->lock);
    wake(f);
    return 0;
}

/* ---- pictures ---- */

static int take_pictures(trip_frames *f)
{
    const trip_wanted *w = &f->now;
    const bool fits = f->rgba && f->width >= w->width && f->height >= w->height;
    float *pixels = NULL;
    if (fits)
        return 0;
    float *old[] = { f->rgba, (float *)f->shown };
    drop_picture(f);
    for (int i = 0; i < 2; i++)
        if (old[i])
            triptych_release_picture(f->t, old[i]);
    int status = triptych_new_picture(f->t, w->width, w->height, 1, &pixels);
    f->shown = (uint8_t *)pixels;
    if (!status)
        status = triptych_new_picture(f->t, w->width, w->height, 4, &f->rgba);
    f->width = status ? 0 : w->width;
    f->height = status ? 0 : w->height;
    return status;
}

static uint8_t byte_of(float x)
{
    return (uint8_t)(x > 0 ? (x < 1 ? x * 255 + 0.5f : 255) : 0);
}

static void show(trip_frames *f, int width, int height, bool whole)
{
    const trip_wanted *w = &f->now;
    const size_t pixels = (size_t)width * (size_t)height;
    pthread_mutex_lock(&f->picture_lock);
    for (size_t i = 0; i < pixels; i++) {
        for (size_t c = 0; c < 3; c++)
            f->shown[4 * i + c] = byte_of(f->rgba[4 * i + c]);
        f->shown[4 * i + 3] = 255;
    }
    f->picture = (trip_picture){ .rgba = f->shown,
                                 .width = width,
                                 .height = height,
                                 .full_width = w->width,
                                 .full_height = w->height,
                                 .navigation = w->navigation,
                                 .document = w->document,
                                 .whole = whole,
                                 .number = f->picture.number + 1 };
    pthread_mutex_unlock(&f->picture_lock);
    f->shown_ms = trip_now_ms();
    wake(f);
}

/* ---- frames ---- */

typedef struct frame {
    int width, height;
    bool whole; /* full size and detail */
    bool final; /* and with the samples and rays that the quality needs */
    draw_settings settings;
    double detail; /* share of the width and height that has voxels of its own */
    bool first;    /* first picture of this view: shown in parts, and always finished */
    double begun_ms;
} frame;

enum { STEP_NS = 10000000, PART_MS = 150, SLOW_MS = 400, MAX_MS = 1000 };
/* Taking and showing the parts of a picture takes at most about this share of its time. */
#define PARTS_SHARE 0.2

/* Moving frames are abandoned only if they take long. */
static bool gives_up(trip_frames *f, const frame *d)
{
    return has_newer(f) && (!d->first || trip_now_ms() - d->begun_ms > MAX_MS || has_other(f));
}

static int show_part(trip_frames *f, const frame *d)
{
    const double begun_ms = trip_now_ms();
    int status = triptych_picture(f->t, f->rgba);
    if (!status)
        show(f, d->width, d->height, false);
    f->taken_ms = trip_now_ms() - begun_ms;
    return status;
}

static int step(trip_frames *f, const frame *d)
{
    int status = triptych_step(f->t, trip_now_ns() + STEP_NS);
    if (status == TRIPTYCH_STEP_WAITS)
        triptych_await(f->t, STEP_NS);
    const double pause_ms = fmax(PART_MS, f->taken_ms / PARTS_SHARE);
    if (status > 0 && d->first && trip_now_ms() - f->shown_ms > pause_ms) {
        int taken = show_part(f, d);
        status = taken ? taken : status;
    }
    return status;
}

static int draw_steps(trip_frames *f, const frame *d)
{
    int status = TRIPTYCH_STEP_MORE;
    while (status > 0) {
        if (gives_up(f, d))
            return TRIPTYCH_CANCELLED;
        status = step(f, d);
    }
    return status ? status : triptych_picture(f->t, f->rgba);
}

static void keep_plan(trip_frames *f)
{
    char *plan = NULL;
    if (triptych_explain(f->t, &plan))
        return;
    pthread_mutex_lock(&f->lock);
    free(f->plan);
    f->plan = plan;
    pthread_mutex_unlock(&f->lock);
}

static double wanted_pixels(const trip_frames *f)
{
    return (double)f->now.width * f->now.height;
}

/* A moving frame is recorded with its number of pixels of detail. */
static void note_pace(trip_frames *f, const frame *d, double ms)
{
    if (d->whole)
        trip_pace_note(&f->whole_pace, wanted_pixels(f), ms);
    else if (d->first)
        trip_pace_note(&f->pace, d->detail * d->detail * wanted_pixels(f), ms);
}

static void note_frame(trip_frames *f, const frame *d, double ms)
{
    triptych_frame_stats stats = { 0 };
    if (f->warm)
        note_pace(f, d, ms);
    f->warm = true;
    const bool counted = triptych_get_frame_stats(f->t, &stats) == 0;
    pthread_mutex_lock(&f->lock);
    trip_frames_status *s = &f->status;
    s->frames++;
    if (d->first) {
        f->times[s->moving++ % TRIP_FRAMES_TIMES] = (float)ms;
        s->moving_ms = ms;
        s->scale = (double)d->width / f->now.width;
        s->lod_px = d->settings.lod.voxel_px;
    }
    if (d->whole)
        s->whole_ms = ms;
    if (counted) {
        snprintf(s->renderer, sizeof s->renderer, "%s", stats.renderer);
        snprintf(s->device, sizeof s->device, "%s", stats.device);
        snprintf(s->engine, sizeof s->engine, "%s", stats.engine);
        snprintf(s->ring, sizeof s->ring, "%s", stats.ring);
        s->stats = stats;
        s->stats.renderer = s->stats.device = s->stats.engine = s->stats.ring = NULL;
    }
    s->exact = d->final && f->wanted_count == f->taken;
    s->failed = false;
    pthread_mutex_unlock(&f->lock);
}

/* Returns whether the last frame has the defaults, because its choice is not known. */
static bool awaits_choice(trip_frames *f)
{
    triptych_frame_stats stats;
    return triptych_get_frame_stats(f->t, &stats) == 0 && stats.choice_waits;
}

static int draw(trip_frames *f, double scale, double detail, const draw_settings *settings,
                bool first)
{
    const trip_wanted *w = &f->now;
    frame d = { .width = (int)ceil(w->width * scale),
                .height = (int)ceil(w->height * scale),
                .whole = scale == 1 && draw_settings_same(settings, &w->settings),
                .settings = *settings,
                .detail = detail,
                .first = first,
                .begun_ms = trip_now_ms() };
    const triptych_view view = trip_navigation_view(&w->navigation, d.width, d.height);
    f->shown_ms = first ? d.begun_ms : f->shown_ms;
    set_ends_early(f, !first);
    int status = use_settings(f, settings);
    if (!status)
        status = triptych_set_view(f->t, &view);
    if (!status)
        status = triptych_begin(f->t);
    if (!status && d.whole)
        keep_plan(f);
    if (!status)
        status = draw_steps(f, &d);
    triptych_end(f->t);
    set_ends_early(f, false);
    if (status)
        return status;
    d.final = d.whole && !awaits_choice(f);
    show(f, d.width, d.height, d.final);
    f->whole = d.final;
    f->awaits_choice = d.whole && !d.final;
    note_frame(f, &d, trip_now_ms() - d.begun_ms);
    wake(f);
    return 0;
}

/* Draws a moving frame, small and coarse enough for its time. Reduced detail is split evenly
 * between wider pixels and wider voxels. */
static int draw_moving(trip_frames *f, double target_ms)
{
    const double detail = trip_pace_scale(&f->pace, wanted_pixels(f), MOVING_SHARE * target_ms);
    const double scale = sqrt(detail);
    draw_settings settings = with_levels(f, MOVING_LOD_PX * scale / detail, MOVING_MAX * target_ms);
    if (!draw_kind_is_gaussian(f->kind) && settings.sheet.samples <= 0 &&
        draw_settings_may_use_sheets(&settings))
        settings.sheet.samples = MOVING_SAMPLES;
    if (!draw_kind_is_gaussian(f->kind) &&
        settings.all.samples <= 0) /* scenes have one by default */
        settings.all.samples = 1;
    return draw(f, scale, detail, &settings, true);
}

/* Draws a full-size, coarse frame before the full picture. Its time is a share of the full
 * picture's expected time. */
static int draw_coarse(trip_frames *f, double whole_ms)
{
    enum { PART = 5 };
    const draw_settings settings = with_levels(f, MOVING_LOD_PX, whole_ms / PART);
    return draw(f, 1, 1, &settings, false);
}

/* Makes the trial for the picture that is shown, and draws the picture again. A new wish ends the
 * trial. */
static int draw_chosen(trip_frames *f)
{
    if (!f->awaits_choice || has_newer(f))
        return 0;
    show_stage(f, "trial", 0);
    set_ends_early(f, true);
    int status = triptych_choose(f->t);
    set_ends_early(f, false);
    return status ? status : draw(f, 1, 1, &f->now.settings, false);
}

/* Returns whether a frame of fewer pixels would take long, and about as long as the full one. Every
 * Gaussian in view is read for both. */
static bool gains_little(const trip_frames *f, double target_ms, double whole_ms)
{
    const double detail = trip_pace_scale(&f->pace, wanted_pixels(f), MOVING_SHARE * target_ms);
    const double small_ms = trip_pace_expect_ms(&f->pace, detail * detail * wanted_pixels(f));
    return f->kind && small_ms > SLOW_MS && small_ms > LITTLE_SHARE * whole_ms;
}

/* Draws a picture at once, then the full one. If the full one takes long, draws a coarse one of
 * full size between them. */
static int draw_whole(trip_frames *f)
{
    enum { LONG_MS = 1500 };
    const draw_settings *whole = &f->now.settings;
    const double wanted = f->params.frames_per_second;
    const double target_ms = 1000 / (wanted > 0 ? wanted : DEFAULT_FPS);
    const double whole_ms = trip_pace_expect_ms(&f->whole_pace, wanted_pixels(f));
    /* the memory of a small frame could be too much beside a full one */
    if (f->plain ||
        (whole_ms > 0 && (whole_ms < target_ms || gains_little(f, target_ms, whole_ms))))
        return draw(f, 1, 1, whole, true);
    int status = draw_moving(f, target_ms);
    if (!status && !f->whole && whole_ms > LONG_MS && !has_newer(f) && draws_levels(f, whole))
        status = draw_coarse(f, whole_ms);
    if (!status && !f->whole && !has_newer(f))
        status = draw(f, 1, 1, whole, false);
    return status;
}

static int draw_wanted(trip_frames *f)
{
    f->awaits_choice = false;
    int status = draw_whole(f);
    return status ? status : draw_chosen(f);
}

static int prepare(trip_frames *f)
{
    int status = 0;
    if (!f->open || f->document != f->now.document) {
        close_data(f);
        status = open_data(f);
    }
    if (!status)
        draw_settings_drop_kind(&f->now.settings, f->kind);
    if (!status && f->kind)
        drop_function_of_scene(f);
    if (f->cold)
        f->now.settings.effects.which &= ~TRIPTYCH_EFFECT_EMISSION;
    if (!status)
        status = take_pictures(f);
    if (!status)
        status = use_settings(f, &f->now.settings);
    if (!status)
        status = use_function(f);
    if (!status && (!f->announced || !f->now.has_navigation || f->other_function))
        status = announce(f);
    return status;
}

static int serve_once(trip_frames *f)
{
    int status = prepare(f);
    return status ? status : draw_wanted(f);
}

/* If memory is too short for pictures and cached pages, no pages are cached. If it is too short for
 * several levels, moving views have no coarse levels. */
static int serve_wanted(trip_frames *f)
{
    for (;;) {
        int status = serve_once(f);
        if (status != TRIPTYCH_ERROR || !f->open || f->plain || has_newer(f))
            return status;
        close_data(f);
        f->plain = f->frugal;
        f->frugal = true;
    }
}

/* Writes the current picture, as `triptych render` does. */
static int write_picture(trip_frames *f, const char *path)
{
    char line[512];
    int status = triptych_write(f->t, path, f->now.width, f->now.height, f->rgba);
    snprintf(line, sizeof line, "wrote %.480s", path);
    if (!status)
        say(f, line, false);
    return status;
}

/* Handles a picture to save, once the picture is complete or has failed. */
static int save(trip_frames *f)
{
    pthread_mutex_lock(&f->lock);
    char *path = f->save && f->wanted_count == f->taken ? strdup(f->save) : NULL;
    pthread_mutex_unlock(&f->lock);
    if (!path)
        return 0;
    int status = f->whole
                     ? write_picture(f, path)
                     : trip_fail(TRIP_ERROR, "view", path, "no picture to save: drawing failed");
    pthread_mutex_lock(&f->lock);
    f->status.unsaved = status != 0;
    if (f->save && !strcmp(f->save, path)) {
        free(f->save);
        f->save = NULL;
    }
    pthread_mutex_unlock(&f->lock);
    free(path);
    wake(f);
    return status;
}

/* Shows a failure. The next wish tries again, because a data set can come back. */
static void fail(trip_frames *f, int status)
{
    char line[512];
    snprintf(line, sizeof line, "%s", triptych_error(f->t));
    if (*line)
        say(f, line, true);
    if (status == TRIPTYCH_ERROR)
        close_data(f);
}

/* Answers the probe at the pointer's position. */
static void look(trip_frames *f)
{
    pthread_mutex_lock(&f->lock);
    const bool looks = f->looks && f->whole;
    trip_probed probed = {
        .valid = true, .x = f->position[0], .y = f->position[1], .navigation = f->now.navigation
    };
    f->looks = f->looks && !looks;
    pthread_mutex_unlock(&f->lock);
    if (!looks || triptych_probe(f->t, probed.x, probed.y, &probed.hit))
        return;
    pthread_mutex_lock(&f->lock);
    f->probed = probed;
    pthread_mutex_unlock(&f->lock);
    wake(f);
}

/* No new wish: save the current picture. */
static void serve(trip_frames *f)
{
    const bool fresh = f->served != f->taken;
    f->served = f->taken;
    int status = fresh ? serve_wanted(f) : 0;
    if (status && status != TRIPTYCH_CANCELLED)
        fail(f, status);
    if (status != TRIPTYCH_CANCELLED && save(f))
        fail(f, TRIPTYCH_USAGE);
    if (!status)
        look(f);
}

void trip_frames_prepare(trip_frames *f)
{
    f->scope = (trip_scope){
        .failed = take_failure, .sink = take_report, .user = f, .signalled = trip_scope_signal()
    };
}

void *trip_frames_run(void *user)
{
    trip_frames *f = user;
    trip_scope *before = trip_scope_enter(&f->scope);
    triptych_set_messages(f->t, take_line, f);
    triptych_set_progress(f->t, show_progress, f);
    while (take_wanted(f))
        serve(f);
    close_data(f);
    trip_wanted_release(&f->now);
    trip_scope_enter(before);
    return NULL;
}
