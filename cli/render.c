/* triptych render: data set -> plan -> reader -> renderer -> merge -> image files. */
#include "commands.h"

#include <stdio.h>
#include <string.h>

#include "cached_volume.h"
#include "context.h"
#include "piped_function.h"
#include "progress.h"
#include "render_options.h"
#include "render_stats.h"
#include "render_view.h"
#include "report.h"

/* The context, whose helper for pictures ends with the program. */
static triptych *context;

/* Everything that lives as long as the command. */
typedef struct drawing {
    render_options o;
    piped_function function;
    cached_volume volume; /* where the input is one */
    triptych *t;
    float *rgba;
    render_stats *stats;
    trip_progress progress;
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

static int open_data(drawing *d, const char *path)
{
    const render_options *o = &d->o;
    return triptych_open(d->t, path,
                         &(triptych_resources){ .memory_bytes = o->memory_bytes,
                                                .threads = (unsigned)o->threads,
                                                .renderer = o->renderer,
                                                .engine = o->engine,
                                                .keep_pages = o->orbit > 1,
                                                .read_hidden = o->hidden == RENDER_HIDDEN_DRAW,
                                                .name = o->input });
}

/* `left_out` as in triptych_function. */
static int set_function(drawing *d, int *left_out)
{
    const session_look *look = &d->o.function;
    return triptych_set_function(d->t, &(triptych_function){ .name = look->tf,
                                                             .opacity_scale = look->opacity_scale,
                                                             .window = look->window,
                                                             .level = look->level,
                                                             .left_out = left_out });
}

/* 1: opens what the cache has of a volume for drawing it by default, if that holds all that the
 * function shows; 0: it does not. */
static int open_usual(drawing *d)
{
    const session_look *look = &d->o.function;
    const trip_brick_params usual = brick_params(&d->o, &(session_look){ 0 });
    int missing = 0,
        status = look->tf || look->window > 0 ? cached_volume_find(&d->volume, &usual) : 0;
    if (status != 1)
        return status;
    status = open_data(d, d->volume.path);
    if (!status)
        status = set_function(d, &missing);
    if (!missing || status < 0)
        return status < 0 ? status : 1;
    triptych_close(d->t);
    cached_volume_close(&d->volume);
    return 0;
}

static int open_from_cache(drawing *d)
{
    int status = open_usual(d);
    if (status != 0)
        return status < 0 ? status : 0;
    status = brick_volume(d);
    if (!status)
        status = open_data(d, d->volume.path);
    return status ? status : set_function(d, NULL);
}

/* What was chosen of the volume is said whether it was bricked now or before. */
static int open_volume(drawing *d)
{
    int status = open_from_cache(d);
    const char *note = status == 0 ? trip_dataset_text_note(d->t->session.text) : NULL;
    if (note)
        trip_note(d->o.input, "%s", note);
    return status;
}

static int open_input(drawing *d)
{
    if (cached_volume_wanted(d->o.input))
        return open_volume(d);
    int status = open_data(d, d->o.input);
    return status ? status : set_function(d, NULL);
}

static void show_progress(void *user, uint64_t splats, uint64_t total)
{
    drawing *d = user;
    trip_progress_show(&d->progress, d->t->counting ? "count" : "draw", splats, total, "splats");
}

static void pass_message(void *user, const char *line)
{
    (void)user;
    trip_report_line(line);
}

static int create_context(drawing *d)
{
    int status = triptych_create(&context);
    d->t = context;
    if (status)
        return trip_fail(TRIP_ERROR, "render", "", "out of memory");
    triptych_set_messages(d->t, pass_message, NULL);
    triptych_set_progress(d->t, show_progress, d);
    return 0;
}

static int open_drawing(drawing *d)
{
    const render_options *o = &d->o;
    const triptych_view view = render_view(o);
    int status = create_context(d);
    if (!status)
        status = open_input(d);
    if (!status)
        status = session_take_image(&d->t->session, o->width, o->height, &d->rgba);
    if (!status)
        status = triptych_set_settings(d->t, &o->settings);
    if (!status)
        status = triptych_set_view(d->t, &view);
    if (!status && o->stats)
        status = render_stats_create(&d->stats);
    return status;
}

static void close_drawing(drawing *d)
{
    render_stats_destroy(d->stats);
    if (d->t) {
        triptych_end(d->t);
        session_release_image(&d->t->session, d->o.width, d->o.height, d->rgba);
        triptych_close(d->t);
    }
    cached_volume_close(&d->volume);
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

/* A view of the orbit, and the plan of its frame. */
static int prepare_image(drawing *d, int index)
{
    int status = triptych_turn(d->t, d->o.orbit ? 360.0 * index / d->o.orbit : 0);
    return status ? status : trip_context_prepare(d->t);
}

/* Leaves the frame for a look at its plan and statistics. */
static int draw_prepared(drawing *d)
{
    enum { LOOK_NS = 20000000 };
    d->progress = trip_progress_start(false);
    int status = triptych_begin(d->t);
    while (!status && (status = triptych_step(d->t, UINT64_MAX)) == TRIPTYCH_WAITS)
        status = triptych_await(d->t, LOOK_NS);
    if (!status)
        status = triptych_picture(d->t, d->rgba);
    trip_progress_end(&d->progress);
    return status;
}

static int tell_of_image(drawing *d)
{
    const triptych *t = d->t;
    const trip_frame_stats *stats = &t->drawing.stats;
    if (d->o.explain)
        render_stats_explain(stats, t->renderer, t->reader, stdout);
    int status = 0;
    if (d->stats)
        status = render_stats_add_frame(d->stats, t->session.data, &t->plan, stats);
    if (!status && d->stats)
        status = render_stats_add_camera(d->stats, &t->camera.params);
    return status;
}

static int draw_image(drawing *d, int index)
{
    const triptych *t = d->t;
    char path[4096];
    int status = image_path(d, index, path, sizeof path);
    if (!status)
        status = prepare_image(d, index);
    if (status)
        return status;
    if (d->o.explain) {
        render_stats_explain_camera(&t->camera.params, t->fit_splats, stdout);
        trip_plan_explain(&t->plan, t->session.data, &t->settings, stdout);
    }
    status = draw_prepared(d);
    if (!status)
        status = tell_of_image(d);
    triptych_end(d->t);
    if (!status)
        status = triptych_write(d->t, path, d->o.width, d->o.height, d->rgba);
    if (!status && !(d->o.stats && !strcmp(d->o.stats, "-")))
        render_stats_summary(path, &d->o, &t->drawing.stats, stdout);
    return status;
}

static int count_image(drawing *d, int index)
{
    int status = prepare_image(d, index);
    if (!status)
        status = draw_prepared(d);
    triptych_end(d->t);
    if (!status && d->stats)
        status = render_stats_add_count(d->stats, index, &d->t->drawing.stats);
    if (!status && d->o.explain)
        render_stats_explain_count(&d->t->drawing.stats, stdout);
    return status;
}

/* Counting comes after all pictures are there, with a reader of its own, so that nothing that was
 * timed saw it. */
static int count_images(drawing *d, int images)
{
    int status = 0;
    trip_context_count(d->t);
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
        status =
            trip_image_prepare(&d.t->pictures); /* it gets ready while the first image is drawn */
    int images = d.o.orbit ? d.o.orbit : 1;
    for (int i = 0; i < images && !status; i++)
        status = draw_image(&d, i);
    if (!status && d.stats)
        status =
            render_stats_describe(d.stats, &d.o, d.t->renderer, d.t->reader, d.t->session.budget);
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
