#include "render_files.h"

#include <stdio.h>
#include <string.h>

#include "new_file.h"
#include "command_line.h"
#include "read_data.h"
#include "render_stats.h"
#include "report.h"
#include "video.h"

int render_file_name(const render_options *o, const char *output, int frame,
                     char path[RENDER_FILE_BYTES])
{
    const char *extension = strrchr(output, '.');
    const bool several = (o->orbit || o->path) && !video_is_named(output);
    int length = several ? snprintf(path, RENDER_FILE_BYTES, "%.*s-%03d%s",
                                    (int)(extension - output), output, frame, extension)
                         : snprintf(path, RENDER_FILE_BYTES, "%s", output);
    if (length < 0 || length >= RENDER_FILE_BYTES)
        return trip_fail(TRIP_USAGE, "render", output,
                         "the name is too long; at most 4095 bytes are possible");
    return 0;
}

/* Returns the path of --stats if it is a regular file, else NULL. */
static const char *stats_file(const render_options *o)
{
    return o->stats && strcmp(o->stats, "-") && !render_stats_is_special(o->stats) ? o->stats
                                                                                   : NULL;
}

static int check_folders(const render_options *o)
{
    const char *stats = stats_file(o);
    int status = trip_new_file_check("write", o->output);
    if (!status && o->depth)
        status = trip_new_file_check("write", o->depth);
    if (!status && stats)
        status = trip_new_file_check("write", stats);
    return status;
}

static int add_read(read_files *r, const sequence *s, triptych *t)
{
    const render_options *o = s->o;
    int status = read_files_add_data(r, t, o->input, &o->volume);
    for (int i = 0; i < o->more_count && !status; i++)
        status = read_files_add(r, o->more[i]);
    if (!status)
        status = read_files_add(r, o->heat);
    if (!status)
        status = read_files_add(r, o->path);
    if (!status)
        status = read_files_add_function(r, o->function.name);
    for (size_t i = 0; i < s->path.count && !status; i++)
        status = read_files_add_function(r, s->path.keys[i].function);
    return status;
}

static int check_name(const read_files *r, const char *name, const char *other)
{
    if (other && read_files_are_one(name, other))
        return trip_option_fail(
            name, "would be written twice; -o, --depth and --stats require different names");
    return read_files_check(r, name);
}

/* Checks the names of a frame's picture and distances. */
static int check_frame(const read_files *r, const sequence *s, int frame)
{
    const render_options *o = s->o;
    const char *stats = stats_file(o);
    char picture[RENDER_FILE_BYTES], depth[RENDER_FILE_BYTES];
    int status = render_file_name(o, o->output, frame, picture);
    if (!status)
        status = check_name(r, picture, stats);
    if (!status && o->depth)
        status = render_file_name(o, o->depth, frame, depth);
    if (!status && o->depth)
        status = check_name(r, depth, stats);
    return !status && o->depth ? check_name(r, picture, depth) : status;
}

int render_files_check(const sequence *s, triptych *t)
{
    read_files r = { 0 };
    const char *stats = stats_file(s->o);
    int status = check_folders(s->o);
    if (!status)
        status = add_read(&r, s, t);
    if (!status && stats)
        status = check_name(&r, stats, NULL);
    for (int i = 0; i < s->frames && !status; i++)
        status = check_frame(&r, s, i);
    read_files_release(&r);
    return status;
}
