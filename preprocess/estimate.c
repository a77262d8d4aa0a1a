#include "estimate.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "clock.h"
#include "disk_time.h"
#include "levels.h"
#include "report.h"
#include "source.h"

/* Number of portions in a sample, and slices of each if memory permits. */
enum { SAMPLES = 16, SAMPLE_SLICES = 4 };
/* Status that ends a scan at its time limit. */
enum { STOPPED = -100 };
/* Time limit in seconds of the sample before a run, and the addition per voxel of the grid. */
static const double check_seconds = 3, check_seconds_per_voxel = 5e-11;
/* Bytes of masks per record; the masks of a halo have fewer bits set. */
static const double mask_bytes = 0.25, halo_mask_bytes = 0.7;
/* Bytes of coarse levels relative to level 0. A level has an eighth of the voxels of the level
 * below for a body, a quarter for a surface, and more for thin vessels. Measured: 0.16 to 0.23 for
 * means with normals, 0.12 to 0.25 for values, 0.07 to 0.17 for their deviations. */
static const double means_part = 0.19, values_part = 0.14, deviations_part = 0.12;
/* Estimates are uncertain: a run is refused only if this share of the estimate does not fit. */
static const double surely = 0.7;

static int64_t slices_of(const trip_memory_plan *plan)
{
    return plan->slices < SAMPLE_SLICES ? plan->slices : SAMPLE_SLICES;
}

static uint64_t stride_of(const trip_brick_input *in, const trip_memory_plan *plan)
{
    uint64_t portions = (uint64_t)(in->info->dims[2] / slices_of(plan)) + 1;
    if (in->info->sparse) /* the number of voxels varies too much between portions */
        return 1;
    return portions > SAMPLES ? portions / SAMPLES : 1;
}

typedef struct sampling {
    const trip_brick_input *in;
    double until;
} sampling;

static int on_progress(void *user, uint64_t voxels)
{
    const sampling *s = user;
    trip_brick_input_progress(s->in, "sample", voxels, s->in->grid_voxels);
    return trip_now_seconds() > s->until ? STOPPED : 0;
}

/* Returns the share of the grid inside the region. */
static double part_in_region(const trip_brick_input *in)
{
    double part = 1;
    for (int a = 0; a < 3; a++)
        part *= (double)(in->region.past[a] - in->region.first[a]) / (double)in->info->dims[a];
    return part;
}

/* Scales the sample up to the volume and down to the region. On average over directions, a
 * one-voxel layer around a body has three voxels per pair of neighbours along x across its border.
 */
static void scale_up(const trip_brick_input *in, const trip_tally *t, trip_brick_estimate *e)
{
    double all = in->info->sparse ? (double)t->voxels : (double)in->grid_voxels;
    double scale = t->voxels ? all / (double)t->voxels : 0;
    e->voxels = (uint64_t)all;
    scale *= part_in_region(in);
    e->kept = (uint64_t)(scale * (double)t->kept);
    e->halo = in->params->no_halo ? 0 : (uint64_t)(3 * scale * (double)t->borders);
}

/* Estimates the seconds for the whole volume from a scan that began at `begin`. `skipping` of its
 * seconds were spent skipping data. */
static double seconds_for_all(const trip_brick_input *in, const trip_tally *t, double begin,
                              double skipping)
{
    double part = in->info->sparse ? 1 : (double)t->voxels / (double)in->grid_voxels;
    return (trip_now_seconds() - begin - skipping) / part + skipping;
}

/* Estimates the numbers of voxels from portions at regular distances, and the seconds for the whole
 * volume. Makes the input's envelope. Stops after `limit_seconds` (0 means no limit). Returns 1 if
 * *e is filled, 0 at the time limit. */
static int estimate_kept(trip_brick_input *in, const trip_memory_plan *plan, double limit_seconds,
                         trip_brick_estimate *e)
{
    double begin = trip_now_seconds(), skipping = 0;
    sampling s = { in, limit_seconds > 0 ? begin + limit_seconds : INFINITY };
    const trip_scan_params scan = { .slices = slices_of(plan),
                                    .read_ahead = plan->read_ahead,
                                    .stride = stride_of(in, plan),
                                    .envelope = trip_brick_envelope(in),
                                    .progress = on_progress,
                                    .user = &s,
                                    .skip_seconds = &skipping };
    trip_tally *t = trip_budget_take(in->budget, sizeof *t);
    if (!t)
        return trip_fail(TRIP_ERROR, "brick", in->params->input,
                         "is too large for the memory allowed; raise --memory");
    int status = trip_scan_volume(t, in->volume, in->params->input, in->workers, &scan, in->budget);
    if (status == 0) {
        scale_up(in, t, e);
        e->seconds += seconds_for_all(in, t, begin, skipping);
    }
    trip_budget_release(in->budget, t, sizeof *t);
    if (status == STOPPED)
        return trip_volume_rewind(in->volume);
    return status < 0 ? status : 1;
}

/* Returns the output's folder, for free(). */
static char *folder_of(const char *path)
{
    char *copy = strdup(path), *folder = copy ? strdup(dirname(copy)) : NULL;
    free(copy);
    return folder;
}

static uint64_t free_bytes(const char *output)
{
    struct statvfs v;
    char *folder = folder_of(output);
    bool known = folder && statvfs(folder, &v) == 0;
    free(folder);
    return known ? (uint64_t)v.f_bavail * v.f_frsize : UINT64_MAX;
}

/* Returns the bytes per splat of a large piece. */
static double piece_bytes(const trip_piece_format *f, unsigned list)
{
    const trip_piece_format own = trip_piece_format_of(f, list);
    return (double)trip_piece_max_bytes(&own) / (double)(1 << 2 * f->tile_log2);
}

/* Returns the bytes of all levels as a multiple of the bytes of level 0. */
static double with_levels(const trip_brick_input *in, unsigned tile_voxels)
{
    const trip_brick_params *p = in->params;
    const trip_level_kinds kinds = trip_levels_kinds(p->levels_for, !p->no_halo);
    if (trip_levels_count(in->info->dims, trip_brick_levels(in), tile_voxels) == 0)
        return 1;
    const bool labels = in->info->labels || in->info->named_labels; /* as far as the file tells */
    return 1 + kinds.means * means_part +
           kinds.values * (values_part + (labels ? 0 : deviations_part));
}

/* Computes the sizes from the numbers of voxels. */
static void estimate_sizes(const trip_brick_input *in, const trip_piece_format *format,
                           const trip_memory_plan *plan, trip_brick_estimate *e)
{
    int lists = plan->in_order && format->quantised ? 2 : 3;
    double pieces = lists * (double)e->kept * piece_bytes(format, 0) +
                    3 * (double)e->halo * piece_bytes(format, TRIP_HALO_LISTS);
    double code = trip_brick_code_bytes(in), normal = trip_brick_normal_bytes(in);
    e->bytes = (uint64_t)(3 *
                          ((double)e->kept * (mask_bytes + code + normal) +
                           (double)e->halo * (halo_mask_bytes + code)) *
                          with_levels(in, 1u << format->tile_log2));
    e->temporary_bytes = pieces > 0.9 * (double)plan->list_bytes ? (uint64_t)pieces : 0;
    e->free_bytes = free_bytes(in->params->output);
}

/* Returns the cost of reading the volume's files, before the estimate itself reads them. Volumes in
 * memory have no files. */
static trip_read_cost read_cost(const trip_brick_input *in)
{
    trip_source source = { 0 };
    trip_read_cost cost = { .cache_bytes = trip_memory_available_bytes(),
                            .passes = trip_brick_input_needs_scan(in) ? 2 : 1 };
    const trip_source_file *largest = NULL;
    if (in->params->volume.memory.data || in->params->volume.memory.read_slices ||
        trip_source_find(&source, in->params->input, &in->params->volume) < 0)
        return cost;
    for (size_t i = 0; i < source.count; i++) {
        const trip_source_file *file = &source.files[i];
        largest = !largest || file->bytes > largest->bytes ? file : largest;
        cost.uncached_bytes += trip_disk_time_uncached(file->path);
    }
    cost.bytes = source.bytes;
    if (largest && (cost.uncached_bytes > 0 || cost.bytes > cost.cache_bytes))
        cost.seconds_per_byte = trip_disk_time_reading(largest->path);
    trip_source_free(&source);
    return cost;
}

/* Estimates from a sample. Replaces the scan that a run makes first. */
static int scan_sample(trip_brick_input *in, const trip_memory_plan *plan, trip_brick_estimate *e)
{
    double begin = trip_now_seconds(), skipping = 0;
    int status = trip_brick_input_scan(in, (trip_scan_params){ .slices = slices_of(plan),
                                                               .read_ahead = plan->read_ahead,
                                                               .stride = stride_of(in, plan),
                                                               .skip_seconds = &skipping });
    if (status == 0)
        e->seconds += seconds_for_all(in, in->tally, begin, skipping);
    return status;
}

static int estimate(trip_brick_input *in, trip_brick_estimate *e)
{
    const trip_brick_params *p = in->params;
    trip_piece_format format = trip_brick_format(p);
    trip_memory_plan plan;
    trip_read_cost cost = read_cost(in);
    format.quantised = trip_brick_will_be_quantised(in);
    int status =
        trip_memory_plan_make(&plan, p->input, in->info, &format, trip_workers_count(in->workers),
                              in->memory_bytes, p->slices);
    if (status == 0 && trip_brick_input_needs_scan(in))
        status = scan_sample(in, &plan, e);
    if (status == 0)
        status = trip_brick_input_make_envelope(in);
    if (status == 0)
        status = estimate_kept(in, &plan, 0, e);
    if (status < 0)
        return status;
    estimate_sizes(in, &format, &plan, e);
    cost.compute_seconds = e->seconds;
    e->seconds = trip_disk_time_read(&cost) +
                 (double)(e->bytes + 2 * e->temporary_bytes) * trip_disk_time_writing(p->output);
    return 0;
}

int trip_brick_estimate_make(const trip_brick_params *params, trip_brick_estimate *e)
{
    trip_brick_input in = { 0 };
    *e = (trip_brick_estimate){ 0 };
    int status = trip_brick_input_open(&in, params);
    if (status == 0)
        status = estimate(&in, e);
    trip_brick_input_close(&in);
    return status;
}

int trip_estimate_check_disk(trip_brick_input *in, const trip_piece_format *format,
                             const trip_memory_plan *plan)
{
    char needed[32], there[32];
    trip_brick_estimate e = { .voxels = in->grid_voxels, .kept = in->grid_voxels };
    estimate_sizes(in, format, plan, &e);
    uint64_t max = in->params->max_bytes ? in->params->max_bytes : UINT64_MAX;
    if (e.bytes + e.temporary_bytes <= e.free_bytes && e.bytes <= max)
        return 0;
    double seconds = check_seconds + check_seconds_per_voxel * (double)in->grid_voxels;
    bool all = in->params->keep_all && !in->info->sparse;
    int status = all ? 1 : estimate_kept(in, plan, seconds, &e);
    if (status <= 0)
        return status;
    estimate_sizes(in, format, plan, &e);
    if (surely * (double)e.bytes > (double)max)
        return trip_fail(
            TRIP_ERROR, "cache", in->params->input,
            "its data set needs about %s, but the cache has %s; raise "
            "TRIPTYCH_CACHE_SIZE, or write the data set elsewhere with `triptych brick`",
            trip_format_bytes(e.bytes, needed), trip_format_bytes(max, there));
    if (surely * (double)(e.bytes + e.temporary_bytes) <= (double)e.free_bytes)
        return 0;
    return trip_fail(TRIP_ERROR, "brick", in->params->output,
                     "needs about %s with temporary data, but the disk has %s free; free "
                     "space, write elsewhere, or keep fewer voxels",
                     trip_format_bytes(e.bytes + e.temporary_bytes, needed),
                     trip_format_bytes(e.free_bytes, there));
}
