#include "quality_trial.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "framing.h"
#include "report.h"

enum {
    LOOK_PX = 64,  /* side of the picture that finds the places */
    PLACE_PX = 24, /* side of a place's picture */
    SMALL_PX = 16, /* the same for narrow voxels, which average out */
    WHOLE_PX = 48, /* a smaller object needs one place for each direction */
    DIRECTIONS = 2,
    PLACES_EACH = 3, /* places for each direction */
    PLACES = DIRECTIONS * PLACES_EACH,
    STEP_NS = 10000000,
    TRUTH_SAMPLES = 16,
};

/* The expected error may use this part of the promise, since a trial sees few pixels. */
#define PART_OF_PROMISE 0.7
/* More rays or samples are not tried if the last ones left more than this share of the error. */
#define STUCK_SHARE 0.9
/* More samples are not tried if the error would be too large without this many gains. */
#define MAX_GAINS 4
/* Pixels of voxels below this width average several voxels. Errors along rays average out too. */
#define NARROW_PX 0.5
/* Opacity from which a pixel shows something. */
#define SEEN_ALPHA (0.5f / 255)

typedef struct place {
    trip_vec3 middle, toward_eye; /* world space */
    int px;
    float *truth; /* px * px pixels */
} place;

typedef struct trying {
    triptych *t; /* the trial's own context */
    const trip_trial *trial;
    trip_vec3 up;
    double voxel_world, reach; /* `reach`: from the middle of the box to a corner */
    place places[PLACES];
    int count;
    float *rgba; /* room for the largest picture */
    int truth_rays;
    double truth_error, across_error; /* that the truth may have; its part of the rays */
    trip_choice best;                 /* the best so far */
    double gain;                      /* difference of pictures with two and four samples */
    double least;                     /* least error of the last tries of samples or rays */
    double best_cost; /* of a choice within the promise; HUGE_VAL if there is none */
} trying;

/* ---- pictures ---- */

/* Draws `px` x `px` pixels around a point, with voxels `voxel_px` wide. */
static int draw(trying *y, trip_vec3 middle, trip_vec3 toward_eye, int px, double voxel_px,
                const trip_choice *choice, float *rgba)
{
    const trip_vec3 from = trip_add(middle, trip_scale(toward_eye, 2 * y->reach));
    const double eye[3] = { from.x, from.y, from.z }, look[3] = { middle.x, middle.y, middle.z };
    const double up[3] = { y->up.x, y->up.y, y->up.z };
    const triptych_view view = { .width = px,
                                 .height = px,
                                 .eye = eye,
                                 .look = look,
                                 .up = up,
                                 .ortho_height = px * y->voxel_world / voxel_px };
    y->t->fixed = choice;
    int status = triptych_set_view(y->t, &view);
    if (!status)
        status = triptych_begin(y->t);
    if (status)
        return status;
    while (!status && (status = triptych_step(y->t, trip_now_ns() + STEP_NS)) > 0) {
        status = status == TRIPTYCH_STEP_WAITS ? triptych_await(y->t, STEP_NS) : 0;
        if (!status && trip_interrupted())
            status = TRIPTYCH_CANCELLED;
    }
    if (!status)
        status = triptych_picture(y->t, rgba);
    triptych_end(y->t);
    return status;
}

static int draw_place(trying *y, const place *p, const trip_choice *choice, float *rgba)
{
    /* slightly narrower voxels, so that rounding does not change levels */
    const double voxel_px = y->trial->voxel_px * (1 - 1e-6);
    return draw(y, p->middle, p->toward_eye, p->px, voxel_px, choice, rgba);
}

/* A sum of differences over seen pixels. */
typedef struct difference {
    double sum, pixels;
} difference;

static void add_difference(difference *d, const float *a, const float *b, int pixels)
{
    for (int i = 0; i < pixels; i++, a += 4, b += 4) {
        if (a[3] < SEEN_ALPHA && b[3] < SEEN_ALPHA)
            continue;
        d->pixels++;
        for (int c = 0; c < 4; c++)
            d->sum += fabs((double)a[c] - (double)b[c]);
    }
}

static double mean_of(difference d)
{
    return d.pixels > 0 ? 255 * d.sum / (4 * d.pixels) : 0;
}

/* ---- places ---- */

/* Sets a place at a pixel of the picture that looks for places. */
static void set_place(trying *y, trip_vec3 middle, trip_vec3 toward_eye, double x, double up,
                      double unit, int px)
{
    const trip_vec3 right = trip_normalize(trip_cross(y->up, toward_eye));
    const trip_vec3 above = trip_cross(toward_eye, right);
    place *p = &y->places[y->count++];
    p->middle =
        trip_add(middle, trip_add(trip_scale(right, x * unit), trip_scale(above, up * unit)));
    p->toward_eye = toward_eye;
    p->px = px;
}

static bool is_seen(const float *rgba, int i)
{
    return rgba[4 * i + 3] >= SEEN_ALPHA;
}

/* Chooses places from a picture of the whole object: pixels that stand at equal parts of the seen
 * pixels, in the order of rows. An object that is small in the frame gets one place. */
static void choose_places(trying *y, trip_vec3 middle, trip_vec3 toward_eye, double unit)
{
    const double whole = 2 * y->reach / y->voxel_world * y->trial->voxel_px;
    int seen = 0, met = 0, next = 0;
    for (int i = 0; i < LOOK_PX * LOOK_PX; i++)
        seen += is_seen(y->rgba, i);
    if (seen > 0 && whole <= WHOLE_PX) {
        set_place(y, middle, toward_eye, 0, 0, unit, (int)fmax(ceil(whole), 8));
        return;
    }
    for (int i = 0; i < LOOK_PX * LOOK_PX && next < PLACES_EACH; i++) {
        if (!is_seen(y->rgba, i) || met++ < (2 * next + 1) * seen / (2 * PLACES_EACH))
            continue;
        set_place(y, middle, toward_eye, i % LOOK_PX + 0.5 - LOOK_PX / 2,
                  LOOK_PX / 2 - (i / LOOK_PX + 0.5), unit,
                  y->trial->voxel_px < 1 ? SMALL_PX : PLACE_PX);
        next++;
    }
}

static int find_places(trying *y)
{
    /* right, front, up */
    static const double directions[DIRECTIONS][3] = { { 0.41, 0.81, 0.42 }, { -0.63, 0.7, 0.33 } };
    const session *s = &y->t->session;
    trip_view_object object = trip_view_object_of(s->data, s->text);
    if (!(trip_length(object.up) > 0))
        object.up = trip_v3(0, 0, 1);
    if (!(trip_length(trip_cross(object.up, object.front)) > 1e-6))
        object.front = fabs(object.up.z) > 0.5 ? trip_v3(0, -1, 0) : trip_v3(0, 0, 1);
    const trip_vec3 right = trip_normalize(trip_cross(object.up, object.front));
    const trip_choice coarse = { .samples_per_sheet = 1, .rays = 1, .lod_px = 1 };
    trip_vec3 corner[2];
    for (int end = 0; end < 2; end++) {
        const double *c = end ? object.hi : object.lo;
        corner[end] = trip_affine_point(&object.index_to_world, trip_v3(c[0], c[1], c[2]));
    }
    /* the middle of two opposite corners is the middle of the box */
    const trip_vec3 middle = trip_scale(trip_add(corner[0], corner[1]), 0.5);
    for (int i = 0; i < 8; i++) {
        const trip_vec3 c =
            trip_affine_point(&object.index_to_world, trip_v3(i & 1 ? object.hi[0] : object.lo[0],
                                                              i & 2 ? object.hi[1] : object.lo[1],
                                                              i & 4 ? object.hi[2] : object.lo[2]));
        y->reach = fmax(y->reach, trip_length(trip_sub(c, middle)));
    }
    y->up = object.up;
    const double unit = 2 * y->reach / LOOK_PX;
    for (int i = 0; i < DIRECTIONS; i++) {
        const double *d = directions[i];
        const trip_vec3 toward_eye = trip_normalize(
            trip_add(trip_add(trip_scale(right, d[0]), trip_scale(object.front, d[1])),
                     trip_scale(object.up, d[2])));
        int status = draw(y, middle, toward_eye, LOOK_PX, y->voxel_world / unit, &coarse, y->rgba);
        if (status)
            return status;
        choose_places(y, middle, toward_eye, unit);
    }
    return 0;
}

/* ---- truth ---- */

/* Rays of the truth along each side of a pixel. Wide voxels have fewer edges in a pixel. If the
 * truth then differs too much from half the rays, it gets twice as many. */
enum { WIDE_RAYS = 4, RAYS = 8, MOST_RAYS = 16 };

/* Measures the mean difference of two choices. */
static int compare(trying *y, const trip_choice *a, const trip_choice *b, double *out)
{
    float *other = y->rgba + (size_t)4 * LOOK_PX * LOOK_PX;
    difference d = { 0 };
    int status = 0;
    for (int i = 0; i < y->count && !status; i++) {
        const place *p = &y->places[i];
        status = draw_place(y, p, a, y->rgba);
        if (!status)
            status = draw_place(y, p, b, other);
        if (!status)
            add_difference(&d, y->rgba, other, p->px * p->px);
    }
    *out = mean_of(d);
    return status;
}

/* Measures the mean difference of a choice from the truth. */
static int compare_with_truth(trying *y, const trip_choice *c, double *out)
{
    difference d = { 0 };
    int status = 0;
    for (int i = 0; i < y->count && !status; i++) {
        const place *p = &y->places[i];
        status = draw_place(y, p, c, y->rgba);
        if (!status)
            add_difference(&d, y->rgba, p->truth, p->px * p->px);
    }
    *out = mean_of(d);
    return status;
}

/* Estimates the error of the truth. The error along rays falls with the square of the samples, so
 * that a third of the change from half of the samples remains. Edges at random positions have an
 * error that falls with the rays to the power of 1.5. So a third of the change from half the rays
 * remains. */
static int find_truth_error(trying *y, const trip_choice *truth)
{
    const trip_choice coarse = { .samples_per_sheet = truth->samples_per_sheet / 2, .rays = 1 };
    const trip_choice fine = { .samples_per_sheet = truth->samples_per_sheet, .rays = 1 };
    const trip_choice sparse = { .samples_per_sheet = truth->samples_per_sheet / 2,
                                 .rays = truth->rays / 2 };
    double along = 0, across = 0;
    int status = y->trial->voxel_px < NARROW_PX ? 0 : compare(y, &coarse, &fine, &along);
    if (!status)
        status = compare_with_truth(y, &sparse, &across);
    y->across_error = across / 3;
    y->truth_error = hypot(along, across) / 3;
    return status;
}

static int draw_truth(trying *y)
{
    const bool narrow = y->trial->voxel_px < NARROW_PX;
    const trip_choice choice = { .samples_per_sheet = narrow ? TRUTH_SAMPLES / 2 : TRUTH_SAMPLES,
                                 .rays = y->truth_rays };
    int status = 0;
    for (int i = 0; i < y->count && !status; i++)
        status = draw_place(y, &y->places[i], &choice, y->places[i].truth);
    return status ? status : find_truth_error(y, &choice);
}

static int find_truth(trying *y)
{
    double *ends = &y->t->settings.early_termination;
    const double of_frames = *ends;
    *ends = TRIP_EARLY_TERMINATION_PRE;
    y->truth_rays = y->trial->voxel_px >= 1 ? WIDE_RAYS : RAYS;
    int status = draw_truth(y);
    if (!status && y->across_error > 0.5 * PART_OF_PROMISE * y->trial->promise) {
        y->truth_rays = y->trial->voxel_px >= 1 ? RAYS : MOST_RAYS;
        status = draw_truth(y);
    }
    *ends = of_frames;
    return status;
}

/* ---- candidates ---- */

/* Returns the level that a candidate draws. */
static int level_of(const trying *y, const trip_choice *c)
{
    const double levels = c->lod_px > 0 ? floor(log2(c->lod_px / y->trial->voxel_px) + 1e-9) : 0;
    return levels > 0 ? (int)levels : 0;
}

/* Returns the relative time for a voxel of the finest level: a part for its preparation, and a part
 * for the rays through it. */
static double cost_of(const trying *y, const trip_choice *c)
{
    const double across = y->trial->voxel_px * c->rays;
    const double samples =
        c->samples_per_sheet ? c->samples_per_sheet : 2 + floor(y->trial->voxel_px / 4);
    const int level = level_of(y, c);
    return ldexp(1 + 0.15 * samples, -3 * level) +
           ldexp(across * across * (0.5 + 0.3 * samples), -level);
}

/* Measures the expected error of a candidate. */
static int measure(trying *y, trip_choice *c)
{
    double apart = 0;
    int status = compare_with_truth(y, c, &apart);
    c->error = hypot(apart, y->truth_error);
    return status;
}

static bool is_within(const trying *y, const trip_choice *c)
{
    return c->error <= PART_OF_PROMISE * y->trial->promise;
}

/* Measures a candidate and keeps it if it is better than the best so far. */
static int try(trying *y, trip_choice *c)
{
    int status = measure(y, c);
    if (status)
        return status;
    const double cost = cost_of(y, c);
    y->least = fmin(y->least, c->error);
    const bool better = is_within(y, c) ? cost < y->best_cost
                                        : y->best_cost == HUGE_VAL && c->error < y->best.error;
    if (better)
        y->best = *c;
    if (better && is_within(y, c))
        y->best_cost = cost;
    return 0;
}

/* Tries the numbers of samples for some rays and levels. More samples never cost less, so it starts
 * in the middle, and then goes up or down. Skips candidates that cost more than the best one. */
static int try_samples(trying *y, int rays, double lod_px)
{
    static const int numbers[] = { 1, 2, 4, 8, 16 };
    const trip_trial *t = y->trial;
    trip_choice c = { .rays = rays, .lod_px = lod_px };
    if (t->has_samples) {
        c.samples_per_sheet = t->given.samples_per_sheet;
        return cost_of(y, &c) < y->best_cost ? try(y, &c) : 0;
    }
    int status = 0, way = 0;
    for (int i = 1; i >= 0 && i < 5 && !status; i += way) {
        c.samples_per_sheet = numbers[i];
        const bool cheap = cost_of(y, &c) < y->best_cost;
        if (!cheap && way >= 0 && i > 1)
            return 0;
        if (!cheap) { /* even fewer samples may still be cheaper */
            way = -1;
            continue;
        }
        const double before = i > 1 && way > 0 ? c.error : 0;
        const double help = MAX_GAINS * y->gain, wanted = PART_OF_PROMISE * t->promise;
        status = try(y, &c);
        const bool within = is_within(y, &c);
        if ((within && way > 0) || (!within && way < 0))
            return status;
        /* errors of rays and of samples add up in squares */
        if (i == 1 && !within && c.error * c.error - help * help > wanted * wanted)
            return status;
        /* more samples no longer help: the rest of the error has another cause */
        if (!within && way > 0 && c.error > STUCK_SHARE * before)
            return status;
        way = within ? -1 : 1;
    }
    return status;
}

/* Returns whether more rays or finer samples hardly help: the error has another cause. */
static bool is_stuck(const trying *y, double before)
{
    return y->least > PART_OF_PROMISE * y->trial->promise && y->least > STUCK_SHARE * before;
}

static int try_rays(trying *y, double lod_px)
{
    static const int numbers[] = { 1, 2, 3, 4, 6, 8, 12, 16 };
    const trip_trial *t = y->trial;
    const int most = y->truth_rays;
    int status = 0;
    if (t->has_rays)
        return try_samples(y, t->given.rays, lod_px);
    double before = y->least = HUGE_VAL;
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers && !status; i++) {
        if (numbers[i] > most || is_stuck(y, before))
            return 0;
        before = y->least;
        status = try_samples(y, numbers[i], lod_px);
    }
    return status;
}

/* Tries levels, the finest first. Ends when a level cannot keep the promise, since coarser ones are
 * worse. Tries each level once, with the narrowest voxels. */
static int try_levels(trying *y)
{
    static const double widths[] = { 0, 0.5, 0.70710678118654752, 1, 1.4142135623730951 };
    const trip_trial *t = y->trial;
    int status = 0, level = -1;
    if (t->has_lod)
        return try_rays(y, t->given.lod_px);
    for (size_t i = 0; i < sizeof widths / sizeof *widths && !status; i++) {
        const trip_choice c = { .lod_px = widths[i] };
        if (level_of(y, &c) <= level)
            continue;
        if (level > 0 && y->least > PART_OF_PROMISE * t->promise)
            return 0;
        level = level_of(y, &c);
        status = try_rays(y, widths[i]);
    }
    return status;
}

static int try_all(trying *y)
{
    const trip_choice few = { .samples_per_sheet = 2, .rays = 1 };
    const trip_choice more = { .samples_per_sheet = 4, .rays = 1 };
    y->best = (trip_choice){ .error = HUGE_VAL };
    y->best_cost = y->least = HUGE_VAL;
    if (y->trial->preferred) {
        trip_choice c = *y->trial->preferred;
        int status = try(y, &c);
        if (status || is_within(y, &c))
            return status;
    }
    if (!y->trial->has_samples) {
        int status = compare(y, &few, &more, &y->gain);
        if (status)
            return status;
    }
    return try_levels(y);
}

/* ---- the trial's own context ---- */

static int open_data(trying *y, const triptych *of)
{
    const session *s = &of->session;
    const triptych_resources r = {
        .memory_bytes = trip_budget_left_bytes(s->budget),
        .threads = of->resources.threads,
        .renderer = TRIPTYCH_RENDERER_CPU,
        .engine = of->resources.engine,
        .name = of->name,
    };
    int status = triptych_open(y->t, s->parts[0]->path, &r);
    for (unsigned i = 1; i < s->part_count && !status; i++)
        status = triptych_add(y->t, s->parts[i]->path);
    if (status)
        return status;
    session_lend_function(&y->t->session, s);
    y->t->has_function = true;
    return session_read_text(&y->t->session);
}

static int use_settings(trying *y, const triptych *of)
{
    static const double transparent[4] = { 0 };
    const trip_settings *drawn = &of->drawn_settings;
    const triptych_light light = { .no_shading = !drawn->shading, .kind = TRIPTYCH_LIGHT_HEAD };
    const triptych_settings settings = {
        .classify = TRIPTYCH_CLASSIFY_POST,
        .interpolation = drawn->kernel == TRIP_KERNEL_NEAREST ? TRIPTYCH_INTERPOLATION_NEAREST
                                                              : TRIPTYCH_INTERPOLATION_LINEAR,
        .early_termination = trip_settings_early_termination(drawn) > 0
                                 ? trip_settings_early_termination(drawn)
                                 : TRIPTYCH_ZERO,
        .background = transparent,
        .light = &light,
    };
    y->voxel_world = cbrt(fabs(trip_affine_determinant(&of->session.data->index_to_world)));
    return triptych_set_settings(y->t, &settings);
}

static int make_room(trying *y)
{
    const size_t truth = 4 * WHOLE_PX * WHOLE_PX, pictures = 2 * 4 * LOOK_PX * LOOK_PX;
    float *memory = calloc(pictures + PLACES * truth, sizeof *memory);
    if (!memory)
        return TRIP_ERROR;
    y->rgba = memory;
    for (int i = 0; i < PLACES; i++)
        y->places[i].truth = memory + pictures + (size_t)i * truth;
    return 0;
}

static int run(trying *y, const triptych *of)
{
    int status = make_room(y);
    if (!status)
        status = open_data(y, of);
    if (!status)
        status = use_settings(y, of);
    if (!status)
        status = find_places(y);
    if (!status && y->count)
        status = find_truth(y);
    return status || !y->count ? status : try_all(y);
}

int trip_quality_trial(triptych *t, const trip_trial *trial, trip_choice *out, char *why)
{
    trying y = { .trial = trial };
    *why = 0;
    if (triptych_create(&y.t))
        return TRIP_ERROR;
    y.t->scope.around = trip_scope_current();
    int status = run(&y, t);
    snprintf(why, 512, "%.511s", triptych_error(y.t));
    *out = y.best;
    if (!status && !y.count) { /* nothing is shown, so nothing is wrong */
        *out = trial->preferred ? *trial->preferred : trial->given;
        out->error = 0;
    }
    session_return_function(&y.t->session);
    triptych_destroy(y.t);
    free(y.rgba);
    if (status != TRIP_INTERRUPTED)
        return status;
    trip_scope_report_again(); /* the trial's context kept the report to itself */
    return trip_fail(TRIP_INTERRUPTED, "render", t->name, "interrupted");
}
