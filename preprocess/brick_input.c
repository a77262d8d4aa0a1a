#include "brick_input.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

#include "brick_memory.h"
#include "brick_metadata.h"
#include "format.h"
#include "normal.h"
#include "report.h"

/* Saturates, because the grid of a sparse volume may have more than 2^64 voxels. */
static uint64_t count_voxels(const int64_t dims[3])
{
    uint64_t voxels = 1;
    for (int a = 0; a < 3; a++)
        if (__builtin_mul_overflow(voxels, (uint64_t)dims[a], &voxels))
            return UINT64_MAX;
    return voxels;
}

static int set_region(trip_brick_input *in)
{
    in->region = in->params->region;
    for (int a = 0; a < 3; a++) {
        int64_t *past = &in->region.past[a], voxels = in->info->dims[a];
        *past = *past ? *past : voxels;
        if (in->region.first[a] < 0 || in->region.first[a] >= *past || *past > voxels)
            return trip_fail(TRIP_USAGE, "brick", in->params->input,
                             "the region is empty or leaves the grid along %c, where the grid "
                             "has voxels 0 to below %" PRId64,
                             "ijk"[a], voxels);
    }
    return 0;
}

trip_coordinates trip_brick_coordinates(const trip_brick_input *in)
{
    double *const *along = in->info->coordinates;
    return trip_coordinates_make(
        along[0] ? (const double *const[3]){ along[0], along[1], along[2] } : NULL, in->info->dims);
}

int trip_brick_levels(const trip_brick_input *in)
{
    return in->info->coordinates[0] ? -1 : in->params->levels;
}

/* Refuses an explicit number of coarse levels that the grid cannot have. */
static int check_levels(const trip_brick_input *in)
{
    if (in->params->levels <= 0 || trip_brick_levels(in) == in->params->levels)
        return 0;
    return trip_fail(TRIP_USAGE, "brick", in->params->input,
                     "grids with uneven spacing have no coarse levels; "
                     "leave out --levels");
}

bool trip_brick_stores_normals(const trip_brick_params *p)
{
    const trip_level_kinds kinds = trip_levels_kinds(p->levels_for, !p->no_halo);
    if (p->normals != TRIP_NORMALS_AUTO)
        return p->normals != TRIP_NORMALS_NONE;
    return (p->no_halo && !p->keep_all) || (p->levels >= 0 && kinds.means && !kinds.values);
}

trip_piece_format trip_brick_format(const trip_brick_params *p)
{
    return (trip_piece_format){ .tile_log2 =
                                    p->tile_voxels ? (unsigned)__builtin_ctz(p->tile_voxels) : 6,
                                .normals = trip_brick_stores_normals(p),
                                .halo = !p->no_halo };
}

static unsigned choose_threads(const trip_brick_input *in)
{
    trip_piece_format format = trip_brick_format(in->params);
    return trip_memory_plan_threads(&format, trip_budget_limit_bytes(in->budget));
}

static int open_volume(trip_brick_input *in)
{
    const trip_brick_params *p = in->params;
    int status = trip_budget_create(&in->budget, p->memory_bytes);
    if (status == 0)
        status = trip_workers_create(&in->workers, p->threads ? p->threads : choose_threads(in));
    if (status == 0)
        status = trip_volume_open(&in->volume, p->input, &p->volume, in->budget);
    if (status < 0)
        return status;
    in->info = trip_volume_get_info(in->volume);
    in->grid_voxels = count_voxels(in->info->dims);
    in->tally = trip_budget_take(in->budget, sizeof *in->tally);
    if (!in->tally)
        return trip_fail(TRIP_ERROR, "brick", p->input, "--memory is far too small");
    trip_tally_clear(in->tally);
    in->memory_bytes = trip_budget_left_bytes(in->budget);
    status = trip_volume_check_axes(p->input, in->info);
    if (status == 0)
        status = check_levels(in);
    return status == 0 ? set_region(in) : status;
}

/* Returns the length of a text in JSON, where a newline takes two bytes. */
static uint64_t bytes_of(const trip_tf *tf)
{
    char *text = trip_tf_to_text(tf);
    uint64_t bytes = 0;
    for (const char *c = text; c && *c; c++)
        bytes += *c == '\n' ? 2 : 1;
    free(text);
    return bytes;
}

/* Checks that the metadata has room for the transfer functions; the first one appears twice. */
static int check_functions(const trip_brick_input *in)
{
    const uint64_t room = TRIP_TEXT_BYTES_MAX - (1 << 20); /* 1 MiB for other metadata */
    uint64_t bytes = 0;
    for (size_t i = 0; i < in->params->function_count; i++)
        bytes += bytes_of(in->functions[i]) * (i == 0 ? 2 : 1);
    return bytes <= room ? 0
                         : trip_fail(TRIP_USAGE, "brick", in->params->input,
                                     "the transfer functions take %" PRIu64
                                     " bytes, but a data set has room for %" PRIu64
                                     "; give fewer or simpler ones",
                                     bytes, room);
}

static int load_functions(trip_brick_input *in)
{
    size_t count = in->params->function_count;
    in->functions = calloc(count + 1, sizeof *in->functions);
    if (!in->functions)
        return trip_fail(TRIP_ERROR, "brick", in->params->input, "out of memory");
    int status = 0;
    for (size_t i = 0; i < count && status == 0; i++)
        status = trip_tf_load(&in->functions[i], in->params->functions[i]);
    return status == 0 ? check_functions(in) : status;
}

int trip_brick_input_open(trip_brick_input *in, const trip_brick_params *params)
{
    in->params = params;
    int status = open_volume(in);
    return status == 0 ? load_functions(in) : status;
}

void trip_brick_input_close(trip_brick_input *in)
{
    trip_envelope_destroy(&in->envelope);
    for (size_t i = 0; in->functions && i < in->params->function_count; i++)
        trip_tf_destroy(in->functions[i]);
    free(in->functions);
    if (in->tally)
        trip_budget_release(in->budget, in->tally, sizeof *in->tally);
    trip_volume_close(in->volume);
    trip_workers_destroy(in->workers);
    if (in->budget)
        trip_budget_destroy(in->budget);
}

bool trip_brick_has_narrow_type(const trip_brick_input *in)
{
    trip_scalar type = in->info->type;
    return type == TRIP_U8 || type == TRIP_I8 || type == TRIP_U16 || type == TRIP_I16;
}

static bool has_byte_type(const trip_brick_input *in)
{
    return in->info->type == TRIP_U8 || in->info->type == TRIP_I8;
}

void trip_brick_type_range(const trip_volume_info *info, double *lo, double *hi)
{
    double size = trip_scalar_bytes(info->type) == 1 ? 256 : 65536;
    double min = info->type == TRIP_I8 || info->type == TRIP_I16 ? -size / 2 : 0;
    double a = info->slope * min + info->inter;
    double b = info->slope * (min + size - 1) + info->inter;
    *lo = fmin(a, b);
    *hi = fmax(a, b);
}

/* Values are rounded to floats. A large offset can leave too few bits for exact codes. */
static bool are_bytes_exact(const trip_brick_input *in)
{
    trip_quantiser q = { 0 };
    double lo, hi;
    if (!has_byte_type(in))
        return false;
    trip_brick_type_range(in->info, &lo, &hi);
    trip_quantiser_set_bytes(&q, lo, hi);
    for (int stored = in->info->type == TRIP_I8 ? -128 : 0, i = 0; i < 256; i++) {
        double value = in->info->slope * (stored + i) + in->info->inter;
        if (trip_quantise(&q, (float)value) % TRIP_CODE_STEP)
            return false;
    }
    return true;
}

unsigned trip_brick_code_bytes(const trip_brick_input *in)
{
    switch (in->params->code_bits) {
    case TRIP_CODE_BITS_8:
        return 1;
    case TRIP_CODE_BITS_16:
        return 2;
    case TRIP_CODE_BITS_AUTO:
        break;
    }
    return are_bytes_exact(in) ? 1 : 2;
}

bool trip_brick_rounds_codes(const trip_brick_input *in)
{
    return in->params->code_bits == TRIP_CODE_BITS_8 && !are_bytes_exact(in);
}

double trip_brick_gradient_full(const trip_brick_input *in, double lo, double hi)
{
    double range = in->scanned ? in->tally->value_max - in->tally->value_min : 0;
    double voxel = cbrt(fabs(trip_affine_determinant(&in->info->index_to_world)));
    return TRIP_GRADIENT_FULL * (range > 0 ? range : hi - lo) / voxel;
}

bool trip_brick_choose_compact(const trip_brick_input *in, double full, double step[3])
{
    double unit = in->info->type < TRIP_F16 ? fabs(in->info->slope) / 2 : 0;
    return trip_compact_normals_choose(&in->info->index_to_world, full, unit, step);
}

/* Returns whether 3-byte normals keep differences of values exactly, as 4-byte normals do. */
static bool are_compact_exact(const trip_brick_input *in)
{
    double lo = 0, hi = 0, step[3];
    if ((!in->scanned && !trip_brick_has_narrow_type(in)) || in->info->coordinates[0])
        return false;
    if (trip_brick_has_narrow_type(in))
        trip_brick_type_range(in->info, &lo, &hi);
    return trip_brick_choose_compact(in, trip_brick_gradient_full(in, lo, hi), step);
}

unsigned trip_brick_normal_bytes(const trip_brick_input *in)
{
    switch (in->params->normals) {
    case TRIP_NORMALS_NONE:
        return 0;
    case TRIP_NORMALS_FULL:
        return 4;
    case TRIP_NORMALS_COMPACT:
        return 3;
    case TRIP_NORMALS_AUTO:
    case TRIP_NORMALS_STORED:
        break;
    }
    return !trip_brick_stores_normals(in->params) ? 0 : are_compact_exact(in) ? 3 : 4;
}

/* Normals of 8- and 16-bit types are made before all values are known, others after that. */
static bool depend_normals_on_range(const trip_brick_input *in)
{
    if (in->params->normals == TRIP_NORMALS_COMPACT)
        return !has_byte_type(in);
    return trip_brick_has_narrow_type(in) && trip_brick_normal_bytes(in) == 4;
}

static bool is_envelope_automatic(const trip_brick_params *p)
{
    return p->automatic || (!p->keep_all && p->function_count == 0 && p->range_count == 0);
}

bool trip_brick_input_needs_scan(const trip_brick_input *in)
{
    bool needed = is_envelope_automatic(in->params) || depend_normals_on_range(in) ||
                  trip_brick_rounds_codes(in);
    for (size_t i = 0; i < in->params->function_count; i++)
        needed = needed || trip_tf_needs_data(in->functions[i]);
    return needed;
}

bool trip_brick_will_be_quantised(const trip_brick_input *in)
{
    return trip_brick_has_narrow_type(in) || trip_brick_input_needs_scan(in);
}

void trip_brick_input_progress(const trip_brick_input *in, const char *stage, uint64_t done,
                               uint64_t total)
{
    if (in->params->progress)
        in->params->progress(in->params->progress_user, stage, done, total);
}

static int on_scan_progress(void *user, uint64_t voxels)
{
    const trip_brick_input *in = user;
    trip_brick_input_progress(in, "scan", voxels, in->grid_voxels);
    return 0;
}

int trip_brick_input_set_tally(trip_brick_input *in, const trip_tally *known)
{
    int status = 0;
    if (known != in->tally)
        *in->tally = *known;
    in->scanned = true;
    trip_tally_histogram(in->tally, &in->histogram);
    const trip_tf_data data = { in->tally->value_min, in->tally->value_max, &in->histogram,
                                trip_brick_kind(in->info, &in->histogram) };
    for (size_t i = 0; i < in->params->function_count && status == 0; i++)
        status = trip_tf_adapt(in->functions[i], &data, in->params->input);
    return status;
}

int trip_brick_input_scan(trip_brick_input *in, trip_scan_params scan)
{
    scan.progress = on_scan_progress;
    scan.user = in;
    int status =
        trip_scan_volume(in->tally, in->volume, in->params->input, in->workers, &scan, in->budget);
    return status == 0 ? trip_brick_input_set_tally(in, in->tally) : status;
}

static int add_automatic(trip_brick_input *in)
{
    trip_tf *tf;
    int status =
        trip_tf_make_automatic(&tf, trip_brick_kind(in->info, &in->histogram), &in->histogram);
    if (status < 0)
        return status;
    status = trip_envelope_add_tf(&in->envelope, tf);
    trip_tf_destroy(tf);
    return status;
}

int trip_brick_input_make_envelope(trip_brick_input *in)
{
    const trip_brick_params *p = in->params;
    int status = is_envelope_automatic(p) ? add_automatic(in) : 0;
    if (p->keep_all && status == 0)
        status = trip_envelope_add_all(&in->envelope);
    for (size_t i = 0; i < p->range_count && status == 0; i++)
        status = trip_envelope_add_range(&in->envelope, p->ranges[i].lo, p->ranges[i].hi);
    for (size_t i = 0; i < p->function_count && status == 0; i++)
        status = trip_envelope_add_tf(&in->envelope, in->functions[i]);
    return status;
}
