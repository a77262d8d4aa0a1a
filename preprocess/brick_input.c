#include "brick_input.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "brick_memory.h"
#include "brick_metadata.h"
#include "format.h"
#include "normal.h"
#include "report.h"
#include "text.h"
#include "typical.h"

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

/* ---- fill values ---- */

void trip_brick_input_tell_fills(trip_brick_input *in)
{
    char text[512], number[32];
    const uint64_t before = in->finite_before, now = in->tally->finite;
    if (in->fills.count == 0)
        return;
    int used =
        snprintf(text, sizeof text, "%" PRIu64 " voxels with", before > now ? before - now : 0);
    for (unsigned i = 0; i < in->fills.count; i++)
        used += snprintf(text + used, sizeof text - (size_t)used, "%s %s", i ? " or" : "",
                         trip_text_from_double(in->fills.values[i], number));
    snprintf(text + used, sizeof text - (size_t)used,
             ", far outside of all other values, count as absent; --fill none keeps them");
    trip_volume_add_note(in->volume, text);
}

void trip_brick_input_set_fills(trip_brick_input *in, const trip_fills *fills,
                                uint64_t finite_before)
{
    in->fills = *fills;
    in->finite_before = finite_before;
    if (fills->count)
        trip_volume_set_fills(in->volume, fills);
}

int trip_brick_input_find_fills(trip_brick_input *in, const trip_tally *t)
{
    return in->params->volume.fill
               ? 0
               : trip_typical_find_fills(t, in->info, &in->fills, in->params->input);
}

static int open_volume(trip_brick_input *in)
{
    char allowed[32];
    const trip_brick_params *p = in->params;
    int status = trip_budget_create(&in->budget, p->memory_bytes);
    if (status == 0)
        status = trip_workers_create(&in->workers, p->threads ? p->threads : choose_threads(in));
    if (status == 0)
        status = trip_volume_open(&in->volume, p->input, &p->volume, in->budget);
    if (status < 0)
        return status;
    in->info = trip_volume_get_info(in->volume);
    if (in->fills.count)
        trip_volume_set_fills(in->volume, &in->fills);
    in->grid_voxels = count_voxels(in->info->dims);
    in->tally = trip_budget_take(in->budget, sizeof *in->tally);
    if (!in->tally)
        return trip_fail(TRIP_ERROR, "brick", p->input,
                         "needs more memory than the %s allowed; raise --memory",
                         trip_format_bytes(trip_budget_limit_bytes(in->budget), allowed));
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
    trip_envelope_destroy(&in->ranks);
    if (in->budget)
        trip_ids_free(&in->ids, in->budget);
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
    const trip_tally *t = in->tally;
    double range = t->has_typical ? t->typical_max - t->typical_min : 0;
    if (in->ids.count && !in->ids.numbered)
        range = in->ids.count > 1 ? in->ids.count - 1 : 1;
    double voxel = cbrt(fabs(trip_affine_determinant(&in->info->index_to_world)));
    return TRIP_GRADIENT_FULL * (range > 0 ? range : hi - lo) / voxel;
}

bool trip_brick_choose_compact(const trip_brick_input *in, double full, double step[3])
{
    double unit = in->info->type < TRIP_F16 ? fabs(in->info->slope) / 2 : 0;
    unit = in->ids.count ? 0.5 : unit;
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

/* Values that are not integers of 32 or 64 bits can be ids too, if there is a scan. */
static bool needs_scan_for_ids(const trip_brick_input *in)
{
    const trip_scalar type = in->info->type;
    return type >= TRIP_U32 && type <= TRIP_I64 && trip_brick_input_may_have_ids(in);
}

bool trip_brick_input_may_have_ids(const trip_brick_input *in)
{
    return !in->info->sparse && !trip_brick_has_narrow_type(in) && in->info->type != TRIP_F16 &&
           in->params->code_bits != TRIP_CODE_BITS_8;
}

bool trip_brick_input_needs_scan(const trip_brick_input *in)
{
    bool needed = is_envelope_automatic(in->params) || depend_normals_on_range(in) ||
                  trip_brick_rounds_codes(in) || needs_scan_for_ids(in);
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

/* Lets the histogram know the ids. */
static void add_ids(trip_brick_input *in)
{
    in->histogram.ids = in->ids.values;
    in->histogram.id_count = in->ids.count;
}

static int on_scan_progress(void *user, uint64_t voxels)
{
    const trip_brick_input *in = user;
    trip_brick_input_progress(in, "scan", voxels, in->grid_voxels);
    return 0;
}

int trip_brick_input_finish_tally(trip_brick_input *in)
{
    trip_tally *t = in->tally;
    int status = 0;
    trip_histogram *h = &in->histogram;
    /* Labels have no outliers: a rare one may lie far from the others. */
    if (!t->has_typical) {
        trip_typical_set_whole(t);
        trip_tally_histogram(t, h);
        add_ids(in);
        if (trip_brick_kind(in->info, h) != TRIP_TF_LABELS)
            status = trip_typical_set(t, in->params->input);
    }
    trip_tally_histogram(t, h);
    add_ids(in);
    return status;
}

int trip_brick_input_set_tally(trip_brick_input *in, const trip_tally *known)
{
    if (known != in->tally)
        *in->tally = *known;
    in->scanned = true;
    int status = trip_brick_input_finish_tally(in);
    const trip_tf_data data = { in->tally->typical_min, in->tally->typical_max, &in->histogram,
                                trip_brick_kind(in->info, &in->histogram) };
    for (size_t i = 0; i < in->params->function_count && status == 0; i++)
        status = trip_tf_adapt(in->functions[i], &data, in->params->input);
    return status;
}

static int scan_again(trip_brick_input *in, const trip_scan_params *scan, trip_id_set *ids)
{
    trip_scan_params p = *scan;
    p.progress = on_scan_progress;
    p.user = in;
    p.ids = trip_brick_input_may_have_ids(in) ? ids : NULL;
    if (ids)
        trip_id_set_free(ids, in->budget);
    return trip_scan_volume(in->tally, in->volume, in->params->input, in->workers, &p, in->budget);
}

/* Scans the volume until no undeclared fill value is left. */
static int scan_without_fills(trip_brick_input *in, const trip_scan_params *scan, trip_id_set *ids)
{
    int status = scan_again(in, scan, ids), found = 0;
    while (status == 0 && (found = trip_brick_input_find_fills(in, in->tally)) > 0) {
        in->finite_before = in->finite_before ? in->finite_before : in->tally->finite;
        trip_volume_set_fills(in->volume, &in->fills);
        status = scan_again(in, scan, ids);
    }
    return status ? status : found;
}

/* Scans once more if some values stand far outside. The bins then are as fine as without them. */
static int scan_typical(trip_brick_input *in, const trip_scan_params *scan)
{
    trip_tally *t = in->tally;
    const double lo = t->value_min, hi = t->value_max;
    const uint64_t finite = t->finite;
    trip_scan_params p = *scan;
    int status = trip_brick_input_finish_tally(in);
    if (status < 0 || !(t->typical_min < t->typical_max) ||
        (t->typical_min == lo && t->typical_max == hi))
        return status;
    p.clip_min = t->typical_min;
    p.clip_max = t->typical_max;
    status = scan_again(in, &p, NULL);
    t->has_typical = 1;
    t->typical_min = t->value_min;
    t->typical_max = t->value_max;
    t->value_min = lo;
    t->value_max = hi;
    t->finite = finite;
    return status;
}

/* Returns whether even codes or floats would merge the distinct integers of the volume, and these
 * are labels by intent. */
static bool are_ids(const trip_brick_input *in, const trip_id_set *s)
{
    const trip_tally *t = in->tally;
    const double unit = in->info->type < TRIP_F16 ? fabs(in->info->slope) : 1;
    const double step = 1.5 * (t->value_max - t->value_min) / 65535;
    const bool merged =
        step >= unit / 2 || fmax(fabs(t->value_min), fabs(t->value_max)) >= 0x1p24 * unit;
    return !s->other && merged && (s->many || s->count > 0) && trip_id_set_coherent(s);
}

static int read_as_ids(trip_brick_input *in, const trip_id_set *s, const trip_scan_params *scan)
{
    int status = trip_ids_make(&in->ids, s, in->info, in->params->input, in->budget);
    if (status < 0)
        return status;
    trip_volume_set_ids(in->volume, &in->ids);
    in->memory_bytes = trip_budget_left_bytes(in->budget);
    if (!in->ids.numbered) {
        in->tally->value_min = in->ids.values[0];
        in->tally->value_max = in->ids.values[in->ids.count - 1];
        return 0;
    }
    char text[200];
    snprintf(
        text, sizeof text,
        "more than %d ids: each is stored as a number from 1 to %d made from it, which sets its "
        "colour",
        TRIP_IDS_MAX, TRIP_IDS_NUMBERS - 1);
    trip_volume_add_note(in->volume, text);
    return scan_again(in, scan, NULL);
}

int trip_brick_input_scan(trip_brick_input *in, trip_scan_params scan)
{
    trip_id_set set = { 0 };
    int status = scan_without_fills(in, &scan, &set);
    if (status == 0 && set.starved)
        status = trip_fail(TRIP_ERROR, "brick", in->params->input,
                           "its distinct values need more memory than --memory allows: raise "
                           "--memory");
    if (status == 0 && are_ids(in, &set))
        status = read_as_ids(in, &set, &scan);
    trip_id_set_free(&set, in->budget);
    if (status == 0)
        status = scan_typical(in, &scan);
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

static bool keeps_id(const trip_brick_input *in, const trip_tf *automatic, double id)
{
    const trip_brick_params *p = in->params;
    bool keeps = p->keep_all || (automatic && trip_tf_evaluate(automatic, id).opacity > 0);
    for (size_t i = 0; i < p->range_count; i++)
        keeps |= p->ranges[i].lo <= id && id <= p->ranges[i].hi;
    for (size_t i = 0; i < p->function_count; i++)
        keeps |= trip_tf_evaluate(in->functions[i], id).opacity > 0;
    return keeps;
}

/* Makes the envelope of the ranks of the kept ids. */
static int make_ranks(trip_brick_input *in)
{
    trip_tf *automatic = NULL;
    int status = 0;
    if (is_envelope_automatic(in->params))
        status = trip_tf_make_automatic(&automatic, trip_brick_kind(in->info, &in->histogram),
                                        &in->histogram);
    for (uint32_t i = 0, past; i < in->ids.count && status == 0; i = past) {
        past = i + 1;
        if (!keeps_id(in, automatic, in->ids.values[i]))
            continue;
        while (past < in->ids.count && keeps_id(in, automatic, in->ids.values[past]))
            past++;
        status = trip_envelope_add_range(&in->ranks, i, past - 1);
    }
    trip_tf_destroy(automatic);
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
    if (in->ids.count && !in->ids.numbered && status == 0)
        status = make_ranks(in);
    return status;
}
