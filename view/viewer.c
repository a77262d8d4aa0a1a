#include "viewer.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "clipping.h"
#include "light.h"
#include "text.h"
#include "state_file.h"

enum { PANEL_WIDTH = 330, SECONDS_SAID = 6 };

/* ---- data sets ---- */

void trip_viewer_init(trip_viewer *v, trip_frames *frames)
{
    *v = (trip_viewer){
        .frames = frames,
        .shown = -1,
        .scale = 1,
        .panel = true,
    };
}

static void free_document(trip_document *d)
{
    if (!d)
        return;
    free(d->input);
    free(d->source);
    free(d->heat);
    free(d->function);
    trip_tf_editor_destroy(d->editor);
    trip_camera_path_release(&d->path);
    free(d->path_file);
    free(d);
}

/* Compares canonical paths. */
static char *path_of(const trip_document *d)
{
    return realpath(d->input, NULL);
}

static void keep(const trip_viewer *v, const trip_document *d)
{
    char *path = v->fresh || !d->opened ? NULL : path_of(d);
    if (!path)
        return;
    char *text = d->edited ? trip_tf_editor_text(d->editor) : NULL;
    char *heat = d->heat ? realpath(d->heat, NULL) : NULL; /* the file may be missing for a while */
    draw_settings settings = d->settings;
    if (!d->heat)
        settings.effects.which &= ~TRIPTYCH_EFFECT_EMISSION;
    trip_state_file_save(&(trip_view_state){ .has_navigation = d->has_navigation,
                                             .navigation = d->navigation,
                                             .function = d->function,
                                             .text = text,
                                             .heat = heat ? heat : d->heat,
                                             .opacity_scale = d->opacity_scale,
                                             .settings = settings,
                                             .clips = d->clips,
                                             .panel = v->panel,
                                             .box = v->box,
                                             .axes = v->axes,
                                             .scale_bar = v->scale_bar },
                         path);
    free(heat);
    free(text);
    free(path);
}

/* The command line's view overrides the saved state. */
static void take_state(trip_viewer *v, trip_document *d, trip_view_state *s)
{
    if (!v->start_given && s->has_navigation) {
        d->navigation = s->navigation;
        d->has_navigation = true;
    }
    if (!v->settings_given) {
        d->settings = s->settings;
        d->clips = s->clips;
        free(d->heat);
        d->heat = s->heat;
        s->heat = NULL;
    }
    if (!(v->opacity_scale > 0))
        d->opacity_scale = s->opacity_scale;
    if (!v->function && s->text && trip_tf_editor_set_text(d->editor, d->input, s->text) == 0)
        d->edited = true;
    if (!v->function && s->function) {
        d->function = s->function;
        s->function = NULL;
    }
    v->box = s->box;
    v->axes = s->axes;
    v->scale_bar = s->scale_bar;
}

static void recall(trip_viewer *v, trip_document *d)
{
    trip_view_state s = { .settings = d->settings,
                          .opacity_scale = d->opacity_scale,
                          .panel = v->panel,
                          .box = v->box,
                          .axes = v->axes,
                          .scale_bar = v->scale_bar };
    char *path = v->fresh ? NULL : path_of(d);
    if (path && trip_state_file_load(&s, path) == 1)
        take_state(v, d, &s);
    trip_view_state_release(&s);
    free(path);
}

void trip_viewer_release(trip_viewer *v)
{
    for (int i = 0; i < v->count; i++) {
        keep(v, v->documents[i]);
        free_document(v->documents[i]);
    }
    *v = (trip_viewer){ .shown = -1 };
}

trip_document *trip_viewer_document(trip_viewer *v)
{
    return v->shown >= 0 ? v->documents[v->shown] : NULL;
}

void trip_viewer_say(trip_viewer *v, const char *text)
{
    snprintf(v->message, sizeof v->message, "%s", text);
    v->message_seconds = 0;
}

static trip_document *make_document(trip_viewer *v, const char *input)
{
    trip_document *d = calloc(1, sizeof *d);
    if (!d)
        return NULL;
    *d = (trip_document){ .input = strdup(input),
                          .function = v->function ? strdup(v->function) : NULL,
                          .heat = v->heat ? strdup(v->heat) : NULL,
                          .editor = trip_tf_editor_create(),
                          .start = v->start,
                          .settings = v->settings,
                          .clips = v->settings.clip.box || v->settings.clip.planes > 0,
                          .opacity_scale = v->opacity_scale > 0 ? v->opacity_scale : 1 };
    if (d->input && d->editor && (d->function || !v->function) && (d->heat || !v->heat)) {
        recall(v, d);
        return d;
    }
    free_document(d);
    return NULL;
}

void trip_viewer_show(trip_viewer *v, int which)
{
    v->shown = which >= 0 && which < v->count ? which : v->count - 1;
    v->changed = true;
    trip_viewer_let_go(v);
}

void trip_viewer_open(trip_viewer *v, const char *input)
{
    int which = 0;
    while (which < v->count && strcmp(v->documents[which]->input, input))
        which++;
    if (which == TRIP_DOCUMENTS) {
        trip_viewer_say(v, "too many open data sets: close one");
        return;
    }
    if (which == v->count) {
        if (!(v->documents[which] = make_document(v, input)))
            return;
        v->count++;
    }
    v->documents[which]->number = ++v->numbers;
    v->documents[which]->opened = false;
    trip_viewer_show(v, which);
}

void trip_viewer_close(trip_viewer *v)
{
    if (v->shown < 0)
        return;
    keep(v, v->documents[v->shown]);
    free_document(v->documents[v->shown]);
    v->count--;
    memmove(v->documents + v->shown, v->documents + v->shown + 1,
            (size_t)(v->count - v->shown) * sizeof *v->documents);
    trip_viewer_show(v, v->shown);
}

/* ---- the wish ---- */

const char *trip_viewer_heat(const trip_document *d)
{
    return d->cold || d->kind ? NULL : d->heat;
}

const char *trip_viewer_function(const trip_document *d)
{
    return draw_kind_is_gaussian(d->kind) ? NULL : d->function;
}

draw_settings trip_viewer_settings(const trip_document *d)
{
    draw_settings s = d->settings;
    if (!d->clips)
        s.clip = (triptych_clip){ 0 };
    if (s.light.kind == TRIPTYCH_LIGHT_HEAD) /* its shadows are invisible */
        s.effects.which &= ~TRIPTYCH_EFFECT_SHADOWS;
    if (!trip_viewer_heat(d)) {
        s.effects.which &= ~TRIPTYCH_EFFECT_EMISSION;
        draw_settings_unset(&s, DRAW_TEMPERATURE);
    }
    draw_settings_drop_excluded(&s, TRIPTYCH_RENDERER_AUTO);
    if (d->opened)
        draw_settings_drop_kind(&s, d->kind);
    return s;
}

/* Posts the editor's text only if the transfer function was edited. */
static void want(trip_viewer *v)
{
    trip_document *d = trip_viewer_document(v);
    if (!d || v->picture_width < 1 || v->height < 1)
        return;
    char *text = d->edited ? trip_tf_editor_text(d->editor) : NULL;
    trip_frames_want(v->frames, &(trip_wanted){ .document = d->number,
                                                .input = d->input,
                                                .keep_all = d->keep_all,
                                                .heat = d->heat,
                                                .has_navigation = d->has_navigation,
                                                .navigation = d->navigation,
                                                .start = &d->start,
                                                .width = v->picture_width,
                                                .height = v->height,
                                                .function = d->function,
                                                .text = text,
                                                .opacity_scale = d->opacity_scale,
                                                .settings = trip_viewer_settings(d) });
    d->revision = trip_tf_editor_revision(d->editor);
    free(text);
    v->changed = false;
}

static void describe(trip_document *d, trip_opened *o)
{
    if (d->opened)
        trip_clipping_rescale(&d->settings.clip, &d->info, &o->info);
    d->opened = true;
    d->small = o->small;
    d->cold = o->cold;
    d->kind = o->kind;
    d->edited &= !d->kind;
    d->info = o->info;
    d->scene = o->scene;
    d->histogram = o->histogram;
    free(d->source);
    d->source = o->source;
    o->source = NULL;
}

static void take_opened(trip_viewer *v)
{
    trip_opened o;
    trip_document *d = NULL;
    if (!trip_frames_take_opened(v->frames, &o))
        return;
    for (int i = 0; i < v->count; i++)
        d = v->documents[i]->number == o.document ? v->documents[i] : d;
    if (d && !d->has_navigation)
        d->navigation = o.navigation;
    if (d)
        d->has_navigation = true;
    if (d && o.first)
        describe(d, &o);
    if (d && o.function && !d->edited) {
        trip_tf_editor_set_text(d->editor, d->input, o.function);
        d->revision = trip_tf_editor_revision(d->editor);
    }
    trip_opened_free(&o);
}

static void take_status(trip_viewer *v)
{
    v->status = trip_frames_get_status(v->frames);
    if (v->status.messages != v->messages)
        trip_viewer_say(v, v->status.message);
    v->messages = v->status.messages;
}

bool trip_viewer_rests(trip_viewer *v)
{
    const trip_document *d = trip_viewer_document(v);
    const trip_frames_status s = trip_frames_get_status(v->frames);
    if (!d || v->changed || v->picture_width < 1 || v->height < 1)
        return !d || !v->changed;
    return s.document == d->number && s.rests && !trip_frames_saving(v->frames) &&
           !(v->maker && (d->small || trip_maker_get_status(v->maker).busy));
}

static void lay_out(trip_viewer *v)
{
    const int panel = (int)(PANEL_WIDTH * v->scale);
    const int width = v->panel && v->width > 2 * panel ? v->width - panel : v->width;
    v->changed |= width != v->picture_width;
    v->picture_width = width;
}

void trip_viewer_resize(trip_viewer *v, int width, int height)
{
    v->changed |= width != v->width || height != v->height;
    v->width = width;
    v->height = height;
    lay_out(v);
}

void trip_viewer_set_panel(trip_viewer *v, bool shown)
{
    v->panel = shown;
    lay_out(v);
}

/* ---- input ---- */

/* Returns whether there is a view to change. */
static trip_document *navigable(trip_viewer *v)
{
    trip_document *d = trip_viewer_document(v);
    return d && d->has_navigation && v->picture_width > 0 && v->height > 0 ? d : NULL;
}

static double depth_of(const trip_document *d)
{
    return trip_navigation_distance(&d->navigation);
}

/* A drag across the shorter side of the picture is half a turn. */
static void drag(trip_viewer *v, trip_document *d, double dx, double dy)
{
    trip_navigation *n = &d->navigation;
    const double side = v->picture_width < v->height ? v->picture_width : v->height;
    const double degrees = 180 / side;
    const bool pans = v->buttons[TRIP_BUTTON_MIDDLE] ||
                      (v->buttons[TRIP_BUTTON_LEFT] && v->modifiers & TRIP_SHIFT);
    if (pans)
        trip_navigation_pan(n, dx, dy, v->height, depth_of(d));
    else if (v->buttons[TRIP_BUTTON_LEFT] && v->modifiers & TRIP_CONTROL)
        trip_navigation_roll(n, dx * degrees);
    else if (v->buttons[TRIP_BUTTON_LEFT])
        trip_navigation_orbit(n, -dx * degrees, dy * degrees);
    else if (v->buttons[TRIP_BUTTON_RIGHT])
        trip_navigation_turn(n, dx * degrees / 3, -dy * degrees / 3);
    else
        return;
    v->changed = true;
}

static void move(trip_viewer *v, double x, double y)
{
    trip_document *d = navigable(v);
    const double dx = x - v->at[0], dy = y - v->at[1];
    v->at[0] = x;
    v->at[1] = y;
    if (d && (dx != 0 || dy != 0))
        drag(v, d, dx, dy);
}

/* Moves towards the point under the pointer. */
static void wheel(trip_viewer *v, double steps)
{
    trip_document *d = navigable(v);
    double point[3];
    if (!d || steps == 0)
        return;
    trip_navigation_point(&d->navigation, v->picture_width, v->height, v->at, depth_of(d), point);
    trip_navigation_dolly(&d->navigation, pow(0.88, steps), point);
    v->changed = true;
}

static void look_along(trip_viewer *v, int axis)
{
    trip_document *d = navigable(v);
    double direction[3] = { 0 };
    direction[axis] = v->modifiers & TRIP_SHIFT ? -1 : 1;
    if (d)
        trip_navigation_look_from(&d->navigation, direction);
    v->changed |= d != NULL;
}

static void change_fov(trip_viewer *v, double factor)
{
    trip_document *d = navigable(v);
    if (d && !(d->navigation.ortho_height > 0))
        trip_navigation_set_fov(&d->navigation,
                                fmin(fmax(d->navigation.fov_degrees * factor, 1), 150));
    v->changed |= d != NULL;
}

static void toggle_parallel(trip_viewer *v)
{
    trip_document *d = navigable(v);
    if (d)
        trip_navigation_set_parallel(&d->navigation, !(d->navigation.ortho_height > 0));
    v->changed |= d != NULL;
}

void trip_viewer_see_side(trip_viewer *v, triptych_side side)
{
    trip_document *d = trip_viewer_document(v);
    if (!d)
        return;
    const double fov = d->has_navigation ? d->navigation.fov_degrees : 0;
    const bool parallel = d->has_navigation && d->navigation.ortho_height > 0;
    d->start = (triptych_view){ .side = side, .ortho_fit = parallel };
    d->start.fov_degrees = parallel ? 0 : fov;
    d->has_navigation = false;
    v->changed = true;
}

void trip_viewer_fit(trip_viewer *v)
{
    trip_document *d = navigable(v);
    if (d && d->opened)
        trip_navigation_fit(&d->navigation, d->info.lo, d->info.hi, v->picture_width, v->height,
                            0.9);
    v->changed |= d != NULL;
}

/* Returns the data set's file name without folder and extension. */
static void name_of(const char *input, char name[256])
{
    char path[4096];
    snprintf(path, sizeof path, "%s", input);
    size_t length = strlen(path);
    while (length > 1 && path[length - 1] == '/')
        path[--length] = 0;
    const char *slash = strrchr(path, '/');
    snprintf(name, 256, "%.200s", slash ? slash + 1 : path);
    char *dot = strrchr(name, '.');
    if (dot && dot != name)
        *dot = 0;
}

/* Returns NAME, a number and the extension, for a file that does not exist yet. */
static void new_name(const trip_document *d, const char *ending, char path[300])
{
    char name[256];
    name_of(d->input, name);
    for (int i = 1; i < 10000; i++) {
        snprintf(path, 300, "%s-%03d%s", name, i, ending);
        if (access(path, F_OK))
            break;
    }
}

void trip_viewer_take_picture(trip_viewer *v)
{
    const trip_document *d = trip_viewer_document(v);
    char path[300];
    if (!d)
        return;
    new_name(d, ".png", path);
    trip_frames_save(v->frames, path);
    trip_viewer_say(v, "the picture is saved as soon as it is complete");
}

/* Interval between keys; people can edit the file. */
#define SECONDS_BETWEEN_KEYS 2

static int add_key(trip_document *d)
{
    trip_camera_path *p = &d->path;
    char *text = d->edited ? trip_tf_editor_text(d->editor) : NULL;
    int status =
        trip_camera_path_add(p, SECONDS_BETWEEN_KEYS * (double)p->count, &d->navigation, text);
    if (!status && !text && trip_viewer_function(d))
        p->keys[p->count - 1].function = strdup(trip_viewer_function(d));
    free(text);
    if (!status) {
        p->keys[p->count - 1].has_clip = true;
        p->keys[p->count - 1].clip = trip_viewer_settings(d).clip;
    }
    return status;
}

static int save_path(trip_document *d)
{
    char path[300];
    if (!d->path_file) {
        new_name(d, ".json", path);
        d->path_file = strdup(path);
    }
    return d->path_file ? trip_camera_path_save(&d->path, d->path_file) : -1;
}

void trip_viewer_mark(trip_viewer *v)
{
    trip_document *d = navigable(v);
    char text[400];
    if (!d)
        return;
    const trip_navigation *first = d->path.count ? &d->path.keys[0].camera : &d->navigation;
    if ((first->ortho_height > 0) != (d->navigation.ortho_height > 0)) {
        trip_viewer_say(v, "all keys of a path must be parallel or all perspective");
        return;
    }
    if (add_key(d) || save_path(d)) {
        trip_viewer_say(v, "cannot write the path");
        return;
    }
    snprintf(text, sizeof text, "key %zu of %s", d->path.count, d->path_file);
    trip_viewer_say(v, text);
}

void trip_viewer_brick_again(trip_viewer *v)
{
    const trip_document *d = trip_viewer_document(v);
    if (!d || !v->maker)
        return;
    if (!trip_maker_start(v->maker, d->number, d->input, true))
        trip_viewer_say(v, "another data set is being bricked: try again later");
}

/* Starts bricking the full volume of a preview. */
static void make_whole(trip_viewer *v)
{
    const trip_document *d = trip_viewer_document(v);
    if (v->maker && d && d->opened && d->small && !trip_maker_get_status(v->maker).busy)
        trip_maker_start(v->maker, d->number, d->input, false);
}

/* Opens a newly bricked data set in place of the current one. */
static void take_made(trip_viewer *v)
{
    trip_made made;
    trip_document *d = NULL;
    if (!v->maker || !trip_maker_take(v->maker, &made))
        return;
    for (int i = 0; i < v->count; i++)
        d = v->documents[i]->number == made.document ? v->documents[i] : d;
    if (d && !made.made) {
        d->small = false; /* keep the preview */
        trip_viewer_say(v, made.message);
    }
    if (!d || !made.made)
        return;
    d->keep_all |= made.keep_all;
    d->small = false;
    d->number = ++v->numbers;
    v->changed |= d == trip_viewer_document(v);
}

static void put_look(FILE *out, const trip_document *d, const draw_settings *s)
{
    char number[32];
    const bool glows = s->effects.which & (TRIPTYCH_EFFECT_EMISSION | TRIPTYCH_EFFECT_AUTO);
    if (trip_viewer_function(d) && !d->edited) {
        fputs(" --tf ", out);
        trip_text_write_word(out, trip_viewer_function(d));
    }
    if (d->opacity_scale != 1)
        fprintf(out, " --opacity-scale %s", trip_text_from_double(d->opacity_scale, number));
    if (trip_viewer_heat(d) && glows) {
        fputs(" --emission ", out);
        trip_text_write_word(out, trip_viewer_heat(d));
    }
}

char *trip_viewer_options(trip_viewer *v)
{
    const trip_document *d = navigable(v);
    char *text = NULL;
    size_t bytes;
    if (!d)
        return NULL;
    const draw_settings s = trip_viewer_settings(d);
    char *camera = trip_navigation_options(&d->navigation, v->picture_width, v->height);
    char *settings = draw_settings_text(&s);
    FILE *out = camera && settings ? open_memstream(&text, &bytes) : NULL;
    if (out) {
        fprintf(out, "%s%s", camera, settings);
        put_look(out, d, &s);
        if (fclose(out)) {
            free(text);
            text = NULL;
        }
    }
    free(camera);
    free(settings);
    return text;
}

void trip_viewer_copy_options(trip_viewer *v)
{
    const trip_document *d = trip_viewer_document(v);
    char *text = trip_viewer_options(v);
    if (text && v->copy)
        v->copy(v->user, text);
    if (text)
        trip_viewer_say(v, d->edited ? "copied as options of triptych render; save the edited "
                                       "transfer function and give it with --tf"
                                     : "copied as options of triptych render");
    free(text);
}

void trip_viewer_set_function(trip_viewer *v, const char *function)
{
    trip_document *d = trip_viewer_document(v);
    char *copy = function ? strdup(function) : NULL;
    if (!d || (function && !copy))
        return;
    free(d->function);
    d->function = copy;
    d->edited = false;
    v->changed = true;
}

static void show_next(trip_viewer *v)
{
    if (v->count > 1)
        trip_viewer_show(v, (v->shown + 1) % v->count);
}

/* Keys for the views from the sides and along the axes. */
static bool press_view(trip_viewer *v, int key)
{
    if (key >= '1' && key <= '6')
        trip_viewer_see_side(v, (triptych_side)(TRIPTYCH_SIDE_FRONT + key - '1'));
    else if (key == '0' || key == TRIP_KEY_HOME)
        trip_viewer_see_side(v, TRIPTYCH_SIDE_DEFAULT);
    else if (key >= 'x' && key <= 'z')
        look_along(v, key - 'x');
    else if (key == 'f')
        trip_viewer_fit(v);
    else if (key == 'o')
        toggle_parallel(v);
    else if (key == '[' || key == ']')
        change_fov(v, key == '[' ? 1 / 1.1 : 1.1);
    else
        return false;
    return true;
}

static void escape(trip_viewer *v)
{
    v->quits = !v->keys;
    v->keys = false;
}

static void press(trip_viewer *v, int key)
{
    if (press_view(v, key))
        return;
    switch (key) {
    case TRIP_KEY_F1:
    case '?':
    case '/':
        v->keys = !v->keys;
        break;
    case TRIP_KEY_ESCAPE:
        escape(v);
        break;
    case TRIP_KEY_TAB:
        show_next(v);
        break;
    case 'q':
        v->quits = true;
        break;
    case 't':
        trip_viewer_set_panel(v, !v->panel);
        break;
    case 'p':
        trip_viewer_take_picture(v);
        break;
    case 'c':
        trip_viewer_copy_options(v);
        break;
    case 'm':
        trip_viewer_mark(v);
        break;
    case 'b':
        v->box = !v->box;
        break;
    default:
        break;
    }
}

static void on_key(trip_viewer *v, const trip_event *e)
{
    if (e->code < 0 || e->code >= TRIP_KEYS)
        return;
    v->modifiers = e->modifiers;
    v->held[e->code] = e->down;
    v->tapped[e->code] |= e->down;
    if (e->down)
        press(v, e->code);
}

void trip_viewer_let_go(trip_viewer *v)
{
    memset(v->buttons, 0, sizeof v->buttons);
    memset(v->held, 0, sizeof v->held);
    memset(v->tapped, 0, sizeof v->tapped);
}

/* A dropped transfer function applies to the current data set. */
static void drop(trip_viewer *v, const char *path)
{
    const char *dot = strrchr(path, '.');
    const trip_document *d = trip_viewer_document(v);
    const bool is_function = dot && !strcmp(dot, ".tf") && d;
    if (is_function && draw_kind_is_gaussian(d->kind))
        trip_viewer_say(v, "a Gaussian scene has colours of its own: no transfer function applies");
    else if (is_function && d->kind)
        trip_viewer_say(v, "--tf and the scene file choose the transfer functions of its volumes");
    else if (is_function)
        trip_viewer_set_function(v, path);
    else
        trip_viewer_open(v, path);
}

/* Fails if options do not apply to the data. Before the data are open, such options are left out
 * later. */
static int check_set(const trip_document *d, const char *options)
{
    draw_settings given = { 0 };
    int status = draw_settings_read_text(&given, options);
    if (given.scene.order == TRIPTYCH_ORDER_DEFAULT)
        given.scene.order = d->settings.scene.order;
    return status || !d->opened
               ? status
               : draw_settings_check_kind(&given, &(triptych_resources){ 0 }, d->kind);
}

/* Clipping that is set becomes active. */
static void set(trip_viewer *v, const char *options)
{
    trip_document *d = trip_viewer_document(v);
    draw_settings next = d ? d->settings : (draw_settings){ 0 };
    if (!d || draw_settings_read_text(&next, options) || check_set(d, options))
        return;
    d->settings = next;
    d->clips |= strstr(options, "--clip-") != NULL;
    v->changed = true;
}

void trip_viewer_event(trip_viewer *v, const trip_event *e)
{
    switch (e->kind) {
    case TRIP_EVENT_MOVE:
        move(v, e->x, e->y);
        break;
    case TRIP_EVENT_BUTTON:
        v->modifiers = e->modifiers;
        if (e->code >= 0 && e->code < TRIP_BUTTONS)
            v->buttons[e->code] = e->down;
        break;
    case TRIP_EVENT_WHEEL:
        wheel(v, e->y);
        break;
    case TRIP_EVENT_KEY:
        on_key(v, e);
        break;
    case TRIP_EVENT_RESIZE:
        trip_viewer_resize(v, (int)e->x, (int)e->y);
        break;
    case TRIP_EVENT_DROP:
        drop(v, e->text);
        break;
    case TRIP_EVENT_SET:
        set(v, e->text);
        break;
    case TRIP_EVENT_CLOSE:
        v->quits = true;
        break;
    default:
        break;
    }
}

/* ---- time ---- */

/* Flies the distance to the point looked at in 1.5 s; with shift, four times as fast. A key that
 * was pressed and released between two ticks flies for one tick. */
static bool fly(trip_viewer *v, double seconds)
{
    trip_document *d = navigable(v);
    bool k[TRIP_KEYS];
    for (int i = 0; i < TRIP_KEYS; i++)
        k[i] = v->held[i] || v->tapped[i];
    if (seconds > 0)
        memset(v->tapped, 0, sizeof v->tapped);
    if (!d)
        return false;
    const double way = depth_of(d) / 1.5 * fmin(seconds, 0.1) * (v->modifiers & TRIP_SHIFT ? 4 : 1);
    const double forward = (k['w'] || k[TRIP_KEY_UP]) - (k['s'] || k[TRIP_KEY_DOWN]);
    const double right = (k['d'] || k[TRIP_KEY_RIGHT]) - (k['a'] || k[TRIP_KEY_LEFT]);
    const double up = k[TRIP_KEY_PAGE_UP] - k[TRIP_KEY_PAGE_DOWN];
    if (forward == 0 && right == 0 && up == 0)
        return false;
    trip_navigation_fly(&d->navigation, forward * way, right * way, up * way);
    v->changed = true;
    return true;
}

/* Probes once for each pointer position and each idle view. */
static void probe(trip_viewer *v)
{
    const trip_document *d = navigable(v);
    const bool inside =
        v->at[0] >= 0 && v->at[1] >= 0 && v->at[0] < v->picture_width && v->at[1] < v->height;
    if (!d || d->kind || !v->probe || !inside || !v->status.exact ||
        (!memcmp(v->at, v->probed, sizeof v->at) &&
         !memcmp(&v->probed_from, &d->navigation, sizeof d->navigation)))
        return;
    memcpy(v->probed, v->at, sizeof v->at);
    v->probed_from = d->navigation;
    trip_frames_probe(v->frames, v->at[0], v->at[1]);
}

bool trip_viewer_tick(trip_viewer *v, double seconds)
{
    const trip_document *d = trip_viewer_document(v);
    take_opened(v);
    take_status(v);
    take_made(v);
    make_whole(v);
    v->message_seconds += seconds;
    const bool vanishes = v->message[0] && v->message_seconds > SECONDS_SAID && !v->status.failed;
    if (vanishes)
        v->message[0] = 0;
    if (d && d->edited && d->revision != trip_tf_editor_revision(d->editor))
        v->changed = true;
    const bool flies = fly(v, seconds);
    if (v->changed)
        want(v);
    else
        probe(v);
    return flies || vanishes;
}

/* ---- position of a picture ---- */

bool trip_viewer_is_current(const trip_viewer *v, const trip_picture *p)
{
    const trip_document *d = v->shown >= 0 ? v->documents[v->shown] : NULL;
    return d && d->number == p->document && p->full_width == v->picture_width &&
           p->full_height == v->height &&
           !memcmp(&p->navigation, &d->navigation, sizeof d->navigation);
}

/* Corner of the picture if it fills its part of the window. */
static void plain_corner(const trip_viewer *v, int i, float corner[4])
{
    corner[0] = (float)(i & 1 ? 2.0 * v->picture_width / v->width - 1 : -1);
    corner[1] = i & 2 ? -1 : 1;
    corner[2] = 0;
    corner[3] = 1;
}

static bool moved_corner(const trip_viewer *v, const trip_document *d, const trip_picture *p, int i,
                         float corner[4])
{
    const double depth = trip_navigation_distance(&p->navigation);
    const double from[2] = { i & 1 ? p->full_width : 0, i & 2 ? p->full_height : 0 };
    double point[3], to[2];
    trip_navigation_point(&p->navigation, p->full_width, p->full_height, from, depth, point);
    const double w =
        trip_navigation_project(&d->navigation, v->picture_width, v->height, point, to);
    if (!(w > 0.01 * depth) && !(d->navigation.ortho_height > 0))
        return false;
    const double scale = d->navigation.ortho_height > 0 ? 1 : w / depth;
    corner[0] = (float)((2 * to[0] / v->width - 1) * scale);
    corner[1] = (float)((1 - 2 * to[1] / v->height) * scale);
    corner[2] = 0;
    corner[3] = (float)scale;
    return true;
}

void trip_viewer_corners(const trip_viewer *v, const trip_picture *p, float corners[4][4])
{
    const trip_document *d = v->shown >= 0 ? v->documents[v->shown] : NULL;
    bool moves =
        d && d->has_navigation && d->number == p->document && !trip_viewer_is_current(v, p);
    for (int i = 0; i < 4 && moves; i++)
        moves = moved_corner(v, d, p, i, corners[i]);
    for (int i = 0; i < 4 && !moves; i++)
        plain_corner(v, i, corners[i]);
}
