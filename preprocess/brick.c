#include "brick.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

#include "brick_input.h"
#include "brick_memory.h"
#include "brick_text.h"
#include "dataset.h"
#include "estimate.h"
#include "folder.h"
#include "gradient.h"
#include "identity.h"
#include "list_builder.h"
#include "report.h"
#include "resume.h"
#include "splats.h"

/* Everything of one run; zeroed at first, so that close() undoes any part of it. */
typedef struct brick {
    const trip_brick_params *params;
    trip_brick_summary *summary;
    trip_brick_input in;
    trip_piece_format format;
    trip_quantiser quantiser;
    unsigned code_bytes, normal_bytes;
    trip_compact_normals compact; /* what 3 bytes mean */
    trip_memory_plan plan;
    trip_spill *spill;
    trip_leftover leftover;
    trip_journal *journal;
    uint64_t identity;
    char *partial_path; /* of the data set */
    bool begun;         /* what an interrupted run left is taken over, or was not wanted */
    trip_writer *writer;
    trip_list_builder *builder;
    trip_splatter *splatter;
    uint64_t written_before; /* up to the end of the last stage */
} brick;

static double now_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static uint64_t input_bytes(const brick *b)
{
    return b->in.tally->voxels * trip_scalar_bytes(b->in.info->type);
}

/* Data set and spill so far. */
static uint64_t bytes_written(const brick *b)
{
    return (b->writer ? trip_writer_bytes(b->writer) : 0) + trip_spill_bytes(b->spill);
}

static void end_stage(brick *b, trip_brick_stage stage, double begin)
{
    trip_brick_cost *c = &b->summary->stages[stage];
    c->seconds = now_seconds() - begin;
    c->bytes_written = bytes_written(b) - b->written_before;
    b->written_before += c->bytes_written;
}

/* Once it was done, a run that goes on knows the result. */
static int scan(brick *b)
{
    const trip_journal_start *start = trip_journal_get_start(b->journal);
    double begin = now_seconds();
    int status = 0;
    if (start)
        status = trip_brick_input_set_tally(&b->in, &start->tally);
    else
        status =
            trip_brick_input_scan(&b->in, (trip_scan_params){ .slices = b->plan.slices,
                                                              .read_ahead = b->plan.read_ahead });
    if (!start)
        b->summary->stages[TRIP_BRICK_SCAN].bytes_read = input_bytes(b);
    end_stage(b, TRIP_BRICK_SCAN, begin);
    return status;
}

/* Gradients are as steep as the range of values allows; it may be unknown. */
static void set_quantiser(brick *b, double lo, double hi)
{
    double least = b->in.scanned ? b->in.tally->value_min : lo;
    double most = b->in.scanned ? b->in.tally->value_max : hi;
    b->quantiser =
        (trip_quantiser){ lo, hi > lo ? hi : lo + 1,
                          trip_gradient_bound(b->in.info, least, most > least ? most : least + 1),
                          trip_gradient_unit(&b->in.info->index_to_world) };
}

/* Codes stand for the type's values, or for the range if it is known; else that is for the end. */
static void choose_codes(brick *b)
{
    double lo = 0, hi = 1;
    bool narrow = trip_brick_has_narrow_type(&b->in);
    b->format.quantised = narrow || b->in.scanned;
    if (narrow)
        trip_brick_type_range(b->in.info, &lo, &hi);
    else if (b->in.scanned) {
        lo = b->in.tally->value_min;
        hi = b->in.tally->value_max;
    }
    set_quantiser(b, lo, hi);
    b->code_bytes = trip_brick_code_bytes(&b->in);
}

/* Of the codes' range where that of the values is not known: shading is full there, too. */
static double full_gradient(const brick *b)
{
    double range = b->in.scanned ? b->in.tally->value_max - b->in.tally->value_min : 0;
    double voxel = cbrt(fabs(trip_affine_determinant(&b->in.info->index_to_world)));
    return TRIP_GRADIENT_FULL * (range > 0 ? range : b->quantiser.hi - b->quantiser.lo) / voxel;
}

/* After the codes. */
static void choose_normals(brick *b)
{
    const trip_volume_info *info = b->in.info;
    double step[3], full = full_gradient(b);
    double unit = info->type < TRIP_F16 ? fabs(info->slope) / 2 : 0;
    b->normal_bytes = trip_brick_normal_bytes(&b->in);
    if (b->normal_bytes != 3)
        return;
    trip_compact_normals_choose(&info->index_to_world, full, unit, step);
    b->compact = trip_compact_normals_make(&info->index_to_world, full, step);
}

static int plan_memory(brick *b)
{
    return trip_memory_plan_make(&b->plan, b->params->input, b->in.info, &b->format,
                                 trip_workers_count(b->in.workers), b->in.memory_bytes,
                                 b->params->slices);
}

/* Whether pieces of the Z list were spilled before the run was killed: then what follows cannot be
 * appended before they are merged. */
static bool has_spilled_order(const brick *b)
{
    for (size_t i = 0; i < trip_spill_count(b->spill); i++)
        if (trip_spill_segment(b->spill, i)->list == TRIP_ORDERED_LIST)
            return true;
    return false;
}

/* When all but the lists is open. A run that goes on with less memory than the killed one had
 * spills the rest of a list that was written in order: all of it comes after what was written. */
static int update_memory_plan(brick *b)
{
    int status = trip_memory_plan_update(&b->plan, b->params->input, b->in.info, &b->format,
                                         trip_workers_count(b->in.workers),
                                         trip_budget_left_bytes(b->in.budget));
    b->plan.in_order = b->plan.in_order && b->format.quantised && !has_spilled_order(b);
    return status;
}

/* The output's name and a suffix, for free(); NULL after a reported failure. */
static char *name_beside(const brick *b, const char *suffix)
{
    char *path;
    size_t length = strlen(b->params->output);
    while (length > 1 && b->params->output[length - 1] == '/')
        length--;
    if (asprintf(&path, "%.*s%s", (int)length, b->params->output, suffix) >= 0)
        return path;
    trip_fail(TRIP_ERROR, "brick", b->params->output, "out of memory");
    return NULL;
}

/* Locks the place for temporary files and looks what a killed run left. */
static int open_spill(brick *b)
{
    bool resume = b->params->resume;
    const int64_t *dims = b->in.info->dims;
    char *path = name_beside(b, ".spill");
    b->partial_path = name_beside(b, ".partial");
    int status = path && b->partial_path ? trip_spill_open(&b->spill, path, resume, b->in.budget)
                                         : TRIP_ERROR;
    if (status == 0)
        status = trip_brick_identity(b->params, b->in.functions, &b->identity);
    if (status == 0 && resume)
        status = trip_leftover_take(&b->leftover, b->spill, b->partial_path, &b->format);
    if (status == 0)
        status = trip_journal_open(
            &b->journal, b->spill,
            &(trip_journal_params){
                .resume = resume,
                .identity = b->identity,
                .scanned = trip_brick_input_needs_scan(&b->in),
                .voxels = b->in.grid_voxels,
                .slice_voxels = b->in.info->sparse ? 0 : (uint64_t)(dims[0] * dims[1]),
                .halo = b->format.halo,
                .ordered_bytes = { b->leftover.bytes[0], b->leftover.bytes[1] } },
            b->in.budget);
    free(path);
    return status;
}

/* Notes how this run works, or takes over how far the killed one was. */
static int start_journal(brick *b)
{
    b->summary->resumed = trip_journal_get_checkpoint(b->journal) != NULL;
    if (trip_journal_get_start(b->journal))
        return 0;
    trip_journal_start *start = calloc(1, sizeof *start);
    if (!start)
        return trip_fail(TRIP_ERROR, "brick", b->params->output, "out of memory");
    start->identity = b->identity;
    start->scanned = b->in.scanned;
    start->tally = *b->in.tally;
    int status = trip_journal_write_start(b->journal, start);
    free(start);
    return status;
}

/* What the header says of codes and normals. */
static trip_writer_codes codes_of(const brick *b)
{
    trip_writer_codes c = { .code_lo = b->quantiser.lo, .code_hi = b->quantiser.hi };
    if (b->normal_bytes == 4)
        c.gradient_scale = b->quantiser.gradient_scale;
    if (b->normal_bytes == 3) {
        c.gradient_full = b->compact.full;
        memcpy(c.gradient_step, b->compact.step, sizeof c.gradient_step);
    }
    return c;
}

static int open_writer(brick *b)
{
    trip_writer_params p = { .replace = b->params->replace,
                             .halo = b->format.halo,
                             .code_bytes = b->code_bytes,
                             .normal_bytes = b->normal_bytes,
                             .tile_voxels = b->params->tile_voxels,
                             .slab_sheets = b->params->slab_sheets,
                             .index_to_world = b->in.info->index_to_world,
                             .codes = codes_of(b) };
    memcpy(p.dims, b->in.info->dims, sizeof p.dims);
    return trip_writer_open(&b->writer, b->params->output, &p, b->in.budget);
}

static int open_builder(brick *b)
{
    trip_list_builder_params p = {
        .format = b->format,
        .quantiser = b->quantiser,
        .producers = trip_workers_count(b->in.workers),
        .in_order = b->plan.in_order,
        .memory_bytes = b->plan.list_bytes,
        .writer = b->writer,
        .spill = b->spill,
        .journal = b->journal,
    };
    memcpy(p.dims, b->in.info->dims, sizeof p.dims);
    return trip_list_builder_create(&b->builder, &p, b->in.budget);
}

static void *reserve(void *user, unsigned thread, unsigned list, size_t bytes)
{
    const brick *b = user;
    return trip_list_builder_reserve(b->builder, thread, list, bytes);
}

static int open_splatter(brick *b)
{
    trip_splat_params p = { .info = b->in.info,
                            .envelope = &b->in.envelope,
                            .format = b->format,
                            .quantiser = b->quantiser,
                            .compact = b->normal_bytes == 3 ? &b->compact : NULL,
                            .tally = !b->in.scanned,
                            .threads = trip_workers_count(b->in.workers),
                            .reserve = reserve,
                            .user = b };
    return trip_splatter_create(&b->splatter, &p, b->in.budget);
}

/* A run that was killed when all was done but for its temporary files. */
static bool is_done(const brick *b)
{
    struct stat st;
    return b->params->resume && !b->params->replace && trip_journal_get_start(b->journal) &&
           stat(b->params->output, &st) == 0;
}

/* The summary of a data set that is there. */
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
    b->summary->bytes = d->bytes - d->header.index_bytes;
    for (unsigned i = 0; i < d->list_count; i++)
        if (d->lists[i].kind == TRIP_KIND_HALO)
            b->summary->halo_bytes += d->lists[i].plane_bytes[TRIP_PLANE_VOXELS];
    b->summary->resumed = true;
    trip_dataset_close(d);
    return 0;
}

static int open_output(brick *b)
{
    const trip_block_form form = { b->format.tile_log2, b->code_bytes, b->normal_bytes };
    int status = open_writer(b);
    if (status == 0)
        status = open_splatter(b);
    if (status == 0)
        status = update_memory_plan(b);
    if (status == 0)
        status = start_journal(b);
    if (status == 0)
        status = open_builder(b);
    if (status == 0 && b->summary->resumed)
        status = trip_leftover_replay(&b->leftover, b->journal, b->builder, &form, b->in.budget);
    return status;
}

static int on_box(void *user, unsigned thread, const trip_box *box)
{
    const brick *b = user;
    return trip_splatter_box(b->splatter, thread, box);
}

/* Adds what the boxes so far gave to what a killed run had seen before. */
static void add_up(const brick *b, trip_tally *tally, uint64_t *kept, uint64_t *halo)
{
    const trip_checkpoint *before = trip_journal_get_checkpoint(b->journal);
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
        return trip_fail(TRIP_ERROR, "brick", b->params->input, "holds no finite value");
    if (t->finite < t->voxels)
        trip_warn(b->params->input, "%llu values that are not finite are taken as not there",
                  (unsigned long long)(t->voxels - t->finite));
    if (b->summary->kept == 0)
        return trip_fail(TRIP_ERROR, "brick", b->params->input,
                         "no voxel is visible: the values are from %g to %g, and the transfer "
                         "functions and ranges show none of them",
                         t->value_min, t->value_max);
    if (t->value_min == t->value_max)
        trip_warn(
            b->params->input,
            "every voxel there is has the value %g: there is nothing to see but their outline",
            t->value_min);
    for (size_t i = 0; i < b->params->function_count; i++)
        trip_tf_check_range(b->in.functions[i], t->value_min, t->value_max, b->params->input);
    return 0;
}

static int read_volume(brick *b)
{
    const trip_checkpoint *before = trip_journal_get_checkpoint(b->journal);
    trip_walk_params walk = { .slices = b->plan.slices,
                              .read_ahead = b->plan.read_ahead,
                              .edge = trip_splat_edge(&b->format),
                              .height = TRIP_SPLAT_HEIGHT,
                              .skip = before ? before->done : 0,
                              .box = on_box,
                              .batch = on_batch,
                              .user = b };
    double begin = now_seconds();
    int status = trip_walk(b->in.volume, b->in.workers, &walk);
    end_stage(b, TRIP_BRICK_READ, begin);
    if (status < 0)
        return status;
    add_up(b, b->in.tally, &b->summary->kept, &b->summary->halo);
    trip_tally_histogram(b->in.tally, &b->in.histogram);
    return check_tally(b);
}

static void on_merge_progress(void *user, uint64_t splats)
{
    const brick *b = user;
    trip_brick_input_progress(&b->in, "merge", splats, 3 * (b->summary->kept + b->summary->halo));
}

static int merge_lists(brick *b)
{
    double begin = now_seconds();
    int status = 0;
    if (!b->format.quantised) {
        set_quantiser(b, b->in.tally->value_min, b->in.tally->value_max);
        const trip_writer_codes codes = codes_of(b);
        status = trip_writer_set_codes(b->writer, &codes);
    }
    if (status == 0)
        status = trip_list_builder_finish(b->builder, &b->quantiser, b->in.workers,
                                          on_merge_progress, b);
    end_stage(b, TRIP_BRICK_MERGE, begin);
    return status;
}

static int fail_count(const brick *b, const char *what, uint64_t counted, uint64_t written)
{
    return trip_fail(TRIP_ERROR, "brick", b->params->output,
                     "%" PRIu64 " %s were counted and %" PRIu64
                     " written: what the interrupted run left is damaged, without --resume it "
                     "starts again",
                     counted, what, written);
}

/* What was written is what was counted: a journal may have counted otherwise. What is around
 * several boxes of a sparse volume was counted more often. */
static int check_records(brick *b)
{
    trip_brick_summary *s = b->summary;
    uint64_t kept = trip_writer_records(b->writer, 0);
    uint64_t halo = b->format.halo ? trip_writer_records(b->writer, TRIP_HALO_LISTS) : 0;
    if (kept != s->kept)
        return fail_count(b, "kept voxels", s->kept, kept);
    if (b->in.info->sparse ? halo > s->halo : halo != s->halo)
        return fail_count(b, "voxels around them", s->halo, halo);
    s->halo = halo;
    s->code_bytes = b->code_bytes;
    s->normal_bytes = b->normal_bytes;
    s->bytes = trip_writer_bytes(b->writer);
    for (unsigned list = TRIP_HALO_LISTS; list < trip_piece_list_count(&b->format); list++)
        s->halo_bytes += trip_writer_plane_bytes(b->writer, list, TRIP_PLANE_VOXELS);
    return 0;
}

static int finish_output(brick *b)
{
    double begin = now_seconds();
    char *text = trip_brick_text_make(&(trip_brick_text){ .params = b->params,
                                                          .info = b->in.info,
                                                          .envelope = &b->in.envelope,
                                                          .functions = b->in.functions,
                                                          .histogram = &b->in.histogram });
    if (!text)
        return TRIP_ERROR;
    trip_writer_summary s = { b->in.tally->value_min, b->in.tally->value_max, b->in.tally->voxels,
                              text };
    int status = check_records(b);
    if (status == 0)
        status = trip_writer_finish(b->writer, &s);
    if (status == 0)
        b->writer = NULL;
    free(text);
    b->summary->stages[TRIP_BRICK_FINISH].seconds = now_seconds() - begin;
    return status;
}

static void fill_summary(brick *b)
{
    trip_brick_summary *s = b->summary;
    const double(*m)[4] = b->in.info->index_to_world.m;
    memcpy(s->dims, b->in.info->dims, sizeof s->dims);
    memcpy(s->note, b->in.info->note, sizeof s->note);
    for (int a = 0; a < 3; a++)
        s->spacing[a] = trip_length(trip_v3(m[0][a], m[1][a], m[2][a]));
    s->voxels = b->in.tally->voxels;
    s->not_finite = b->in.tally->voxels - b->in.tally->finite;
    s->value_min = b->in.tally->value_min;
    s->value_max = b->in.tally->value_max;
    s->kind = trip_brick_kind(b->in.info, &b->in.histogram);
    s->input_bytes = input_bytes(b);
    s->temporary_bytes = trip_spill_bytes(b->spill);
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
    return status == 0 ? open_spill(b) : status;
}

static int make(brick *b)
{
    int status = trip_brick_input_needs_scan(&b->in) ? scan(b) : 0;
    if (status == 0)
        status = trip_brick_input_make_envelope(&b->in);
    if (status < 0)
        return status;
    choose_codes(b);
    choose_normals(b);
    status = plan_memory(b);
    if (status == 0 && !trip_journal_get_start(b->journal))
        status = trip_estimate_check_disk(&b->in, &b->format, &b->plan);
    if (status == 0)
        status = open_output(b);
    b->begun = status == 0;
    if (status == 0)
        status = read_volume(b);
    if (status == 0)
        status = merge_lists(b);
    return status == 0 ? finish_output(b) : status;
}

static int run(brick *b)
{
    int status = prepare(b);
    if (status == 0)
        status = is_done(b) ? summarise_done(b) : make(b);
    if (status == 0)
        fill_summary(b);
    return status;
}

/* Who resumes and interrupts will want to resume again. Other failures leave nothing, nor does an
 * end; a run that was refused before it began leaves all that it found. */
static void keep_or_remove_leftovers(brick *b, int status)
{
    trip_leftover now = trip_leftover_none();
    bool keep = b->params->resume && status == TRIP_INTERRUPTED;
    if (b->spill && (b->begun || status == 0))
        trip_spill_keep(b->spill, keep);
    if (b->spill && b->begun && keep)
        trip_leftover_take(&now, b->spill, b->partial_path, &b->format);
    trip_leftover_close(&now);
}

static void close_all(brick *b, int status)
{
    trip_list_builder_destroy(b->builder);
    trip_splatter_destroy(b->splatter);
    keep_or_remove_leftovers(b, status);
    trip_writer_abort(b->writer);
    trip_journal_close(b->journal);
    trip_leftover_close(&b->leftover);
    trip_spill_close(b->spill);
    trip_brick_input_close(&b->in);
    free(b->partial_path);
}

int trip_brick(const trip_brick_params *params, trip_brick_summary *summary)
{
    brick b = { .params = params, .summary = summary, .leftover = trip_leftover_none() };
    *summary = (trip_brick_summary){ 0 };
    int status = run(&b);
    close_all(&b, status);
    return status;
}
