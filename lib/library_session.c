#include "library_session.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "brick_command.h"
#include "computed_normals.h"
#include "dataset_join.h"
#include "dataset_normals.h"
#include "report.h"
#include "shade.h"

static const size_t table_bytes = 65536 * sizeof(trip_tf_entry);
static const size_t map_bytes = TRIP_CODES * sizeof(uint16_t);

enum { LEVELS = 1 + TRIP_DATASET_LEVELS_MAX };

/* Whether bricking dropped visible values of a part. Only examined if the caller wants this instead
 * of a warning. */
static bool find_missing(const session *s, const trip_tf *tf, const session_look *look)
{
    double range[2];
    bool missing = false;
    for (unsigned i = 0; i < s->part_count && look->missing; i++)
        missing = missing || trip_dataset_metadata_culled(s->texts[i], tf, range) >= 1;
    if (look->missing)
        *look->missing = missing;
    return missing;
}

/* Whether the user knows the part by its path. If not, it stands for a volume, and messages have
 * the volume's name. */
static bool is_named_by_path(const session *s, unsigned part)
{
    const char *path = s->parts[part]->path;
    return part || strncmp(s->input, path, strlen(path)) == 0;
}

static void warn_of_culled_values(const session *s, unsigned part, const trip_tf *tf,
                                  const session_look *look)
{
    const char *input = part ? s->parts[part]->path : s->input;
    double range[2], voxels = trip_dataset_metadata_culled(s->texts[part], tf, range);
    if (voxels < 1)
        return;
    double span[2];
    const bool named = look->window == 0 && !look->tf_text;
    trip_tf_visible_span(tf, s->data->header.value_min, s->data->header.value_max, span);
    char *command = brick_command(s->texts[part], input, is_named_by_path(s, part) ? NULL : input,
                                  look->tf, named ? NULL : span);
    trip_warn(input,
              "the transfer function reveals about %.0f voxels with values from %g to %g that "
              "bricking dropped; to keep them: %s",
              voxels, range[0], range[1], command ? command : "brick the volume again");
    free(command);
}

static void warn_of_lost_peak(const session *s, const trip_tf *tf)
{
    const trip_draw_codes *d = &s->draw;
    trip_draw_loss loss;
    trip_tf_point peak;
    if (trip_draw_codes_loss(d, tf, &loss))
        trip_warn(s->input,
                  "the transfer function changes from %.9g to %.9g, but post draws only %.2g steps "
                  "there, since the whole function spans %.9g to %.9g; narrow it, or use "
                  "--classify pre",
                  loss.lo, loss.hi, fmax(1, loss.codes), loss.first, loss.last);
    else if (trip_tf_lost_peak(tf, d->lo, d->hi, &peak))
        trip_warn(s->input,
                  "the transfer function has a peak at %.9g that is narrower than the %.3g between "
                  "two codes, so it is not drawn; make it wider",
                  peak.value, trip_draw_value_per_code(d));
}

/* Opacity o becomes 1 - (1 - o)^scale. */
static void scale_extinction(trip_tf_entry *table, double scale)
{
    if (scale > 0 && scale != 1)
        for (int code = 0; code < 65536; code++)
            table[code].extinction = (float)(table[code].extinction * scale);
}

int session_load_function(const session *s, const session_look *look, trip_tf **tf)
{
    int status = look->tf_text ? trip_tf_parse(tf, s->input, look->tf_text, strlen(look->tf_text))
                 : look->tf    ? trip_tf_load(tf, look->tf)
                               : trip_dataset_metadata_tf(s->text, s->data, tf);
    bool window = look->window > 0;
    if (!status && !(window && trip_tf_spans_window(*tf))) /* a window replaces the range */
        status = trip_dataset_metadata_adapt(s->text, s->data, *tf, s->input);
    return !status && window ? trip_tf_window(*tf, look->window, look->level) : status;
}

static void release_tables(session *s)
{
    trip_budget_release(s->budget, s->table, table_bytes);
    trip_budget_release(s->budget, s->draw_table, table_bytes);
    trip_budget_release(s->budget, s->draw_map, map_bytes);
    s->table = s->draw_table = NULL;
    s->draw_map = NULL;
}

static int take_tables(session *s)
{
    const bool even = trip_codes_even(&s->data->codes);
    s->table = trip_budget_take(s->budget, table_bytes);
    if (!even)
        s->draw_table = trip_budget_take(s->budget, table_bytes);
    if (!even)
        s->draw_map = trip_budget_take(s->budget, map_bytes);
    if (s->table && (even || (s->draw_table && s->draw_map)))
        return 0;
    release_tables(s);
    return trip_fail(TRIP_ERROR, "render", s->input,
                     "the table of the transfer function does not fit in memory; raise --memory");
}

int session_read_text(session *s)
{
    int status = 0;
    for (unsigned i = 0; i < s->part_count && !status; i++)
        if (!s->texts[i])
            status = trip_dataset_metadata_parse(&s->texts[i], s->parts[i]);
    s->text = s->texts[0];
    return status;
}

const trip_tf_entry *session_table(const session *s, bool interpolates)
{
    return interpolates && s->draw_table ? s->draw_table : s->table;
}

trip_classification *session_classified(const session *s, unsigned level)
{
    return &s->classified[level];
}

void session_keep_tables(session *s)
{
    enum { SMALL_PART = 8 };
    if (trip_mean_tables_bytes(&s->mean_tables) > trip_budget_left_bytes(s->budget) / SMALL_PART)
        trip_mean_tables_release(&s->mean_tables, s->budget);
}

static void fill_tables(session *s, const trip_tf *tf, double opacity_scale)
{
    const double voxel_world = cbrt(fabs(trip_affine_determinant(&s->data->index_to_world)));
    const double typical[2] = { s->data->header.typical_min, s->data->header.typical_max };
    s->draw = trip_draw_codes_for(tf, &s->data->codes, typical, s->draw_map);
    s->shading_range = TRIP_SHADING_WIDTHS * trip_draw_codes_changing(tf);
    trip_draw_codes_stored_table(&s->draw, tf, voxel_world, s->table);
    scale_extinction(s->table, opacity_scale);
    if (!s->draw_table)
        return;
    trip_draw_codes_table(&s->draw, tf, voxel_world, s->draw_table);
    scale_extinction(s->draw_table, opacity_scale);
}

int session_use_function(session *s, const session_look *look)
{
    const trip_file_header *h = &s->data->header;
    trip_tf *tf = NULL;
    int status = session_read_text(s);
    for (int i = 0; i < LEVELS; i++) {
        trip_classification_forget_table(&s->classified[i]);
        s->classified[i].draw = &s->draw;
    }
    trip_mean_tables_release(&s->mean_tables, s->budget);
    if (!status && !s->table)
        status = take_tables(s);
    if (!status)
        status = session_load_function(s, look, &tf);
    if (!status && !find_missing(s, tf, look)) {
        trip_tf_check_range(tf, h->typical_min, h->typical_max, s->input);
        for (unsigned i = 0; i < s->part_count; i++)
            warn_of_culled_values(s, i, tf, look);
        fill_tables(s, tf, look->opacity_scale);
        warn_of_lost_peak(s, tf);
    }
    trip_tf_destroy(tf);
    return status;
}

void session_lend_function(session *to, const session *from)
{
    to->table = from->table;
    to->draw_table = from->draw_table;
    to->draw_map = from->draw_map;
    to->draw = from->draw;
    to->shading_range = from->shading_range;
    for (int i = 0; i < LEVELS; i++)
        to->classified[i].draw = &to->draw;
}

void session_return_function(session *s)
{
    s->table = s->draw_table = NULL;
    s->draw_map = NULL;
}

/* Opens another data set, without drawing it yet. */
static int open_part(session *s, const char *input)
{
    trip_dataset **parts = realloc(s->parts, (s->part_count + 1) * sizeof *parts);
    s->parts = parts ? parts : s->parts;
    trip_dataset_metadata **texts = realloc(s->texts, (s->part_count + 1) * sizeof *texts);
    s->texts = texts ? texts : s->texts;
    if (!parts || !texts)
        return trip_fail(TRIP_ERROR, "open", input, "out of memory");
    texts[s->part_count] = NULL;
    int status = trip_dataset_open(&parts[s->part_count], input, s->budget);
    s->part_count += status == 0;
    return status;
}

/* Sets the data set that is drawn. It has normals, stored or computed. */
static int use_data(session *s, trip_dataset *data)
{
    trip_dataset *with = NULL;
    int status = 0;
    if (!(data->header.planes >> TRIP_PLANE_NORMALS & 1))
        status = trip_dataset_normals_open(&with, data, s->budget);
    if (status)
        return status;
    trip_dataset_normals_close(s->with_normals);
    s->with_normals = with;
    s->data = with ? with : data;
    return 0;
}

int session_open_data(session *s, const char *input, uint64_t memory_bytes)
{
    *s = (session){ .input = input };
    int status = trip_budget_create(&s->budget, memory_bytes);
    s->classified = calloc(LEVELS, sizeof *s->classified);
    if (!status && !s->classified)
        status = trip_fail(TRIP_ERROR, "open", input, "out of memory");
    if (!status)
        status = open_part(s, input);
    return status ? status : use_data(s, s->parts[0]);
}

/* Fails if the last part is made of another volume than the first one. One
 * transfer function cannot show both, even if the grids are equal. */
static int check_source(session *s)
{
    const unsigned last = s->part_count - 1;
    int status = session_read_text(s);
    if (status)
        return status;
    const char *first = trip_dataset_metadata_source(s->texts[0]);
    const char *other = trip_dataset_metadata_source(s->texts[last]);
    if (!first || !other || !strcmp(first, other))
        return 0;
    return trip_fail(TRIP_ERROR, "open", s->parts[last]->path,
                     "is made of another volume (%s) than %s (%s); " TRIP_JOIN_ADVICE, other,
                     s->parts[0]->path, first);
}

static void drop_last_part(session *s)
{
    s->part_count--;
    trip_dataset_metadata_destroy(s->texts[s->part_count]);
    trip_dataset_close(s->parts[s->part_count]);
}

int session_add_data(session *s, const char *input)
{
    trip_dataset *joined = NULL;
    int status = open_part(s, input);
    if (status)
        return status;
    status = trip_dataset_join(&joined, s->parts, s->part_count, s->budget);
    if (!status)
        status = check_source(s);
    if (!status)
        status = use_data(s, joined);
    if (status) {
        trip_dataset_join_close(joined);
        drop_last_part(s);
        return status;
    }
    trip_dataset_join_close(s->joined);
    s->joined = joined;
    memset(s->classified, 0, LEVELS * sizeof *s->classified);
    trip_mean_tables_release(&s->mean_tables, s->budget);
    return 0;
}

const char *session_needs_splats(const session *s)
{
    const trip_file_header *h = &s->data->header;
    if (h->dims[0] < 2 || h->dims[1] < 2 || h->dims[2] < 2)
        return "the grid is one voxel thick";
    if (h->halo == 0 && h->kept < h->dims[0] * h->dims[1] * h->dims[2])
        return "voxels were dropped, and the data set has no halo";
    return NULL;
}

int session_open(session *s, const char *input, const session_look *look, uint64_t memory_bytes)
{
    int status = session_open_data(s, input, memory_bytes);
    return status ? status : session_use_function(s, look);
}

void session_close(session *s)
{
    if (s->budget)
        release_tables(s);
    if (s->budget)
        trip_mean_tables_release(&s->mean_tables, s->budget);
    trip_dataset_normals_close(s->with_normals);
    trip_dataset_join_close(s->joined);
    for (unsigned i = 0; i < s->part_count; i++) {
        trip_dataset_metadata_destroy(s->texts[i]);
        trip_dataset_close(s->parts[i]);
    }
    free(s->parts);
    free(s->texts);
    free(s->classified);
    if (s->budget)
        trip_budget_destroy(s->budget);
    *s = (session){ 0 };
}

/* Returns the renderer's memory for the ring. Returns NULL if the renderer has none, or if the
 * engine cannot read into it. */
static void *const *take_slots(const session *s, const session_reader *wanted, unsigned count,
                               size_t bytes)
{
    trip_renderer *r = wanted->renderer;
    void *const *slots = r && r->ops->take_slots ? r->ops->take_slots(r, count, bytes) : NULL;
    if (!slots || trip_reader_probe(s->data, wanted->engine, slots[0]))
        return slots;
    r->ops->drop_slots(r);
    return NULL;
}

enum { SLOTS = 8, MAX_SLOTS = 16, MAX_SLOT_BYTES = 512 << 10 };

/* Slots are handed out in order, so one late read delays the slots behind it. More slots keep more
 * reads running meanwhile. With `skip`, fewer slots avoid reading blocks that later turn out to be
 * occluded. */
static unsigned choose_slots(const session_reader *wanted, uint64_t ring_bytes, size_t plane_count)
{
    bool fit = ring_bytes / MAX_SLOTS / plane_count >= MAX_SLOT_BYTES;
    return fit && !wanted->skip ? MAX_SLOTS : SLOTS;
}

static bool computes_normals(const session *s, const session_reader *wanted)
{
    return s->data->computes_normals && wanted->planes >> TRIP_PLANE_NORMALS & 1;
}

int session_make_reader(const session *s, trip_reader **out, const session_reader *wanted)
{
    uint64_t left = trip_budget_left_bytes(s->budget);
    const bool computes = computes_normals(s, wanted);
    const uint64_t own = computes ? trip_computed_normals_bytes(s->data) : 0;
    left -= own < left ? own : left;
    size_t page = (size_t)1 << s->data->header.page_log2;
    size_t plane_count = wanted->planes & 1u << TRIP_PLANE_NORMALS && !computes ? 2 : 1;
    unsigned slots = choose_slots(wanted, left / 4, plane_count);
    size_t slot = (size_t)(left / 4) / slots / page * page, max = MAX_SLOT_BYTES * plane_count;
    slot = slot < page ? page : slot;
    trip_reader_params params = {
        .engine = wanted->engine,
        .planes = wanted->planes,
        .slots = slots,
        .slot_bytes =
            trip_reader_slot_bytes(s->data, wanted->planes, slot < max || page > max ? slot : max),
        .threads = (unsigned)wanted->threads,
        .skip = wanted->skip,
        .skip_user = wanted->skip_user,
        .cache_bytes = wanted->cache ? (size_t)(left / 2) : 0,
    };
    if (wanted->renderer)
        params.runner = trip_renderer_runner(wanted->renderer);
    if (!computes) /* runs with computed normals lie in memory of the reader */
        params.slot_memory = take_slots(s, wanted, params.slots, params.slot_bytes);
    return trip_reader_create(out, s->data, &params, s->budget);
}

static size_t image_bytes(int width, int height)
{
    return (size_t)width * (size_t)height * 4 * sizeof(float);
}

int session_take_image(const session *s, int width, int height, float **rgba)
{
    *rgba = trip_budget_take(s->budget, image_bytes(width, height));
    if (*rgba)
        return 0;
    return trip_fail(
        TRIP_ERROR, "render", s->input,
        "a picture of %d x %d pixels does not fit in memory; raise --memory or lower --size", width,
        height);
}

void session_release_image(const session *s, int width, int height, float *rgba)
{
    if (rgba)
        trip_budget_release(s->budget, rgba, image_bytes(width, height));
}
