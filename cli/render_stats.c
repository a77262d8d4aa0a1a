#include "render_stats.h"

#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "json.h"
#include "new_file.h"
#include "render_view.h"
#include "report.h"
#include "text.h"

struct render_stats {
    cJSON *root, *frames;
};

static const char *const axis_names[3] = { "x", "y", "z" };
static const char *const method_names[] = { "merge", "clip", "axis" };

static int out_of_memory(void)
{
    return trip_fail(TRIP_ERROR, "render", "--stats", "out of memory");
}

int render_stats_create(render_stats **out)
{
    render_stats *s = calloc(1, sizeof *s);
    *out = s;
    if (!s)
        return out_of_memory();
    s->root = cJSON_CreateObject();
    s->frames = cJSON_CreateArray();
    return s->root && s->frames ? 0 : out_of_memory();
}

void render_stats_destroy(render_stats *s)
{
    if (!s)
        return;
    cJSON_Delete(s->root);
    cJSON_Delete(s->frames);
    free(s);
}

/* Milliseconds to the microsecond. */
static void add_ms(cJSON *object, const char *name, double ms)
{
    char text[32];
    snprintf(text, sizeof text, "%.3f", ms);
    cJSON_AddRawToObject(object, name, text);
}

/* Level 0 goes with what was read of its layer. */
static void add_plan(cJSON *lists, const trip_list *of, const trip_plan_list *p)
{
    char name[24];
    cJSON *list = cJSON_GetObjectItem(lists, trip_plan_list_name(of, name));
    if (!list)
        list = cJSON_AddObjectToObject(lists, name);
    cJSON_AddNumberToObject(list, "bricks", (double)p->bricks);
    cJSON_AddNumberToObject(list, "bricks_selected", (double)p->bricks_selected);
    cJSON_AddNumberToObject(list, "bricks_transparent", (double)p->bricks_transparent);
    cJSON_AddNumberToObject(list, "bricks_outside", (double)p->bricks_outside);
    cJSON_AddNumberToObject(list, "bricks_without_weight", (double)p->bricks_without_weight);
}

/* What was not counted is left out. */
static cJSON *add_list(cJSON *lists, int axis, const trip_frame_stats *frame)
{
    const trip_list_stats *s = &frame->lists[axis];
    cJSON *list = cJSON_AddObjectToObject(lists, axis_names[axis]);
    cJSON_AddNumberToObject(list, "splats_read", (double)s->splats_read);
    if (frame->counted) {
        cJSON_AddNumberToObject(list, "splats_projected", (double)s->splats_projected);
        cJSON_AddNumberToObject(list, "splats_drawn", (double)s->splats_drawn);
    }
    return list;
}

int render_stats_add_frame(render_stats *s, const trip_dataset *data, const trip_plan *plan,
                           const trip_frame_stats *frame)
{
    cJSON *f = cJSON_CreateObject();
    add_ms(f, "ms", frame->ms);
    add_ms(f, "read_ms", frame->read_ms);
    add_ms(f, "draw_ms", frame->draw_ms);
    add_ms(f, "merge_ms", frame->merge_ms);
    cJSON_AddNumberToObject(f, "reads", (double)frame->reader.reads);
    cJSON_AddNumberToObject(f, "bytes_cached", (double)frame->reader.bytes_cached);
    cJSON_AddNumberToObject(f, "bytes_of_planes_left_out",
                            (double)trip_plan_bytes_left_out(plan, data));
    cJSON_AddNumberToObject(f, "runs_skipped", (double)frame->reader.runs_skipped);
    cJSON_AddNumberToObject(f, "bytes_skipped", (double)frame->reader.bytes_skipped);
    cJSON *lists = cJSON_AddObjectToObject(f, "lists");
    for (int axis = 0; axis < 3; axis++) {
        cJSON *list = add_list(lists, axis, frame);
        cJSON_AddNumberToObject(list, "bytes_read", (double)frame->lists[axis].bytes_read);
    }
    for (unsigned i = 0; i < data->list_count; i++)
        if (trip_kind_of(data->lists[i].kind)->splatted)
            add_plan(lists, &data->lists[i], &plan->lists[i]);
    return f && lists && cJSON_AddItemToArray(s->frames, f) ? 0 : out_of_memory();
}

int render_stats_add_count(render_stats *s, int index, const trip_frame_stats *counted)
{
    cJSON *lists = cJSON_AddObjectToObject(cJSON_GetArrayItem(s->frames, index), "counted");
    for (int axis = 0; axis < 3; axis++)
        add_list(lists, axis, counted);
    return lists ? 0 : out_of_memory();
}

int render_stats_add_camera(render_stats *s, const trip_camera_params *view)
{
    char *options = render_view_options(view);
    cJSON *last = cJSON_GetArrayItem(s->frames, cJSON_GetArraySize(s->frames) - 1);
    bool added = options && cJSON_AddStringToObject(last, "camera", options);
    free(options);
    return added ? 0 : out_of_memory();
}

static bool write_text(FILE *f, const char *text)
{
    if (!f)
        return false;
    bool good = fputs(text, f) >= 0 && fputs("\n", f) >= 0;
    return fclose(f) == 0 && good;
}

/* Devices, pipes and links are written to and stay what they are. */
static bool is_special(const char *path)
{
    struct stat st;
    return lstat(path, &st) == 0 && !S_ISREG(st.st_mode);
}

static int write_file(const char *path, const char *text)
{
    trip_new_file file;
    if (is_special(path))
        return write_text(fopen(path, "we"), text) ? 0
                                                   : trip_fail_errno("write", path, "cannot write");
    int status = trip_new_file_begin(&file, "write", path);
    if (status < 0)
        return status;
    if (write_text(fdopen(dup(file.fd), "w"), text))
        return trip_new_file_finish(&file);
    status = trip_fail_errno("write", path, "cannot write");
    trip_new_file_abandon(&file);
    return status;
}

/* Where reads land, and how the renderer gets at it. */
static const char *ring_text(const trip_renderer *renderer, const trip_reader *reader)
{
    if (renderer->resident)
        return "not used: the renderer holds the data";
    if (trip_reader_in_place(reader))
        return "mapped: reads land in the renderer's memory";
    return renderer->ops->take_slots ? "copied: batches go to the renderer's memory"
                                     : "shared: the renderer draws from the ring";
}

int render_stats_describe(render_stats *s, const render_options *o, const trip_renderer *renderer,
                          const trip_reader *reader, const trip_budget *budget)
{
    cJSON *root = s->root;
    const int size[2] = { o->width, o->height };
    cJSON_AddStringToObject(root, "renderer", renderer->ops->name);
    cJSON_AddStringToObject(root, "device", renderer->ops->device(renderer));
    cJSON_AddStringToObject(root, "method", method_names[o->settings.method]);
    cJSON_AddStringToObject(root, "engine", trip_reader_engine_name(reader));
    cJSON_AddStringToObject(root, "ring", ring_text(renderer, reader));
    cJSON_AddItemToObject(root, "size", cJSON_CreateIntArray(size, 2));
    cJSON_AddNumberToObject(root, "peak_rss_bytes", (double)trip_memory_peak_rss_bytes());
    cJSON_AddNumberToObject(root, "memory_limit_bytes", (double)trip_budget_limit_bytes(budget));
    return cJSON_AddNumberToObject(root, "memory_peak_bytes",
                                   (double)trip_budget_peak_bytes(budget))
               ? 0
               : out_of_memory();
}

int render_stats_write(render_stats *s, const render_options *o)
{
    cJSON_AddItemToObject(s->root, "frames", s->frames);
    s->frames = NULL;
    char *text = trip_json_print(s->root, true);
    if (!text)
        return out_of_memory();
    int status = 0;
    if (strcmp(o->stats, "-"))
        status = write_file(o->stats, text);
    else
        puts(text); /* main() says when stdout cannot be written */
    free(text);
    return status;
}

void render_stats_explain_camera(const trip_camera_params *view, uint64_t splats, FILE *out)
{
    char *options = render_view_options(view);
    fprintf(out, "camera      %s\n", options ? options : "");
    if (splats)
        fprintf(out, "fitted      to what is visible, found among %" PRIu64 " splats\n", splats);
    free(options);
}

void render_stats_explain(const trip_frame_stats *frame, const trip_renderer *renderer,
                          const trip_reader *reader, FILE *out)
{
    char bytes[32];
    for (int axis = 0; axis < 3; axis++) {
        const trip_list_stats *s = &frame->lists[axis];
        if (s->splats_read == 0)
            continue;
        fprintf(out, "cost %s      %s read, %" PRIu64 " splats\n", axis_names[axis],
                trip_format_bytes(s->bytes_read, bytes), s->splats_read);
    }
    if (frame->reader.bytes_cached)
        fprintf(out, "cache       %s from memory\n",
                trip_format_bytes(frame->reader.bytes_cached, bytes));
    if (frame->reader.bytes_skipped)
        fprintf(out, "hidden      %s in %" PRIu64 " runs not read: behind what is opaque\n",
                trip_format_bytes(frame->reader.bytes_skipped, bytes), frame->reader.runs_skipped);
    fprintf(out, "ring        %s\n", ring_text(renderer, reader));
    fprintf(out, "time        %.1f ms: waiting for the disk %.1f, drawing %.1f, merging %.1f\n",
            frame->ms, frame->read_ms, frame->draw_ms, frame->merge_ms);
}

void render_stats_explain_count(const trip_frame_stats *counted, FILE *out)
{
    for (int axis = 0; axis < 3; axis++) {
        const trip_list_stats *s = &counted->lists[axis];
        if (s->splats_read)
            fprintf(out,
                    "count %s     %" PRIu64 " splats, %" PRIu64 " projected, %" PRIu64 " drawn\n",
                    axis_names[axis], s->splats_read, s->splats_projected, s->splats_drawn);
    }
}

void render_stats_summary(const char *path, const render_options *o, const trip_frame_stats *frame,
                          FILE *out)
{
    uint64_t splats = 0, bytes = 0;
    char text[32];
    for (int axis = 0; axis < 3; axis++) {
        splats += frame->lists[axis].splats_read;
        bytes += frame->lists[axis].bytes_read;
    }
    trip_text_write(out, path);
    fprintf(out, ": %d x %d, %.2f million splats, %s read, %.2f s\n", o->width, o->height,
            (double)splats * 1e-6, trip_format_bytes(bytes, text), frame->ms * 1e-3);
}
