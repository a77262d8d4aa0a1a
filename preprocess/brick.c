#include "brick.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "brick_memory.h"
#include "brick_text.h"
#include "list_builder.h"
#include "report.h"
#include "scan.h"
#include "splats.h"

/* Everything of one run; zeroed at first, so that close() undoes any part of it. */
typedef struct brick {
    const trip_brick_params *params;
    trip_brick_summary *summary;
    trip_budget *budget;
    trip_workers *workers;
    trip_volume *volume;
    const trip_volume_info *info;
    uint64_t grid_voxels;  /* of the dims: what progress counts */
    uint64_t memory_bytes; /* left once the input was opened */

    trip_tf **functions;
    trip_envelope envelope;
    bool scanned; /* the tally is of a pass before */
    trip_tally *tally;
    trip_histogram histogram;

    trip_piece_format format;
    trip_quantiser quantiser;
    trip_memory_plan plan;
    trip_writer *writer;
    trip_spill *spill;
    trip_list_builder *builder;
    trip_splatter *splatter;
} brick;

static double now_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static void report_progress(const brick *b, const char *stage, uint64_t done, uint64_t total)
{
    if (b->params->progress)
        b->params->progress(b->params->progress_user, stage, done, total);
}

static int check_dims(const brick *b)
{
    for (int a = 0; a < 3; a++)
        if (b->info->dims[a] > 1 << 24)
            return trip_fail(TRIP_ERROR, "brick", b->params->input,
                             "more than 16777216 voxels along an axis");
    return 0;
}

static int open_input(brick *b)
{
    const trip_brick_params *p = b->params;
    int status = trip_budget_create(&b->budget, p->memory_bytes);
    if (status == 0)
        status = trip_workers_create(&b->workers, p->threads);
    if (status == 0)
        status = trip_volume_open(&b->volume, p->input, &p->volume, b->budget);
    if (status < 0)
        return status;
    b->info = trip_volume_get_info(b->volume);
    b->grid_voxels = (uint64_t)(b->info->dims[0] * b->info->dims[1] * b->info->dims[2]);
    b->format.tile_log2 = p->tile_voxels ? (unsigned)__builtin_ctz(p->tile_voxels) : 6;
    b->format.normals = !p->no_normals;
    b->tally = trip_budget_take(b->budget, sizeof *b->tally);
    if (!b->tally)
        return trip_fail(TRIP_ERROR, "brick", p->input, "--memory is far too little");
    trip_tally_clear(b->tally);
    b->memory_bytes = trip_budget_left_bytes(b->budget);
    return check_dims(b);
}

static int load_functions(brick *b)
{
    size_t count = b->params->function_count;
    b->functions = calloc(count + 1, sizeof *b->functions);
    if (!b->functions)
        return trip_fail(TRIP_ERROR, "brick", b->params->input, "out of memory");
    int status = 0;
    for (size_t i = 0; i < count && status == 0; i++)
        status = trip_tf_load(&b->functions[i], b->params->functions[i]);
    return status;
}

/* 8 and 16 bits: codes stand for all values of the type, without a look at the data. */
static bool has_narrow_type(const brick *b)
{
    trip_scalar type = b->info->type;
    return type == TRIP_U8 || type == TRIP_I8 || type == TRIP_U16 || type == TRIP_I16;
}

static bool is_envelope_automatic(const brick *b)
{
    const trip_brick_params *p = b->params;
    return !p->keep_all && p->function_count == 0 && p->range_count == 0;
}

static bool needs_scan(const brick *b)
{
    bool normalised = false;
    for (size_t i = 0; i < b->params->function_count; i++)
        normalised = normalised || trip_tf_is_normalised(b->functions[i]);
    return normalised || is_envelope_automatic(b);
}

static void on_scan_progress(void *user, uint64_t voxels)
{
    const brick *b = user;
    report_progress(b, "scan", voxels, b->grid_voxels);
}

static int scan(brick *b)
{
    double begin = now_seconds();
    int status = trip_scan_volume(b->tally, b->volume, b->params->input, b->workers, b->plan.slices,
                                  b->budget, on_scan_progress, b);
    b->scanned = true;
    b->summary->scan_seconds = now_seconds() - begin;
    trip_tally_histogram(b->tally, &b->histogram);
    for (size_t i = 0; i < b->params->function_count && status == 0; i++)
        trip_tf_denormalise(b->functions[i], b->tally->value_min, b->tally->value_max);
    return status;
}

static int add_automatic(brick *b)
{
    trip_tf *tf;
    int status = trip_brick_automatic_tf(&tf, b->info, &b->histogram);
    if (status < 0)
        return status;
    status = trip_envelope_add_tf(&b->envelope, tf);
    trip_tf_destroy(tf);
    return status;
}

static int make_envelope(brick *b)
{
    const trip_brick_params *p = b->params;
    int status = is_envelope_automatic(b) ? add_automatic(b) : 0;
    if (p->keep_all)
        status = trip_envelope_add_all(&b->envelope);
    for (size_t i = 0; i < p->range_count && status == 0; i++)
        status = trip_envelope_add_range(&b->envelope, p->ranges[i].lo, p->ranges[i].hi);
    for (size_t i = 0; i < p->function_count && status == 0; i++)
        status = trip_envelope_add_tf(&b->envelope, b->functions[i]);
    return status;
}

static void type_limits(trip_scalar type, double *lo, double *hi)
{
    double size = trip_scalar_bytes(type) == 1 ? 256 : 65536;
    *lo = type == TRIP_I8 || type == TRIP_I16 ? -size / 2 : 0;
    *hi = *lo + size - 1;
}

static void set_quantiser(brick *b, double lo, double hi)
{
    b->quantiser = (trip_quantiser){ lo, hi > lo ? hi : lo + 1,
                                     trip_gradient_bound(b->info, lo, hi > lo ? hi : lo + 1) };
}

/* Codes stand for the type's values, or for the range if it is known; else that is for the end. */
static void choose_codes(brick *b)
{
    double lo, hi;
    type_limits(b->info->type, &lo, &hi);
    double a = b->info->slope * lo + b->info->inter, c = b->info->slope * hi + b->info->inter;
    b->format.quantised = has_narrow_type(b) || b->scanned;
    if (has_narrow_type(b))
        set_quantiser(b, fmin(a, c), fmax(a, c));
    else if (b->scanned)
        set_quantiser(b, b->tally->value_min, b->tally->value_max);
    else
        set_quantiser(b, 0, 1);
}

static int plan_memory(brick *b)
{
    return trip_memory_plan_make(&b->plan, b->params->input, b->info, &b->format,
                                 trip_workers_count(b->workers), trip_budget_limit_bytes(b->budget),
                                 b->params->slices);
}

static int open_spill(brick *b)
{
    char *path;
    size_t length = strlen(b->params->output);
    while (length > 1 && b->params->output[length - 1] == '/')
        length--;
    if (asprintf(&path, "%.*s.spill", (int)length, b->params->output) < 0)
        return trip_fail(TRIP_ERROR, "brick", b->params->output, "out of memory");
    int status = trip_spill_open(&b->spill, path, b->budget);
    free(path);
    return status;
}

static int open_writer(brick *b)
{
    trip_writer_params p = { .replace = b->params->replace,
                             .normals = b->format.normals,
                             .tile_voxels = b->params->tile_voxels,
                             .slab_sheets = b->params->slab_sheets,
                             .index_to_world = b->info->index_to_world,
                             .code_lo = b->quantiser.lo,
                             .code_hi = b->quantiser.hi,
                             .gradient_scale = b->quantiser.gradient_scale };
    memcpy(p.dims, b->info->dims, sizeof p.dims);
    return trip_writer_open(&b->writer, b->params->output, &p, b->budget);
}

static int open_builder(brick *b)
{
    trip_list_builder_params p = {
        .format = b->format,
        .quantiser = b->quantiser,
        .producers = trip_workers_count(b->workers),
        .ordered_axis = b->plan.in_order && b->format.quantised ? 2 : -1,
        .memory_bytes = b->plan.list_bytes,
        .writer = b->writer,
        .spill = b->spill,
    };
    memcpy(p.dims, b->info->dims, sizeof p.dims);
    return trip_list_builder_create(&b->builder, &p, b->budget);
}

static void *reserve(void *user, unsigned thread, int axis, size_t bytes)
{
    return trip_list_builder_reserve(user, thread, axis, bytes);
}

static int open_splatter(brick *b)
{
    trip_splat_params p = { .info = b->info,
                            .envelope = &b->envelope,
                            .format = b->format,
                            .quantiser = b->quantiser,
                            .tally = !b->scanned,
                            .threads = trip_workers_count(b->workers),
                            .reserve = reserve,
                            .user = b->builder };
    return trip_splatter_create(&b->splatter, &p, b->budget);
}

static int open_output(brick *b)
{
    int status = open_writer(b);
    if (status == 0)
        status = open_spill(b);
    if (status == 0)
        status = open_builder(b);
    return status == 0 ? open_splatter(b) : status;
}

static int on_box(void *user, unsigned thread, const trip_box *box)
{
    const brick *b = user;
    return trip_splatter_box(b->splatter, thread, box);
}

static int on_batch(void *user, uint64_t batches, uint64_t voxels)
{
    const brick *b = user;
    (void)batches;
    report_progress(b, "read", voxels, b->grid_voxels);
    return trip_list_builder_end_batch(b->builder);
}

static int check_tally(brick *b)
{
    const trip_tally *t = b->tally;
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
    return 0;
}

static int read_volume(brick *b)
{
    trip_walk_params walk = { .slices = b->plan.slices,
                              .read_ahead = b->plan.read_ahead,
                              .edge = trip_splat_edge(&b->format),
                              .height = TRIP_SPLAT_HEIGHT,
                              .box = on_box,
                              .batch = on_batch,
                              .user = b };
    double begin = now_seconds();
    int status = trip_walk(b->volume, b->workers, &walk);
    b->summary->read_seconds = now_seconds() - begin;
    if (status < 0)
        return status;
    if (!b->scanned)
        trip_splatter_tally(b->splatter, b->tally);
    if (!b->scanned)
        trip_tally_histogram(b->tally, &b->histogram);
    b->summary->kept = trip_splatter_kept(b->splatter);
    return check_tally(b);
}

static void on_merge_progress(void *user, uint64_t splats)
{
    const brick *b = user;
    report_progress(b, "merge", splats, 3 * b->summary->kept);
}

static int merge_lists(brick *b)
{
    double begin = now_seconds();
    int status = 0;
    if (!b->format.quantised) {
        set_quantiser(b, b->tally->value_min, b->tally->value_max);
        status = trip_writer_set_codes(b->writer, b->quantiser.lo, b->quantiser.hi,
                                       b->quantiser.gradient_scale);
    }
    if (status == 0)
        status =
            trip_list_builder_finish(b->builder, &b->quantiser, b->workers, on_merge_progress, b);
    b->summary->merge_seconds = now_seconds() - begin;
    return status;
}

static int finish_output(brick *b)
{
    double begin = now_seconds();
    char *text = trip_brick_text_make(&(trip_brick_text){ .params = b->params,
                                                          .info = b->info,
                                                          .envelope = &b->envelope,
                                                          .functions = b->functions,
                                                          .histogram = &b->histogram });
    if (!text)
        return TRIP_ERROR;
    b->summary->bytes = trip_writer_bytes(b->writer);
    trip_writer_summary s = { b->tally->value_min, b->tally->value_max, b->tally->voxels, text };
    int status = trip_writer_finish(b->writer, &s);
    if (status == 0)
        b->writer = NULL;
    free(text);
    b->summary->finish_seconds = now_seconds() - begin;
    return status;
}

static void fill_summary(brick *b)
{
    trip_brick_summary *s = b->summary;
    const double(*m)[4] = b->info->index_to_world.m;
    memcpy(s->dims, b->info->dims, sizeof s->dims);
    for (int a = 0; a < 3; a++)
        s->spacing[a] = trip_length(trip_v3(m[0][a], m[1][a], m[2][a]));
    s->voxels = b->tally->voxels;
    s->not_finite = b->tally->voxels - b->tally->finite;
    s->value_min = b->tally->value_min;
    s->value_max = b->tally->value_max;
    s->input_bytes = s->voxels * trip_scalar_bytes(b->info->type);
    s->temporary_bytes = trip_spill_bytes(b->spill);
    s->memory_bytes = trip_budget_limit_bytes(b->budget);
    s->peak_memory_bytes = trip_budget_peak_bytes(b->budget);
}

static int run(brick *b)
{
    int status = open_input(b);
    if (status == 0)
        status = load_functions(b);
    b->format.quantised = true;
    if (status == 0)
        status = plan_memory(b);
    if (status == 0 && needs_scan(b))
        status = scan(b);
    if (status == 0)
        status = make_envelope(b);
    if (status < 0)
        return status;
    choose_codes(b);
    status = plan_memory(b);
    if (status == 0)
        status = open_output(b);
    if (status == 0)
        status = read_volume(b);
    if (status == 0)
        status = merge_lists(b);
    if (status == 0)
        status = finish_output(b);
    if (status == 0)
        fill_summary(b);
    return status;
}

static void close_all(brick *b)
{
    trip_list_builder_destroy(b->builder);
    trip_splatter_destroy(b->splatter);
    trip_writer_abort(b->writer);
    trip_spill_close(b->spill);
    trip_envelope_destroy(&b->envelope);
    for (size_t i = 0; b->functions && i < b->params->function_count; i++)
        trip_tf_destroy(b->functions[i]);
    free(b->functions);
    if (b->tally)
        trip_budget_release(b->budget, b->tally, sizeof *b->tally);
    trip_volume_close(b->volume);
    trip_workers_destroy(b->workers);
    if (b->budget)
        trip_budget_destroy(b->budget);
}

int trip_brick(const trip_brick_params *params, trip_brick_summary *summary)
{
    brick b = { .params = params, .summary = summary };
    *summary = (trip_brick_summary){ 0 };
    int status = run(&b);
    close_all(&b);
    return status;
}
