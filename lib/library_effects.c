/* Chooses the effects of a frame, with reasons. Keeps the light map from frame to frame. */
#include <stdlib.h>

#include "clock.h"
#include "eye_dome.h"
#include "library_context.h"
#include "placed_stream.h"
#include "renderer.h"
#include "report.h"

enum { CODES = 65536 };

/* Whether most visible codes are opaque within a voxel. */
static bool is_of_surfaces(const triptych *t)
{
    const trip_tf_entry *table = t->session.table;
    const double voxel = t->camera.voxel_world;
    const trip_codes *codes = &t->session.data->codes;
    const int count = trip_codes_ids(codes) ? (int)codes->entries : CODES;
    int shown = 0, opaque = 0;
    for (int code = 0; code < count && code < CODES; code++) {
        shown += table[code].extinction > 0;
        opaque += (double)table[code].extinction * voxel > 0.69314718055994531; /* opacity 1/2 */
    }
    return 2 * opaque > shown;
}

/* Returns the effects that suit the kind of data and the transfer function. */
static int choose(triptych *t)
{
    const trip_tf_kind kind = trip_dataset_metadata_kind(t->session.text);
    const bool surfaces = kind == TRIP_TF_LABELS && is_of_surfaces(t);
    const bool head = t->given.light.kind == TRIPTYCH_LIGHT_HEAD;
    switch (kind) {
    case TRIP_TF_FOG:
        t->why_effects = head ? "smoke, clouds or fog would scatter the light, but it comes from "
                                "the eye; give it a direction or position"
                              : "smoke, clouds or fog scatter the light";
        return head ? 0 : TRIPTYCH_EFFECT_SHADOWS;
    case TRIP_TF_LABELS:
        t->why_effects =
            surfaces ? "labels are drawn as surfaces" : "transparent labels keep their colours";
        return surfaces ? TRIPTYCH_EFFECT_OCCLUSION : 0;
    case TRIP_TF_CT:
    case TRIP_TF_MR:
        t->why_effects = "measured values keep the colours of the transfer function";
        return 0;
    default:
        t->why_effects = "values keep the colours of the transfer function";
        return 0;
    }
}

static int check_effects(const triptych *t, int effects)
{
    if (!TRIP_HAS_EFFECTS && effects)
        return trip_fail(TRIP_USAGE, "render", "effects", "this build has no effects");
    if (effects & TRIPTYCH_EFFECT_EMISSION && !t->heat)
        return trip_fail(TRIP_USAGE, "render", "emission",
                         "emission needs a data set of heat; give one");
    return 0;
}

/* Sets the direction of a light that turns with the view. Chooses such a light for shadows if none
 * is given. */
static void choose_light(triptych *t)
{
    static const double upper_left_front[3] = { 1, 1, 1 };
    trip_settings *s = &t->drawn_settings;
    const triptych_light *light = &t->given.light;
    const bool chosen = light->kind == TRIPTYCH_LIGHT_DEFAULT && s->effects.shadows;
    const double *toward = chosen ? upper_left_front : light->toward;
    if (!chosen && light->kind != TRIPTYCH_LIGHT_VIEW)
        return;
    s->headlight = false;
    s->light_direction =
        trip_normalize(trip_camera_direction(&t->camera, toward[0], toward[1], toward[2]));
    if (chosen && !t->light_noted)
        trip_note(t->name, "the light for the shadows comes from the upper left front of the view; "
                           "--light chooses another");
    t->light_noted |= chosen;
}

int trip_context_choose_effects(triptych *t)
{
    trip_effects *e = &t->drawn_settings.effects;
    int effects = t->given.effects.which & ~TRIPTYCH_EFFECT_AUTO, status = 0;
    t->why_effects = NULL;
    if (t->given.effects.which & TRIPTYCH_EFFECT_AUTO) {
        status = session_read_text(&t->session);
        effects |= status ? 0 : choose(t);
        effects |= t->heat ? TRIPTYCH_EFFECT_EMISSION : 0;
    }
    if (t->settings.show == TRIP_SHOW_MERGE) /* the merge map shows nothing of the volume */
        effects = 0;
    if (!status)
        status = check_effects(t, effects);
    e->shadows = effects & TRIPTYCH_EFFECT_SHADOWS;
    e->occlusion = effects & TRIPTYCH_EFFECT_OCCLUSION;
    e->emission = effects & TRIPTYCH_EFFECT_EMISSION;
    e->cueing = effects & TRIPTYCH_EFFECT_CUEING ? t->settings.effects.cueing : 0;
    choose_light(t);
    return status;
}

void trip_context_drop_light(triptych *t)
{
    trip_light_map_destroy(t->light);
    t->light = NULL;
}

int triptych_set_heat(triptych *t, const char *path)
{
    trip_scope *before = trip_context_enter_anew(t);
    int status = trip_context_check_idle(t, true);
    if (!status)
        status = trip_context_check_volume(t);
    if (status)
        return trip_context_leave(before, status);
    trip_context_drop_heat(t);
    return trip_context_leave(before,
                              path ? trip_emission_create(&t->heat, path, t->session.budget) : 0);
}

void trip_context_drop_heat(triptych *t)
{
    trip_emission_destroy(t->heat);
    t->heat = NULL;
}

/* For the integral, `cells` is 0, which makes one node per voxel. */
static int begin_heat(triptych *t)
{
    const trip_effects *e = &t->drawn_settings.effects;
    const triptych_resources *r = &t->resources;
    if (!e->emission) {
        if (t->heat)
            trip_emission_drop(t->heat);
        return 0;
    }
    const trip_dataset *drawn = t->at_level ? t->at_level : t->session.data;
    return trip_emission_begin(t->heat, &(trip_emission_params){
                                            .index_to_world = &drawn->index_to_world,
                                            .kelvin = { t->kelvin[0], t->kelvin[1] },
                                            .cells = t->plan.gathers ? 0 : e->cells,
                                            .engine = (trip_engine)r->engine,
                                            .threads = trip_context_threads(r->threads),
                                        });
}

/* Returns the clip of the matter that takes light, in index space: without the slab that is drawn.
 */
static trip_clip clip_of_light(const triptych *t)
{
    const trip_dataset *data = t->at_level ? t->at_level : t->session.data;
    trip_clip clip = t->drawn_settings.clip;
    const int first = t->cut.count - t->slab_cuts;
    if (!t->slab_cuts)
        return t->plan.clip;
    clip.count -= t->slab_cuts;
    for (int i = first; i < clip.count; i++)
        clip.planes[i] = clip.planes[i + t->slab_cuts];
    clip = trip_clip_before(&clip, &t->camera.index_to_world);
    trip_clip_simplify(&clip, data->header.dims);
    return clip;
}

static int begin_light(triptych *t)
{
    const triptych_resources *r = &t->resources;
    if (!trip_effects_light(&t->drawn_settings.effects) || t->plan.gathers) {
        trip_context_drop_light(t);
        return 0;
    }
    int status = t->light ? 0 : trip_light_map_create(&t->light, t->session.budget);
    const trip_clip clip = clip_of_light(t);
    const trip_light_source source = {
        .data = t->at_level ? t->at_level : t->session.data,
        .level = t->level,
        .settings = &t->drawn_settings,
        .clip = &clip,
        .table = t->session.table,
        .engine = (trip_engine)r->engine,
        .threads = trip_context_threads(r->threads),
    };
    return status ? status : trip_light_map_begin(t->light, &source);
}

int trip_context_begin_light(triptych *t)
{
    const int status = begin_heat(t);
    return status ? status : begin_light(t);
}

static void explain(const triptych *t, const char *name, int effect, bool runs, FILE *out)
{
    const bool automatic = t->given.effects.which & TRIPTYCH_EFFECT_AUTO;
    const char *why = t->given.effects.which & effect ? "asked for" : "not asked for";
    if (t->settings.show == TRIP_SHOW_MERGE && (automatic || t->given.effects.which & effect))
        why = "the merge map does not show the volume";
    /* for fog, why_effects is about shadows, whether or not they run */
    else if (automatic && !(t->given.effects.which & effect) && effect == TRIPTYCH_EFFECT_EMISSION)
        why = runs ? "a data set of heat is given" : "no data set of heat is given";
    else if (automatic && !(t->given.effects.which & effect))
        why = runs || effect & (TRIPTYCH_EFFECT_SHADOWS | TRIPTYCH_EFFECT_EDL)
                  ? t->why_effects
                  : "the kind of data does not call for it";
    fprintf(out, "%-11s %s: %s\n", name, runs ? "runs" : "does not run", why);
}

static void explain_lattice(const triptych *t, FILE *out)
{
    if (t->plan.gathers) {
        fprintf(out, "light       an integral from each position, %s\n",
                t->drawn_settings.effects.occlusion ? "also in each direction of the occlusion"
                                                    : "towards the light");
        return;
    }
    const trip_light_grid *grid = trip_light_map_gathered(t->light);
    fprintf(out, "light       %d x %d x %d nodes, one in %g voxels: %s\n", grid->nodes[0],
            grid->nodes[1], grid->nodes[2], grid->spacing,
            trip_light_map_is_complete(t->light) ? "kept from the frame before, so nothing is read"
            : trip_light_map_is_gathered(t->light)
                ? "kept from the frame before, but swept for another light"
                : "one more list is read");
}

static void explain_heat(const triptych *t, FILE *out)
{
    const trip_light_map *map = trip_emission_map(t->heat);
    const trip_light_grid *grid = trip_light_map_gathered(map);
    fprintf(out, "heat        %d x %d x %d nodes, one in %g voxels, %g to %g K: %s\n",
            grid->nodes[0], grid->nodes[1], grid->nodes[2], grid->spacing, t->kelvin[0],
            t->kelvin[1],
            trip_light_map_is_complete(map) ? "kept from the frame before, so nothing is read"
                                            : "a list of its data set is read");
}

void trip_context_explain_effects(const triptych *t, FILE *out)
{
    const trip_effects *e = &t->drawn_settings.effects;
    explain(t, "shadows", TRIPTYCH_EFFECT_SHADOWS, e->shadows, out);
    explain(t, "occlusion", TRIPTYCH_EFFECT_OCCLUSION, e->occlusion, out);
    explain(t, "emission", TRIPTYCH_EFFECT_EMISSION, e->emission, out);
    explain(t, "cueing", TRIPTYCH_EFFECT_CUEING, e->cueing > 0, out);
    if (trip_effects_light(e))
        explain_lattice(t, out);
    if (e->emission)
        explain_heat(t, out);
}

/* ---- Gaussian scenes ---- */

/* Colours of a camera have no light that shows their shape. */
static bool suits_eye_dome(triptych *t, bool integral)
{
    t->why_effects = integral ? "the integral has no distances"
                     : t->lit ? "light shades the points"
                              : "no light shades the points";
    return !integral && !t->lit;
}

/* ---- occlusion of clouds ---- */

/* Whether an earlier object has the same lattice. */
static bool shares_openness(const triptych *t, unsigned i)
{
    bool shared = false;
    for (unsigned k = 0; k < i && !shared; k++)
        shared = t->openness[k] == t->openness[i];
    return shared;
}

void trip_context_drop_openness(triptych *t)
{
    for (unsigned i = t->placed_count; i > 0 && t->openness; i--) {
        if (!shares_openness(t, i - 1))
            trip_openness_end(t->openness[i - 1]);
        t->placed[i - 1].change = (trip_gaussian_change){ NULL, NULL };
    }
    free(t->openness);
    free(t->openness_views);
    t->openness = NULL;
    t->openness_views = NULL;
}

static int take_openness(triptych *t)
{
    t->openness = calloc(t->placed_count, sizeof *t->openness);
    t->openness_views = calloc(t->placed_count, sizeof *t->openness_views);
    int status = t->openness && t->openness_views
                     ? 0
                     : trip_fail(TRIP_ERROR, "render", "occlusion", "out of memory");
    for (unsigned i = 0; i < t->placed_count && !status; i++) {
        for (unsigned k = 0; k < i && !t->openness[i]; k++)
            if (t->placed[k].set == t->placed[i].set)
                t->openness[i] = t->openness[k];
        if (!t->openness[i])
            status = trip_openness_begin(&t->openness[i], t->placed[i].set,
                                         t->settings.effects.cells, t->session.budget);
    }
    if (status)
        trip_context_drop_openness(t);
    return status;
}

static bool is_openness_complete(const triptych *t)
{
    bool complete = true;
    for (unsigned i = 0; i < t->placed_count; i++)
        complete &= trip_openness_is_complete(t->openness[i]);
    return complete;
}

static int begin_openness(triptych *t)
{
    int status = t->given.effects.which & TRIPTYCH_EFFECT_OCCLUSION
                     ? check_effects(t, TRIPTYCH_EFFECT_OCCLUSION)
                     : 0;
    const bool runs = !status && !t->mixed && t->given.effects.which & TRIPTYCH_EFFECT_OCCLUSION &&
                      t->settings.show != TRIP_SHOW_MERGE;
    if (t->openness &&
        (!runs || trip_openness_light_cells(t->openness[0]) != t->settings.effects.cells))
        trip_context_drop_openness(t);
    if (!runs)
        return status;
    t->openness_kept = t->openness && is_openness_complete(t);
    if (!t->openness)
        status = take_openness(t);
    for (unsigned i = 0; i < t->placed_count && !status; i++) {
        trip_openness_view *v = &t->openness_views[i];
        *v = trip_openness_view_of(t->openness[i], &t->camera, &t->placed[i].placement);
        t->placed[i].change = (trip_gaussian_change){ trip_openness_change, v };
    }
    return status;
}

int trip_context_step_scene_effects(triptych *t, uint64_t deadline_ns)
{
    const trip_task_runner runner = trip_renderer_runner(t->renderer);
    int status = TRIP_FRAME_DONE;
    for (unsigned i = 0; i < t->placed_count && t->openness && status == TRIP_FRAME_DONE; i++)
        do {
            status = trip_frame_poll();
            if (!status)
                status = trip_openness_step(t->openness[i], &runner);
        } while (status == TRIP_FRAME_MORE && trip_now_ns() < deadline_ns);
    if (status < 0)
        trip_context_drop_openness(t);
    return status;
}

void trip_context_add_scene_effects(const triptych *t, triptych_frame_stats *stats)
{
    stats->effects |= t->levels ? TRIPTYCH_EFFECT_EDL : 0;
    for (unsigned i = 0; i < t->placed_count && t->openness; i++) {
        const trip_light_stats s = trip_openness_stats(t->openness[i]);
        const bool shared = shares_openness(t, i);
        stats->effects |= TRIPTYCH_EFFECT_OCCLUSION;
        stats->light_memory_bytes += shared ? 0 : s.memory_bytes;
        if (shared || t->openness_kept)
            continue;
        stats->light_bytes_read += s.bytes_read;
        stats->light_gather_ms += s.gather_ms;
        stats->light_sweep_ms += s.sweep_ms;
    }
}

/* ---- effects of Gaussian scenes ---- */

static int begin_eye_dome(triptych *t)
{
    const bool integral = t->resources.renderer == TRIPTYCH_RENDERER_INTEGRAL;
    const bool given = t->given.effects.which & TRIPTYCH_EFFECT_EDL;
    const bool automatic = t->given.effects.which & TRIPTYCH_EFFECT_AUTO;
    t->why_effects = NULL;
    const bool chosen = automatic && suits_eye_dome(t, integral);
    if (t->mixed || !(chosen || given))
        return 0;
    int status = check_effects(t, TRIPTYCH_EFFECT_EDL);
    if (!status && integral)
        status = trip_option_fail("--effects", "edl does not apply to --renderer integral");
    if (status)
        return status;
    t->levels_bytes = (size_t)t->camera.width * (size_t)t->camera.height * sizeof *t->levels;
    t->levels = trip_budget_take(t->session.budget, t->levels_bytes);
    return t->levels ? 0
                     : trip_fail(TRIP_ERROR, "render", "edl",
                                 "the distances of %d x %d pixels do not fit in memory; raise "
                                 "--memory or lower --size or --samples",
                                 t->camera.width, t->camera.height);
}

int trip_context_begin_scene_effects(triptych *t)
{
    const int status = begin_openness(t);
    return status ? status : begin_eye_dome(t);
}

/* Returns the settings. Lengths count in pixels of the picture, also with several rays. */
static trip_eye_dome eye_dome_of(const triptych *t)
{
    const triptych_effects *e = &t->given.effects;
    return (trip_eye_dome){
        .strength = e->edl_strength > 0 ? e->edl_strength : TRIP_EYE_DOME_STRENGTH,
        .radius_px = e->edl_radius_px > 0 ? e->edl_radius_px : TRIP_EYE_DOME_RADIUS_PX,
    };
}

void trip_context_apply_scene_effects(triptych *t, float *rgba, const float *distances)
{
    trip_eye_dome e = eye_dome_of(t);
    e.radius_px *= t->drawn_settings.samples;
    trip_eye_dome_darken(&e, &t->camera, distances, t->levels, rgba);
}

void trip_context_end_scene_effects(triptych *t)
{
    trip_budget_release(t->session.budget, t->levels, t->levels_bytes);
    t->levels = NULL;
    t->levels_bytes = 0;
}

static void explain_openness(const triptych *t, FILE *out)
{
    for (unsigned i = 0; i < t->placed_count; i++) {
        double cell;
        const trip_light_grid *g = trip_openness_grid(t->openness[i], &cell);
        if (!shares_openness(t, i))
            fprintf(out, "light       %d x %d x %d nodes, %.4g apart: %s\n", g->nodes[0],
                    g->nodes[1], g->nodes[2], cell,
                    t->openness_kept ? "kept from the frame before, so nothing is read"
                                     : "the finest level of the data set is read once");
    }
}

void trip_context_explain_scene_effects(const triptych *t, FILE *out)
{
    const trip_eye_dome e = eye_dome_of(t);
    if (t->mixed)
        return;
    explain(t, "occlusion", TRIPTYCH_EFFECT_OCCLUSION, t->openness != NULL, out);
    if (t->openness)
        explain_openness(t, out);
    explain(t, "edl", TRIPTYCH_EFFECT_EDL, t->levels != NULL, out);
    if (t->levels)
        fprintf(out, "            strength %g, neighbours at %g pixels\n", e.strength, e.radius_px);
}
