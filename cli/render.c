/* triptych render: data set -> plan -> reader -> renderer -> merge -> image files. */
#include "commands.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cached_volume.h"
#include "library.h"
#include "piped_function.h"
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
    float *rgba, *depth; /* depth: NULL without --depth */
    render_stats *stats;
    trip_progress progress;
} drawing;

/* What is kept of a volume: what is shown by default, and what the function shows besides, so that
 * nothing is missing; everything where a window moves it, so that the next window finds it in the
 * cache. */
static triptych_brick_options brick_options(const render_options *o, const triptych_function *look)
{
    enum { MOST_THREADS = 256 };
    triptych_brick_options options = o->volume;
    options.keep_all = look->window > 0;
    options.functions = &look->name;
    options.function_count = look->name && !options.keep_all ? 1 : 0;
    options.automatic = 1;
    options.memory_bytes = o->memory_bytes;
    options.threads = (unsigned)(o->threads < MOST_THREADS ? o->threads : MOST_THREADS);
    return options;
}

static int brick_volume(drawing *d)
{
    const render_options *o = &d->o;
    const triptych_brick_options wanted = brick_options(o, &o->function);
    int status = cached_volume_open(&d->volume, d->t, o->input, &wanted);
    trip_progress_end(&d->progress);
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

/* 1: opens what the cache has of a volume for drawing it by default, if that holds all that the
 * function shows; 0: it does not. */
static int open_usual(drawing *d)
{
    triptych_function look = d->o.function;
    const triptych_brick_options usual = brick_options(&d->o, &(triptych_function){ 0 });
    int missing = 0, status = look.name || look.window > 0
                                  ? cached_volume_find(&d->volume, d->t, d->o.input, &usual)
                                  : 0;
    trip_progress_end(&d->progress);
    if (status != 1)
        return status;
    look.left_out = &missing;
    status = open_data(d, d->volume.path);
    if (!status)
        status = triptych_set_function(d->t, &look);
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
    return status ? status : triptych_set_function(d->t, &d->o.function);
}

/* What was chosen of the volume is said whether it was bricked now or before. */
static int open_volume(drawing *d)
{
    int status = open_from_cache(d);
    if (!status && d->o.field == RENDER_FIELD_SOURCE)
        status = triptych_set_source(d->t, d->o.input, &d->o.volume);
    char *note = status == 0 ? library_note(d->t, "note") : NULL;
    if (note)
        trip_note(d->o.input, "%s", note);
    free(note);
    return status;
}

static int open_input(drawing *d)
{
    if (cached_volume_wanted(d->o.input))
        return open_volume(d);
    int status = open_data(d, d->o.input);
    return status ? status : triptych_set_function(d->t, &d->o.function);
}

static int create_context(drawing *d)
{
    d->progress = trip_progress_start(false);
    int status = library_create(&context, &d->progress);
    d->t = context;
    return status;
}

static int open_drawing(drawing *d)
{
    const render_options *o = &d->o;
    const triptych_view view = render_view(o);
    int status = open_input(d);
    if (!status)
        status = triptych_new_picture(d->t, o->width, o->height, 4, &d->rgba);
    if (!status && o->depth)
        status = triptych_new_picture(d->t, o->width, o->height, 1, &d->depth);
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
        triptych_close(d->t); /* the pictures too */
    }
    cached_volume_close(&d->volume);
}

enum { PATH_BYTES = 4096 };

/* Of an orbit, image.png -> image-007.png. */
static int image_path(const drawing *d, const char *output, int index, char path[PATH_BYTES])
{
    const char *extension = strrchr(output, '.');
    size_t bytes = PATH_BYTES;
    int length = d->o.orbit ? snprintf(path, bytes, "%.*s-%03d%s", (int)(extension - output),
                                       output, index, extension)
                            : snprintf(path, bytes, "%s", output);
    if (length < 0 || (size_t)length >= bytes)
        return trip_fail(TRIP_USAGE, "render", output, "the name is too long");
    return 0;
}

/* A view of the orbit. */
static int turn(drawing *d, int index)
{
    return triptych_turn(d->t, d->o.orbit ? 360.0 * index / d->o.orbit : 0);
}

/* Draws the frame that is begun. */
static int draw_frame(drawing *d)
{
    enum { LOOK_NS = 20000000 };
    int status;
    d->progress = trip_progress_start(false);
    while ((status = triptych_step(d->t, UINT64_MAX)) == TRIPTYCH_WAITS)
        triptych_await(d->t, LOOK_NS);
    if (!status)
        status = d->depth ? triptych_picture_and_depth(d->t, d->rgba, d->depth)
                          : triptych_picture(d->t, d->rgba);
    trip_progress_end(&d->progress);
    return status;
}

/* The plan before the frame is drawn, what it cost afterwards. */
static int draw_planned(drawing *d, int index)
{
    int status = turn(d, index);
    if (!status)
        status = triptych_begin(d->t);
    if (!status && d->o.explain)
        status = render_stats_explain_plan(d->t, stdout);
    if (!status)
        status = draw_frame(d);
    triptych_end(d->t);
    if (!status && d->o.explain)
        status = render_stats_explain_cost(d->t, stdout);
    return status;
}

static int write_image(drawing *d, const char *path, int index)
{
    char depth_path[PATH_BYTES];
    int status = triptych_write(d->t, path, d->o.width, d->o.height, d->rgba);
    if (!status && d->depth)
        status = image_path(d, d->o.depth, index, depth_path);
    if (!status && d->depth)
        status = triptych_write_depth(d->t, depth_path, d->o.width, d->o.height, d->depth);
    return status;
}

static int draw_image(drawing *d, int index)
{
    char path[PATH_BYTES];
    int status = image_path(d, d->o.output, index, path);
    if (!status)
        status = draw_planned(d, index);
    if (!status && d->stats)
        status = render_stats_add_frame(d->stats, d->t);
    if (!status)
        status = write_image(d, path, index);
    if (!status && !(d->o.stats && !strcmp(d->o.stats, "-")))
        status = render_stats_summary(path, &d->o, d->t, stdout);
    return status;
}

static int count_image(drawing *d, int index)
{
    int status = turn(d, index);
    if (!status)
        status = triptych_begin(d->t);
    if (!status)
        status = draw_frame(d);
    triptych_end(d->t);
    if (!status && d->stats)
        status = render_stats_add_count(d->stats, index, d->t);
    if (!status && d->o.explain)
        status = render_stats_explain_count(d->t, stdout);
    return status;
}

/* Counting comes after all pictures are there, with a reader of its own, so that it changes nothing
 * that was timed. */
static int count_images(drawing *d, int images)
{
    triptych_settings counted = d->o.settings;
    counted.count = 1;
    int status = triptych_set_settings(d->t, &counted);
    for (int i = 0; i < images && !status; i++)
        status = count_image(d, i);
    return status;
}

int trip_command_render(int argc, char **argv)
{
    drawing d = { 0 };
    int status = render_options_parse(&d.o, argc, argv);
    if (!status)
        status = create_context(&d);
    if (!status)
        status = triptych_prepare_write(d.t, d.o.output, d.o.depth);
    if (!status)
        status = render_options_check_outputs(&d.o);
    if (!status)
        status = piped_function_keep(&d.function, d.t, &d.o.function.name);
    if (!status)
        status = open_drawing(&d);
    int images = d.o.orbit ? d.o.orbit : 1;
    for (int i = 0; i < images && !status; i++)
        status = draw_image(&d, i);
    if (!status && d.stats)
        status = render_stats_describe(d.stats, &d.o, d.t);
    if (!status && d.o.count)
        status = count_images(&d, images);
    if (!status && d.stats)
        status = render_stats_write(d.stats, &d.o);
    if (status == TRIP_ERROR && d.volume.hold >= 0 && d.volume.path)
        cached_volume_check(&d.volume, d.t, d.o.input);
    close_drawing(&d);
    piped_function_release(&d.function);
    return trip_exit_status(status);
}
