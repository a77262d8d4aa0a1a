#include <GLFW/glfw3.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "blit.h"
#include "gauges.h"
#include "input_queue.h"
#include "panel.h"
#include "player.h"
#include "report.h"
#include "view.h"
#include "viewer.h"

enum { WIDTH = 1100, HEIGHT = 720 };

/* Interval at which an idle window wakes up to check for signals. */
static const double sleep_seconds = 0.1, script_seconds = 0.002;
/* Number of pictures that Dear ImGui needs to lay out a change. */
enum { PICTURES_AFTER_INPUT = 4 };

typedef struct window {
    const trip_view_params *params;
    GLFWwindow *glfw;
    trip_viewer viewer;
    trip_frames *frames;
    trip_maker *maker; /* NULL disables background bricking */
    trip_panel *panel;
    trip_blit *blit;
    atomic_bool woken;
    trip_input_queue queue;
    int to_draw;        /* pictures of the window still to draw */
    bool hidden;        /* minimised */
    trip_picture shown; /* in the texture; its pixels are gone */
    double last;        /* time of the viewer's last tick, seconds */
    double panel_at;    /* time of the panel's last picture, seconds */
    double sent_at;     /* arrival of the last event sent since that picture; 0 if none */
    double input_at;    /* time of the oldest input without a picture yet; 0 if none */
    trip_gauges gauges;
    trip_player player;
    bool plays;
    char *shot;  /* file for the next picture of the window; may be NULL */
    triptych *t; /* writes `shot` */
    char title[512];
} window;

static int fail_of_glfw(const char *where)
{
    const char *why = NULL;
    glfwGetError(&why);
    return trip_fail(TRIP_ERROR, "view", where, "%s", why ? why : "failed");
}

/* ---- input ---- */

static void note_input(window *w, double seconds)
{
    w->to_draw = PICTURES_AFTER_INPUT;
    w->sent_at = seconds;
    if (w->input_at == 0)
        w->input_at = seconds;
}

static bool is_of_pointer(const trip_event *e)
{
    return e->kind == TRIP_EVENT_MOVE || e->kind == TRIP_EVENT_WHEEL ||
           (e->kind == TRIP_EVENT_BUTTON && e->down);
}

static bool is_held(const trip_viewer *v)
{
    bool held = false;
    for (int i = 0; i < TRIP_BUTTONS; i++)
        held |= v->buttons[i];
    return held;
}

/* Returns whether the panel takes an event: a drag that began there, or keys during text input. */
static bool is_for_panel(const window *w, const trip_event *e)
{
    const bool drags = is_held(&w->viewer);
    return (is_of_pointer(e) && trip_panel_has_pointer(w->panel) && !drags) ||
           (e->kind == TRIP_EVENT_KEY && trip_panel_has_keys(w->panel));
}

/* Both the panel and the picture get releases and pointer moves. */
static void send(window *w, const trip_event *e, double seconds)
{
    trip_viewer *v = &w->viewer;
    const bool for_panel = is_for_panel(w, e);
    const bool begins = e->down && (e->kind == TRIP_EVENT_KEY || e->kind == TRIP_EVENT_BUTTON);
    note_input(w, seconds);
    if (e->kind == TRIP_EVENT_ICONIFY)
        w->hidden = e->down;
    if (for_panel || !begins || (e->kind == TRIP_EVENT_BUTTON && !is_held(v)))
        trip_panel_event(w->panel, e);
    if (!for_panel || !(begins || is_of_pointer(e)))
        trip_viewer_event(v, e);
    else if (e->kind == TRIP_EVENT_MOVE)
        memcpy(v->at, (double[2]){ e->x, e->y }, sizeof v->at);
}

static bool draws_pictures(const window *w)
{
    return !w->hidden && w->viewer.width > 0 && w->viewer.height > 0;
}

/* Sends the events that need no picture before them. */
static void send_queued(window *w)
{
    trip_queued_event one;
    while (trip_input_queue_next(&w->queue, &one)) {
        send(w, &one.event, one.seconds);
        free(one.event.text);
        if (!draws_pictures(w))
            trip_input_queue_drawn(&w->queue);
    }
}

static void queue(window *w, const trip_event *e)
{
    trip_input_queue_push(&w->queue, e, glfwGetTime());
}

static unsigned modifiers_of(int mods)
{
    return (mods & GLFW_MOD_SHIFT ? TRIP_SHIFT : 0) | (mods & GLFW_MOD_CONTROL ? TRIP_CONTROL : 0) |
           (mods & GLFW_MOD_ALT ? TRIP_ALT : 0);
}

/* Returns the pixels per unit of window coordinates. */
static double pixels_a_unit(const window *w)
{
    int units, unit_height;
    glfwGetWindowSize(w->glfw, &units, &unit_height);
    return units > 0 && w->viewer.width > 0 ? (double)w->viewer.width / units : 1;
}

static void on_move(GLFWwindow *glfw, double x, double y)
{
    window *w = glfwGetWindowUserPointer(glfw);
    const double ratio = pixels_a_unit(w);
    queue(w, &(trip_event){ .kind = TRIP_EVENT_MOVE, .x = x * ratio, .y = y * ratio });
}

static void on_button(GLFWwindow *glfw, int button, int action, int mods)
{
    if (button >= TRIP_BUTTONS)
        return;
    queue(glfwGetWindowUserPointer(glfw), &(trip_event){ .kind = TRIP_EVENT_BUTTON,
                                                         .code = button,
                                                         .modifiers = modifiers_of(mods),
                                                         .down = action == GLFW_PRESS });
}

static void on_wheel(GLFWwindow *glfw, double x, double y)
{
    (void)x;
    queue(glfwGetWindowUserPointer(glfw), &(trip_event){ .kind = TRIP_EVENT_WHEEL, .y = y });
}

/* Maps letters and digits by the user's keyboard layout. */
static int key_of(int key, int scancode)
{
    static const int keys[][2] = {
        { GLFW_KEY_ESCAPE, TRIP_KEY_ESCAPE },
        { GLFW_KEY_ENTER, TRIP_KEY_ENTER },
        { GLFW_KEY_KP_ENTER, TRIP_KEY_ENTER },
        { GLFW_KEY_TAB, TRIP_KEY_TAB },
        { GLFW_KEY_BACKSPACE, TRIP_KEY_BACKSPACE },
        { GLFW_KEY_DELETE, TRIP_KEY_DELETE },
        { GLFW_KEY_LEFT, TRIP_KEY_LEFT },
        { GLFW_KEY_RIGHT, TRIP_KEY_RIGHT },
        { GLFW_KEY_UP, TRIP_KEY_UP },
        { GLFW_KEY_DOWN, TRIP_KEY_DOWN },
        { GLFW_KEY_HOME, TRIP_KEY_HOME },
        { GLFW_KEY_END, TRIP_KEY_END },
        { GLFW_KEY_PAGE_UP, TRIP_KEY_PAGE_UP },
        { GLFW_KEY_PAGE_DOWN, TRIP_KEY_PAGE_DOWN },
        { GLFW_KEY_F1, TRIP_KEY_F1 },
        { GLFW_KEY_SPACE, ' ' },
    };
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        if (keys[i][0] == key)
            return keys[i][1];
    const char *name = glfwGetKeyName(key, scancode);
    if (!name || !name[0] || name[1])
        return -1;
    return name[0] >= 'A' && name[0] <= 'Z' ? name[0] - 'A' + 'a' : (unsigned char)name[0];
}

static void on_key(GLFWwindow *glfw, int key, int scancode, int action, int mods)
{
    const int code = key_of(key, scancode);
    if (code < 0 || action == GLFW_REPEAT)
        return;
    queue(glfwGetWindowUserPointer(glfw), &(trip_event){ .kind = TRIP_EVENT_KEY,
                                                         .code = code,
                                                         .modifiers = modifiers_of(mods),
                                                         .down = action == GLFW_PRESS });
}

static void on_text(GLFWwindow *glfw, unsigned code)
{
    window *w = glfwGetWindowUserPointer(glfw);
    queue(w, &(trip_event){ .kind = TRIP_EVENT_TEXT, .code = (int)code });
}

static void on_size(GLFWwindow *glfw, int width, int height)
{
    window *w = glfwGetWindowUserPointer(glfw);
    queue(w, &(trip_event){ .kind = TRIP_EVENT_RESIZE, .x = width, .y = height });
}

static void on_drop(GLFWwindow *glfw, int count, const char **paths)
{
    for (int i = 0; i < count; i++) {
        char *path = strdup(paths[i]);
        if (path)
            queue(glfwGetWindowUserPointer(glfw),
                  &(trip_event){ .kind = TRIP_EVENT_DROP, .text = path });
        free(path);
    }
}

static void on_iconify(GLFWwindow *glfw, int iconified)
{
    window *w = glfwGetWindowUserPointer(glfw);
    queue(w, &(trip_event){ .kind = TRIP_EVENT_ICONIFY, .down = iconified });
}

static void on_focus(GLFWwindow *glfw, int focused)
{
    window *w = glfwGetWindowUserPointer(glfw);
    if (!focused && !w->plays)
        trip_input_queue_release_all(&w->queue, glfwGetTime());
}

static void on_refresh(GLFWwindow *glfw)
{
    window *w = glfwGetWindowUserPointer(glfw);
    w->to_draw = PICTURES_AFTER_INPUT;
}

static void listen(window *w)
{
    GLFWwindow *g = w->glfw;
    glfwSetWindowUserPointer(g, w);
    glfwSetCursorPosCallback(g, on_move);
    glfwSetMouseButtonCallback(g, on_button);
    glfwSetScrollCallback(g, on_wheel);
    glfwSetKeyCallback(g, on_key);
    glfwSetCharCallback(g, on_text);
    glfwSetFramebufferSizeCallback(g, on_size);
    glfwSetDropCallback(g, on_drop);
    glfwSetWindowIconifyCallback(g, on_iconify);
    glfwSetWindowFocusCallback(g, on_focus);
    glfwSetWindowRefreshCallback(g, on_refresh);
}

/* ---- scripts ---- */

static void play_event(void *user, const trip_event *e)
{
    window *w = user;
    if (e->kind == TRIP_EVENT_RESIZE) {
        const double ratio = pixels_a_unit(w);
        glfwSetWindowSize(w->glfw, (int)(e->x / ratio), (int)(e->y / ratio));
        return;
    }
    if (e->kind == TRIP_EVENT_ICONIFY && e->down)
        glfwIconifyWindow(w->glfw);
    else if (e->kind == TRIP_EVENT_ICONIFY)
        glfwRestoreWindow(w->glfw);
    queue(w, e);
}

/* Returns whether the complete picture is in the texture. */
static bool play_rests(void *user)
{
    window *w = user;
    if (!trip_viewer_rests(&w->viewer))
        return false;
    return w->viewer.status.failed || !trip_viewer_document(&w->viewer) || w->hidden ||
           (trip_viewer_is_current(&w->viewer, &w->shown) && w->shown.whole);
}

static bool play_has_size(void *user, int width, int height)
{
    const window *w = user;
    return w->viewer.width == width && w->viewer.height == height;
}

static bool play_find(void *user, const char *label, double box[4])
{
    window *w = user;
    w->to_draw = PICTURES_AFTER_INPUT;
    return trip_panel_find(w->panel, label, box);
}

static void play_shoot(void *user, const char *path)
{
    window *w = user;
    free(w->shot);
    w->shot = strdup(path);
    w->to_draw = PICTURES_AFTER_INPUT;
}

static void play_save(void *user, const char *path)
{
    window *w = user;
    trip_frames_save(w->frames, path);
}

static int play_saved(void *user)
{
    const window *w = user;
    const trip_frames_status status = trip_frames_get_status(w->frames);
    char line[sizeof status.message + 16];
    if (!status.unsaved)
        return 0;
    snprintf(line, sizeof line, "triptych: %s", status.message);
    trip_report_line(line);
    return TRIP_ERROR;
}

static int play_report(void *user, const char *path)
{
    window *w = user;
    const char *labels[TRIP_PANEL_LABELS];
    const int count = trip_panel_labels(w->panel, labels);
    return trip_gauges_write(&w->gauges, &w->viewer, labels, count, path);
}

static int play(window *w)
{
    const trip_player_window methods = { w,          play_event, play_rests, play_has_size,
                                         play_find,  play_shoot, play_save,  play_saved,
                                         play_report };
    if (!w->plays || w->shot || w->queue.count)
        return 0;
    w->player.width = w->viewer.width;
    w->player.height = w->viewer.height;
    const int more = trip_player_step(&w->player, &methods, glfwGetTime() + 1);
    w->viewer.quits |= more == 0;
    return more < 0 ? more : 0;
}

/* ---- pictures of the window ---- */

static void upload(void *user, const trip_picture *p)
{
    window *w = user;
    trip_blit_upload(w->blit, p->rgba, p->width, p->height);
    w->shown = *p;
    w->shown.rgba = NULL;
    w->to_draw = w->to_draw > 1 ? w->to_draw : 1;
}

static int write_shot(window *w)
{
    const int width = w->viewer.width, height = w->viewer.height;
    float *rgba = malloc((size_t)width * (size_t)height * 4 * sizeof *rgba);
    if (!rgba)
        return trip_fail(TRIP_ERROR, "view", w->shot, "out of memory");
    trip_blit_read(width, height, rgba);
    int status = w->t ? 0 : triptych_create(&w->t);
    if (!status)
        status = triptych_write(w->t, w->shot, width, height, rgba);
    if (status)
        trip_report_line(triptych_error(w->t));
    free(rgba);
    free(w->shot);
    w->shot = NULL;
    return status;
}

static void draw_picture(window *w)
{
    const trip_document *d = trip_viewer_document(&w->viewer);
    float corners[4][4];
    if (!d || w->shown.document != d->number)
        return;
    trip_viewer_corners(&w->viewer, &w->shown, corners);
    const bool exact = w->shown.whole && trip_viewer_is_current(&w->viewer, &w->shown);
    trip_blit_draw(w->blit, corners, exact);
}

/* Fills the area that no picture covers with the background. */
static void clear(const window *w)
{
    const trip_viewer *v = &w->viewer;
    const trip_document *d = v->shown >= 0 ? v->documents[v->shown] : NULL;
    const double *ground = d ? draw_settings_background(&d->settings) : (const double[4]){ 0 };
    float colour[3];
    for (int i = 0; i < 3; i++)
        colour[i] = (float)(ground[i] * ground[3]);
    trip_blit_clear(v->width, v->height, colour[0], colour[1], colour[2]);
}

/* Advances the panel's clock and returns the seconds since its last picture. Events that waited for
 * slow pictures keep their times, so that two quick clicks remain a double click. */
static double tick_panel(window *w)
{
    const double now = w->sent_at > 0 ? w->sent_at : glfwGetTime();
    const double seconds = fmax(now - w->panel_at, 0);
    w->panel_at += seconds;
    w->sent_at = 0;
    return seconds;
}

static int draw(window *w)
{
    if (!draws_pictures(w)) {
        w->input_at = w->sent_at = 0; /* no picture answers the input */
        return 0;
    }
    clear(w);
    draw_picture(w);
    trip_panel_draw(w->panel, &w->viewer, tick_panel(w));
    trip_input_queue_drawn(&w->queue);
    int status = w->shot ? write_shot(w) : 0;
    glfwSwapBuffers(w->glfw);
    if (w->input_at > 0)
        trip_gauges_note_answer(&w->gauges, (glfwGetTime() - w->input_at) * 1e3);
    w->input_at = 0;
    return status;
}

/* ---- the window ---- */

static void wake(void *user)
{
    window *w = user;
    atomic_store(&w->woken, true);
    glfwPostEmptyEvent();
}

static void copy(void *user, const char *text)
{
    const window *w = user;
    glfwSetClipboardString(w->glfw, text);
}

static int open_window(window *w)
{
    const trip_view_params *p = w->params;
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 2);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    w->glfw = glfwCreateWindow(p->width ? p->width : WIDTH, p->height ? p->height : HEIGHT,
                               "Triptych", NULL, NULL);
    if (!w->glfw)
        return fail_of_glfw("window");
    glfwMakeContextCurrent(w->glfw);
    glfwSwapInterval(p->script ? 0 : 1);
    return trip_blit_create(&w->blit);
}

static int open_panel(window *w)
{
    float x = 1, y = 1;
    glfwGetWindowContentScale(w->glfw, &x, &y);
    const double scale = w->params->scale > 0 ? w->params->scale : (double)fmaxf(x, y);
    w->viewer.scale = scale > 0.5 && scale < 8 ? scale : 1;
    return trip_panel_create(&w->panel, w->viewer.scale);
}

static int start_frames(window *w)
{
    const trip_view_params *p = w->params;
    const trip_frames_params params = {
        .memory_bytes = p->memory_bytes,
        .threads = p->threads,
        .renderer = p->renderer,
        .engine = p->engine,
        .frames_per_second = p->frames_per_second,
        .choices_folder = p->choices_folder,
        .wake = wake,
        .wake_user = w,
        .find = p->find,
        .release = p->release,
        .user = p->user,
    };
    w->frames = trip_frames_start(&params);
    return w->frames ? 0 : trip_fail(TRIP_ERROR, "view", "window", "out of memory");
}

static int start_maker(window *w)
{
    const trip_view_params *p = w->params;
    if (!p->make)
        return 0;
    w->maker = trip_maker_create(
        &(trip_maker_params){ .make = p->make, .user = p->user, .wake = wake, .wake_user = w });
    return w->maker ? 0 : trip_fail(TRIP_ERROR, "view", "window", "out of memory");
}

static void open_documents(window *w)
{
    const trip_view_params *p = w->params;
    trip_viewer *v = &w->viewer;
    int width, height;
    v->user = w;
    v->maker = w->maker;
    v->copy = copy;
    v->start = p->start;
    v->settings = p->settings;
    v->function = p->function;
    v->heat = p->heat;
    v->opacity_scale = p->opacity_scale;
    v->start_given = p->start_given;
    v->settings_given = p->settings_given;
    v->fresh = p->fresh;
    v->panel = !p->no_panel;
    for (int i = 0; i < p->count; i++)
        trip_viewer_open(v, p->inputs[i]);
    v->heat = NULL; /* only the given inputs have it */
    if (v->count > 1)
        trip_viewer_show(v, 0);
    glfwGetFramebufferSize(w->glfw, &width, &height);
    trip_viewer_resize(v, width, height);
}

static void show_title(window *w)
{
    const trip_document *d = trip_viewer_document(&w->viewer);
    char title[512];
    snprintf(title, sizeof title, "%.400s%sTriptych", d ? d->input : "", d ? " - " : "");
    if (strcmp(title, w->title))
        glfwSetWindowTitle(w->glfw, title);
    memcpy(w->title, title, sizeof title);
}

/* Handles input and news, and draws if there is something new. */
static int pass(window *w)
{
    int status = play(w);
    if (status)
        return status;
    send_queued(w);
    const double now = glfwGetTime(), seconds = now - w->last;
    w->last = now;
    if (atomic_exchange(&w->woken, false) && !w->to_draw)
        w->to_draw = 1;
    const bool goes_on = trip_viewer_tick(&w->viewer, seconds);
    trip_frames_use_picture(w->frames, w->shown.number, upload, w);
    show_title(w);
    if (w->to_draw || goes_on || w->queue.count)
        status = draw(w);
    w->to_draw -= w->to_draw > 0;
    if (w->queue.count)
        glfwPollEvents();
    else if (w->plays)
        glfwWaitEventsTimeout(script_seconds);
    else if (w->to_draw || goes_on)
        glfwWaitEventsTimeout(0.008);
    else
        glfwWaitEventsTimeout(sleep_seconds);
    return status;
}

static int run(window *w)
{
    int status = 0;
    while (!status && !w->viewer.quits && !glfwWindowShouldClose(w->glfw)) {
        status = pass(w);
        if (!status && trip_interrupted())
            status = trip_fail(TRIP_INTERRUPTED, "view", "interrupted", "by a signal");
    }
    return status;
}

static void close_window(window *w)
{
    trip_frames_stop(w->frames);
    trip_maker_destroy(w->maker);
    trip_viewer_release(&w->viewer);
    trip_panel_destroy(w->panel);
    trip_blit_destroy(w->blit);
    trip_script_free(&w->player.script);
    trip_input_queue_free(&w->queue);
    triptych_destroy(w->t);
    free(w->shot);
    if (w->glfw)
        glfwDestroyWindow(w->glfw);
    glfwTerminate();
}

static int check_outputs(const trip_view_params *p, const trip_script *script)
{
    int status = 0;
    for (size_t i = 0; i < script->count && !status && p->check_output; i++) {
        const trip_event *e = &script->events[i];
        if (e->kind == TRIP_EVENT_SCREENSHOT || e->kind == TRIP_EVENT_PICTURE ||
            e->kind == TRIP_EVENT_STATUS)
            status = p->check_output(p->check_user, e->text);
    }
    return status;
}

static int load_script(window *w)
{
    const trip_view_params *p = w->params;
    trip_script *script = &w->player.script;
    int status = p->script ? trip_script_load(script, p->script) : 0;
    if (!status)
        status = check_outputs(p, script);
    if (status)
        trip_script_free(script);
    return status;
}

int trip_view_run(const trip_view_params *params)
{
    window w = { .params = params, .plays = params->script };
    int status = load_script(&w);
    if (status)
        return status;
    if (!glfwInit())
        return fail_of_glfw("display");
    status = open_window(&w);
    if (!status)
        status = start_frames(&w);
    if (!status)
        status = start_maker(&w);
    if (!status) {
        trip_viewer_init(&w.viewer, w.frames);
        status = open_panel(&w);
    }
    if (!status) {
        listen(&w);
        open_documents(&w);
        status = run(&w);
    }
    close_window(&w);
    return status;
}
