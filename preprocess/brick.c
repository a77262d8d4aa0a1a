#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include "brick.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "brick_codes.h"
#include "brick_input.h"
#include "brick_memory.h"
#include "brick_temporary.h"
#include "brick_metadata.h"
#include "clock.h"
#include "dataset.h"
#include "estimate.h"
#include "folder.h"
#include "levels.h"
#include "list_builder.h"
#include "report.h"
#include "splats.h"
#include "orientation.h"

/* Status of a run that found fill values too late. */
enum { AGAIN = -101 };

/* State of a run. It starts zeroed, so that close_all() can undo any part of it. */
typedef struct brick {
    const trip_brick_params *params;
    trip_brick_summary *summary;
    trip_brick_input in;
    trip_piece_format format;
    trip_brick_codes codes;
    trip_coordinates coordinates; /* read by the writer until it is done */
    trip_memory_plan plan;
    trip_brick_temporary temporary;
    trip_writer *writer;
    trip_list_builder *builder;
    trip_splatter *splatter;
    unsigned levels;        /* number of coarse levels */
    trip_level_kinds kinds; /* kinds of lists of the coarse levels */
    trip_orientation upright;
    uint64_t written_before; /* bytes written until the end of the last stage */
} brick;

static uint64_t input_bytes(const brick *b)
{
    return b->in.tally->voxels * trip_scalar_bytes(b->in.info->type);
}

/* Returns the bytes of the data set and the spill so far. */
static uint64_t bytes_written(const brick *b)
{
    return (b->writer ? trip_writer_bytes(b->writer) : 0) + trip_spill_bytes(b->temporary.spill);
}

static void end_stage(brick *b, trip_brick_stage stage, double begin)
{
    trip_brick_cost *c = &b->summary->stages[stage];
    c->seconds = trip_now_seconds() - begin;
    c->bytes_written = bytes_written(b) - b->written_before;
    b->written_before += c->bytes_written;
}

/* Scans the volume. A resumed run reads the result from its journal. */
static int scan(brick *b)
{
    const trip_journal_start *start = trip_journal_get_start(b->temporary.journal);
    double begin = trip_now_seconds();
    int status = 0;
    /* The ids are not in the journal. A scan finds the same ones again. */
    const bool known = start && !start->ids;
    if (known)
        status = trip_brick_input_set_tally(&b->in, &start->tally);
    else
        status =
            trip_brick_input_scan(&b->in, (trip_scan_params){ .slices = b->plan.slices,
                                                              .read_ahead = b->plan.read_ahead });
    if (!known)
        b->summary->stages[TRIP_BRICK_SCAN].bytes_read = input_bytes(b);
    end_stage(b, TRIP_BRICK_SCAN, begin);
    return status;
}

static int plan_memory(brick *b)
{
    return trip_memory_plan_make(&b->plan, b->params->input, b->in.info, &b->format,
                                 trip_workers_count(b->in.workers), b->in.memory_bytes,
                                 b->params->slices);
}

/* Divides the memory again once all but the lists is allocated. A resumed run with less memory than
 * the interrupted one spills the rest of a list that was written in order, because the rest follows
 * the written part. But once pieces of the list were spilled, later ones cannot be appended before
 * the merge. */
static int update_memory_plan(brick *b)
{
    int status = trip_memory_plan_update(&b->plan, b->params->input, b->in.info, &b->format,
                                         trip_workers_count(b->in.workers),
                                         trip_budget_left_bytes(b->in.budget));
    b->plan.in_order =
        b->plan.in_order && b->format.quantised && !trip_brick_temporary_has_ordered(&b->temporary);
    return status;
}

static int open_writer(brick *b)
{
    trip_writer_list lists[6 * (TRIP_LEVELS_MAX + 1)];
    b->coordinates = trip_brick_coordinates(&b->in);
    trip_writer_params p = { .replace = b->params->replace,
                             .halo = b->format.halo,
                             .code_bytes = b->codes.code_bytes,
                             .normal_bytes = b->codes.normal_bytes,
                             .tile_voxels = b->params->tile_voxels,
                             .slab_sheets = b->params->slab_sheets,
                             .index_to_world = b->in.info->index_to_world,
                             .coordinates = &b->coordinates,
                             .codes = trip_brick_codes_header(&b->codes) };
    memcpy(p.dims, b->in.info->dims, sizeof p.dims);
    b->levels = trip_levels_count(p.dims, trip_brick_levels(&b->in), 1u << b->format.tile_log2);
    b->kinds = trip_levels_kinds(b->params->levels_for, b->format.halo);
    p.lists = lists;
    p.list_count =
        trip_levels_lists(p.dims, &p.index_to_world, b->format.halo, b->kinds, b->levels, lists);
    return trip_writer_open(&b->writer, b->params->output, &p, b->in.budget);
}

static int open_builder(brick *b)
{
    trip_list_builder_params p = {
        .format = b->format,
        .quantiser = b->codes.quantiser,
        .producers = trip_workers_count(b->in.workers),
        .in_order = b->plan.in_order,
        .memory_bytes = b->plan.list_bytes,
        .writer = b->writer,
        .spill = b->temporary.spill,
        .journal = b->temporary.journal,
    };
    memcpy(p.dims, b->in.info->dims, sizeof p.dims);
    return trip_list_builder_create(&b->builder, &p, b->in.budget);
}

static int reserve(void *user, unsigned thread, unsigned list, size_t bytes, void **memory)
{
    const brick *b = user;
    return trip_list_builder_reserve(b->builder, thread, list, bytes, memory);
}

static int open_splatter(brick *b)
{
    trip_splat_params p = { .info = b->in.info,
                            .envelope = trip_brick_envelope(&b->in),
                            .region = &b->in.region,
                            .format = b->format,
                            .quantiser = b->codes.quantiser,
                            .compact = b->codes.normal_bytes == 3 ? &b->codes.compact : NULL,
                            .tally = !b->in.scanned,
                            .threads = trip_workers_count(b->in.workers),
                            .reserve = reserve,
                            .user = b };
    return trip_splatter_create(&b->splatter, &p, b->in.budget);
}

/* Summarises the data set that the interrupted run completed. */
static int summarise_done(brick *b)
{
    trip_dataset *d;
    int status = trip_dataset_open(&d, b->params->output, b->in.budget);
    if (status < 0)
        return status;
    trip_tally_clear(b->in.tally);
    b->in.tally->voxels = b->in.tally->finite = d->header.voxels;
    b->in.tally->value_min = d->header.value_min;
    b->in.tally->value_max = d->header.value_max;
    b->summary->kept = d->header.kept;
    b->summary->halo = d->header.halo;
    b->summary->code_bytes = d->header.code_bytes;
    b->summary->normal_bytes = d->header.normal_bytes;
    b->summary->bytes = d->bytes;
    for (unsigned i = 0; i < d->list_count; i++) {
        const trip_list *l = &d->lists[i];
        uint64_t bytes = 0;
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            bytes += l->plane_bytes[plane];
        b->summary->halo_bytes += l->kind == TRIP_KIND_HALO ? bytes : 0;
        b->summary->level_bytes += l->level > 0 ? bytes : 0;
        b->summary->levels = l->level > b->summary->levels ? l->level : b->summary->levels;
    }
    b->summary->resumed = true;
    trip_dataset_close(d);
    return 0;
}

static int open_output(brick *b)
{
    const trip_block_form form = { .tile_log2 = b->format.tile_log2,
                                   .code_bytes = b->codes.code_bytes,
                                   .normal_bytes = b->codes.normal_bytes };
    int status = open_writer(b);
    if (status == 0)
        status = open_splatter(b);
    if (status == 0)
        status = update_memory_plan(b);
    if (status == 0)
        status = trip_brick_temporary_begin(&b->temporary, &b->in);
    b->summary->resumed = trip_journal_get_checkpoint(b->temporary.journal) != NULL;
    if (status == 0)
        status = open_builder(b);
    if (status == 0 && b->summary->resumed)
        status = trip_leftover_replay(&b->temporary.leftover, b->temporary.journal, b->builder,
                                      &form, b->in.budget);
    return status;
}

static int on_box(void *user, unsigned thread, const trip_box *box)
{
    const brick *b = user;
    return trip_splatter_box(b->splatter, thread, box);
}

/* Sums the counts of the boxes so far and of the part that an interrupted run finished. */
static void add_up(const brick *b, trip_tally *tally, uint64_t *kept, uint64_t *halo)
{
    const trip_checkpoint *before = trip_journal_get_checkpoint(b->temporary.journal);
    *kept = trip_splatter_kept(b->splatter) + (before ? before->kept : 0);
    *halo = trip_splatter_halo(b->splatter) + (before ? before->halo : 0);
    if (b->in.scanned)
        return;
    trip_splatter_tally(b->splatter, tally);
    if (before)
        trip_tally_add(tally, &before->tally);
}

static int on_batch(void *user, uint64_t done, uint64_t voxels)
{
    const brick *b = user;
    trip_brick_input_progress(&b->in, "read", voxels, b->in.grid_voxels);
    int full = trip_list_builder_end_batch(b->builder, (double)voxels / (double)b->in.grid_voxels);
    if (full <= 0)
        return full;
    trip_checkpoint *c = calloc(1, sizeof *c);
    if (!c)
        return trip_fail(TRIP_ERROR, "brick", b->params->output, "out of memory");
    c->done = done;
    add_up(b, &c->tally, &c->kept, &c->halo);
    return trip_list_builder_spill(b->builder, c);
}

static int check_tally(brick *b)
{
    const trip_tally *t = b->in.tally;
    if (t->voxels == 0)
        return trip_fail(TRIP_ERROR, "brick", b->params->input, "has no active voxels");
    if (t->finite == 0)
        return trip_fail(TRIP_ERROR, "brick", b->params->input, "has no finite values");
    const uint64_t before = b->in.finite_before > t->finite ? b->in.finite_before : t->finite;
    if (before < t->voxels)
        trip_warn(b->params->input, "%llu values are not finite%s and count as absent",
                  (unsigned long long)(t->voxels - before),
                  b->in.info->fills.count && !b->in.fills.count ? " or are the fill value" : "");
    if (b->summary->kept == 0)
        return trip_fail(TRIP_ERROR, "brick", b->params->input,
                         "no voxel is visible: the values are from %g to %g, outside of all "
                         "transfer functions and ranges%s",
                         t->value_min, t->value_max,
                         trip_region_is_whole(&b->params->region) ? "" : " in the region");
    if (t->value_min == t->value_max)
        trip_warn(b->params->input, "every voxel has the value %g, so only the outline is visible",
                  t->value_min);
    /* With the automatic transfer function as the default, drawing checks the others when it uses
     * them. */
    for (size_t i = 0; i < b->params->function_count && !b->params->automatic; i++)
        trip_tf_check_range(b->in.functions[i], t->typical_min, t->typical_max, b->params->input);
    return 0;
}

/* Without a scan, fill values become known once everything is read. The volume is then read again.
 */
static int finish_tally(brick *b)
{
    const int found = trip_brick_input_find_fills(&b->in, b->in.tally);
    if (found == 0)
        return trip_brick_input_finish_tally(&b->in);
    return found < 0 ? found : AGAIN;
}

static int read_volume(brick *b)
{
    const trip_checkpoint *before = trip_journal_get_checkpoint(b->temporary.journal);
    trip_walk_params walk = { .slices = b->plan.slices,
                              .read_ahead = b->plan.read_ahead,
                              .edge = trip_splat_edge(&b->format),
                              .height = TRIP_SPLAT_HEIGHT,
                              .skip = before ? before->done : 0,
                              .box = on_box,
                              .batch = on_batch,
                              .user = b };
    double begin = trip_now_seconds();
    int status = trip_walk(b->in.volume, b->in.workers, &walk);
    end_stage(b, TRIP_BRICK_READ, begin);
    if (status < 0)
        return status;
    add_up(b, b->in.tally, &b->summary->kept, &b->summary->halo);
    if (!b->in.scanned && b->in.tally->finite > 0)
        status = finish_tally(b);
    if (status == 0)
        trip_brick_input_tell_fills(&b->in);
    return status == 0 ? check_tally(b) : status;
}

static void on_merge_progress(void *user, uint64_t splats)
{
    const brick *b = user;
    trip_brick_input_progress(&b->in, "merge", splats, 3 * (b->summary->kept + b->summary->halo));
}

static int merge_lists(brick *b)
{
    double begin = trip_now_seconds();
    int status = 0;
    if (!b->format.quantised) {
        status = trip_brick_codes_set_range(&b->codes, &b->in);
        const trip_writer_codes codes = trip_brick_codes_header(&b->codes);
        if (status == 0)
            status = trip_writer_set_codes(b->writer, &codes);
    }
    if (status == 0)
        status = trip_list_builder_finish(b->builder, &b->codes.quantiser, b->in.workers,
                                          on_merge_progress, b);
    end_stage(b, TRIP_BRICK_MERGE, begin);
    return status;
}

static void on_levels_progress(void *user, uint64_t done, uint64_t total)
{
    const brick *b = user;
    trip_brick_input_progress(&b->in, "levels", done, total);
}

/* Returns whether more of the volume's typical range lies above the envelope than below it. */
static bool is_hidden_above(const brick *b)
{
    const trip_envelope *e = &b->in.envelope;
    const trip_tally *t = b->in.tally;
    return e->count > 0 && t->typical_max - (double)e->intervals[e->count - 1].hi >
                               (double)e->intervals[0].lo - t->typical_min;
}

/* Makes the coarse levels. First releases the memory of level 0, which is no longer needed. */
static int make_levels(brick *b)
{
    double begin = trip_now_seconds();
    trip_list_builder_destroy(b->builder);
    trip_splatter_destroy(b->splatter);
    b->builder = NULL;
    b->splatter = NULL;
    trip_levels_params p = { .format = b->format,
                             .kinds = b->kinds,
                             .quantiser = b->codes.quantiser,
                             .compact = b->codes.normal_bytes == 3 ? &b->codes.compact : NULL,
                             .index_to_world = b->in.info->index_to_world,
                             .levels = b->levels,
                             .typical_min = b->in.tally->typical_min,
                             .typical_max = b->in.tally->typical_max,
                             .codes = trip_brick_codes_get(&b->codes),
                             .hidden_above = is_hidden_above(b),
                             .labels =
                                 trip_brick_kind(b->in.info, &b->in.histogram) == TRIP_TF_LABELS &&
                                 !trip_tf_is_solid(&b->in.histogram),
                             .folder = b->temporary.partial_path,
                             .writer = b->writer,
                             .spill = b->temporary.spill,
                             .workers = b->in.workers,
                             .progress = on_levels_progress,
                             .progress_user = b };
    memcpy(p.dims, b->in.info->dims, sizeof p.dims);
    int status = b->levels > 0 ? trip_levels_make(&p, b->in.budget) : 0;
    end_stage(b, TRIP_BRICK_LEVELS, begin);
    return status;
}

static int fail_count(const brick *b, const char *subject, uint64_t counted, uint64_t written)
{
    return trip_fail(TRIP_ERROR, "brick", b->params->output,
                     "%" PRIu64 " %s were counted and %" PRIu64
                     " written: the data of the interrupted run are damaged; run again without "
                     "--resume",
                     counted, subject, written);
}

/* Checks the number of written records against the counts, part of which may come from a journal.
 * The halo of a sparse volume may be counted more than once. */
static int check_records(brick *b)
{
    trip_brick_summary *s = b->summary;
    uint64_t kept = trip_writer_records(b->writer, 0);
    uint64_t halo = b->format.halo ? trip_writer_records(b->writer, TRIP_HALO_LISTS) : 0;
    if (kept != s->kept)
        return fail_count(b, "kept voxels", s->kept, kept);
    if (b->in.info->sparse ? halo > s->halo : halo != s->halo)
        return fail_count(b, "halo voxels", s->halo, halo);
    s->halo = halo;
    s->code_bytes = b->codes.code_bytes;
    s->normal_bytes = b->codes.normal_bytes;
    s->bytes = trip_writer_bytes(b->writer);
    const unsigned lists = trip_levels_first_list(b->format.halo, b->kinds, 1);
    const unsigned past = trip_levels_first_list(b->format.halo, b->kinds, b->levels + 1);
    for (unsigned list = TRIP_HALO_LISTS; list < lists; list++)
        s->halo_bytes += trip_writer_plane_bytes(b->writer, list, TRIP_PLANE_VOXELS);
    s->levels = b->levels;
    for (unsigned list = lists; list < past; list++)
        for (int plane = 0; plane < TRIP_PLANES; plane++)
            s->level_bytes += trip_writer_plane_bytes(b->writer, list, plane);
    return 0;
}

/* Returns whether the orientation must be guessed: neither the file nor its program gives it. With
 * uneven spacing, a mirror image of the voxels is not a mirror image of the object, so nothing is
 * guessed. */
static bool is_up_unknown(const trip_volume_info *info)
{
    for (int a = 0; a < 3; a++)
        if (info->coordinates[a])
            return false;
    return !info->oriented && !info->space[0] && !info->up[0] && strcmp(info->format, "nifti");
}

static int find_orientation(brick *b)
{
    const trip_tally *t = b->in.tally;
    trip_occupancy_params p = { .levels = b->levels,
                                .halo = b->format.halo,
                                .kinds = b->kinds,
                                .tile_log2 = b->format.tile_log2,
                                .codes = trip_brick_codes_get(&b->codes),
                                .typical_min = t->typical_min,
                                .typical_max = t->typical_max };
    memcpy(p.dims, b->in.info->dims, sizeof p.dims);
    /* A region may look unlike the whole object. */
    const bool whole = trip_region_is_whole(&b->params->region);
    return whole && is_up_unknown(b->in.info)
               ? trip_orientation_find(&b->upright, b->writer, &p, b->in.budget)
               : 0;
}

static trip_brick_metadata metadata_of(const brick *b)
{
    return (trip_brick_metadata){ .params = b->params,
                                  .info = b->in.info,
                                  .envelope = &b->in.envelope,
                                  .functions = b->in.functions,
                                  .histogram = &b->in.histogram,
                                  .tally = b->in.tally,
                                  .fills = &b->in.info->fills,
                                  .upright = b->upright };
}

/* Adds the index, which the writer has completed, to the size. The writer is gone. */
static int add_index(brick *b)
{
    char *path = NULL;
    struct stat st;
    int status = 0;
    b->writer = NULL;
    if (asprintf(&path, "%s/" TRIP_INDEX_NAME, b->params->output) < 0)
        return trip_fail(TRIP_ERROR, "brick", b->params->output, "out of memory");
    if (stat(path, &st) == 0)
        b->summary->bytes += (uint64_t)st.st_size;
    else
        status = trip_fail_errno("brick", path, "cannot read the size");
    free(path);
    return status;
}

static int finish_output(brick *b)
{
    double begin = trip_now_seconds();
    const trip_brick_metadata metadata = metadata_of(b);
    char *text = trip_brick_metadata_make(&metadata);
    if (!text)
        return TRIP_ERROR;
    trip_writer_summary s = { .value_min = b->in.tally->value_min,
                              .value_max = b->in.tally->value_max,
                              .typical_min = b->in.tally->typical_min,
                              .typical_max = b->in.tally->typical_max,
                              .voxels = b->in.tally->voxels,
                              .text = text };
    int status = check_records(b);
    if (status == 0)
        status =
            trip_brick_temporary_note_output(&b->temporary, &b->in, trip_writer_folder(b->writer));
    if (status == 0)
        status = trip_writer_finish(b->writer, &s);
    if (status == 0)
        status = add_index(b);
    free(text);
    b->summary->stages[TRIP_BRICK_FINISH].seconds = trip_now_seconds() - begin;
    return status;
}

static void fill_summary(brick *b)
{
    trip_brick_summary *s = b->summary;
    const double(*m)[4] = b->in.info->index_to_world.m;
    memcpy(s->dims, b->in.info->dims, sizeof s->dims);
    const trip_brick_metadata metadata = metadata_of(b);
    trip_brick_metadata_note(&metadata, s->note);
    for (int a = 0; a < 3; a++)
        s->spacing[a] = trip_length(trip_v3(m[0][a], m[1][a], m[2][a]));
    s->voxels = b->in.tally->voxels;
    s->not_finite = b->in.tally->voxels - b->in.tally->finite;
    s->value_min = b->in.tally->value_min;
    s->value_max = b->in.tally->value_max;
    s->kind = trip_brick_kind(b->in.info, &b->in.histogram);
    s->input_bytes = input_bytes(b);
    s->temporary_bytes = trip_spill_bytes(b->temporary.spill);
    s->stages[TRIP_BRICK_READ].bytes_read = s->input_bytes;
    s->stages[TRIP_BRICK_MERGE].bytes_read = s->temporary_bytes;
    s->memory_bytes = trip_budget_limit_bytes(b->in.budget);
    s->peak_memory_bytes = trip_budget_peak_bytes(b->in.budget);
}

static int prepare(brick *b)
{
    const trip_brick_params *p = b->params;
    int status = p->resume ? 0 : trip_folder_check(p->output, p->replace);
    if (status == 0)
        status = trip_brick_input_open(&b->in, p);
    b->format = trip_brick_format(p);
    if (status == 0) {
        b->format.quantised = trip_brick_will_be_quantised(&b->in);
        status = plan_memory(b);
    }
    return status == 0 ? trip_brick_temporary_open(&b->temporary, &b->in, &b->format) : status;
}

static int make(brick *b)
{
    int status = b->params->resume ? trip_folder_check(b->params->output, b->params->replace) : 0;
    const trip_journal_start *start = trip_journal_get_start(b->temporary.journal);
    if (status == 0 && start)
        trip_brick_input_set_fills(&b->in, &start->fills, start->finite_before);
    if (status == 0 && trip_brick_input_needs_scan(&b->in))
        status = scan(b);
    if (status == 0)
        status = trip_brick_input_make_envelope(&b->in);
    if (status < 0)
        return status;
    b->format.quantised = trip_brick_has_narrow_type(&b->in) || b->in.scanned;
    status = trip_brick_codes_choose(&b->codes, &b->in);
    if (status == 0)
        status = plan_memory(b);
    if (status == 0 && !trip_journal_get_start(b->temporary.journal))
        status = trip_estimate_check_disk(&b->in, &b->format, &b->plan);
    if (status == 0)
        status = open_output(b);
    b->temporary.begun = status == 0;
    if (status == 0)
        status = read_volume(b);
    if (status == 0)
        status = merge_lists(b);
    if (status == 0)
        status = make_levels(b);
    if (status == 0)
        status = find_orientation(b);
    return status == 0 ? finish_output(b) : status;
}

static int run(brick *b)
{
    int status = prepare(b);
    if (status == 0)
        status =
            trip_brick_temporary_is_done(&b->temporary, b->params) ? summarise_done(b) : make(b);
    if (status == 0)
        fill_summary(b);
    return status;
}

static void close_all(brick *b, int status)
{
    trip_list_builder_destroy(b->builder);
    trip_splatter_destroy(b->splatter);
    trip_brick_temporary_end(&b->temporary, &b->format, b->params->resume, status);
    trip_writer_abort(b->writer);
    trip_brick_temporary_close(&b->temporary);
    trip_brick_input_close(&b->in);
}

/* Runs once. If new fill values were found, adds them to `fills` and returns AGAIN. */
static int run_once(const trip_brick_params *params, trip_brick_summary *summary, trip_fills *fills,
                    uint64_t *finite)
{
    brick b = { .params = params, .summary = summary, .upright = { -1, -1 } };
    b.in.fills = *fills;
    b.temporary = trip_brick_temporary_none();
    *summary = (trip_brick_summary){ 0 };
    b.in.finite_before = *finite;
    int status = run(&b);
    if (status == AGAIN) {
        *fills = b.in.fills;
        *finite = b.in.finite_before ? b.in.finite_before : b.in.tally->finite;
    }
    close_all(&b, status);
    return status;
}

int trip_brick(const trip_brick_params *params, trip_brick_summary *summary)
{
    trip_fills fills = { 0 };
    uint64_t finite = 0;
    int status;
    do
        status = run_once(params, summary, &fills, &finite);
    while (status == AGAIN);
    return status;
}
