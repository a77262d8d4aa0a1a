/* Makes data sets of volumes (triptych_brick.h). */
#include "triptych_brick.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "anatomy.h"
#include "brick.h"
#include "brick_metadata.h"
#include "estimate.h"
#include "gaussian_file.h"
#include "gaussian_format.h"
#include "glance.h"
#include "library_context.h"
#include "library_points.h"
#include "point_file.h"
#include "identity.h"
#include "report.h"
#include "source.h"
#include "source_field.h"
#include "volume.h"

/* The volume must be free of faults. */
static trip_volume_memory memory_of(const triptych_volume *v)
{
    trip_volume_memory m = { .type = (trip_scalar)trip_scalar_from_name(v->type),
                             .data = v->data,
                             .read_slices = v->data ? NULL : v->read_slices,
                             .user = v->user };
    int64_t dense = trip_scalar_bytes(m.type);
    for (int a = 0; a < 3; a++) {
        m.dims[a] = v->dims[a];
        m.stride_bytes[a] = v->stride_bytes[a] ? v->stride_bytes[a] : dense;
        dense *= v->dims[a];
    }
    memcpy(m.index_to_world.m, v->index_to_world, sizeof m.index_to_world.m);
    return m;
}

static trip_volume_params volume_params(const triptych_brick_options *o)
{
    trip_volume_params p = {
        .grid = o->grid,
        .level_set = (trip_level_set_mode)o->level_set,
        .raw_dims = { o->raw_dims[0], o->raw_dims[1], o->raw_dims[2] },
        .raw_type = o->raw_type,
        .coordinates = o->coordinates,
        .spacing = { o->spacing[0], o->spacing[1], o->spacing[2] },
        .raw_endian = (int)o->raw_endian,
        .raw_offset_bytes = o->raw_offset_bytes,
        .axes = o->axes,
        .allow_gaps = o->allow_gaps,
        .series = o->series,
        .channel = o->channel,
        .time = o->time,
        .fill = o->fill,
        .max_voxels = o->max_voxels,
    };
    if (o->in_memory)
        p.memory = memory_of(o->in_memory);
    return p;
}

static trip_region region_of(const triptych_brick_options *o)
{
    return (trip_region){
        .first = { o->region_first[0], o->region_first[1], o->region_first[2] },
        .past = { o->region_past[0], o->region_past[1], o->region_past[2] },
    };
}

/* `ranges` has the ranges of the options in the type of the bricker. */
static trip_brick_params brick_params(triptych *t, const char *volume,
                                      const triptych_brick_options *o,
                                      const trip_value_range *ranges)
{
    return (trip_brick_params){
        .input = volume,
        .volume = volume_params(o),
        .functions = o->functions,
        .function_count = o->function_count,
        .ranges = ranges,
        .range_count = o->range_count,
        .keep_all = o->keep_all,
        .automatic = o->automatic,
        .region = region_of(o),
        .code_bits = (trip_brick_code_bits)o->code_bits,
        .normals = (trip_brick_normals)o->normals,
        .no_halo = o->no_halo,
        .levels = o->levels,
        .levels_for = (trip_brick_levels_for)o->levels_for,
        .replace = o->replace,
        .resume = o->resume,
        .tile_voxels = o->tile_voxels,
        .slab_sheets = o->slab_sheets,
        .memory_bytes = o->memory_bytes,
        .threads = trip_context_threads(o->threads),
        .max_bytes = o->max_bytes,
        .progress = t->show ? trip_context_show_stage : NULL,
        .progress_user = t,
    };
}

/* Returns whether all values and their strides span less than 2^63 bytes. */
static bool is_addressable(const triptych_volume *v)
{
    int64_t size = trip_scalar_bytes((trip_scalar)trip_scalar_from_name(v->type)), span = size;
    bool possible = true;
    for (int a = 0; a < 3 && possible; a++) {
        int64_t stride = v->stride_bytes[a], extent;
        possible = !__builtin_mul_overflow(size, v->dims[a], &size) && stride > INT64_MIN &&
                   !__builtin_mul_overflow(llabs(stride), v->dims[a] - 1, &extent) &&
                   !__builtin_add_overflow(span, extent, &span);
    }
    return possible;
}

static const char *fault_of_memory(const triptych_volume *v)
{
    if (!v->type || !triptych_is_raw_type(v->type))
        return "unknown type of a volume in memory; use uint8, int16, float, ...";
    if (v->dims[0] < 1 || v->dims[1] < 1 || v->dims[2] < 1)
        return "a volume in memory must have at least one voxel along each axis";
    if (!v->data && !v->read_slices)
        return "a volume in memory needs data or read_slices()";
    if (!is_addressable(v))
        return "a volume in memory must span less than 2^63 bytes";
    const int64_t *s = v->stride_bytes;
    if ((s[0] || s[1] || s[2]) && (!s[0] || !s[1] || !s[2]))
        return "the strides of a volume in memory must be all 0 or none";
    return NULL;
}

/* Must return NULL before volume_params() may be called. */
static const char *fault_of_volume(const triptych_brick_options *o)
{
    const char *fault = o->in_memory ? fault_of_memory(o->in_memory) : NULL;
    if (fault)
        return fault;
    for (int a = 0; a < 3; a++) {
        if (!(o->spacing[a] >= 0 && isfinite(o->spacing[a])))
            return "the spacing of voxels must be finite and at least 0";
        if (o->raw_dims[a] < 0 || o->raw_dims[a] > INT32_MAX)
            return "raw data must have 1 to 2147483647 voxels along each axis";
    }
    if (o->axes && !trip_anatomy_axes_valid(o->axes))
        return "the axes must be three letters: one of R and L, one of A and P, one of S and I";
    trip_fills fills;
    if (o->fill && !trip_fills_parse(o->fill, &fills))
        return "the fill value must be a number or \"none\"";
    if (o->raw_type && !triptych_is_raw_type(o->raw_type))
        return "unknown type of raw data";
    if (o->raw_offset_bytes > UINT64_C(1) << 62)
        return "raw data starts too far into the file";
    if (o->series < 0 || o->channel < 0 || o->time < 0)
        return "series, channels and times count from 0";
    if (o->level_set < TRIPTYCH_LEVEL_SET_DEFAULT || o->level_set > TRIPTYCH_LEVEL_SET_BAND ||
        o->raw_endian < TRIPTYCH_ENDIAN_NATIVE || o->raw_endian > TRIPTYCH_ENDIAN_BIG)
        return "unknown level set or byte order";
    return NULL;
}

static const char *fault_of_options(const triptych_brick_options *o)
{
    unsigned tile = o->tile_voxels;
    if (tile && tile != 16 && tile != 32 && tile != 64 && tile != 128)
        return "the edge of a tile must be 16, 32, 64 or 128 voxels";
    if (o->slab_sheets > 64)
        return "a brick must have 1 to 64 sheets";
    if (o->code_bits < TRIPTYCH_CODE_BITS_AUTO || o->code_bits > TRIPTYCH_CODE_BITS_16)
        return "codes must have 8 or 16 bits";
    if (o->normals < TRIPTYCH_NORMALS_AUTO || o->normals > TRIPTYCH_NORMALS_STORED)
        return "unknown kind of normals";
    if (o->levels_for < TRIPTYCH_LEVELS_FOR_AUTO || o->levels_for > TRIPTYCH_LEVELS_FOR_BOTH)
        return "coarse levels must be for post, pre or both";
    if (o->harmonics)
        return "stored harmonics apply to Gaussian scenes only";
    if (o->no_halo &&
        (o->levels_for == TRIPTYCH_LEVELS_FOR_POST || o->levels_for == TRIPTYCH_LEVELS_FOR_BOTH))
        return "coarse levels for post require the halo";
    if (o->in_memory && o->resume)
        return "a volume in memory cannot be resumed, since nothing tells whether it changed";
    for (size_t i = 0; i < o->range_count; i++)
        if (!(o->ranges[i].lo <= o->ranges[i].hi))
            return "a range has its minimum above its maximum";
    return fault_of_volume(o);
}

/* Makes the parameters of bricking. Free *ranges with free(). */
static int make_params(triptych *t, const char *volume, const triptych_brick_options *options,
                       trip_value_range **ranges, trip_brick_params *out)
{
    const triptych_brick_options o = options ? *options : (triptych_brick_options){ 0 };
    const char *fault = fault_of_options(&o);
    int status = trip_context_check_idle(t, false);
    *ranges = NULL;
    *out = (trip_brick_params){ .input = volume };
    if (!status && fault)
        status = trip_fail(TRIP_USAGE, "brick", volume, "%s", fault);
    if (!status && !(*ranges = calloc(o.range_count + 1, sizeof **ranges)))
        status = trip_fail(TRIP_ERROR, "brick", volume, "out of memory");
    for (size_t i = 0; i < o.range_count && !status; i++)
        (*ranges)[i] = (trip_value_range){ o.ranges[i].lo, o.ranges[i].hi };
    if (!status)
        *out = brick_params(t, volume, &o, *ranges);
    return status;
}

static triptych_brick_summary summary_of(const trip_brick_summary *s)
{
    triptych_brick_summary out = {
        .value_min = s->value_min,
        .value_max = s->value_max,
        .voxels = s->voxels,
        .kept = s->kept,
        .halo = s->halo,
        .not_finite = s->not_finite,
        .code_bytes = s->code_bytes,
        .normal_bytes = s->normal_bytes,
        .kind = trip_tf_kind_name(s->kind),
        .kind_title = trip_tf_kind_title(s->kind),
        .input_bytes = s->input_bytes,
        .bytes = s->bytes,
        .halo_bytes = s->halo_bytes,
        .level_bytes = s->level_bytes,
        .levels = s->levels,
        .temporary_bytes = s->temporary_bytes,
        .resumed = s->resumed,
        .memory_bytes = s->memory_bytes,
        .peak_memory_bytes = s->peak_memory_bytes,
    };
    for (int a = 0; a < 3; a++) {
        out.dims[a] = s->dims[a];
        out.spacing[a] = s->spacing[a];
    }
    for (int i = 0; i < TRIPTYCH_STAGES; i++)
        out.stages[i] = (triptych_brick_stage){ s->stages[i].seconds, s->stages[i].bytes_read,
                                                s->stages[i].bytes_written };
    snprintf(out.note, sizeof out.note, "%s", s->note);
    return out;
}

int triptych_brick(triptych *t, const char *volume, const char *data_set,
                   const triptych_brick_options *options, triptych_brick_summary *summary)
{
    trip_scope *before = trip_context_enter_anew(t);
    trip_value_range *ranges;
    trip_brick_params params;
    trip_brick_summary made = { 0 };
    int status = make_params(t, volume, options, &ranges, &params);
    params.output = data_set;
    if (!status && options)
        status = trip_context_check_no_points(volume, options);
    if (!status)
        status = trip_brick(&params, &made);
    if (summary)
        *summary = status ? (triptych_brick_summary){ 0 } : summary_of(&made);
    free(ranges);
    return trip_context_leave(before, status);
}

int triptych_estimate(triptych *t, const char *volume, const char *data_set,
                      const triptych_brick_options *options, triptych_brick_estimate *out)
{
    trip_scope *before = trip_context_enter_anew(t);
    trip_value_range *ranges;
    trip_brick_params params;
    trip_brick_estimate e = { 0 };
    int status = make_params(t, volume, options, &ranges, &params);
    params.output = data_set;
    if (!status && options)
        status = trip_context_check_no_points(volume, options);
    if (!status)
        status = trip_brick_estimate_make(&params, &e);
    *out = (triptych_brick_estimate){ 0 };
    if (!status)
        *out = (triptych_brick_estimate){ e.voxels,          e.kept,       e.halo,   e.bytes,
                                          e.temporary_bytes, e.free_bytes, e.seconds };
    free(ranges);
    return trip_context_leave(before, status);
}

static void show_bytes(void *user, uint64_t done, uint64_t total)
{
    trip_context_show_stage(user, "look", done, total);
}

/* Raise this with every change that makes the same scene give another data set. */
enum { GAUSSIAN_BRICKER_VERSION = 3, POINT_BRICKER_VERSION = 1 };

static int describe_scene_form(const trip_brick_params *params, char **text)
{
    if (asprintf(text, "gaussians %d %d\n", GAUSSIAN_BRICKER_VERSION, TRIP_GAUSSIAN_VERSION) >= 0)
        return 0;
    *text = NULL;
    return trip_fail(TRIP_ERROR, "brick", params->input, "out of memory");
}

typedef enum kind_of_input { A_VOLUME, A_SCENE, A_CLOUD } kind_of_input;

static kind_of_input kind_of(const char *input)
{
    return trip_gaussian_file_is(input) ? A_SCENE : trip_point_file_is(input) ? A_CLOUD : A_VOLUME;
}

static int describe_cloud_form(const char *input, const triptych_brick_options *o, char **text)
{
    char options[256];
    const int status = trip_context_describe_points_form(input, o, options);
    if (status < 0)
        return status;
    if (asprintf(text, "%s%d %d %d\n", options, POINT_BRICKER_VERSION, GAUSSIAN_BRICKER_VERSION,
                 TRIP_GAUSSIAN_VERSION) >= 0)
        return 0;
    *text = NULL;
    return trip_fail(TRIP_ERROR, "brick", input, "out of memory");
}

/* Describes the options and the version of the program, since another version may make a different
 * data set of the same volume. */
static int describe_form(const trip_brick_params *params, const triptych_brick_options *o,
                         char **text)
{
    char *form = NULL;
    const kind_of_input kind = kind_of(params->input);
    int status = kind == A_SCENE   ? describe_scene_form(params, &form)
                 : kind == A_CLOUD ? describe_cloud_form(params->input, o, &form)
                                   : trip_brick_form_text(params, &form);
    if (status)
        return status;
    int length = asprintf(text, "%s" TRIP_VERSION "\n", form);
    free(form);
    if (length >= 0)
        return 0;
    *text = NULL;
    return trip_fail(TRIP_ERROR, "brick", params->input, "out of memory");
}

static int identify_kept(const trip_brick_params *params, triptych_identity *out)
{
    char *text = NULL;
    const bool is_volume = kind_of(params->input) == A_VOLUME; /* a scene keeps all it has */
    int status =
        is_volume ? trip_brick_kept_text(params, &text) : describe_scene_form(params, &text);
    if (status)
        return status;
    const trip_digest kept = trip_source_digest_text(text);
    memcpy(out->kept, kept.text, sizeof out->kept);
    free(text);
    return 0;
}

static int identify(triptych *t, const trip_brick_params *params, const triptych_brick_options *o,
                    uint64_t max_content_bytes, triptych_identity *out)
{
    trip_source source = { 0 };
    trip_digest state = { "" }, content = { "" };
    char *text = NULL;
    int status =
        kind_of(params->input) == A_CLOUD ? 0 : trip_context_check_no_points(params->input, o);
    if (!status)
        status = trip_context_find_files(&source, params->input, &params->volume);
    if (!status)
        status = describe_form(params, o, &text);
    if (!status)
        status = identify_kept(params, out);
    if (!status)
        status = trip_source_digest_state(&source, text, &state);
    out->stable = !status && trip_source_is_stable(&source); /* before the content is read */
    if (!status && max_content_bytes > 0 && source.bytes <= max_content_bytes)
        status =
            trip_source_digest_content(&source, text, &content, t->show ? show_bytes : NULL, t);
    out->bytes = source.bytes;
    memcpy(out->state, state.text, sizeof out->state);
    memcpy(out->content, content.text, sizeof out->content);
    trip_source_free(&source);
    free(text);
    return status;
}

int triptych_identify(triptych *t, const char *volume, const triptych_brick_options *options,
                      uint64_t max_content_bytes, triptych_identity *out)
{
    trip_scope *before = trip_context_enter_anew(t);
    trip_value_range *ranges;
    trip_brick_params params;
    *out = (triptych_identity){ 0 };
    int status = make_params(t, volume, options, &ranges, &params);
    if (!status && options && options->in_memory)
        status = trip_fail(TRIP_USAGE, "brick", volume, "a volume in memory has no identity");
    if (!status)
        status = identify(t, &params, options ? options : &(triptych_brick_options){ 0 },
                          max_content_bytes, out);
    free(ranges);
    return trip_context_leave(before, status);
}

static int list_files(const char *volume, const triptych_brick_options *o,
                      int (*found)(void *user, const char *path), void *user)
{
    const char *fault = fault_of_volume(o);
    trip_source source = { 0 };
    if (fault)
        return trip_fail(TRIP_USAGE, "read", volume, "%s", fault);
    const trip_volume_params params = volume_params(o);
    int status = trip_context_find_files(&source, volume, &params);
    for (size_t i = 0; i < source.count && status >= 0; i++)
        status = found(user, source.files[i].path);
    trip_source_free(&source);
    return status < 0 ? status : 0;
}

int triptych_list_files(triptych *t, const char *volume, const triptych_brick_options *options,
                        int (*found)(void *user, const char *path), void *user)
{
    trip_scope *before = trip_context_enter_anew(t);
    const triptych_brick_options defaults = { 0 };
    return trip_context_leave(before,
                              list_files(volume, options ? options : &defaults, found, user));
}

/* Calls found(user, LINE) for each line of a text, which it cuts into lines. */
static int each_line(char *text, triptych_text_callback found, void *user)
{
    int status = 0;
    for (char *line = text, *end; line && *line && status >= 0; line = end) {
        end = strchr(line, '\n');
        if (end)
            *end++ = 0;
        status = found(user, line);
    }
    return status < 0 ? status : 0;
}

static triptych_description description_of(const trip_volume_info *info,
                                           const trip_volume_params *params)
{
    triptych_description d = { .format = info->format, .type = trip_scalar_name(info->type) };
    for (int a = 0; a < 3; a++) {
        const double step =
            trip_length(trip_v3(info->index_to_world.m[0][a], info->index_to_world.m[1][a],
                                info->index_to_world.m[2][a]));
        const double *x = info->coordinates[a];
        d.dims[a] = info->dims[a];
        d.spacing_min[a] = d.spacing_max[a] = step;
        for (int64_t i = 1; x && i < info->dims[a]; i++) {
            const double apart = (x[i] - x[i - 1]) * step;
            d.spacing_min[a] = i == 1 ? apart : fmin(d.spacing_min[a], apart);
            d.spacing_max[a] = i == 1 ? apart : fmax(d.spacing_max[a], apart);
        }
    }
    memcpy(d.index_to_world, info->index_to_world.m, sizeof d.index_to_world);
    snprintf(d.space, sizeof d.space, "%s", info->space);
    d.orientation = trip_brick_orientation(info, params);
    snprintf(d.grid, sizeof d.grid, "%s", info->name);
    snprintf(d.modality, sizeof d.modality, "%s", info->modality);
    snprintf(d.note, sizeof d.note, "%s", info->note);
    return d;
}

typedef struct opened_volume {
    trip_budget *budget;
    trip_volume *volume;
} opened_volume;

static int open_volume(opened_volume *v, const char *path, const triptych_brick_options *o)
{
    const char *fault = fault_of_volume(o);
    *v = (opened_volume){ 0 };
    if (fault)
        return trip_fail(TRIP_USAGE, "read", path, "%s", fault);
    const trip_volume_params params = volume_params(o);
    int status = trip_budget_create(&v->budget, o->memory_bytes);
    return status ? status : trip_volume_open(&v->volume, path, &params, v->budget);
}

static void close_volume(opened_volume *v)
{
    trip_volume_close(v->volume);
    if (v->budget)
        trip_budget_destroy(v->budget);
}

static int describe(const char *path, const triptych_brick_options *o, triptych_description *out,
                    triptych_text_callback series, void *user)
{
    opened_volume v;
    int status = open_volume(&v, path, o);
    const trip_volume_info *info = status ? NULL : trip_volume_get_info(v.volume);
    const trip_volume_params params = status ? (trip_volume_params){ 0 } : volume_params(o);
    if (!status)
        *out = description_of(info, &params);
    char *parts = info ? info->parts : NULL;
    if (parts && series && !(parts = strdup(parts)))
        status = trip_fail(TRIP_ERROR, "read", path, "out of memory");
    else if (parts && series) {
        status = each_line(parts, series, user);
        free(parts);
    }
    close_volume(&v);
    return status;
}

int triptych_describe(triptych *t, const char *volume, const triptych_brick_options *options,
                      triptych_description *out, triptych_text_callback series, void *user)
{
    trip_scope *before = trip_context_enter_anew(t);
    const triptych_brick_options defaults = { 0 };
    *out = (triptych_description){ 0 };
    return trip_context_leave(before,
                              describe(volume, options ? options : &defaults, out, series, user));
}

static int sample_values(const char *path, const triptych_brick_options *o, triptych_values *out)
{
    opened_volume v;
    trip_glance g = { 0 };
    int status = open_volume(&v, path, o);
    if (!status)
        status = trip_glance_at(&g, v.volume, path, v.budget);
    if (!status)
        *out = (triptych_values){ .share = g.share,
                                  .value_min = g.value_min,
                                  .value_max = g.value_max,
                                  .typical_min = g.typical_min,
                                  .typical_max = g.typical_max,
                                  .fill_count = o->fill ? 0 : (unsigned)g.fills.count };
    if (!status)
        memcpy(out->fills, g.fills.values, sizeof out->fills);
    close_volume(&v);
    return status;
}

int triptych_sample_values(triptych *t, const char *volume, const triptych_brick_options *options,
                           triptych_values *out)
{
    trip_scope *before = trip_context_enter_anew(t);
    const triptych_brick_options defaults = { 0 };
    *out = (triptych_values){ 0 };
    return trip_context_leave(before, sample_values(volume, options ? options : &defaults, out));
}

static int use_source(triptych *t, const char *path, const triptych_brick_options *o)
{
    const char *fault = fault_of_volume(o);
    int status = trip_context_check_idle(t, true);
    if (!status)
        status = trip_context_check_volume(t);
    if (!status && fault)
        status = trip_fail(TRIP_USAGE, "read", path, "%s", fault);
    if (!status && t->resources.renderer != TRIPTYCH_RENDERER_INTEGRAL)
        status = trip_fail(TRIP_USAGE, "render", path,
                           "only the integral renderer draws the values of a volume itself; use "
                           "--renderer integral");
    if (status)
        return status;
    const trip_volume_params params = volume_params(o);
    trip_context_drop_renderer(t); /* since its field would take as much memory again */
    trip_field_destroy(t->source);
    return trip_source_field_read(&t->source, t->session.data, path, &params, t->session.budget);
}

int triptych_set_source(triptych *t, const char *volume, const triptych_brick_options *options)
{
    trip_scope *before = trip_context_enter_anew(t);
    const triptych_brick_options defaults = { 0 };
    return trip_context_leave(before, use_source(t, volume, options ? options : &defaults));
}

int triptych_is_raw_type(const char *name)
{
    return trip_scalar_from_name(name) >= 0;
}
