#include "render_stats.h"

#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "budget.h"
#include "json.h"
#include "navigation.h"
#include "new_file.h"
#include "report.h"
#include "size_print.h"
#include "text.h"

struct render_stats {
    cJSON *root, *frames;
};

static const char *const footprint_names[] = { "exact", "ewa", "fixed" };

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

/* Adds milliseconds, rounded to microseconds. */
static void add_ms(cJSON *object, const char *name, double ms)
{
    char text[32];
    snprintf(text, sizeof text, "%.3f", ms);
    cJSON_AddRawToObject(object, name, text);
}

/* Names a list: "x" at level 0, "x1" at level 1, or "x halo". Names are unique among the lists that
 * are drawn. */
static const char *list_name(const triptych_list *list, char name[24])
{
    if (!strcmp(list->kind, "halo"))
        snprintf(name, 24, "%c halo", 'x' + list->axis);
    else if (list->level == 0)
        snprintf(name, 24, "%c", 'x' + list->axis);
    else
        snprintf(name, 24, "%c%u", 'x' + list->axis, list->level);
    return name;
}

/* Leaves out the splats projected and drawn if they were not counted. */
static void add_splats(cJSON *list, const triptych_list_stats *s)
{
    cJSON_AddNumberToObject(list, "splats_read", (double)s->splats_read);
    if (!s->counted)
        return;
    cJSON_AddNumberToObject(list, "splats_projected", (double)s->splats_projected);
    cJSON_AddNumberToObject(list, "splats_drawn", (double)s->splats_drawn);
}

static void add_list(cJSON *list, const triptych_list_stats *s)
{
    add_splats(list, s);
    cJSON_AddNumberToObject(list, "bytes_read", (double)s->bytes_read);
    cJSON_AddNumberToObject(list, "bricks", (double)s->bricks);
    cJSON_AddNumberToObject(list, "bricks_selected", (double)s->bricks_selected);
    cJSON_AddNumberToObject(list, "bricks_transparent", (double)s->bricks_transparent);
    cJSON_AddNumberToObject(list, "bricks_outside", (double)s->bricks_outside);
    cJSON_AddNumberToObject(list, "bricks_without_weight", (double)s->bricks_without_weight);
    cJSON_AddNumberToObject(list, "bricks_clipped", (double)s->bricks_clipped);
    cJSON_AddNumberToObject(list, "bricks_of_other_levels", (double)s->bricks_of_other_levels);
}

/* Returns whether frames use the list. pre uses the lists of voxels and means. post uses the lists
 * of voxels, values and the halo. */
static bool is_drawn_from(const triptych_list *list, const triptych_frame_stats *frame,
                          const triptych_list_stats *s)
{
    if (s->splats_read > 0)
        return true;
    if (list->level == 0 || frame->classify == TRIPTYCH_CLASSIFY_PRE)
        return list->drawn;
    return !strcmp(list->kind, "values");
}

/* Calls `one` with the name and the statistics of each list that can be drawn. */
static int each_list(triptych *t,
                     void (*one)(void *user, const char *name, const triptych_list_stats *s),
                     void *user)
{
    triptych_info info = { 0 };
    triptych_frame_stats frame;
    int status = triptych_is_scene(t) ? 0 : triptych_get_info(t, &info);
    if (!status)
        status = triptych_get_frame_stats(t, &frame);
    for (unsigned i = 0; !status && i < info.lists; i++) {
        char name[24];
        triptych_list list;
        triptych_list_stats s;
        status = triptych_get_list(t, i, &list);
        if (!status)
            status = triptych_get_list_stats(t, i, &s);
        if (!status && is_drawn_from(&list, &frame, &s))
            one(user, list_name(&list, name), &s);
    }
    return status;
}

/* Adds a list to an object. Lists of the same name, from several data sets, are summed. */
static void put_list(cJSON *lists, const char *name, cJSON *list)
{
    const cJSON *before = cJSON_GetObjectItemCaseSensitive(lists, name);
    if (!before) {
        cJSON_AddItemToObject(lists, name, list);
        return;
    }
    const cJSON *more = list ? list->child : NULL;
    for (cJSON *sum = before->child; sum && more; sum = sum->next, more = more->next)
        cJSON_SetNumberValue(sum, sum->valuedouble + more->valuedouble);
    cJSON_Delete(list);
}

static void add_whole(void *user, const char *name, const triptych_list_stats *s)
{
    cJSON *list = cJSON_CreateObject();
    add_list(list, s);
    put_list(user, name, list);
}

static void add_counted(void *user, const char *name, const triptych_list_stats *s)
{
    cJSON *list = cJSON_CreateObject();
    add_splats(list, s);
    put_list(user, name, list);
}

/* Returns the options of a view, for free(). */
static char *options_of(const triptych_camera *camera)
{
    const trip_navigation n = trip_navigation_from_camera(camera, NULL);
    return trip_navigation_options(&n, camera->width, camera->height);
}

static int add_camera(cJSON *frame, triptych *t)
{
    triptych_camera view;
    int status = triptych_get_camera(t, &view);
    char *options = status ? NULL : options_of(&view);
    bool added = options && cJSON_AddStringToObject(frame, "camera", options);
    free(options);
    return status || added ? status : out_of_memory();
}

/* Adds the Gaussians of each object, if there are several. */
static void add_objects(cJSON *frame, triptych *t)
{
    const uint64_t *drawn;
    const unsigned count = triptych_get_objects(t, &drawn);
    cJSON *list = count > 1 ? cJSON_AddArrayToObject(frame, "gaussians_by_object") : NULL;
    for (unsigned i = 0; list && i < count; i++)
        cJSON_AddItemToArray(list, cJSON_CreateNumber((double)drawn[i]));
}

/* Adds the surfels of a deferred picture, by their fate. */
static void add_surfels(cJSON *frame, const triptych_frame_stats *s)
{
    cJSON *o = cJSON_AddObjectToObject(frame, "surfels");
    cJSON_AddNumberToObject(o, "objects_in_view", s->objects_in_view);
    cJSON_AddNumberToObject(o, "planned", (double)s->surfels_planned);
    cJSON_AddNumberToObject(o, "away", (double)s->surfels_away);
    cJSON_AddNumberToObject(o, "unread", (double)s->surfels_unread);
    cJSON_AddNumberToObject(o, "read", (double)s->splats);
    cJSON_AddNumberToObject(o, "outside", (double)s->surfels_outside);
    cJSON_AddNumberToObject(o, "hidden", (double)s->surfels_hidden);
    cJSON_AddNumberToObject(o, "visible", (double)s->surfels_visible);
}

int render_stats_add_frame(render_stats *s, triptych *t)
{
    triptych_frame_stats frame;
    int status = triptych_get_frame_stats(t, &frame);
    if (status)
        return status;
    cJSON *f = cJSON_CreateObject();
    add_ms(f, "ms", frame.ms);
    add_ms(f, "read_ms", frame.wait_ms);
    add_ms(f, "draw_ms", frame.draw_ms);
    add_ms(f, "merge_ms", frame.merge_ms);
    cJSON_AddNumberToObject(f, "reads", (double)frame.reads);
    cJSON_AddNumberToObject(f, "bytes_cached", (double)frame.bytes_cached);
    cJSON_AddNumberToObject(f, "bytes_of_planes_left_out", (double)frame.bytes_unused);
    cJSON_AddNumberToObject(f, "runs_skipped", (double)frame.runs_occluded);
    cJSON_AddNumberToObject(f, "bytes_skipped", (double)frame.bytes_occluded);
    if (frame.light_memory_bytes)
        cJSON_AddNumberToObject(f, "light_bytes_read", (double)frame.light_bytes_read);
    if (frame.heat_memory_bytes)
        cJSON_AddNumberToObject(f, "heat_bytes_read", (double)frame.heat_bytes_read);
    if (triptych_is_scene(t)) {
        cJSON_AddNumberToObject(f, "gaussians", (double)frame.splats);
        cJSON_AddNumberToObject(f, "bytes_read", (double)frame.bytes_read);
        add_objects(f, t);
    }
    if (frame.order == TRIPTYCH_ORDER_DEFERRED)
        add_surfels(f, &frame);
    cJSON *lists = cJSON_AddObjectToObject(f, "lists");
    if (!f || !lists || !cJSON_AddItemToArray(s->frames, f)) {
        cJSON_Delete(f);
        return out_of_memory();
    }
    status = each_list(t, add_whole, lists);
    return status ? status : add_camera(f, t);
}

int render_stats_add_count(render_stats *s, int index, triptych *t)
{
    cJSON *lists = cJSON_AddObjectToObject(cJSON_GetArrayItem(s->frames, index), "counted");
    return lists ? each_list(t, add_counted, lists) : out_of_memory();
}

static bool write_text(FILE *f, const char *text)
{
    if (!f)
        return false;
    bool good = fputs(text, f) >= 0 && fputs("\n", f) >= 0;
    return fclose(f) == 0 && good;
}

bool render_stats_is_special(const char *path)
{
    struct stat st;
    return lstat(path, &st) == 0 && !S_ISREG(st.st_mode) && !S_ISDIR(st.st_mode);
}

static int write_file(const char *path, const char *text)
{
    trip_new_file file;
    if (render_stats_is_special(path))
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

static void add_interpolation(cJSON *root, triptych_interpolation drawn)
{
    const draw_settings s = { .all.interpolation = drawn };
    if (drawn)
        cJSON_AddStringToObject(root, "interpolation",
                                draw_settings_choice(&s, DRAW_INTERPOLATION));
}

static void add_scene_method(cJSON *root, const render_options *o,
                             const triptych_frame_stats *frame)
{
    const draw_settings drawn = { .scene.order = frame->order };
    cJSON_AddStringToObject(root, "order",
                            o->resources.renderer == TRIPTYCH_RENDERER_INTEGRAL
                                ? "integral"
                                : draw_settings_choice(&drawn, DRAW_ORDER));
    cJSON_AddStringToObject(root, "kernel",
                            frame->order == TRIPTYCH_ORDER_DEFERRED ? "discs"
                            : frame->footprint
                                ? footprint_names[frame->footprint - TRIPTYCH_FOOTPRINT_EXACT]
                                : "projected");
}

static void add_method(cJSON *root, const render_options *o, const triptych_frame_stats *frame)
{
    add_interpolation(root, frame->interpolation);
    if (o->resources.renderer == TRIPTYCH_RENDERER_INTEGRAL) {
        static const char *const fields[] = { [RENDER_FIELD_UNSET] = "stored",
                                              [RENDER_FIELD_STORED] = "stored",
                                              [RENDER_FIELD_SOURCE] = "source",
                                              [RENDER_FIELD_SPLATS] = "splats" };
        cJSON_AddStringToObject(root, "field", fields[o->field]);
        cJSON_AddNumberToObject(root, "tolerance", frame->tolerance);
        return;
    }
    cJSON_AddStringToObject(root, "classify",
                            frame->classify == TRIPTYCH_CLASSIFY_POST ? "post" : "pre");
    if (frame->classify == TRIPTYCH_CLASSIFY_POST) {
        cJSON_AddNumberToObject(root, "samples_per_sheet", frame->samples_per_sheet);
        cJSON_AddBoolToObject(root, "closed_form", frame->closed_form);
    } else {
        cJSON_AddStringToObject(root, "compositing",
                                draw_settings_choice(&o->settings, DRAW_COMPOSITING));
        cJSON_AddStringToObject(root, "kernel",
                                footprint_names[frame->footprint - TRIPTYCH_FOOTPRINT_EXACT]);
    }
    cJSON_AddStringToObject(root, "method", draw_settings_choice(&o->settings, DRAW_METHOD));
}

int render_stats_describe(render_stats *s, const render_options *o, triptych *t)
{
    cJSON *root = s->root;
    const int size[2] = { o->view.view.width, o->view.view.height };
    triptych_frame_stats frame;
    int status = triptych_get_frame_stats(t, &frame);
    if (status)
        return status;
    cJSON_AddStringToObject(root, "renderer", frame.renderer);
    cJSON_AddStringToObject(root, "device", frame.device);
    if (triptych_is_scene(t))
        add_scene_method(root, o, &frame);
    else
        add_method(root, o, &frame);
    if (frame.lod_px > 0)
        cJSON_AddNumberToObject(root, "lod_px", frame.lod_px);
    if (frame.rays > 0)
        cJSON_AddNumberToObject(root, "samples", frame.rays);
    if (frame.promised_error > 0) {
        cJSON *quality = cJSON_AddObjectToObject(root, "quality");
        cJSON_AddNumberToObject(quality, "promised_error", frame.promised_error);
        if (frame.expected_error >= 0)
            cJSON_AddNumberToObject(quality, "expected_error", frame.expected_error);
        cJSON_AddNumberToObject(quality, "trials", frame.trials);
        cJSON_AddNumberToObject(quality, "trial_ms", frame.trial_ms);
    }
    if (frame.effects) {
        cJSON *effects = cJSON_AddArrayToObject(root, "effects");
        static const char *const names[] = { "shadows", "occlusion", "cueing",
                                             NULL,      "emission",  "edl" };
        for (int i = 0; i < 6; i++)
            if (frame.effects >> i & 1)
                cJSON_AddItemToArray(effects, cJSON_CreateString(names[i]));
    }
    if (frame.early_termination >= 0)
        cJSON_AddNumberToObject(root, "early_termination", frame.early_termination);
    cJSON_AddStringToObject(root, "engine", frame.engine);
    cJSON_AddStringToObject(root, "ring", frame.ring);
    cJSON_AddItemToObject(root, "size", cJSON_CreateIntArray(size, 2));
    cJSON_AddNumberToObject(root, "peak_rss_bytes", (double)trip_memory_peak_rss_bytes());
    cJSON_AddNumberToObject(root, "memory_limit_bytes", (double)frame.memory_bytes);
    return cJSON_AddNumberToObject(root, "memory_peak_bytes", (double)frame.peak_memory_bytes)
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
        puts(text); /* main() reports a failed write to stdout */
    free(text);
    return status;
}

int render_stats_explain_plan(triptych *t, FILE *out)
{
    triptych_camera view;
    char *options = NULL, *plan = NULL;
    int status = triptych_get_camera(t, &view);
    if (!status)
        status = triptych_explain(t, &plan);
    if (!status && !(options = options_of(&view)))
        status = out_of_memory();
    if (!status) {
        fprintf(out, "camera      %s\n", options);
        if (view.splats)
            fprintf(out, "fitted      to the visible part, found among %" PRIu64 " voxels\n",
                    view.splats);
        fputs(plan, out);
    }
    free(options);
    free(plan);
    return status;
}

/* Returns the name for the records that were read. */
static const char *things_read(const render_options *o, const triptych *t,
                               const triptych_frame_stats *frame)
{
    if (triptych_is_scene(t))
        return "Gaussians";
    const bool splats = o->resources.renderer == TRIPTYCH_RENDERER_INTEGRAL
                            ? o->field == RENDER_FIELD_SPLATS
                            : frame->classify == TRIPTYCH_CLASSIFY_PRE;
    return splats ? "splats" : "voxels";
}

/* The stream for the lines of costs, and the name for records. */
typedef struct costs {
    FILE *out;
    const char *things;
} costs;

static void explain_list(void *user, const char *name, const triptych_list_stats *s)
{
    const costs *c = user;
    char bytes[32];
    if (s->splats_read)
        fprintf(c->out, "cost %-6s %s read, %" PRIu64 " %s\n", name,
                trip_format_bytes(s->bytes_read, bytes), s->splats_read, c->things);
}

enum { OBJECTS_PRINTED = 16 };

int render_stats_explain_cost(const render_options *o, triptych *t, FILE *out)
{
    char bytes[32], memory[32];
    triptych_frame_stats frame;
    int status = triptych_get_frame_stats(t, &frame);
    costs c = { out, status ? "" : things_read(o, t, &frame) };
    if (!status)
        status = each_list(t, explain_list, &c);
    if (status)
        return status;
    const uint64_t *drawn;
    const unsigned objects = triptych_get_objects(t, &drawn);
    for (unsigned i = 0; i < objects && i < OBJECTS_PRINTED && objects > 1; i++)
        fprintf(out, "object %-4u %" PRIu64 " Gaussians read in the order of drawing\n", i + 1,
                drawn[i]);
    if (objects > OBJECTS_PRINTED)
        fprintf(out, "objects     %u more, which --stats lists\n", objects - OBJECTS_PRINTED);
    if (frame.order == TRIPTYCH_ORDER_DEFERRED)
        fprintf(out,
                "surfels     %" PRIu64 " in view, %" PRIu64
                " in bricks facing away not read, %" PRIu64 " in hidden bricks not read, %" PRIu64
                " outside or facing away, %" PRIu64 " hidden, %" PRIu64 " visible\n",
                frame.surfels_planned, frame.surfels_away, frame.surfels_unread,
                frame.surfels_outside, frame.surfels_hidden, frame.surfels_visible);
    if (frame.bytes_cached)
        fprintf(out, "cache       %s from memory\n", trip_format_bytes(frame.bytes_cached, bytes));
    if (frame.bytes_occluded)
        fprintf(out, "occluded    %s in %" PRIu64 " runs not read, hidden by opaque bricks\n",
                trip_format_bytes(frame.bytes_occluded, bytes), frame.runs_occluded);
    if (frame.light_memory_bytes)
        fprintf(out, "light       %s read in %.1f ms, computed in %.1f ms; %s of memory\n",
                trip_format_bytes(frame.light_bytes_read, bytes), frame.light_gather_ms,
                frame.light_sweep_ms, trip_format_bytes(frame.light_memory_bytes, memory));
    if (frame.heat_memory_bytes)
        fprintf(out, "heat        %s read in %.1f ms; %s of memory\n",
                trip_format_bytes(frame.heat_bytes_read, bytes), frame.heat_ms,
                trip_format_bytes(frame.heat_memory_bytes, memory));
    if (frame.normals_ms > 0)
        fprintf(out, "normals     computed in %.1f ms\n", frame.normals_ms);
    fprintf(out, "drawn by    %s: %s\n", frame.renderer, frame.device);
    fprintf(out, "ring        %s\n", frame.ring);
    fprintf(out, "time        %.1f ms: waiting for the disk %.1f, drawing %.1f, %s %.1f\n",
            frame.ms, frame.wait_ms, frame.draw_ms,
            o->resources.renderer == TRIPTYCH_RENDERER_INTEGRAL ? "integrating" : "merging",
            frame.merge_ms);
    return 0;
}

static void explain_counted(void *user, const char *name, const triptych_list_stats *s)
{
    if (s->splats_read)
        fprintf(user, "count %-5s %" PRIu64 " splats, %" PRIu64 " projected, %" PRIu64 " drawn\n",
                name, s->splats_read, s->splats_projected, s->splats_drawn);
}

int render_stats_explain_count(triptych *t, FILE *out)
{
    return each_list(t, explain_counted, out);
}

/* Writes the expected error, with the rays if a pixel has several. Says if the promise fails. */
static void write_promise(const triptych_frame_stats *f, FILE *out)
{
    if (!(f->promised_error > 0) || f->expected_error < 0)
        return;
    if (f->rays > 1)
        fprintf(out, ", %d rays per pixel", f->rays * f->rays);
    if (f->lod_px > 0)
        fputs(", coarse levels", out);
    fprintf(out, ", error about %.2g of 255", f->expected_error);
    if (f->expected_error > f->promised_error)
        fprintf(out, " (more than the promised %g)", f->promised_error);
    if (f->trial_ms > 0)
        fprintf(out, ", trial %.2f s", f->trial_ms * 1e-3);
}

int render_stats_summary(const char *path, const render_options *o, triptych *t, FILE *out)
{
    char count[32], text[32];
    triptych_frame_stats frame;
    int status = triptych_get_frame_stats(t, &frame);
    if (status)
        return status;
    trip_text_write(out, path);
    fprintf(out, ": %d x %d, %s %s, %s read, %.2f s", o->view.view.width, o->view.view.height,
            size_print_count(frame.splats, count), things_read(o, t, &frame),
            trip_format_bytes(frame.bytes_read, text), frame.ms * 1e-3);
    write_promise(&frame, out);
    fputc('\n', out);
    return 0;
}

void render_stats_sequence(const render_sequence *s, const render_options *o, FILE *out)
{
    char memory[32];
    trip_text_write(out, s->first);
    if (s->last) {
        fputs(" to ", out);
        trip_text_write(out, s->last);
    }
    fprintf(out, ": %d pictures of %d x %d, %.3f s each, %.2f s in all, %s of memory at peak\n",
            s->frames, o->view.view.width, o->view.view.height, s->seconds / s->frames, s->seconds,
            trip_format_bytes(trip_memory_peak_rss_bytes(), memory));
}
