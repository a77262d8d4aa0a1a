/* triptych render: data set -> plan -> reader -> renderer -> merge -> image files or a video. */
#include "commands.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cache_folder.h"
#include "cached_volume.h"
#include "clock.h"
#include "flight.h"
#include "library.h"
#include "piped_tf.h"
#include "placed_input.h"
#include "render_files.h"
#include "render_options.h"
#include "render_stats.h"
#include "report.h"
#include "text.h"
#include "sequence.h"
#include "video.h"

/* The context lives until the program ends, because its helper process for images does. */
static triptych *context;

/* State of the command. */
typedef struct drawing {
    render_options o;
    piped_tf function;
    cached_volume volume; /* if the input is a volume */
    placed_input placed;  /* if the input is a scene file */
    char *choices_folder;
    triptych *t;
    float *rgba, *depth; /* depth is NULL without --depth */
    sequence sequence;
    bool by_cameras; /* the sequence sets each frame's camera; else the first view is turned */
    video *video;    /* NULL if frames go into image files */
    render_stats *stats;
    trip_progress progress;
    int empty;    /* number of pictures without any visible voxel */
    int done;     /* number of finished pictures */
    double begin; /* of the first picture, seconds of the monotonic clock */
} drawing;

/* Returns the wanted data set of a volume. Bricking always keeps the voxels that the automatic
 * transfer function shows, and the voxels that the sequence's transfer functions show. If a window
 * moves the transfer function, bricking keeps every voxel, so that the next window finds its voxels
 * in the cache. A smaller data set serves too if it holds the voxels of this window. */
static cached_wish wish_of(const drawing *d)
{
    const render_options *o = &d->o;
    const sequence *shown = &d->sequence;
    cached_wish wish = { .options = o->volume, .checksum = o->quality.measured };
    triptych_brick_options *options = &wish.options;
    options->keep_all = o->function.window > 0;
    options->functions = shown->names;
    options->function_count = shown->name_count;
    options->ranges = shown->ranges;
    options->range_count = shown->range_count;
    options->automatic = 1;
    options->levels_for = o->levels_for;
    options->memory_bytes = o->resources.memory_bytes;
    options->threads = o->resources.threads;
    if (options->keep_all) {
        options->function_count = options->range_count = 0;
        wish.shown = sequence_has_functions(shown) ? NULL : &o->function;
    }
    return wish;
}

/* Returns whether stdout gets no lines about pictures. */
static bool has_no_summary(const render_options *o)
{
    return command_line_quiet() || (o->stats && !strcmp(o->stats, "-"));
}

static int brick_volume(drawing *d)
{
    const render_options *o = &d->o;
    const cached_wish wish = wish_of(d);
    int status = cached_volume_open(&d->volume, d->t, o->input, &wish);
    trip_progress_end(&d->progress);
    if (status == 0 && d->volume.seconds > 0 && !has_no_summary(o)) {
        trip_text_write(stdout, o->input);
        printf(": bricked into the cache in %.2f s\n", d->volume.seconds);
    }
    if (status == 0 && d->volume.wider && !has_no_summary(o)) {
        trip_text_write(stdout, o->input);
        puts(": found in the cache, in a data set made for another transfer function");
    }
    return status;
}

static int open_data(drawing *d, const char *path)
{
    const render_options *o = &d->o;
    triptych_resources resources = o->resources;
    resources.keep_pages = d->sequence.frames > 1;
    resources.name = o->input;
    int status = placed_input_open(&d->placed, d->t, path, &resources);
    return status || d->placed.count ? status : library_add(d->t, o->more, o->more_count, o->heat);
}

static int open_from_cache(drawing *d)
{
    int status = brick_volume(d);
    if (!status)
        status = open_data(d, d->volume.path);
    return status ? status : triptych_set_transfer_function(d->t, &d->o.function);
}

/* Prints the note of bricking also if the data set came from the cache. */
static int open_volume(drawing *d)
{
    int status = open_from_cache(d);
    if (!status)
        status = quality_options_check_data(d->o.quality.measured, d->t, d->o.input);
    if (!status && d->o.field == RENDER_FIELD_SOURCE)
        status = triptych_set_source(d->t, d->o.input, &d->o.volume);
    char *note = status == 0 && !triptych_is_scene(d->t) ? library_note(d->t, "note") : NULL;
    if (note)
        trip_note(d->o.input, "%s", note);
    free(note);
    return status;
}

/* Returns whether the inputs are objects with places of their own. */
static bool places_objects(const drawing *d)
{
    const render_options *o = &d->o;
    bool scenes = triptych_is_gaussians(d->t, o->input) != 0;
    for (int i = 0; i < o->more_count; i++)
        scenes |= triptych_is_gaussians(d->t, o->more[i]) || triptych_is_scene_file(o->more[i]);
    return triptych_is_scene_file(o->input) || o->place || (o->more_count && scenes);
}

/* Checks the settings of the kinds of objects. Settings of one kind do not concern the others. */
static int check_objects(const drawing *d)
{
    const render_options *o = &d->o;
    unsigned scenes = 0;
    for (unsigned i = 0; i < d->placed.count; i++)
        scenes += triptych_is_gaussians(d->t, d->placed.given[i].path) != 0;
    const bool mixed = scenes && scenes < d->placed.count;
    int status = mixed ? 0 : draw_settings_check_kind(&o->settings, &o->resources, scenes > 0);
    if (!status && o->quality.error > 0)
        status = trip_option_fail("--error", "does not apply to several objects in one picture");
    if (!status && o->field == RENDER_FIELD_SOURCE)
        status = trip_option_fail("--field", "source does not apply to objects with places");
    if (!status && o->heat)
        status = trip_option_fail("--emission", "does not apply to objects with places");
    if (!status && scenes == d->placed.count && (o->function.name || o->function.window > 0))
        status = library_fail_scene_option(o->function.name ? "tf" : "window");
    return status;
}

/* Several inputs without places must be data sets of one volume. */
static int check_input(const drawing *d)
{
    const render_options *o = &d->o;
    for (int i = 0; i < o->more_count; i++) {
        const char *volume = cached_volume_wanted(o->input)     ? o->input
                             : cached_volume_wanted(o->more[i]) ? o->more[i]
                                                                : NULL;
        if (volume)
            return trip_option_fail(volume, TRIP_ONE_VOLUME_A_PICTURE);
    }
    const bool is_scene = triptych_is_gaussians(d->t, o->input) != 0;
    int status = library_check_kind(d->t, o->input, &o->settings, &o->resources, &o->function);
    if (!status && is_scene && o->quality.error > 0)
        status = library_fail_scene_option("error");
    return status;
}

/* Finds or makes the data sets of a scene file. */
static int find_objects(drawing *d)
{
    const cached_wish wish = wish_of(d);
    const char *inputs[1 + RENDER_MORE_MAX] = { d->o.input };
    const bool file = triptych_is_scene_file(d->o.input);
    if (file && (d->o.more_count || d->o.place))
        return trip_option_fail(d->o.input,
                                "is a scene file, which lists and places all objects; leave "
                                "out other inputs and --place");
    memcpy(inputs + 1, d->o.more, (size_t)d->o.more_count * sizeof *inputs);
    int status = file ? placed_input_read(&d->placed, d->t, d->o.input, &wish.options)
                      : placed_input_list(&d->placed, d->t, inputs, (unsigned)d->o.more_count + 1,
                                          d->o.place, &wish.options);
    trip_progress_end(&d->progress);
    if (!status && d->placed.bricked && !has_no_summary(&d->o)) {
        trip_text_write(stdout, d->o.input);
        printf(": %u of its %u objects bricked into the cache in %.2f s\n", d->placed.bricked,
               d->placed.count, d->placed.seconds);
    }
    return status;
}

static int open_input(drawing *d)
{
    if (places_objects(d)) {
        int found = find_objects(d);
        if (!found)
            found = check_objects(d);
        if (!found)
            found = open_data(d, d->o.input);
        return found ? found : triptych_set_transfer_function(d->t, &d->o.function);
    }
    const int checked = check_input(d);
    if (checked)
        return checked;
    if (cached_volume_wanted(d->o.input))
        return open_volume(d);
    int status = open_data(d, d->o.input);
    return status ? status : triptych_set_transfer_function(d->t, &d->o.function);
}

static int create_context(drawing *d)
{
    d->choices_folder = cache_folder_choices();
    d->o.resources.choices_folder = d->choices_folder;
    d->progress = trip_progress_start();
    int status = library_create(&context, &d->progress);
    d->t = context;
    return status;
}

static const char *data_path(const drawing *d)
{
    return d->volume.path ? d->volume.path : d->o.input;
}

static int take_pictures(drawing *d)
{
    const render_options *o = &d->o;
    int status = triptych_new_picture(d->t, o->view.view.width, o->view.view.height, 4, &d->rgba);
    if (!status && o->depth)
        status = triptych_new_picture(d->t, o->view.view.width, o->view.view.height, 1, &d->depth);
    return status ? status : draw_settings_use(d->t, &o->settings);
}

static int open_drawing(drawing *d)
{
    int status = sequence_find_shown(&d->sequence);
    if (!status)
        status = open_input(d);
    if (!status)
        status = take_pictures(d);
    if (!status)
        status = sequence_set_view(&d->sequence, d->t);
    if (!status && d->o.stats)
        status = render_stats_create(&d->stats);
    return status;
}

static void close_drawing(drawing *d)
{
    render_stats_destroy(d->stats);
    video_abandon(d->video);
    sequence_release(&d->sequence);
    if (d->t) {
        triptych_end(d->t);
        triptych_close(d->t); /* frees rgba and depth too */
    }
    cached_volume_close(&d->volume);
    placed_input_close(&d->placed);
    free(d->choices_folder);
}

static int set_frame(drawing *d, int index)
{
    if (d->by_cameras)
        return sequence_set_frame(&d->sequence, d->t, index, false);
    return triptych_turn(d->t, d->o.orbit ? 360.0 * index / d->o.orbit : 0);
}

/* Returns whether the pictures of a sequence get no lines of their own. */
static bool is_silent(const drawing *d)
{
    return d->sequence.frames > 1 && !d->o.explain;
}

/* Draws the frame after triptych_begin(). */
static int draw_frame(drawing *d)
{
    enum { LOOK_NS = 20000000 };
    int status = 0;
    while (!status && (status = triptych_step(d->t, UINT64_MAX)) == TRIPTYCH_STEP_WAITS)
        status = triptych_await(d->t, LOOK_NS);
    if (!status)
        status = d->depth ? triptych_picture_and_depth(d->t, d->rgba, d->depth)
                          : triptych_picture(d->t, d->rgba);
    if (status || !is_silent(d))
        trip_progress_end(&d->progress);
    return status;
}

/* Prints the plan before the frame is drawn, and the cost afterwards. */
static int draw_planned(drawing *d, int index)
{
    int status = set_frame(d, index);
    if (!status)
        status = triptych_begin(d->t);
    if (!status && d->o.explain)
        status = render_stats_explain_plan(d->t, stdout);
    if (!status)
        status = draw_frame(d);
    triptych_end(d->t);
    if (!status && d->o.explain)
        status = render_stats_explain_cost(&d->o, d->t, stdout);
    return status;
}

/* Writes the picture and its distances, unless the frame goes into a video. */
static int write_image(void *user, triptych *t, int index, const float *rgba, const float *depth)
{
    const drawing *d = user;
    char path[RENDER_FILE_BYTES];
    int status = d->video ? 0 : render_file_name(&d->o, d->o.output, index, path);
    if (!status && !d->video)
        status = triptych_write(t, path, d->o.view.view.width, d->o.view.view.height, rgba);
    if (!status && depth)
        status = render_file_name(&d->o, d->o.depth, index, path);
    if (!status && depth)
        status = triptych_write_depth(t, path, d->o.view.view.width, d->o.view.view.height, depth);
    return status;
}

/* Returns whether the picture shows only the background. */
static bool is_empty(const render_options *o, const float *rgba)
{
    const double *ground = draw_settings_background(&o->settings);
    const size_t pixels = (size_t)o->view.view.width * (size_t)o->view.view.height;
    double max = 0;
    for (size_t i = 0; i < 4 * pixels && max < 1e-6; i++)
        max = fabs((double)rgba[i] - (i % 4 < 3 ? ground[i % 4] : 1) * ground[3]);
    return max < 1e-6;
}

static void warn_of_empty(const drawing *d)
{
    const int frames = d->sequence.frames;
    char which[64] = "the picture is empty";
    if (frames > 1)
        snprintf(which, sizeof which, "%d of %d pictures are empty", d->empty, frames);
    if (d->empty)
        trip_warn(d->o.output, "%s: check the view, the clipping and the transfer function", which);
}

/* Adds the picture to the video and prints its summary; called in the order of the frames. */
static int finish_image(void *user, triptych *t, int index, const float *rgba)
{
    drawing *d = user;
    char path[RENDER_FILE_BYTES];
    int status = d->video ? video_add(d->video, rgba) : 0;
    d->empty += is_empty(&d->o, rgba);
    if (!status && is_silent(d))
        trip_progress_pictures(&d->progress, ++d->done, d->sequence.frames);
    else if (!status && !(status = render_file_name(&d->o, d->o.output, index, path)) &&
             !has_no_summary(&d->o))
        status = render_stats_summary(path, &d->o, t, stdout);
    return status;
}

/* Prints one line for all pictures of a sequence. */
static void print_sequence(const drawing *d, bool is_video)
{
    char first[RENDER_FILE_BYTES], last[RENDER_FILE_BYTES];
    const int frames = d->sequence.frames;
    if (!is_silent(d) || has_no_summary(&d->o) || render_file_name(&d->o, d->o.output, 0, first) ||
        render_file_name(&d->o, d->o.output, frames - 1, last))
        return;
    render_stats_sequence(&(render_sequence){ .first = first,
                                              .last = is_video ? NULL : last,
                                              .frames = frames,
                                              .seconds = trip_now_seconds() - d->begin },
                          &d->o, stdout);
}

/* Tells how many pictures of a sequence exist after Ctrl-C. */
static void note_interrupted(const drawing *d)
{
    if (d->video)
        trip_note(d->o.output, "%d of %d pictures were drawn; no video is written", d->done,
                  d->sequence.frames);
    else
        trip_note(d->o.output, "the first %d of %d pictures are written", d->done,
                  d->sequence.frames);
}

static int draw_image(drawing *d, int index)
{
    int status = draw_planned(d, index);
    if (!status && d->stats)
        status = render_stats_add_frame(d->stats, d->t);
    if (!status)
        status = write_image(d, d->t, index, d->rgba, d->depth);
    return status ? status : finish_image(d, d->t, index, d->rgba);
}

/* Returns how many frames are drawn at once. It is 1 if each frame is timed, or if one frame alone
 * uses all processors or reads the source. */
static int contexts_of(const drawing *d)
{
    enum { DEFAULT = 2 };
    const render_options *o = &d->o;
    bool slow = o->resources.renderer == TRIPTYCH_RENDERER_INTEGRAL ||
                o->resources.renderer == TRIPTYCH_RENDERER_REFERENCE ||
                o->resources.engine == TRIPTYCH_ENGINE_NULL;
    if (d->sequence.frames < 2 || o->stats || o->explain || o->field == RENDER_FIELD_SOURCE)
        return 1;
    return o->in_flight ? o->in_flight : slow ? 1 : DEFAULT;
}

/* Opens the data again with all of the memory, after frames in flight. */
static int reopen(drawing *d)
{
    int status = open_data(d, data_path(d));
    if (!status)
        status = library_set_function_quietly(d->t, &d->o.function);
    return status ? status : take_pictures(d);
}

/* Draws frames in flight from frame *first on, and sets *first to the first frame that is left. */
static int draw_in_flight(drawing *d, int *first)
{
    const flight f = { .o = &d->o,
                       .sequence = &d->sequence,
                       .data = data_path(d),
                       .placed = &d->placed,
                       .contexts = contexts_of(d),
                       .write = write_image,
                       .then = finish_image,
                       .user = d };
    if (f.contexts < 2)
        return 0;
    if (d->choices_folder) { /* makes the trial once for all contexts */
        int chosen = triptych_choose(d->t);
        if (chosen)
            return chosen;
    }
    triptych_close(d->t);
    d->rgba = d->depth = NULL;
    d->by_cameras = true;
    int status = flight_draw(&f, first);
    return status > 0 ? reopen(d) : status;
}

static int start_video(drawing *d)
{
    const render_options *o = &d->o;
    if (!video_is_named(o->output))
        return 0;
    return video_create(&d->video, o->output, o->view.view.width, o->view.view.height,
                        sequence_frames_per_second(&d->sequence));
}

static int draw_images(drawing *d)
{
    int first = 0,
        status = d->sequence.frames > 1 || d->o.path ? sequence_prepare(&d->sequence, d->t) : 0;
    d->by_cameras = d->o.path;
    if (!status)
        status = start_video(d);
    d->begin = trip_now_seconds();
    if (is_silent(d))
        trip_progress_pictures(&d->progress, 0, d->sequence.frames);
    if (!status)
        status = draw_in_flight(d, &first);
    for (int i = first; i < d->sequence.frames && !status; i++)
        status = draw_image(d, i);
    trip_progress_end(&d->progress);
    if (status == TRIP_INTERRUPTED && is_silent(d))
        note_interrupted(d);
    const bool is_video = d->video != NULL;
    if (!status && is_video) {
        status = video_finish(d->video);
        d->video = NULL;
    }
    if (!status)
        print_sequence(d, is_video);
    return status;
}

static int count_image(drawing *d, int index)
{
    int status = set_frame(d, index);
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

/* Counts after all pictures are written, with a separate reader, so that counting changes no
 * timing. */
static int count_images(drawing *d, int images)
{
    draw_settings counted = d->o.settings;
    counted.all.count_exactly = 1;
    int status = draw_settings_use(d->t, &counted);
    for (int i = 0; i < images && !status; i++)
        status = count_image(d, i);
    return status;
}

/* Checks that the program can write these kinds of image files. */
static int check_kinds(drawing *d)
{
    const render_options *o = &d->o;
    bool is_video = video_is_named(o->output);
    return is_video ? video_check(o->output, o->view.view.width, o->view.view.height)
                    : triptych_prepare_write(d->t, o->output, o->depth);
}

int trip_command_render(int argc, char **argv)
{
    drawing d = { 0 };
    int status = render_options_parse(&d.o, argc, argv);
    if (!status)
        status = create_context(&d);
    if (!status)
        status = check_kinds(&d);
    if (!status)
        status = sequence_load(&d.sequence, &d.o);
    if (!status)
        status = render_files_check(&d.sequence, d.t);
    if (!status)
        status = piped_tf_keep(&d.function, d.t, &d.o.function.name);
    if (!status)
        status = open_drawing(&d);
    if (!status)
        status = draw_images(&d);
    if (!status)
        warn_of_empty(&d);
    if (!status && d.stats)
        status = render_stats_describe(d.stats, &d.o, d.t);
    if (!status && d.o.count)
        status = count_images(&d, d.sequence.frames);
    if (!status && d.stats)
        status = render_stats_write(d.stats, &d.o);
    if (status == TRIP_ERROR && d.volume.hold >= 0 && d.volume.path)
        cached_volume_check(&d.volume, d.t, d.o.input);
    close_drawing(&d);
    piped_tf_release(&d.function);
    return trip_exit_status(status);
}
