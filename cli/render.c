/* triptych render: data set -> plan -> reader -> renderer -> merge -> image files. */
#include "commands.h"

#include <stdio.h>
#include <string.h>

#include "cached_volume.h"
#include "cpu/cpu_renderer.h"
#include "frame.h"
#include "image_file.h"
#include "piped_function.h"
#include "progress.h"
#include "render_options.h"
#include "render_stats.h"
#include "render_view.h"
#include "report.h"
#include "session.h"

/* Its helper ends with the program. */
static trip_image_files pictures;

/* Everything that lives as long as the command. */
typedef struct drawing {
    render_options o;
    piped_function function;
    cached_volume volume; /* where the input is one */
    session session;
    render_views views;
    float *rgba;
    trip_renderer *renderer;
    trip_reader *reader;
    render_stats *stats;
    trip_progress progress;
    bool counting; /* the frames are drawn once more, and everything of them */
} drawing;

/* What is kept of a volume: what is shown by default, and what the function shows besides, so that
 * nothing is missing; everything where a window moves it, so that the next window finds it in the
 * cache. */
static trip_brick_params brick_params(const render_options *o, const session_look *look)
{
    enum { MOST_THREADS = 256 };
    bool all = look->window > 0;
    return (trip_brick_params){
        .input = o->input,
        .volume = o->volume,
        .functions = &look->tf,
        .function_count = look->tf && !all ? 1 : 0,
        .automatic = true,
        .keep_all = all,
        .memory_bytes = o->memory_bytes,
        .threads = (unsigned)(o->threads < MOST_THREADS ? o->threads : MOST_THREADS),
    };
}

static int brick_volume(drawing *d)
{
    const render_options *o = &d->o;
    const trip_brick_params wanted = brick_params(o, &o->function);
    int status = cached_volume_open(&d->volume, &wanted);
    if (status == 0 && d->volume.seconds > 0 && !(o->stats && !strcmp(o->stats, "-")))
        printf("%s: bricked into the cache in %.2f s\n", o->input, d->volume.seconds);
    return status;
}

/* 1: opens what the cache has of a volume for drawing it by default, if that holds all that the
 * function shows; 0: it does not. */
static int open_usual(drawing *d, session_look look)
{
    const trip_brick_params usual = brick_params(&d->o, &(session_look){ 0 });
    bool missing = false;
    int status = look.tf || look.window > 0 ? cached_volume_find(&d->volume, &usual) : 0;
    if (status != 1)
        return status;
    look.missing = &missing;
    status = session_open(&d->session, d->volume.path, &look, d->o.memory_bytes);
    if (!missing || status < 0)
        return status < 0 ? status : 1;
    session_close(&d->session);
    cached_volume_close(&d->volume);
    return 0;
}

static int open_from_cache(drawing *d)
{
    session_look look = d->o.function;
    look.name = d->o.input;
    int status = open_usual(d, look);
    if (status != 0)
        return status < 0 ? status : 0;
    status = brick_volume(d);
    return status == 0 ? session_open(&d->session, d->volume.path, &look, d->o.memory_bytes)
                       : status;
}

/* What was chosen of the volume is said whether it was bricked now or before. */
static int open_volume(drawing *d)
{
    int status = open_from_cache(d);
    const char *note = status == 0 ? trip_dataset_text_note(d->session.text) : NULL;
    if (note)
        trip_note(d->o.input, "%s", note);
    return status;
}

static int open_drawing(drawing *d)
{
    const render_options *o = &d->o;
    int status = cached_volume_wanted(o->input)
                     ? open_volume(d)
                     : session_open(&d->session, o->input, &o->function, o->memory_bytes);
    if (!status)
        status = session_take_image(&d->session, o->width, o->height, &d->rgba);
    if (!status)
        status = render_views_make(&d->views, o, &d->session);
    if (!status)
        status = trip_renderer_create(&d->renderer, o->renderer, (unsigned)o->threads,
                                      d->session.budget);
    if (!status && o->stats)
        status = render_stats_create(&d->stats);
    return status;
}

static void close_drawing(drawing *d)
{
    render_stats_destroy(d->stats);
    if (d->reader)
        trip_reader_destroy(d->reader);
    if (d->renderer)
        d->renderer->ops->destroy(d->renderer);
    session_release_image(&d->session, d->o.width, d->o.height, d->rgba);
    session_close(&d->session);
    cached_volume_close(&d->volume);
}

/* The reader is made when the first plan says which planes there are to read. */
static int make_reader(drawing *d, unsigned planes)
{
    bool finds_hidden = !strcmp(d->renderer->ops->name, "cpu");
    bool draws_all = d->o.hidden == RENDER_HIDDEN_DRAW || d->counting;
    const session_reader wanted = {
        .engine = d->o.engine,
        .planes = planes,
        .threads = d->o.threads,
        .cache = d->o.orbit > 1 && !d->counting,
        .renderer = d->renderer,
        .skip = finds_hidden && !draws_all ? trip_cpu_covered : NULL,
        .skip_user = d->renderer,
    };
    return d->reader ? 0 : session_make_reader(&d->session, &d->reader, &wanted);
}

/* image.png -> image-007.png */
static int image_path(const drawing *d, int index, char *path, size_t bytes)
{
    const char *output = d->o.output, *extension = strrchr(output, '.');
    int length = d->o.orbit ? snprintf(path, bytes, "%.*s-%03d%s", (int)(extension - output),
                                       output, index, extension)
                            : snprintf(path, bytes, "%s", output);
    if (length < 0 || (size_t)length >= bytes)
        return trip_fail(TRIP_USAGE, "render", "-o", "the name is too long");
    return 0;
}

static void show_progress(void *user, uint64_t splats, uint64_t total)
{
    drawing *d = user;
    trip_progress_show(&d->progress, d->counting ? "count" : "draw", splats, total, "splats");
}

static int draw_planned(drawing *d, const trip_camera *camera, const trip_plan *plan,
                        trip_frame_stats *stats)
{
    const session *s = &d->session;
    trip_frame frame = {
        .data = s->data,
        .camera = camera,
        .settings = &d->o.settings,
        .plan = plan,
        .table = s->table,
        .count = d->counting,
        .progress = show_progress,
        .progress_user = d,
    };
    int status = make_reader(d, plan->planes);
    d->progress = trip_progress_start(false);
    if (!status)
        status = trip_frame_draw(d->renderer, d->reader, &frame, d->rgba, stats);
    trip_progress_end(&d->progress);
    return status;
}

/* The camera and the plan of an image; the plan is released by the caller. */
static int plan_image(const drawing *d, int index, trip_camera *camera, trip_plan *plan)
{
    const session *s = &d->session;
    trip_camera_params view = render_views_get(&d->views, index);
    int status = trip_camera_make(camera, &view, &s->data->index_to_world);
    return status ? status
                  : trip_plan_make(plan, s->data, camera, &d->o.settings, s->table, s->budget);
}

static int draw_image(drawing *d, int index)
{
    const session *s = &d->session;
    char path[4096];
    trip_camera camera;
    trip_plan plan;
    trip_frame_stats stats;
    int status = image_path(d, index, path, sizeof path);
    if (!status)
        status = plan_image(d, index, &camera, &plan);
    if (status)
        return status;
    if (d->o.explain) {
        render_stats_explain_camera(&camera.params, d->views.splats, stdout);
        trip_plan_explain(&plan, s->data, &d->o.settings, stdout);
    }
    status = draw_planned(d, &camera, &plan, &stats);
    if (!status && d->o.explain)
        render_stats_explain(&stats, d->renderer, d->reader, stdout);
    if (!status && d->stats)
        status = render_stats_add_frame(d->stats, s->data, &plan, &stats);
    if (!status && d->stats)
        status = render_stats_add_camera(d->stats, &camera.params);
    trip_plan_release(&plan, s->budget);
    if (!status)
        status = trip_image_write(&pictures, path, d->o.width, d->o.height, d->rgba, NULL);
    if (!status && !(d->o.stats && !strcmp(d->o.stats, "-")))
        render_stats_summary(path, &d->o, &stats, stdout);
    return status;
}

static int count_image(drawing *d, int index)
{
    trip_camera camera;
    trip_plan plan;
    trip_frame_stats counted;
    int status = plan_image(d, index, &camera, &plan);
    if (status)
        return status;
    status = draw_planned(d, &camera, &plan, &counted);
    trip_plan_release(&plan, d->session.budget);
    if (!status && d->stats)
        status = render_stats_add_count(d->stats, index, &counted);
    if (!status && d->o.explain)
        render_stats_explain_count(&counted, stdout);
    return status;
}

/* Counting comes after all pictures are there, with a reader of its own, so that nothing that was
 * timed saw it. */
static int count_images(drawing *d, int images)
{
    int status = 0;
    trip_reader_destroy(d->reader);
    d->reader = NULL;
    d->counting = true;
    for (int i = 0; i < images && !status; i++)
        status = count_image(d, i);
    return status;
}

int trip_command_render(int argc, char **argv)
{
    drawing d = { 0 };
    int status = render_options_parse(&d.o, argc, argv);
    if (!status)
        status = render_options_check_outputs(&d.o);
    if (!status)
        status = piped_function_keep(&d.function, &d.o.function.tf);
    if (!status)
        status = open_drawing(&d);
    if (!status)
        status = trip_image_prepare(&pictures); /* it gets ready while the first image is drawn */
    int images = d.o.orbit ? d.o.orbit : 1;
    for (int i = 0; i < images && !status; i++)
        status = draw_image(&d, i);
    if (!status && d.stats)
        status = render_stats_describe(d.stats, &d.o, d.renderer, d.reader, d.session.budget);
    if (!status && d.o.count)
        status = count_images(&d, images);
    if (!status && d.stats)
        status = render_stats_write(d.stats, &d.o);
    if (status == TRIP_ERROR && d.volume.hold >= 0 && d.volume.path)
        cached_volume_check(&d.volume, d.o.input);
    close_drawing(&d);
    piped_function_release(&d.function);
    return trip_exit_status(status);
}
