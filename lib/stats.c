/* The costs of a frame: the plan in words, and statistics per frame and list. */
#include <stdio.h>
#include <stdlib.h>

#include "library_context.h"
#include "report.h"

/* Explains the levels of a post frame, from the eye outward. */
static void explain_parts(const triptych *t, FILE *out)
{
    const trip_lod_parts *p = &t->parts;
    const trip_settings *s = &t->drawn_settings;
    const bool coarse = p->count > 1 || p->level[0] > 0;
    if (s->classify != TRIP_CLASSIFY_POST || !trip_settings_has_levels(s) ||
        s->show == TRIP_SHOW_MERGE)
        return;
    if (trip_dataset_levels(t->session.data, TRIP_KIND_VALUES) == 0) {
        fprintf(out, "levels      do not run: the data set has none\n");
        return;
    }
    fprintf(out, "levels      %s: level %u", coarse ? "run" : "do not run", p->level[0]);
    if (p->share > 0)
        fprintf(out, ", and %.0f %% of the picture from level %u", 100 * p->share, p->level[1]);
    for (int i = 1; i < p->count && !(p->share > 0); i++)
        fprintf(out, ", from depth %.6g on level %u", p->distance[i], p->level[i]);
    if (p->bounded && p->bytes > s->max_bytes)
        fputs(": the coarsest level, with more bytes than the bound allows\n", out);
    else if (p->bounded)
        fputs(": the finest that the bound on bytes allows\n", out);
    else if (s->lod_px > 0 && coarse)
        fprintf(out, ": the coarsest with voxels at most %g pixels wide\n", s->lod_px);
    else if (s->lod_px > 0)
        fprintf(out, ": coarser levels have voxels more than %g pixels wide\n", s->lod_px);
    else
        fputs(": the finest\n", out);
    if (p->count > 1)
        fprintf(
            out,
            "            %d pictures are drawn; the lines below explain number %d, at level %u\n",
            p->count, t->part + 1, p->level[t->part]);
}

/* Explains the choices for settings that were left open. */
static void explain_choices(const triptych *t, FILE *out)
{
    if (t->plan.gathers)
        return;
    if (t->why_pre)
        fprintf(out, "default     pre instead of post: %s\n", t->why_pre);
    explain_parts(t, out);
    trip_context_explain_quality(t, out);
    const bool nearest = t->drawn_settings.kernel == TRIP_KERNEL_NEAREST;
    if (t->nearest_chosen)
        fputs("default     nearest instead of linear interpolation: the values are labels\n", out);
    if (t->drawn_settings.classify == TRIP_CLASSIFY_POST && nearest)
        fputs("samples     one per voxel that a ray meets, as always with the nearest value\n",
              out);
    else if (t->drawn_settings.classify == TRIP_CLASSIFY_POST && !t->choice.samples_per_sheet)
        fprintf(out, "samples     %d per sheet, by the view: voxels are up to %.3g %s wide\n",
                t->samples_per_sheet.samples_per_sheet, t->samples_per_sheet.voxel_px,
                t->choice.rays > 1 ? "samples" : "px");
}

int triptych_explain(triptych *t, char **text)
{
    trip_scope *before = trip_context_enter(t);
    size_t bytes;
    *text = NULL;
    int status = t->drawn ? 0 : trip_fail(TRIP_USAGE, "render", "frame", "no frame is begun");
    FILE *f = status ? NULL : open_memstream(text, &bytes);
    if (f && trip_context_draws_scene(t))
        trip_context_explain_scene(t, f);
    if (f && !trip_context_draws_scene(t)) {
        explain_choices(t, f);
        trip_plan_explain(&t->plan, t->session.data, &t->drawn_settings, f);
        trip_context_explain_effects(t, f);
    }
    if (!status && (!f || fclose(f) != 0)) {
        free(*text);
        *text = NULL;
        status = trip_fail(TRIP_ERROR, "render", "frame", "out of memory");
    }
    return trip_context_leave(before, status);
}

/* Says where blocks are read to, and how the renderer reaches them. */
static const char *ring_text(const trip_renderer *renderer, const trip_reader *reader)
{
    if (renderer->resident)
        return "not used: the renderer holds the data";
    if (trip_reader_in_place(reader))
        return "mapped: the disk writes into the renderer's memory";
    return renderer->ops->take_slots ? "copied: batches are copied to the renderer's memory"
                                     : "shared: the renderer draws from the ring";
}

static size_t list_stats_bytes(const triptych *t)
{
    return t->session.data->list_count * sizeof(triptych_list_stats);
}

void trip_context_drop_stats(triptych *t)
{
    if (t->list_stats)
        trip_budget_release(t->session.budget, t->list_stats, list_stats_bytes(t));
    t->list_stats = NULL;
    t->has_stats = false;
}

static int effects_of(const trip_effects *e)
{
    return (e->shadows ? TRIPTYCH_EFFECT_SHADOWS : 0) |
           (e->occlusion ? TRIPTYCH_EFFECT_OCCLUSION : 0) |
           (e->cueing > 0 ? TRIPTYCH_EFFECT_CUEING : 0) |
           (e->emission ? TRIPTYCH_EFFECT_EMISSION : 0);
}

static trip_light_stats stats_of(const trip_light_map *map)
{
    return map ? trip_light_map_stats(map) : (trip_light_stats){ 0 };
}

static triptych_frame_stats frame_stats(const triptych *t)
{
    const trip_frame_stats *s = &t->drawing.stats;
    const trip_light_stats light = stats_of(t->light);
    const trip_light_stats heat = stats_of(t->heat ? trip_emission_map(t->heat) : NULL);
    return (triptych_frame_stats){
        .ms = s->ms,
        .plan_ms = t->plan_ms,
        .wait_ms = s->read_ms,
        .normals_ms = (double)s->reader.normals_ns * 1e-6,
        .draw_ms = s->draw_ms,
        .merge_ms = s->merge_ms,
        .splats = s->reader.splats,
        .bytes_read = s->reader.bytes_read,
        .reads = s->reader.reads,
        .bytes_cached = s->reader.bytes_cached,
        .runs_occluded = s->reader.runs_skipped,
        .bytes_occluded = s->reader.bytes_skipped,
        .bytes_unused = trip_plan_bytes_left_out(&t->plan, t->session.data),
        .memory_bytes = trip_budget_limit_bytes(t->session.budget),
        .peak_memory_bytes = trip_budget_peak_bytes(t->session.budget),
        .renderer = t->renderer->ops->name,
        .device = t->renderer->ops->device(t->renderer),
        .engine = trip_reader_engine_name(t->reader),
        .classify = (triptych_classify)(t->drawn_settings.classify + 1),
        .samples_per_sheet = t->drawn_settings.classify == TRIP_CLASSIFY_POST
                                 ? t->drawn_settings.samples_per_sheet
                                 : 0,
        .rays = trip_context_draws_values(t) && t->plan.gathers ? 0 : t->choice.rays,
        .lod_px = t->drawn_settings.lod_px,
        .expected_error = t->promise > 0 && !t->choice_waits ? t->choice.error : -1,
        .promised_error = t->promise,
        .trial_ms = t->trial_ms,
        .trials = t->trials,
        .choice_waits = t->choice_waits,
        .interpolation = trip_context_draws_values(t)
                             ? (triptych_interpolation)(t->drawn_settings.kernel + 1)
                             : TRIPTYCH_INTERPOLATION_DEFAULT,
        .footprint = (triptych_footprint)(t->drawn_settings.footprint + 1),
        .early_termination =
            t->plan.gathers ? -1 : trip_settings_early_termination(&t->drawn_settings),
        .tolerance = t->plan.gathers ? t->drawn_settings.tolerance : 0,
        .ring = ring_text(t->renderer, t->reader),
        .effects = effects_of(&t->drawn_settings.effects),
        .light_bytes_read = light.bytes_read,
        .light_memory_bytes = light.memory_bytes,
        .light_gather_ms = light.gather_ms,
        .light_sweep_ms = light.sweep_ms,
        .heat_bytes_read = heat.bytes_read,
        .heat_memory_bytes = heat.memory_bytes,
        .heat_ms = heat.gather_ms,
        .closed_form = t->drawn_settings.classify == TRIP_CLASSIFY_POST && !t->plan.gathers &&
                       t->renderer->ops->closed_forms && !t->plan.not_closed,
    };
}

static triptych_list_stats list_stats(const triptych *t, unsigned i)
{
    const trip_list_stats counts = trip_frame_list_stats(t->renderer, t->reader, i);
    const trip_plan_list *planned = &t->plan.lists[i];
    bool counted = t->drawing.stats.counted;
    return (triptych_list_stats){
        .bricks = planned->bricks,
        .bricks_selected = planned->bricks_selected,
        .bricks_transparent = planned->bricks_transparent,
        .bricks_outside = planned->bricks_outside,
        .bricks_without_weight = planned->bricks_without_weight,
        .bricks_clipped = planned->bricks_clipped,
        .bricks_of_other_levels = planned->bricks_of_other_levels,
        .splats_read = counts.splats_read,
        .bytes_read = counts.bytes_read,
        .counted = counted,
        .splats_projected = counted ? counts.splats_projected : 0,
        .splats_drawn = counted ? counts.splats_drawn : 0,
    };
}

/* Measures the bytes drawn per millisecond in frames with bounded levels. A bound of time is
 * converted to bytes by this rate. */
static void note_rate(triptych *t)
{
    const double bytes = t->plan.lod.limit.bytes + t->parts.bytes;
    const double ms = t->stats.ms - t->stats.merge_ms;
    if (!(bytes > 0 && ms > 0) || t->part + 1 < t->parts.count)
        return;
    t->bytes_per_ms = t->bytes_per_ms > 0 ? 0.5 * (t->bytes_per_ms + bytes / ms) : bytes / ms;
}

/* Adds the costs of earlier parts of a frame. */
static void add_stats(triptych_frame_stats *to, const triptych_frame_stats *before)
{
    to->ms += before->ms;
    to->plan_ms += before->plan_ms;
    to->wait_ms += before->wait_ms;
    to->normals_ms += before->normals_ms;
    to->draw_ms += before->draw_ms;
    to->merge_ms += before->merge_ms;
    to->splats += before->splats;
    to->bytes_read += before->bytes_read;
    to->reads += before->reads;
    to->bytes_cached += before->bytes_cached;
    to->runs_occluded += before->runs_occluded;
    to->bytes_occluded += before->bytes_occluded;
    to->bytes_unused += before->bytes_unused;
}

/* Whether list i belongs to an earlier part, so that its statistics are complete. */
static bool is_of_part_before(const triptych *t, unsigned i)
{
    for (int part = 0; part < t->part; part++)
        if (t->session.data->lists[i].level == t->parts.level[part])
            return true;
    return false;
}

/* Records the statistics of a list. Later bands add their reads. */
static void note_list(triptych *t, unsigned i)
{
    const triptych_list_stats before = t->list_stats[i];
    t->list_stats[i] = list_stats(t, i);
    if (t->band == 0)
        return;
    t->list_stats[i].splats_read += before.splats_read;
    t->list_stats[i].bytes_read += before.bytes_read;
}

int trip_context_note_stats(triptych *t)
{
    unsigned count = t->session.data->list_count;
    if (!t->list_stats)
        t->list_stats = trip_budget_take(t->session.budget, list_stats_bytes(t));
    if (!t->list_stats)
        return trip_fail(TRIP_ERROR, "render", t->name,
                         "the frame's statistics do not fit in memory; raise --memory");
    t->stats = frame_stats(t);
    snprintf(t->device, sizeof t->device, "%s", t->stats.device);
    t->stats.device = t->device;
    if (t->part > 0 || t->band > 0)
        add_stats(&t->stats, &t->before_stats);
    for (unsigned i = 0; i < count; i++)
        if (!is_of_part_before(t, i))
            note_list(t, i);
    t->has_stats = true;
    note_rate(t);
    trip_context_note_quality(t);
    return 0;
}

static int check_stats(const triptych *t)
{
    int status = trip_context_check_open(t);
    if (!status && !t->has_stats)
        return trip_fail(TRIP_USAGE, "render", t->name, "no frame has been drawn");
    return status;
}

int triptych_get_frame_stats(triptych *t, triptych_frame_stats *out)
{
    trip_scope *before = trip_context_enter(t);
    int status = check_stats(t);
    *out = status ? (triptych_frame_stats){ 0 } : t->stats;
    return trip_context_leave(before, status);
}

int triptych_get_list_stats(triptych *t, unsigned number, triptych_list_stats *out)
{
    trip_scope *before = trip_context_enter(t);
    int status = check_stats(t);
    if (!status)
        status = trip_context_check_list(t, number);
    *out = status ? (triptych_list_stats){ 0 } : t->list_stats[number];
    return trip_context_leave(before, status);
}
