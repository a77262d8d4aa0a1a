/* triptych render: data set -> plan -> reader -> renderer -> merge -> image files. */
#include "commands.h"

#include <stdio.h>
#include <string.h>

#include "cpu_renderer.h"
#include "frame.h"
#include "image_file.h"
#include "render_options.h"
#include "render_stats.h"
#include "render_view.h"
#include "report.h"

/* Everything that lives as long as the command. */
typedef struct session {
    render_options o;
    trip_budget *budget;
    trip_dataset *data;
    trip_dataset_text *text;
    trip_tf *tf;
    trip_tf_entry *table;
    float *rgba;
    trip_renderer *renderer;
    trip_reader *reader;
    render_stats *stats;
} session;

static const size_t table_bytes = 65536 * sizeof(trip_tf_entry);

static size_t rgba_bytes(const render_options *o)
{
    return (size_t)o->width * (size_t)o->height * 4 * sizeof(float);
}

static void warn_of_culled_values(const session *s)
{
    double range[2], voxels = trip_dataset_text_culled(s->text, s->tf, range);
    if (voxels >= 1)
        trip_warn(s->o.input,
                  "the transfer function shows about %.0f voxels with values from %g to %g that "
                  "were left out when the data set was made; brick it again for this function",
                  voxels, range[0], range[1]);
}

static int load_transfer_function(session *s)
{
    const trip_file_header *h = &s->data->header;
    int status =
        s->o.tf ? trip_tf_load(&s->tf, s->o.tf) : trip_dataset_text_tf(s->text, s->data, &s->tf);
    if (status)
        return status;
    trip_tf_denormalise(s->tf, h->value_min, h->value_max);
    warn_of_culled_values(s);
    double voxel_world = cbrt(fabs(trip_affine_determinant(&s->data->index_to_world)));
    trip_tf_fill_table(s->tf, h->code_lo, h->code_hi, voxel_world, s->table);
    return 0;
}

static int take_buffers(session *s)
{
    s->table = trip_budget_take(s->budget, table_bytes);
    s->rgba = trip_budget_take(s->budget, rgba_bytes(&s->o));
    if (s->table && s->rgba)
        return 0;
    return trip_fail(TRIP_ERROR, "render", s->o.output,
                     "an image of %d x %d does not fit the memory given; raise --memory or make "
                     "it smaller",
                     s->o.width, s->o.height);
}

static int open_session(session *s)
{
    int status = trip_budget_create(&s->budget, s->o.memory_bytes);
    if (!status)
        status = trip_dataset_open(&s->data, s->o.input, s->budget);
    if (!status)
        status = trip_dataset_text_parse(&s->text, s->data);
    if (!status)
        status = take_buffers(s);
    if (!status)
        status = load_transfer_function(s);
    if (!status)
        status =
            trip_renderer_create(&s->renderer, s->o.renderer, (unsigned)s->o.threads, s->budget);
    if (!status && s->o.stats)
        status = render_stats_create(&s->stats);
    return status;
}

static void close_session(session *s)
{
    render_stats_destroy(s->stats);
    if (s->reader)
        trip_reader_destroy(s->reader);
    if (s->renderer)
        s->renderer->ops->destroy(s->renderer);
    if (s->rgba)
        trip_budget_release(s->budget, s->rgba, rgba_bytes(&s->o));
    if (s->table)
        trip_budget_release(s->budget, s->table, table_bytes);
    trip_tf_destroy(s->tf);
    trip_dataset_text_destroy(s->text);
    if (s->data)
        trip_dataset_close(s->data);
    if (s->budget)
        trip_budget_destroy(s->budget);
}

/* The reader is made when the first plan says which planes there are to read; its ring takes at
 * most a quarter of the memory that is left, an orbit's cache half. */
static int make_reader(session *s, unsigned planes)
{
    enum { SLOTS = 8, MAX_SLOT_BYTES = 1 << 20 };
    if (s->reader)
        return 0;
    uint64_t left = trip_budget_left_bytes(s->budget);
    size_t page = (size_t)1 << s->data->header.page_log2;
    size_t plane_count = planes & 1u << TRIP_PLANE_NORMALS ? 2 : 1;
    size_t slot = (size_t)(left / 4) / (SLOTS * plane_count) / page * page;
    slot = slot < page ? page : slot;
    trip_reader_params params = {
        .engine = s->o.engine,
        .planes = planes,
        .slots = SLOTS,
        .slot_bytes = slot < MAX_SLOT_BYTES || page > MAX_SLOT_BYTES ? slot : MAX_SLOT_BYTES,
        .threads = (unsigned)s->o.threads,
        .skip = s->o.hidden == RENDER_HIDDEN_SKIP ? trip_cpu_covered : NULL,
        .skip_user = s->renderer,
        .cache_bytes = s->o.orbit > 1 ? (size_t)(left / 2) : 0,
    };
    return trip_reader_create(&s->reader, s->data, &params, s->budget);
}

/* image.png -> image-007.png */
static int image_path(const session *s, int index, char *path, size_t bytes)
{
    const char *output = s->o.output, *extension = strrchr(output, '.');
    int length = s->o.orbit ? snprintf(path, bytes, "%.*s-%03d%s", (int)(extension - output),
                                       output, index, extension)
                            : snprintf(path, bytes, "%s", output);
    if (length < 0 || (size_t)length >= bytes)
        return trip_fail(TRIP_USAGE, "render", "-o", "the name is too long");
    return 0;
}

static int draw_planned(session *s, const trip_camera *camera, const trip_plan *plan,
                        trip_frame_stats *stats)
{
    trip_frame frame = {
        .data = s->data,
        .camera = camera,
        .settings = &s->o.settings,
        .plan = plan,
        .table = s->table,
        .count = s->o.stats || s->o.explain,
    };
    if (s->o.explain)
        trip_plan_explain(plan, s->data, &s->o.settings, stdout);
    int status = make_reader(s, plan->planes);
    if (!status)
        status = trip_frame_draw(s->renderer, s->reader, &frame, s->rgba, stats);
    if (!status && s->o.explain)
        render_stats_explain(stats, stdout);
    return status;
}

static int draw_image(session *s, int index)
{
    char path[4096];
    trip_camera camera;
    trip_plan plan;
    trip_frame_stats stats;
    trip_camera_params view = render_view(&s->o, s->data, s->text, index);
    int status = image_path(s, index, path, sizeof path);
    if (!status)
        status = trip_camera_make(&camera, &view, &s->data->index_to_world);
    if (!status)
        status = trip_plan_make(&plan, s->data, &camera, &s->o.settings, s->table, s->budget);
    if (status)
        return status;
    status = draw_planned(s, &camera, &plan, &stats);
    trip_plan_release(&plan, s->budget);
    if (!status)
        status = trip_image_write(path, s->o.width, s->o.height, s->rgba, NULL);
    if (!status && s->stats)
        status = render_stats_add_frame(s->stats, &stats);
    if (!status && !(s->o.stats && !strcmp(s->o.stats, "-")))
        render_stats_summary(path, &s->o, &stats, stdout);
    return status;
}

int trip_command_render(int argc, char **argv)
{
    session s = { 0 };
    int status = render_options_parse(&s.o, argc, argv);
    if (!status)
        status = open_session(&s);
    for (int i = 0; !status && i < (s.o.orbit ? s.o.orbit : 1); i++)
        status = draw_image(&s, i);
    if (!status && s.stats)
        status = render_stats_write(s.stats, &s.o, s.renderer, s.reader, s.budget);
    close_session(&s);
    return trip_exit_status(status);
}
