/* The frames of triptych.h: begin, steps, picture, end. */
#include <string.h>

#include "gaussian_frame.h"
#include "clock.h"
#include "library_context.h"
#include "cpu/cpu_renderer.h"
#include "dataset_level.h"
#include "kernel.h"
#include "normalise.h"
#include "report.h"
#include "rounding.h"
#include "splat.h"
#include "debug_view.h"

static void show_progress(void *user, const char *stage, uint64_t done, uint64_t total)
{
    triptych *t = user;
    t->show(t->show_user, t->given.all.count_exactly ? "count" : stage, done, total);
}

void trip_context_drop_reader(triptych *t)
{
    trip_reader_destroy(t->reader);
    t->reader = NULL;
}

void trip_context_drop_level(triptych *t)
{
    trip_context_drop_light(t);
    trip_dataset_level_close(t->at_level);
    t->at_level = NULL;
    t->level = 0;
}

/* Returns the session with the data set that frames are drawn from: the coarse level, if one is in
 * use. */
static session drawn_session(const triptych *t)
{
    session s = t->session;
    s.data = t->at_level ? t->at_level : s.data;
    return s;
}

/* Releases the pictures of the parts already drawn and of several rays per pixel. */
static void drop_before(triptych *t)
{
    trip_budget_release(t->session.budget, t->before, t->before_bytes);
    t->before = NULL;
    t->before_bytes = 0;
}

void trip_context_drop_renderer(triptych *t)
{
    drop_before(t);
    trip_budget_release(t->session.budget, t->banded, t->banded_bytes);
    t->banded = NULL;
    t->banded_bytes = 0;
    trip_context_drop_reader(t);
    trip_context_drop_light(t);
    if (t->renderer)
        t->renderer->ops->destroy(t->renderer);
    if (t->device_renderer)
        t->device_renderer->ops->destroy(t->device_renderer);
    t->renderer = t->device_renderer = NULL;
}

/* Makes a reader for the wanted planes, or keeps the current one if it serves. Readers serve all
 * levels. A reader with a cache also serves if it reads more planes. Counting uses a reader of its
 * own, so that its reads do not fill the cache of timed frames. */
static int make_reader(triptych *t, unsigned planes)
{
    const triptych_resources *r = &t->resources;
    bool finds_occluded = !strcmp(t->renderer->ops->name, "cpu");
    bool draws_all = r->read_occluded || t->given.all.count_exactly;
    const session_reader wanted = {
        .engine = (trip_engine)r->engine,
        .planes = planes,
        .threads = (int)trip_context_threads(r->threads),
        .cache = r->keep_pages && !t->given.all.count_exactly && !t->plan.gathers,
        .renderer = t->renderer,
        .skip = finds_occluded && !draws_all ? trip_cpu_occluded : NULL,
        .skip_user = t->renderer,
    };
    const bool reads = wanted.cache ? !(planes & ~t->planes) : planes == t->planes;
    if (t->reader && reads && t->given.all.count_exactly == t->reader_counts)
        return 0;
    trip_context_drop_reader(t);
    t->planes = planes;
    t->reader_counts = t->given.all.count_exactly;
    return session_make_reader(&t->session, &t->reader, &wanted);
}

/* Returns the number of frame pixels along each side of a picture pixel. For several rays per
 * pixel, renderers draw a larger picture. The integral traces several rays itself. */
static int pixels_a_side(const triptych *t)
{
    return t->resources.renderer == TRIPTYCH_RENDERER_INTEGRAL ? 1 : t->choice.rays;
}

static int make_camera(triptych *t, const trip_dataset *data)
{
    trip_camera_params view = t->turned;
    view.width *= pixels_a_side(t);
    view.height *= pixels_a_side(t);
    return trip_camera_make(&t->camera, &view, &data->index_to_world);
}

/* Bytes that a processor draws per millisecond, until frames have been measured. */
#define DEFAULT_BYTES_PER_MS 20e3

/* Returns the settings with the bound of time converted to a bound of bytes. */
static trip_settings bounded_settings(const triptych *t)
{
    trip_settings s = t->settings;
    const double rate = t->bytes_per_ms > 0 ? t->bytes_per_ms : DEFAULT_BYTES_PER_MS;
    const double bytes = fmax(t->given.lod.max_ms * rate, 1);
    if (t->given.lod.max_ms > 0)
        s.max_bytes = s.max_bytes > 0 ? fmin(s.max_bytes, bytes) : bytes;
    return s;
}

/* Selects the level that frames are drawn from. */
static int use_level(triptych *t, unsigned level)
{
    int status = 0;
    if (level == t->level)
        return 0;
    trip_context_drop_level(t);
    if (level > 0)
        status = trip_dataset_level_open(&t->at_level, t->session.data, level);
    t->level = t->at_level ? level : 0;
    return status;
}

/* Writes why the frame must be drawn by splats. Returns NULL if post can draw it. */
static const char *needs_splats(triptych *t)
{
    const char *option = draw_settings_of_splats(&t->given);
    if (!option)
        return session_needs_splats(&t->session);
    snprintf(t->why_splats, sizeof t->why_splats, "--%s is for splats", option);
    return t->why_splats;
}

bool trip_context_draws_values(const triptych *t)
{
    return t->resources.renderer == TRIPTYCH_RENDERER_INTEGRAL
               ? t->drawn_settings.field == TRIP_FIELD_VALUES
               : t->drawn_settings.classify == TRIP_CLASSIFY_POST;
}

/* Selects the nearest value for labels if no interpolation was given. Says so once per data set. */
static int choose_interpolation(triptych *t)
{
    trip_settings *s = &t->drawn_settings;
    trip_histogram histogram;
    int status = 0;
    t->nearest_chosen = false;
    if (t->given.all.interpolation == TRIPTYCH_INTERPOLATION_DEFAULT &&
        trip_context_draws_values(t)) {
        status = session_read_text(&t->session);
        t->nearest_chosen = !status &&
                            trip_dataset_metadata_kind(t->session.text) == TRIP_TF_LABELS &&
                            trip_dataset_metadata_histogram(t->session.text, &histogram) &&
                            !trip_tf_is_solid(&histogram);
    }
    if (t->nearest_chosen)
        s->kernel = TRIP_KERNEL_NEAREST;
    if (t->nearest_chosen && !t->nearest_noted)
        trip_note(t->session.input, "the values are labels, so each point takes the value of the "
                                    "nearest voxel (--interpolation linear interpolates)");
    t->nearest_noted |= t->nearest_chosen;
    return status;
}

/* Lets the integral take the means over the areas of pixels. */
static void choose_areas(triptych *t)
{
    t->drawn_settings.samples = 0;
    if (!t->given.integral.tolerance)
        t->drawn_settings.tolerance = TRIP_TOLERANCE_OF_AREAS;
}

/* Chooses the settings that do not depend on the level, and the classification. */
static int choose_settings(triptych *t)
{
    const bool integral = t->resources.renderer == TRIPTYCH_RENDERER_INTEGRAL;
    const bool automatic = draw_settings_classify(&t->given) == TRIPTYCH_CLASSIFY_AUTO;
    t->drawn_settings = bounded_settings(t);
    t->drawn_settings.shading_range = t->session.shading_range;
    t->why_pre = automatic && !integral ? needs_splats(t) : NULL;
    if (t->why_pre || integral)
        t->drawn_settings.classify = TRIP_CLASSIFY_PRE;
    if (integral && t->given.all.samples <= 0)
        choose_areas(t);
    if (trip_coordinates_uneven(&t->session.data->coordinates) && !integral &&
        trip_settings_sum_sheets(&t->drawn_settings) &&
        t->drawn_settings.footprint ==
            TRIP_FOOTPRINT_EXACT) /* exact footprints are not summed with uneven spacing */
        t->drawn_settings.footprint = TRIP_FOOTPRINT_EWA;
    if (t->given.all
            .normalise) /* normalising adds the background later; depth cueing still uses its colour
                         */
        t->drawn_settings.background[3] = 0;
    return choose_interpolation(t);
}

int trip_context_takes_nearest(triptych *t, bool *out)
{
    /* The last frame's choices stay, since its statistics name them. */
    const trip_settings drawn = t->drawn_settings;
    const char *why_pre = t->why_pre;
    const bool chosen = t->nearest_chosen;
    const int status = choose_settings(t);
    *out = t->drawn_settings.kernel == TRIP_KERNEL_NEAREST && trip_context_draws_values(t);
    t->drawn_settings = drawn;
    t->why_pre = why_pre;
    t->nearest_chosen = chosen;
    return status;
}

/* Chooses the levels of the frame by the camera of level 0. A frame with distances or with a light
 * map needs one level: distances belong to one surface, and a light map to one level. */
static int choose_parts(triptych *t)
{
    const trip_settings *s = &t->drawn_settings;
    const bool one = t->given.all.count_exactly || s->depth || s->effects.emission ||
                     trip_effects_light(&s->effects);
    int status = 0;
    t->parts = (trip_lod_parts){ .count = 1 };
    t->part = 0;
    if (s->classify != TRIP_CLASSIFY_POST || t->resources.renderer == TRIPTYCH_RENDERER_INTEGRAL)
        return status;
    status = trip_lod_parts_make(&t->parts, t->session.data, &t->camera, s, one, t->session.budget);
    if (t->parts.count > 1) /* the background is added after the last part */
        t->drawn_settings.background[3] = 0;
    return status;
}

/* Selects the level of the next part and makes its camera. A first part at level 0 has the camera
 * of plan_first(). */
static int enter_part(triptych *t)
{
    int status = use_level(t, t->parts.level[t->part]);
    if (!status && (t->part > 0 || t->level > 0))
        status = make_camera(t, drawn_session(t).data);
    if (status)
        return status;
    t->samples_per_sheet =
        trip_sheet_samples_of_view(&t->camera, drawn_session(t).data->header.dims);
    t->drawn_settings.samples_per_sheet = t->choice.samples_per_sheet
                                              ? t->choice.samples_per_sheet
                                              : t->samples_per_sheet.samples_per_sheet;
    if (t->drawn_settings.kernel == TRIP_KERNEL_NEAREST) /* boxes are exact (sheet.h) */
        t->drawn_settings.samples_per_sheet = 2;
    t->drawn_settings.clip = trip_context_clip(t);
    trip_lod_parts_clip(&t->parts, t->part, &t->drawn_settings.clip);
    return 0;
}

/* ---- bands ---- */

/* Returns the number of rows of the current band, in pixels of the frame. */
static int rows_drawn(const triptych *t)
{
    const int rest = t->camera.height - t->band * t->band_rows;
    return t->bands > 1 && t->band_rows < rest ? t->band_rows : rest;
}

static size_t pixels_drawn(const triptych *t)
{
    return (size_t)t->camera.width * (size_t)rows_drawn(t);
}

static void drop_banded(triptych *t)
{
    trip_budget_release(t->session.budget, t->banded, t->banded_bytes);
    t->banded = NULL;
    t->banded_bytes = 0;
}

/* Divides a frame of several rays per pixel into bands, if its pixels would take more than a part
 * of the memory. Only the CPU renderer can draw bands. Bits do not depend on bands. */
static int choose_bands(triptych *t)
{
    enum { BYTES = 48, PART = 4 }; /* two layers and a picture; the rest is for voxels */
    const int side = t->choice.rays, unit = TRIP_FRAME_ROWS * side;
    const bool can = !strcmp(t->renderer->ops->name, "cpu") && trip_context_draws_values(t);
    const double limit = (double)trip_budget_limit_bytes(t->session.budget) / PART;
    const double rows = limit / ((double)BYTES * t->camera.width);
    t->band = 0;
    t->bands = 1;
    t->band_rows = t->camera.height;
    drop_banded(t);
    if (side < 2 || !can || rows >= t->camera.height)
        return 0;
    t->band_rows = rows > unit ? (int)(rows / unit) * unit : unit;
    t->bands = (t->camera.height + t->band_rows - 1) / t->band_rows;
    t->banded_bytes = (size_t)t->turned.width * (size_t)t->turned.height * 4 * sizeof *t->banded;
    t->banded = trip_budget_take(t->session.budget, t->banded_bytes);
    if (t->banded)
        return 0;
    t->banded_bytes = 0;
    return trip_fail(TRIP_ERROR, "render", "samples",
                     "a picture of %d x %d pixels with %d rays per pixel does not fit in memory; "
                     "raise --memory or lower --size",
                     t->turned.width, t->turned.height, side * side);
}

/* Returns how many pictures hold the parts already drawn: one, or two with three parts or more. */
static size_t pictures_of_parts(const triptych *t)
{
    return t->parts.count > 2 ? 2 : t->parts.count > 1;
}

/* Allocates the pictures of the parts already drawn, and one more for several rays per pixel.
 * Called after planning, before the reader takes its share of the memory left. */
static int take_before(triptych *t)
{
    const int side = pixels_a_side(t);
    const size_t pictures = pictures_of_parts(t) + (side > 1);
    const size_t bytes = pictures * pixels_drawn(t) * 4 * sizeof *t->before;
    if (bytes != t->before_bytes)
        drop_before(t);
    if (bytes == t->before_bytes)
        return 0;
    t->before = trip_budget_take(t->session.budget, bytes);
    t->before_bytes = t->before ? bytes : 0;
    if (t->before)
        return 0;
    if (side > 1)
        return trip_fail(TRIP_ERROR, "render", "samples",
                         "a picture %d times as wide and high does not fit in memory; raise "
                         "--memory or lower --samples",
                         side);
    return trip_fail(TRIP_ERROR, "render", "levels",
                     "the pictures of several levels do not fit in memory; raise --memory");
}

/* Keeps the picture between frames only if it is a small part of the memory left. */
static void keep_small_before(triptych *t)
{
    enum { SMALL_PART = 8 };
    if (t->before && t->before_bytes > trip_budget_left_bytes(t->session.budget) / SMALL_PART)
        drop_before(t);
}

static int make_renderer(triptych *t)
{
    return t->renderer ? 0
                       : trip_renderer_create(&t->renderer, (trip_renderer_kind)t->required,
                                              t->resources.threads, t->session.budget);
}

static int prepare(triptych *t)
{
    const triptych_resources *r = &t->resources;
    triptych_renderer renderer = r->renderer;
    int status = trip_context_check_idle(t, true);
    if (!status)
        status = draw_settings_check(&t->given, &renderer, false);
    if (!status)
        status = draw_settings_check_kind(&t->given, r, DRAW_KIND_VOLUME);
    if (status)
        return status;
    if (t->renderer && t->required != renderer)
        trip_context_drop_renderer(t);
    t->required = renderer;
    if (!t->has_function)
        status = trip_context_use_transfer_function(t, &(triptych_transfer_function){ 0 });
    if (!status && !t->has_view)
        status = trip_context_find_view(t, &(triptych_view){ 0 });
    return status ? status : make_renderer(t);
}

/* Plans a frame of the integral renderer, by the kinds of lists that make up its field. */
static int plan_field(triptych *t)
{
    session *s = &t->session;
    unsigned kinds = 1u << TRIP_KIND_VOXELS;
    if (t->settings.field == TRIP_FIELD_VALUES)
        kinds = t->source ? 0 : kinds | 1u << TRIP_KIND_HALO;
    else if (t->source)
        return trip_fail(
            TRIP_USAGE, "render", "field",
            "the sum of the splats needs the values of the data set; do not give a volume");
    const bool values = trip_settings_interpolates(&t->drawn_settings, true);
    return trip_plan_make_field(&t->plan, s->data, &t->camera, &t->drawn_settings, kinds,
                                values ? &s->draw : NULL, s->budget);
}

/* Computes the common size of fixed footprints. */
static int choose_sprites(triptych *t)
{
    trip_settings *s = &t->drawn_settings;
    const uint64_t *dims = t->session.data->header.dims;
    if (s->footprint != TRIP_FOOTPRINT_FIXED)
        return 0;
    const trip_vec3 middle = trip_v3(0.5 * ((double)dims[0] - 1), 0.5 * ((double)dims[1] - 1),
                                     0.5 * ((double)dims[2] - 1));
    s->sprite_px = trip_splat_sprite_px(&t->camera, s, middle);
    if (s->sprite_px > 0)
        return 0;
    return trip_fail(TRIP_USAGE, "render", "kernel",
                     "fixed footprints take their size from the middle of the volume, which lies "
                     "behind the eye; move the eye");
}

/* Returns the table of the frame's codes. */
static const trip_tf_entry *table_of(const triptych *t)
{
    const bool integral = t->resources.renderer == TRIPTYCH_RENDERER_INTEGRAL;
    return session_table(&t->session, trip_settings_interpolates(&t->drawn_settings, integral));
}

static int plan_frame(triptych *t)
{
    session *s = &t->session;
    int status = choose_sprites(t);
    if (status)
        return status;
    if (t->resources.renderer == TRIPTYCH_RENDERER_INTEGRAL)
        return plan_field(t);
    if (t->drawn_settings.classify == TRIP_CLASSIFY_POST ||
        !trip_settings_has_levels(&t->drawn_settings)) /* these frames get all the memory */
        trip_mean_tables_release(&s->mean_tables, s->budget);
    status = trip_plan_make_next(&t->plan, drawn_session(t).data, &t->camera, &t->drawn_settings,
                                 table_of(t), session_classified(s, t->level), &s->mean_tables,
                                 s->budget);
    t->plan.level = t->level;
    return status;
}

/* Checks rounding once per transfer function and settings. The reference and the integral do not
 * round. */
static void check_rounding(triptych *t)
{
    const trip_settings *s = &t->drawn_settings;
    bool rounds = !strcmp(t->renderer->ops->name, "cpu") || !strcmp(t->renderer->ops->name, "gl");
    if (!t->rounding_checked && rounds && s->classify == TRIP_CLASSIFY_PRE && !s->show)
        trip_rounding_check(&t->session, s);
    t->rounding_checked = true;
}

/* Warns if the coarsest level exceeds the bound of bytes, or if the data set has no levels. */
static void check_bound(const triptych *t)
{
    const double max = t->settings.max_bytes;
    char is[32], allowed[32];
    if (!(max > 0) || t->settings.show == TRIP_SHOW_MERGE)
        return;
    const double bytes = t->plan.lod.level    ? t->plan.lod.limit.bytes
                         : t->parts.bytes > 0 ? t->parts.bytes
                                              : trip_lod_values_bytes(t->session.data, &t->camera,
                                                                      &t->drawn_settings, 0);
    if (bytes <= max)
        return;
    trip_format_bytes((uint64_t)bytes, is);
    trip_format_bytes((uint64_t)max, allowed);
    trip_warn(t->session.input,
              "the coarsest level reads up to %s of codes and normals, more than the %s allowed",
              is, allowed);
}

/* Plans the next part. */
static int plan(triptych *t)
{
    uint64_t start = trip_now_ns();
    int status = enter_part(t);
    if (!status)
        status = plan_frame(t);
    t->plan_ms = (double)(trip_now_ns() - start) * 1e-6;
    t->begun = status == 0;
    return status;
}

int triptych_choose(triptych *t)
{
    trip_scope *before = trip_context_enter_anew(t);
    const int later = t->resources.choose_later;
    if (trip_context_draws_scene(t)) /* it has no choices of quality */
        return trip_context_leave(before, trip_context_check_idle(t, true));
    int status = prepare(t);
    if (!status)
        status = choose_settings(t);
    t->resources.choose_later = 0;
    if (!status)
        status = trip_context_choose_quality(t);
    t->resources.choose_later = later;
    return trip_context_leave(before, status);
}

static int plan_first(triptych *t)
{
    uint64_t start = trip_now_ns();
    int status = choose_settings(t);
    t->drawn_settings.deviations = t->renderer->ops->blurs;
    check_rounding(t);
    if (!status)
        status = trip_context_choose_quality(t);
    if (!status) /* a trial releases the renderer */
        status = make_renderer(t);
    if (!status)
        status = make_camera(t, t->session.data);
    if (!status)
        status = trip_context_choose_effects(t);
    if (!status)
        status = choose_bands(t);
    if (!status)
        status = choose_parts(t);
    const double ms = (double)(trip_now_ns() - start) * 1e-6;
    if (!status)
        status = plan(t);
    t->plan_ms += ms;
    if (!status)
        check_bound(t);
    return status;
}

/* Warns once per kernel, when a frame is drawn. */
static void warn_of_halo(triptych *t)
{
    const session *s = &t->session;
    if (t->kernel_warned || !trip_plan_halo_is_short(t->frame.data, &t->drawn_settings))
        return;
    t->kernel_warned = true;
    trip_warn(s->input,
              "has %s voxel of halo, but the %s kernel needs two; missing voxels count as the "
              "nearest voxel (brick with --keep-all to keep all)",
              t->frame.data->header.halo ? "one" : "no", trip_kernel_name(t->settings.kernel));
}

/* Warns once per data set, when a frame asks for levels and the data set has only levels for the
 * other classification. */
static void warn_of_levels(triptych *t)
{
    const trip_dataset *data = t->session.data;
    const bool post = t->drawn_settings.classify == TRIP_CLASSIFY_POST;
    if (t->levels_warned || !(t->drawn_settings.lod_px > 0) ||
        trip_dataset_levels(data, post ? TRIP_KIND_VALUES : TRIP_KIND_MEANS) > 0 ||
        trip_dataset_levels(data, post ? TRIP_KIND_MEANS : TRIP_KIND_VALUES) == 0)
        return;
    t->levels_warned = true;
    trip_warn(t->session.input,
              "has no coarse levels for %s, so the finest level is drawn everywhere; brick with "
              "--levels-for both",
              post ? "post" : "pre");
}

/* Sets the unit of the source's values by the draw codes. */
static void place_source(triptych *t)
{
    const trip_draw_codes *draw = &t->session.draw;
    const double per_code = trip_draw_value_per_code(draw);
    if (t->source && draw->of_stored)
        trip_field_set_unit(t->source,
                            (trip_field_unit){ draw->lo, per_code > 0 ? 1 / per_code : 0 });
}

static int start(triptych *t)
{
    int status = trip_context_begin_light(t);
    place_source(t);
    if (!status)
        status = make_reader(t, t->plan.planes);
    t->frame = (trip_frame){
        .data = drawn_session(t).data,
        .camera = &t->camera,
        .settings = &t->drawn_settings,
        .plan = &t->plan,
        .table = table_of(t),
        .field = t->source,
        .light = t->light,
        .emission = t->drawn_settings.effects.emission ? t->heat : NULL,
        .count = t->given.all.count_exactly,
        .progress = t->show ? show_progress : NULL,
        .progress_user = t,
        .first_row = t->bands > 1 ? t->band * t->band_rows : 0,
        .rows = t->bands > 1 ? rows_drawn(t) : 0,
    };
    t->drawn = status == 0;
    if (!status)
        status = trip_frame_begin(&t->drawing, t->renderer, t->reader, &t->frame);
    if (!status)
        warn_of_halo(t);
    if (!status)
        warn_of_levels(t);
    return status;
}

static void end(triptych *t)
{
    if (trip_context_draws_scene(t))
        trip_context_end_scene(t);
    if (t->drawn)
        trip_frame_end(&t->drawing);
    if (t->begun)
        trip_plan_release(&t->plan, t->session.budget);
    if (t->begun)
        session_keep_tables(&t->session);
    t->begun = t->drawn = false;
}

int triptych_begin(triptych *t)
{
    trip_scope *before = trip_context_enter_anew(t);
    int status = trip_context_draws_scene(t) ? trip_context_begin_scene(t) : prepare(t);
    if (status || trip_context_draws_scene(t))
        return trip_context_leave(before, status);
    status = plan_first(t);
    if (!status)
        status = take_before(t);
    if (!status)
        status = start(t);
    if (status) {
        end(t);
        drop_before(t);
    }
    return trip_context_leave(before, status);
}

static int check_drawing(const triptych *t)
{
    return t->drawn ? 0 : trip_fail(TRIP_USAGE, "render", "frame", "no frame is begun");
}

int triptych_await(triptych *t, uint64_t timeout_ns)
{
    trip_scope *before = trip_context_enter(t);
    int status = check_drawing(t);
    if (!status && !trip_context_draws_scene(t))
        trip_frame_await(&t->drawing, timeout_ns);
    if (!status && t->mixed)
        trip_context_await_mixed(t, timeout_ns);
    if (!status && trip_interrupted())
        status = trip_fail(TRIP_INTERRUPTED, "render", t->name, "interrupted");
    return trip_context_leave(before, status);
}

void trip_context_take_means(const float *fine, int side, int width, int height, float *rgba)
{
    const size_t row = (size_t)width * (size_t)side * 4;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++, rgba += 4) {
            const float *corner = fine + (size_t)(y * side) * row + (size_t)(x * side) * 4;
            double sum[4] = { 0 };
            for (int n = 0; n < side * side; n++)
                for (int c = 0; c < 4; c++)
                    sum[c] += (double)corner[(size_t)(n / side) * row + (size_t)(n % side * 4 + c)];
            for (int c = 0; c < 4; c++)
                rgba[c] = (float)(sum[c] / (side * side));
        }
}

/* Takes the picture drawn so far, with the earlier parts and the background. */
static int take_drawn(triptych *t, float *rgba, float *depth)
{
    const double *behind = t->settings.background;
    const size_t pixels = pixels_drawn(t);
    int status = trip_frame_picture(&t->drawing, rgba, depth);
    if (status)
        return status;
    if (t->part > 0)
        trip_lod_parts_add(&t->parts, t->before, rgba, t->drawing.done, pixels, rgba);
    if (t->given.all.normalise)
        trip_normalise(rgba, pixels, behind);
    else if (t->parts.count > 1)
        trip_put_behind(rgba, pixels, behind);
    return 0;
}

static int take_colours(triptych *t, float *rgba, float *depth)
{
    const int side = pixels_a_side(t);
    if (side == 1)
        return take_drawn(t, rgba, depth);
    float *fine = t->before + pictures_of_parts(t) * 4 * pixels_drawn(t);
    int status = take_drawn(t, fine, NULL);
    if (!status)
        trip_context_take_means(fine, side, t->turned.width, rows_drawn(t) / side, rgba);
    return status;
}

/* Returns the number of floats of the picture above the current band. */
static size_t floats_above(const triptych *t)
{
    return (size_t)t->turned.width * (size_t)(t->band * t->band_rows / t->choice.rays) * 4;
}

/* Takes the picture of all bands drawn so far. Rows below show the background. */
static int take_bands(triptych *t, float *rgba, float *depth)
{
    const size_t above = floats_above(t);
    const size_t all = (size_t)t->turned.width * (size_t)t->turned.height * 4;
    const double *b = t->settings.background;
    int status = take_colours(t, rgba + above, depth);
    if (t->bands == 1 || status)
        return status;
    memcpy(rgba, t->banded, above * sizeof *rgba);
    const size_t drawn = (size_t)t->turned.width * (size_t)(rows_drawn(t) / t->choice.rays) * 4;
    for (size_t i = above + drawn; i < all; i++)
        rgba[i] = (float)(i % 4 < 3 ? b[i % 4] * b[3] : b[3]);
    return 0;
}

/* Adds the drawn part to the picture of the earlier parts. */
static int keep_before(triptych *t)
{
    float *picture = t->part == 0 ? t->before : t->before + 4 * pixels_drawn(t);
    int status = trip_frame_picture(&t->drawing, picture, NULL);
    if (!status && t->part > 0)
        trip_lod_parts_add(&t->parts, t->before, picture, true, pixels_drawn(t), t->before);
    return status;
}

static bool has_next(const triptych *t)
{
    return t->part + 1 < t->parts.count || t->band + 1 < t->bands;
}

/* Ends a part or band that is drawn, and begins the next. */
static int begin_next(triptych *t)
{
    const bool ends_band = t->part + 1 == t->parts.count;
    int status = ends_band ? take_colours(t, t->banded + floats_above(t), NULL) : keep_before(t);
    if (!status)
        status = trip_context_note_stats(t);
    if (status)
        return status;
    t->before_stats = t->stats;
    end(t);
    t->part = ends_band ? 0 : t->part + 1;
    t->band += ends_band;
    status = plan(t);
    if (!status)
        status = take_before(t);
    return status ? status : start(t);
}

int triptych_step(triptych *t, uint64_t deadline_ns)
{
    trip_scope *before = trip_context_enter(t);
    int status = check_drawing(t);
    if (!status && trip_context_draws_scene(t))
        return trip_context_leave(before, trip_context_step_scene(t, deadline_ns));
    if (!status)
        status = trip_frame_step(&t->drawing, deadline_ns);
    while (status == TRIP_FRAME_DONE && has_next(t)) {
        status = begin_next(t);
        status = status ? status : trip_frame_step(&t->drawing, deadline_ns);
    }
    return trip_context_leave(before, status);
}

/* Draws the weights at the pixels of the picture, independent of the frame. */
static void draw_merge_map(const triptych *t, float *rgba)
{
    const int side = pixels_a_side(t), width = t->turned.width, height = t->turned.height;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++, rgba += 4) {
            double rgb[3];
            trip_debug_view_merge(&t->drawn_settings, &t->camera, t->plan.axis_of_view,
                                  (x + 0.5) * side, (y + 0.5) * side, rgb);
            for (int c = 0; c < 3; c++)
                rgba[c] = (float)rgb[c];
            rgba[3] = 1;
        }
}

/* A frame with distances must be taken with distances, and any other frame without. */
static int take_picture(triptych *t, float *rgba, float *depth)
{
    int status = check_drawing(t);
    if (!status && t->settings.depth != (depth != NULL))
        status = trip_fail(TRIP_USAGE, "render", "depth", "%s",
                           depth ? "the frame was begun without distances"
                                 : "the frame has distances; use triptych_picture_and_depth()");
    if (status || trip_context_draws_scene(t))
        return status ? status : trip_context_take_scene(t, rgba, depth);
    status = take_bands(t, rgba, depth);
    if (!status && t->settings.show == TRIP_SHOW_MERGE)
        draw_merge_map(t, rgba);
    if (!status && t->drawing.done)
        status = trip_context_note_stats(t);
    return status;
}

int triptych_picture(triptych *t, float *rgba)
{
    trip_scope *before = trip_context_enter(t);
    return trip_context_leave(before, take_picture(t, rgba, NULL));
}

int triptych_picture_and_depth(triptych *t, float *rgba, float *depth)
{
    trip_scope *before = trip_context_enter(t);
    return trip_context_leave(before, take_picture(t, rgba, depth));
}

void triptych_end(triptych *t)
{
    trip_scope *before = trip_scope_enter(&t->scope); /* keeps the error of the last call */
    end(t);
    if (!trip_context_draws_scene(t)) {
        keep_small_before(t);
        drop_banded(t);
    }
    trip_context_leave(before, 0);
}

/* Waits for the disk in short intervals, so that cancelling takes effect soon. */
int triptych_draw(triptych *t, float *rgba)
{
    enum { LOOK_NS = 20000000 };
    int status = triptych_begin(t);
    if (status)
        return status;
    while (!status && (status = triptych_step(t, UINT64_MAX)) == TRIPTYCH_STEP_WAITS)
        status = triptych_await(t, LOOK_NS);
    if (!status)
        status = triptych_picture(t, rgba);
    triptych_end(t);
    return status;
}
