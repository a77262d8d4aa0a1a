/* Chooses samples, rays and levels of a frame, so that the quality's promise is kept. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <xxhash.h>

#include "clock.h"
#include "library_context.h"
#include "quality_trial.h"
#include "report.h"

enum { CODES = 65536, EXACT_RAYS_MIN = 4, EXACT_RAYS_MAX = 16 };
/* Raise it if trials choose otherwise: stored choices then count as unknown. */
#define TRIAL_VERSION 2u

/* Returns the distances from the eye to the nearest and farthest point of the kept voxels' box, in
 * world units. */
static void find_distances(const triptych *t, trip_vec3 eye, double out[2])
{
    const trip_dataset *d = t->session.data;
    double lo[3], hi[3], inside[3];
    trip_affine to_index;
    trip_dataset_kept_bounds(d, lo, hi);
    trip_affine_invert(&d->index_to_world, &to_index); /* the map was checked on opening */
    const trip_vec3 e = trip_affine_point(&to_index, eye);
    for (int a = 0; a < 3; a++) {
        lo[a] = trip_coordinates_position(&d->coordinates, a, lo[a]);
        hi[a] = trip_coordinates_position(&d->coordinates, a, hi[a]);
        inside[a] = fmin(fmax(trip_component(e, a), lo[a]), hi[a]);
    }
    const trip_vec3 nearest =
        trip_affine_point(&d->index_to_world, trip_v3(inside[0], inside[1], inside[2]));
    out[0] = trip_length(trip_sub(nearest, eye));
    out[1] = out[0];
    for (int i = 0; i < 8; i++) {
        const trip_vec3 corner = trip_affine_point(
            &d->index_to_world,
            trip_v3(i & 1 ? hi[0] : lo[0], i & 2 ? hi[1] : lo[1], i & 4 ? hi[2] : lo[2]));
        out[1] = fmax(out[1], trip_length(trip_sub(corner, eye)));
    }
}

/* Returns the width of a voxel in pixels, at the point looked at. That point counts as inside the
 * object. The width is the same in all pictures of a turntable. */
static double voxel_px(const triptych *t)
{
    const trip_camera_params *v = &t->turned;
    const double voxel = cbrt(fabs(trip_affine_determinant(&t->session.data->index_to_world)));
    double near_far[2];
    if (v->ortho_height > 0)
        return voxel * v->height / v->ortho_height;
    find_distances(t, v->eye, near_far);
    const double least = fmax(near_far[0], (near_far[0] + near_far[1]) / 8);
    const double distance = fmin(fmax(trip_length(trip_sub(v->look, v->eye)), least), near_far[1]);
    return voxel * v->height / (2 * distance * tan(v->fov_degrees * (M_PI / 360)));
}

/* Returns whether numbers can be chosen for the frame. If not, the defaults are drawn. */
static bool may_choose(const triptych *t)
{
    const trip_settings *s = &t->drawn_settings;
    return trip_context_draws_values(t) && t->resources.renderer != TRIPTYCH_RENDERER_INTEGRAL &&
           t->given.all.method <= TRIPTYCH_METHOD_MERGE && !s->show && !t->given.all.normalise &&
           !t->given.all.count_exactly && !(t->given.lod.max_bytes > 0) &&
           !(t->given.lod.max_ms > 0);
}

/* Returns whether levels are not chosen. Light and distances allow only one level, and the trial
 * sees no light. */
static bool needs_finest(const triptych *t)
{
    return t->settings.depth || t->session.part_count > 1 ||
           t->given.effects.which & ~TRIPTYCH_EFFECT_CUEING ||
           trip_dataset_levels(t->session.data, TRIP_KIND_VALUES) == 0;
}

/* Describes the trial for the frame. */
static trip_trial trial_of(const triptych *t, const trip_choice *defaults)
{
    const draw_settings *g = &t->given;
    trip_trial out = {
        .voxel_px = trip_choice_step_px(t->choice_step),
        .promise = t->promise,
        .given = *defaults,
        .has_samples = g->sheet.samples > 0 || t->drawn_settings.kernel == TRIP_KERNEL_NEAREST,
        .has_rays = g->all.samples > 0 || t->settings.depth,
        .has_lod = g->lod.voxel_px > 0 || g->lod.voxel_px == TRIPTYCH_ZERO || needs_finest(t),
    };
    return out;
}

static uint64_t checksum_of(const triptych *t)
{
    uint64_t sum = 0;
    for (unsigned i = 0; i < t->session.part_count; i++)
        sum = sum * 31 + t->session.parts[i]->header.header_checksum;
    return sum;
}

/* Returns a hash of all that a choice depends on, without the data. */
static uint64_t look_of(const triptych *t, const trip_trial *trial)
{
    const session *s = &t->session;
    const trip_settings *d = &t->drawn_settings;
    const double numbers[] = {
        TRIAL_VERSION,
        t->choice_step,
        trial->promise,
        trial->has_samples ? trial->given.samples_per_sheet : -1,
        trial->has_rays ? trial->given.rays : -1,
        trial->has_lod ? trial->given.lod_px : -1,
        d->kernel == TRIP_KERNEL_NEAREST,
        d->shading,
        d->shading ? s->shading_range : 0,
        trip_settings_early_termination(d),
        s->draw.lo,
        s->draw.hi,
    };
    const trip_tf_entry *table = session_table(s, trip_settings_interpolates(d, false));
    return XXH64(table, CODES * sizeof *table, XXH64(numbers, sizeof numbers, 0));
}

static void read_stored(triptych *t, uint64_t data)
{
    if (t->choices_folder && t->choices_read != data)
        trip_choices_read(&t->choices, t->choices_folder, data);
    t->choices_read = data;
}

/* Frees the memory of earlier frames for the trial's pictures. */
static int make_choice(triptych *t, const trip_trial *trial, trip_choice_key key)
{
    char why[512];
    const double begun_ms = trip_now_ms();
    trip_context_drop_renderer(t);
    int status = trip_quality_trial(t, trial, &t->choice, why);
    if (status == TRIP_INTERRUPTED)
        return status;
    if (status) {
        t->choice = trial->given;
        snprintf(t->no_trial, sizeof t->no_trial, "%s", why);
        trip_choices_add(&t->choices, key, &t->choice); /* with no error, and not in the file */
        return 0;
    }
    t->trials++;
    t->trial_ms = trip_now_ms() - begun_ms;
    trip_choices_add(&t->choices, key, &t->choice);
    if (t->choices_folder)
        trip_choices_write(t->choices_folder, key, &t->choice);
    return 0;
}

/* Looks for a known choice, or makes one. */
static int find_choice(triptych *t, trip_trial *trial, bool now)
{
    const trip_choice_key key = { checksum_of(t), look_of(t, trial) };
    read_stored(t, key.data);
    if (trip_choices_find(&t->choices, key, &t->choice))
        return 0;
    t->choice_waits = !now;
    return now ? make_choice(t, trial, key) : 0;
}

/* Returns the rays of the best quality: four for each voxel. */
static int exact_rays(double px)
{
    return (int)fmin(fmax(ceil(EXACT_RAYS_MIN / px), EXACT_RAYS_MIN), EXACT_RAYS_MAX);
}

static int choose(triptych *t, bool now)
{
    const trip_settings *s = &t->settings;
    const bool exact = t->given.all.quality == TRIPTYCH_QUALITY_EXACT;
    const trip_choice defaults = { .samples_per_sheet = s->samples_per_sheet,
                                   .rays = s->samples,
                                   .lod_px = s->lod_px,
                                   .error = -1 };
    t->choice = t->fixed ? *t->fixed : defaults;
    t->promise = t->trial_ms = 0;
    t->choice_waits = false;
    if (t->fixed || !may_choose(t))
        return 0;
    const double px = voxel_px(t);
    if (exact && t->given.all.samples <= 0 && !s->depth)
        t->choice.rays = exact_rays(px);
    t->choice_step = trip_choice_step(px);
    t->promise = draw_settings_promise(t->given.all.quality);
    trip_trial trial = trial_of(t, &defaults);
    if (exact || (trial.has_samples && trial.has_rays && trial.has_lod)) {
        t->promise = 0;
        return 0;
    }
    trip_choice preferred = defaults;
    if (t->given.all.quality == TRIPTYCH_QUALITY_HIGH && !trial.has_samples)
        preferred.samples_per_sheet = 0;
    if (px >= 1 && t->given.all.quality != TRIPTYCH_QUALITY_DRAFT)
        trial.preferred = &preferred;
    return find_choice(t, &trial, now);
}

/* Writes the numbers in words: "8 samples per sheet, 2 x 2 rays per pixel, the finest level". */
static void write_choice(const triptych *t, FILE *out)
{
    const trip_choice *c = &t->choice;
    if (t->drawn_settings.kernel != TRIP_KERNEL_NEAREST)
        fprintf(out, "%d sample%s per sheet, ", t->drawn_settings.samples_per_sheet,
                t->drawn_settings.samples_per_sheet == 1 ? "" : "s");
    fprintf(out, "%d ray%s per pixel, ", c->rays * c->rays, c->rays == 1 ? "" : "s");
    if (c->lod_px > 0)
        fprintf(out, "levels with voxels up to %.2g px", c->lod_px);
    else
        fputs("the finest level", out);
}

static const char *quality_name(const triptych *t)
{
    return draw_settings_choice(&t->given, DRAW_QUALITY);
}

void trip_context_explain_quality(const triptych *t, FILE *out)
{
    if (!(t->promise > 0) || t->plan.gathers)
        return;
    fprintf(out, "quality     ");
    write_choice(t, out);
    if (t->choice_waits)
        fputs(": the defaults, without a trial", out);
    else if (t->choice.error >= 0)
        fprintf(out, ": expected mean error %.2g of 255, %s promises %g", t->choice.error,
                !t->given.all.quality ? "normal" : quality_name(t), t->promise);
    if (t->trial_ms > 0)
        fprintf(out, "; the trial took %.0f ms", t->trial_ms);
    else if (t->choice.error >= 0 && !t->choice_waits)
        fputs("; known from an earlier trial", out);
    fputc('\n', out);
}

void trip_context_note_quality(triptych *t)
{
    if (*t->no_trial)
        trip_warn(t->session.input,
                  "no trial of the quality was possible, so the picture has the default samples "
                  "and rays: %s",
                  t->no_trial);
    *t->no_trial = 0;
}

static void use_choice(triptych *t)
{
    t->drawn_settings.samples = t->choice.rays;
    t->drawn_settings.lod_px = t->choice.lod_px;
}

int trip_context_choose_quality(triptych *t)
{
    int status = choose(t, !t->resources.choose_later);
    if (!status && t->resources.renderer != TRIPTYCH_RENDERER_INTEGRAL)
        use_choice(t);
    return status;
}
