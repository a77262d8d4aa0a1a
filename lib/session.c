#include "session.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "brick_command.h"
#include "report.h"

static const size_t table_bytes = 65536 * sizeof(trip_tf_entry);

/* Whether values which show were left out, where the caller wants that in place of a warning. */
static bool find_missing(const session *s, const trip_tf *tf, const session_look *look)
{
    double range[2];
    if (look->missing)
        *look->missing = trip_dataset_text_culled(s->text, tf, range) >= 1;
    return look->missing && *look->missing;
}

static void warn_of_culled_values(const session *s, const trip_tf *tf, const session_look *look)
{
    double range[2], voxels = trip_dataset_text_culled(s->text, tf, range);
    if (voxels < 1)
        return;
    double span[2];
    trip_tf_visible_span(tf, s->data->header.value_min, s->data->header.value_max, span);
    char *command = brick_command(s->text, s->input, look->tf, look->window > 0 ? span : NULL);
    trip_warn(s->input,
              "the transfer function shows about %.0f voxels with values from %g to %g that were "
              "left out when the data set was made; to have them: %s",
              voxels, range[0], range[1], command ? command : "brick it again");
    free(command);
}

/* An opacity o becomes 1 - (1 - o)^scale. */
static void warn_of_lost_peak(const session *s, const trip_tf *tf)
{
    const trip_file_header *h = &s->data->header;
    trip_tf_point peak;
    if (trip_tf_lost_peak(tf, h->code_lo, h->code_hi, &peak))
        trip_warn(s->input,
                  "the transfer function has a peak at %.9g that is narrower than the %.3g between "
                  "two codes of the data: it is not shown; make it wider",
                  peak.value, (h->code_hi - h->code_lo) / 65535);
}

static void scale_extinction(trip_tf_entry *table, double scale)
{
    if (scale > 0 && scale != 1)
        for (int code = 0; code < 65536; code++)
            table[code].extinction = (float)(table[code].extinction * scale);
}

/* The function in data units, with its window. */
static int load_function(const session *s, const session_look *look, trip_tf **tf)
{
    int status = look->tf_text ? trip_tf_parse(tf, s->input, look->tf_text, strlen(look->tf_text))
                 : look->tf    ? trip_tf_load(tf, look->tf)
                               : trip_dataset_text_tf(s->text, s->data, tf);
    bool window = look->window > 0;
    if (!status && !(window && trip_tf_is_normalised(*tf))) /* a window replaces the range */
        status = trip_dataset_text_adapt(s->text, s->data, *tf);
    return !status && window ? trip_tf_window(*tf, look->window, look->level) : status;
}

static int take_table(session *s)
{
    s->table = trip_budget_take(s->budget, table_bytes);
    if (s->table)
        return 0;
    return trip_fail(TRIP_ERROR, "render", s->input,
                     "the transfer function's table does not fit the memory given; raise --memory");
}

int session_read_text(session *s)
{
    return s->text ? 0 : trip_dataset_text_parse(&s->text, s->data);
}

int session_use_function(session *s, const session_look *look)
{
    const trip_file_header *h = &s->data->header;
    trip_tf *tf = NULL;
    int status = session_read_text(s);
    if (!status && !s->table)
        status = take_table(s);
    if (!status)
        status = load_function(s, look, &tf);
    if (!status && !find_missing(s, tf, look)) {
        trip_tf_check_range(tf, h->value_min, h->value_max, s->input);
        warn_of_culled_values(s, tf, look);
        warn_of_lost_peak(s, tf);
        double voxel_world = cbrt(fabs(trip_affine_determinant(&s->data->index_to_world)));
        trip_tf_fill_table(tf, h->code_lo, h->code_hi, voxel_world, s->table);
        scale_extinction(s->table, look->opacity_scale);
    }
    trip_tf_destroy(tf);
    return status;
}

int session_open_data(session *s, const char *input, uint64_t memory_bytes)
{
    *s = (session){ .input = input };
    int status = trip_budget_create(&s->budget, memory_bytes);
    return status ? status : trip_dataset_open(&s->data, input, s->budget);
}

int session_open(session *s, const char *input, const session_look *look, uint64_t memory_bytes)
{
    int status = session_open_data(s, input, memory_bytes);
    return status ? status : session_use_function(s, look);
}

void session_close(session *s)
{
    if (s->table)
        trip_budget_release(s->budget, s->table, table_bytes);
    trip_dataset_text_destroy(s->text);
    if (s->data)
        trip_dataset_close(s->data);
    if (s->budget)
        trip_budget_destroy(s->budget);
    *s = (session){ 0 };
}

/* Memory of the renderer's for the ring; NULL where it has none, or none that reads land in. */
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

enum { SLOTS = 8, MOST_SLOTS = 16, MAX_SLOT_BYTES = 512 << 10 };

/* Slots are handed out in order, so that one late read holds up the others: the more are on their
 * way, the less. But what is read ahead is read before it is known to be occluded. */
static unsigned choose_slots(const session_reader *wanted, uint64_t ring_bytes, size_t plane_count)
{
    bool fit = ring_bytes / MOST_SLOTS / plane_count >= MAX_SLOT_BYTES;
    return fit && !wanted->skip ? MOST_SLOTS : SLOTS;
}

int session_make_reader(const session *s, trip_reader **out, const session_reader *wanted)
{
    uint64_t left = trip_budget_left_bytes(s->budget);
    size_t page = (size_t)1 << s->data->header.page_log2;
    size_t plane_count = wanted->planes & 1u << TRIP_PLANE_NORMALS ? 2 : 1;
    unsigned slots = choose_slots(wanted, left / 4, plane_count);
    size_t slot = (size_t)(left / 4) / slots / page * page, most = MAX_SLOT_BYTES * plane_count;
    slot = slot < page ? page : slot;
    trip_reader_params params = {
        .engine = wanted->engine,
        .planes = wanted->planes,
        .slots = slots,
        .slot_bytes = trip_reader_slot_bytes(s->data, wanted->planes,
                                             slot < most || page > most ? slot : most),
        .threads = (unsigned)wanted->threads,
        .skip = wanted->skip,
        .skip_user = wanted->skip_user,
        .cache_bytes = wanted->cache ? (size_t)(left / 2) : 0,
    };
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
    return trip_fail(TRIP_ERROR, "render", s->input,
                     "an image of %d x %d does not fit the memory given; raise --memory or make "
                     "it smaller",
                     width, height);
}

void session_release_image(const session *s, int width, int height, float *rgba)
{
    if (rgba)
        trip_budget_release(s->budget, rgba, image_bytes(width, height));
}
