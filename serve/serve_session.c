#include "serve_session.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "clipping.h"
#include "clock.h"
#include "encode.h"
#include "json.h"
#include "light.h"
#include "report.h"
#include "scene.h"
#include "script.h"
#include "text.h"
#include "viewer.h"

enum { WIDTH = 1024, HEIGHT = 768, MAX_SIDE = 4096, MIN_SIDE = 16, MAX_EVENTS = 1000 };

struct trip_session {
    pthread_mutex_t lock; /* guards the viewer and its frames */
    trip_frames *frames;
    trip_viewer viewer;
    /* The drawing thread takes this lock too, and may hold its own locks. No other lock is taken
     * while this one is held. */
    pthread_mutex_t news_lock;
    pthread_cond_t news; /* signals news or the end */
    uint64_t came;       /* counts news; under news_lock */
    bool ended;          /* under news_lock */
    uint64_t seen;       /* last `came` handled by the ticking thread */
    uint64_t told;       /* messages handled by the ticking thread */
    const char *given;   /* the command line's transfer function, or NULL */
};

static void wake(void *user)
{
    trip_session *s = user;
    pthread_mutex_lock(&s->news_lock);
    s->came++;
    pthread_cond_broadcast(&s->news);
    pthread_mutex_unlock(&s->news_lock);
}

static uint64_t news_so_far(trip_session *s, bool *ended)
{
    pthread_mutex_lock(&s->news_lock);
    uint64_t came = s->came;
    *ended = s->ended;
    pthread_mutex_unlock(&s->news_lock);
    return came;
}

/* Waits until news exceed `came`. Returns false at the deadline. */
static bool wait_for_news(trip_session *s, uint64_t came, const struct timespec *end)
{
    int late = 0;
    pthread_mutex_lock(&s->news_lock);
    while (s->came == came && !s->ended && !late)
        late = pthread_cond_timedwait(&s->news, &s->news_lock, end);
    pthread_mutex_unlock(&s->news_lock);
    return !late;
}

static void make_locks(trip_session *s)
{
    pthread_condattr_t monotonic;
    pthread_mutex_init(&s->lock, NULL);
    pthread_mutex_init(&s->news_lock, NULL);
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&s->news, &monotonic);
    pthread_condattr_destroy(&monotonic);
}

static void show(trip_session *s, const trip_serve_params *p)
{
    trip_viewer *v = &s->viewer;
    trip_viewer_init(v, s->frames);
    v->settings = p->settings;
    v->function = s->given = p->function;
    v->heat = p->heat;
    v->opacity_scale = 1;
    v->fresh = true; /* ignore the window's saved states */
    trip_viewer_resize(v, WIDTH, HEIGHT);
    trip_viewer_set_panel(v, false);
    trip_viewer_open(v, p->input);
}

trip_session *trip_session_start(const trip_serve_params *p)
{
    trip_session *s = calloc(1, sizeof *s);
    if (!s)
        return NULL;
    make_locks(s);
    s->frames = trip_frames_start(&(trip_frames_params){ .memory_bytes = p->memory_bytes,
                                                         .threads = p->threads,
                                                         .renderer = p->renderer,
                                                         .engine = p->engine,
                                                         .frames_per_second = p->frames_per_second,
                                                         .choices_folder = p->choices_folder,
                                                         .find = p->find,
                                                         .open = p->open,
                                                         .release = p->release,
                                                         .user = p->find_user,
                                                         .wake = wake,
                                                         .wake_user = s });
    if (!s->frames) {
        free(s);
        return NULL;
    }
    show(s, p);
    return s;
}

void trip_session_end(trip_session *s)
{
    pthread_mutex_lock(&s->news_lock);
    s->ended = true;
    pthread_cond_broadcast(&s->news);
    pthread_mutex_unlock(&s->news_lock);
}

void trip_session_stop(trip_session *s)
{
    trip_frames_stop(s->frames);
    trip_viewer_release(&s->viewer);
    pthread_cond_destroy(&s->news);
    pthread_mutex_destroy(&s->news_lock);
    pthread_mutex_destroy(&s->lock);
    free(s);
}

static struct timespec in_seconds(double seconds)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    double whole = floor(seconds);
    t.tv_sec += (time_t)whole;
    t.tv_nsec += (long)((seconds - whole) * 1e9);
    t.tv_sec += t.tv_nsec / 1000000000;
    t.tv_nsec %= 1000000000;
    return t;
}

void trip_session_tick(trip_session *s, double seconds)
{
    const struct timespec end = in_seconds(seconds);
    bool ended;
    double start = trip_now_seconds();
    wait_for_news(s, s->seen, &end);
    s->seen = news_so_far(s, &ended);
    pthread_mutex_lock(&s->lock);
    trip_viewer_tick(&s->viewer, trip_now_seconds() - start);
    pthread_mutex_unlock(&s->lock);
}

/* Accepts script events, except keys that end the viewer, write files or toggle the window's panel.
 */
static bool is_allowed(const trip_event *e)
{
    bool other = e->kind == TRIP_EVENT_KEY && e->code < 128 && strchr("pqcmt", e->code);
    bool size = e->kind == TRIP_EVENT_RESIZE &&
                (e->x < MIN_SIDE || e->x > MAX_SIDE || e->y < MIN_SIDE || e->y > MAX_SIDE);
    return e->kind <= TRIP_EVENT_RESIZE && e->kind != TRIP_EVENT_TEXT && !other && !size;
}

static void act(trip_session *s, const trip_script *script)
{
    trip_viewer *v = &s->viewer;
    pthread_mutex_lock(&s->lock);
    for (size_t i = 0; i < script->count; i++) {
        const trip_event *e = &script->events[i];
        if (e->kind == TRIP_EVENT_RESIZE)
            trip_viewer_resize(v, (int)e->x, (int)e->y);
        else
            trip_viewer_event(v, e);
    }
    trip_viewer_tick(v, 0);
    pthread_mutex_unlock(&s->lock);
}

bool trip_session_do(trip_session *s, const char *text, size_t bytes)
{
    trip_script script;
    trip_scope quiet = { .sink = trip_report_discard }, *before = trip_scope_enter(&quiet);
    bool good = trip_script_parse(&script, "events", text, bytes) == 0;
    trip_scope_enter(before);
    good = good && script.count <= MAX_EVENTS;
    for (size_t i = 0; good && i < script.count; i++)
        good = is_allowed(&script.events[i]);
    if (good)
        act(s, &script);
    trip_script_free(&script);
    return good;
}

/* Returns the same name with static lifetime. */
static const char *preset(const char *name)
{
    triptych_preset p;
    for (unsigned i = 0; triptych_get_preset(i, &p); i++)
        if (!strcmp(p.name, name))
            return p.name;
    return NULL;
}

bool trip_session_set_function(trip_session *s, const char *name)
{
    const char *known = s->given && !strcmp(name, s->given) ? s->given : preset(name);
    if (*name && !known)
        return false;
    pthread_mutex_lock(&s->lock);
    const trip_document *d = trip_viewer_document(&s->viewer);
    const bool applies = d && !d->kind;
    if (applies)
        trip_viewer_set_function(&s->viewer, known);
    trip_viewer_tick(&s->viewer, 0);
    pthread_mutex_unlock(&s->lock);
    return applies;
}

static bool choose(const char *text, const char *const *names, int *out)
{
    for (int i = 0; names[i]; i++)
        if (!strcmp(text, names[i])) {
            *out = i;
            return true;
        }
    return false;
}

/* Parses "head", "turns", "fixed", "AZIMUTH,ELEVATION" or "AZIMUTH,ELEVATION,DISTANCE" of
 * trip_light_control. A light without distance turns with the view. */
static bool set_light(trip_document *d, const char *value)
{
    char copy[64], *rest = copy;
    double numbers[3] = { 0, 0, TRIP_LIGHT_FARTHEST };
    const bool turns = !strcmp(value, "turns");
    int count = 0;
    if (!strcmp(value, "head")) {
        trip_light_set_head(&d->settings, true);
        return true;
    }
    if (!d->opened || strlen(value) >= sizeof copy)
        return false;
    if (d->has_navigation && (turns || !strcmp(value, "fixed"))) {
        trip_light_set_turns(&d->settings, &d->info, &d->navigation, turns);
        return true;
    }
    snprintf(copy, sizeof copy, "%s", value);
    for (; count < 3 && rest; count++)
        if (!trip_text_to_double(strsep(&rest, ","), &numbers[count]))
            return false;
    const trip_light_control c = { count == 2, numbers[0], numbers[1], numbers[2] };
    if (count < 2 || rest ||
        !(fabs(c.round) <= 360 && fabs(c.up) <= 90 && c.distance >= TRIP_LIGHT_NEAREST))
        return false;
    trip_light_control_set(&d->settings, &d->info, &c);
    return true;
}

static bool has_light(const trip_document *d)
{
    return d->kind == DRAW_KIND_VOLUME || d->kind == DRAW_KIND_CLOUD;
}

static bool is_lit(const trip_document *d)
{
    return d->kind == DRAW_KIND_VOLUME || d->scene.lit;
}

static bool set_shading(trip_document *d, const char *value)
{
    static const char *const no_yes[] = { "0", "1", NULL };
    int on = 0;
    if (!choose(value, no_yes, &on))
        return false;
    trip_light_set_shading(&d->settings, is_lit(d), on);
    return true;
}

static bool set_number(double *out, const char *value, double lo, double hi)
{
    double number;
    if (!trip_text_to_double(value, &number) || !(number >= lo && number <= hi))
        return false;
    *out = number;
    return true;
}

/* Returns whether a setting applies to the data. Before they are open, it is left out later. */
static bool applies(const trip_document *d, const char *name, const draw_settings *s)
{
    draw_settings kept = *s;
    bool all = true;
    draw_settings_drop_kind(&kept, d->kind);
    for (int i = 0; i < DRAW_OPTIONS; i++) {
        const trip_option *row = &draw_settings_table.rows[i];
        all &= strcmp(row->name, name) || trip_option_same(row, &kept, s);
    }
    return all || !d->opened;
}

/* Sets a setting by its option. An empty value selects the default. */
static bool set_setting(trip_document *d, const char *name, const char *value)
{
    trip_scope quiet = { .sink = trip_report_discard }, *before = trip_scope_enter(&quiet);
    uint64_t given = 0;
    bool known = false;
    int status = 0;
    draw_settings next = d->settings;
    for (int i = 0; i < DRAW_OPTIONS; i++)
        if (!strcmp(draw_settings_table.rows[i].name, name)) {
            draw_settings_unset(&next, i);
            known = i != DRAW_DEPTH && i != DRAW_COUNT;
        }
    if (known && *value)
        status = trip_option_read(&draw_settings_table, name, value, &next, &given);
    trip_scope_enter(before);
    if (!known || status || !applies(d, name, &next))
        return false;
    d->settings = next;
    d->clips |= *value && !strncmp(name, "clip-", 5); /* clipping that is set becomes active */
    return true;
}

static bool set_switch(trip_document *d, const trip_effect_switch *e, const char *value)
{
    static const char *const no_yes[] = { "0", "1", NULL };
    int on = 0;
    return choose(value, no_yes, &on) && trip_effect_turn(e, on, &d->settings, trip_viewer_heat(d));
}

/* Whether the data can have one of the effects. */
static bool has_effect(const trip_document *d, int bits)
{
    return d->kind != DRAW_KIND_OBJECTS && draw_settings_effects_of_kind(d->kind) & bits;
}

/* Sets an effect or a number of light.h. */
static bool set_effect(trip_document *d, const char *name, const char *value)
{
    double number;
    for (int i = 0; i < TRIP_EFFECT_SWITCHES; i++)
        if (!strcmp(name, trip_effect_switches[i].name) &&
            has_effect(d, trip_effect_switches[i].bit))
            return set_switch(d, &trip_effect_switches[i], value);
    for (int i = 0; i < TRIP_EFFECT_NUMBERS; i++)
        if (!strcmp(name, trip_effect_numbers[i].name) &&
            has_effect(d, trip_effect_numbers[i].bits))
            return trip_text_to_double(value, &number) &&
                   trip_effect_number_set(&trip_effect_numbers[i], number, &d->settings);
    return false;
}

bool trip_session_set(trip_session *s, const char *name, const char *value)
{
    bool good = false;
    pthread_mutex_lock(&s->lock);
    trip_document *d = trip_viewer_document(&s->viewer);
    if (d && !strcmp(name, "opacity"))
        good = set_number(&d->opacity_scale, value, 1e-3, 1e3);
    else if (d && has_light(d) && !strcmp(name, "light"))
        good = set_light(d, value);
    else if (d && has_light(d) && !strcmp(name, "shading"))
        good = set_shading(d, value);
    else if (d)
        good = set_effect(d, name, value) || set_setting(d, name, value);
    s->viewer.changed |= good;
    trip_viewer_tick(&s->viewer, 0);
    pthread_mutex_unlock(&s->lock);
    return good;
}

char *trip_session_presets(void)
{
    cJSON *root = cJSON_CreateArray();
    triptych_preset p;
    for (unsigned i = 0; triptych_get_preset(i, &p); i++)
        cJSON_AddItemToArray(root, cJSON_CreateString(p.name));
    char *text = root ? trip_json_print(root, false) : NULL;
    cJSON_Delete(root);
    return text;
}

/* Copies the pixels, so that encoding does not delay drawing. */
typedef struct copy {
    uint8_t *rgba;
    int width, height;
    uint64_t number;
    bool whole;
} copy;

static void take(void *user, const trip_picture *p)
{
    copy *c = user;
    size_t bytes = 4 * (size_t)p->width * (size_t)p->height;
    *c = (copy){ malloc(bytes), p->width, p->height, p->number, p->whole };
    if (c->rgba)
        memcpy(c->rgba, p->rgba, bytes);
}

static bool await_copy(trip_session *s, uint64_t number, double seconds, copy *c)
{
    const struct timespec end = in_seconds(seconds);
    bool there = false, more = true, ended = false;
    while (!there && more && !ended) {
        uint64_t came = news_so_far(s, &ended);
        pthread_mutex_lock(&s->lock);
        there = trip_frames_use_picture(s->frames, number, take, c);
        pthread_mutex_unlock(&s->lock);
        more = there || wait_for_news(s, came, &end);
    }
    return there;
}

bool trip_session_await(trip_session *s, uint64_t number, double seconds, trip_session_picture *out)
{
    copy c = { NULL };
    *out = (trip_session_picture){ NULL };
    if (!await_copy(s, number, seconds, &c) || !c.rgba)
        return false;
    if (c.whole)
        trip_encode_png(c.rgba, c.width, c.height, &out->file, &out->bytes);
    else
        trip_encode_jpeg(c.rgba, c.width, c.height, &out->file, &out->bytes);
    out->number = c.number;
    out->whole = c.whole;
    free(c.rgba);
    return out->file != NULL;
}

/* Writes the settings as trip_session_set() takes them. */
static void add_settings(cJSON *root, const draw_settings *s)
{
    cJSON *settings = cJSON_AddObjectToObject(root, "settings");
    char value[TRIP_OPTION_TEXT_BYTES];
    for (int i = 0; i < DRAW_OPTIONS; i++) {
        const trip_option *row = &draw_settings_table.rows[i];
        if (!trip_option_is_set(row, s))
            continue;
        trip_option_print(row, s, value);
        cJSON_AddStringToObject(settings, row->name, value[0] ? value : "1");
    }
}

static void add_numbers(cJSON *to, const trip_effect_switch *below, const draw_settings *s)
{
    cJSON *numbers = cJSON_AddArrayToObject(to, "numbers");
    for (int i = 0; i < TRIP_EFFECT_NUMBERS; i++) {
        const trip_effect_number *n = &trip_effect_numbers[i];
        if (!trip_effect_number_is_below(n, below, s))
            continue;
        cJSON *number = cJSON_CreateObject();
        cJSON_AddStringToObject(number, "name", n->name);
        cJSON_AddStringToObject(number, "label", n->label);
        cJSON_AddStringToObject(number, "unit", n->unit);
        cJSON_AddNumberToObject(number, "lo", n->lo);
        cJSON_AddNumberToObject(number, "hi", n->hi);
        cJSON_AddNumberToObject(number, "step", n->step);
        cJSON_AddNumberToObject(number, "value", trip_effect_number_get(n, s));
        cJSON_AddItemToArray(numbers, number);
    }
}

/* Writes the state of the page's effect controls. */
static void add_switches(cJSON *root, const trip_document *d)
{
    const draw_settings *s = &d->settings;
    cJSON *switches = cJSON_AddArrayToObject(root, "switches");
    for (int i = 0; i < TRIP_EFFECT_SWITCHES; i++) {
        const trip_effect_switch *e = &trip_effect_switches[i];
        const char *lacks = trip_effect_lacks(e, s, trip_viewer_heat(d));
        if (!has_effect(d, e->bit))
            continue;
        cJSON *to = cJSON_CreateObject();
        cJSON_AddStringToObject(to, "name", e->name);
        cJSON_AddStringToObject(to, "label", e->label);
        cJSON_AddBoolToObject(to, "on", s->effects.which & e->bit && !lacks);
        cJSON_AddStringToObject(to, "lacks", lacks ? lacks : "");
        add_numbers(to, e, s);
        cJSON_AddItemToArray(switches, to);
    }
}

/* Writes the light as trip_session_set() takes it, with "head" as a flag of its own. */
static void add_light(cJSON *root, const trip_document *d)
{
    const trip_light_control c = trip_light_control_of(&d->settings, &d->info);
    cJSON *light = cJSON_AddObjectToObject(root, "light");
    cJSON_AddBoolToObject(light, "shading", trip_light_shades(&d->settings, is_lit(d)));
    cJSON_AddBoolToObject(light, "head", trip_light_is_head(&d->settings));
    cJSON_AddBoolToObject(light, "turns", c.turns);
    cJSON_AddNumberToObject(light, "round", c.round);
    cJSON_AddNumberToObject(light, "up", c.up);
    cJSON_AddNumberToObject(light, "distance", c.distance);
}

/* Writes the entries of a choice as trip_session_set() takes them. */
static void add_choice(cJSON *to, const trip_scene_choice *choice, const trip_document *d)
{
    trip_scene_entry entries[TRIP_SCENE_ENTRIES];
    int chosen;
    const int count = trip_scene_entries(choice, &d->scene, &d->settings, entries, &chosen);
    cJSON *item = count > 1 ? cJSON_CreateObject() : NULL;
    if (!item)
        return;
    cJSON_AddStringToObject(item, "name", draw_settings_table.rows[choice->row].name);
    cJSON_AddStringToObject(item, "label", choice->label);
    cJSON_AddStringToObject(item, "value", entries[chosen].value);
    cJSON *names = cJSON_AddArrayToObject(item, "entries");
    for (int i = 0; i < count; i++) {
        cJSON *entry = cJSON_CreateObject();
        cJSON_AddStringToObject(entry, "label", entries[i].label);
        cJSON_AddStringToObject(entry, "value", entries[i].value);
        cJSON_AddItemToArray(names, entry);
    }
    cJSON_AddItemToArray(to, item);
}

/* Writes a line about a scene, its choices, and the settings that it has. */
static void add_scene(cJSON *root, const trip_document *d, const draw_settings *shown,
                      const trip_frames_status *status)
{
    cJSON *scene = cJSON_AddObjectToObject(root, "scene");
    char text[160];
    trip_scene_say(&d->scene, shown, status, text, sizeof text);
    cJSON_AddStringToObject(scene, "text", text);
    cJSON *choices = cJSON_AddArrayToObject(scene, "choices");
    for (int i = 0; i < TRIP_SCENE_CHOICES; i++)
        add_choice(choices, &trip_scene_choices[i], d);
    cJSON *rows = cJSON_AddArrayToObject(scene, "applies");
    cJSON_AddItemToArray(rows, cJSON_CreateString("opacity"));
    for (int i = 0; i < DRAW_OPTIONS; i++)
        if (draw_settings_applies(&d->settings, i, d->kind))
            cJSON_AddItemToArray(rows, cJSON_CreateString(draw_settings_table.rows[i].name));
}

/* Writes the range of the page's clipping box, in world units: lower corner, upper corner. */
static void add_bounds(cJSON *root, const trip_document *d)
{
    triptych_clip all = { 0 };
    if (d->kind)
        trip_clipping_box_of_all(&all, &d->info, true);
    const double *corners[2] = { d->kind ? all.box_lo : d->info.lo,
                                 d->kind ? all.box_hi : d->info.hi };
    cJSON *bounds = cJSON_AddArrayToObject(root, "bounds");
    for (int i = 0; i < 6; i++)
        cJSON_AddItemToArray(bounds, cJSON_CreateNumber(corners[i / 3][i % 3]));
}

bool trip_session_take_failure(trip_session *s, char *line, size_t bytes)
{
    const trip_frames_status status = trip_frames_get_status(s->frames);
    const bool fresh = status.failed && status.messages != s->told;
    if (fresh)
        snprintf(line, bytes, "triptych: %s", status.message);
    s->told = status.messages;
    return fresh;
}

char *trip_session_status(trip_session *s)
{
    cJSON *root = cJSON_CreateObject();
    pthread_mutex_lock(&s->lock);
    trip_frames_status status = trip_frames_get_status(s->frames);
    char *camera = trip_viewer_options(&s->viewer);
    const trip_document *d = trip_viewer_document(&s->viewer);
    const draw_settings settings = d ? trip_viewer_settings(d) : s->viewer.settings;
    char effects[256];
    trip_effects_say(&settings, d ? trip_viewer_heat(d) : NULL, effects, sizeof effects);
    cJSON_AddBoolToObject(root, "opened", d && d->opened);
    if (d && d->opened)
        add_bounds(root, d);
    if (d && d->opened && has_light(d))
        add_light(root, d);
    if (d && d->kind != DRAW_KIND_OBJECTS)
        add_switches(root, d);
    if (d && d->kind)
        add_scene(root, d, &settings, &status);
    const char *function = d ? trip_viewer_function(d) : NULL;
    cJSON_AddStringToObject(root, "function", function ? function : "");
    cJSON_AddNumberToObject(root, "opacity", d ? d->opacity_scale : 1);
    pthread_mutex_unlock(&s->lock);
    cJSON_AddBoolToObject(root, "exact", status.exact);
    cJSON_AddBoolToObject(root, "failed", status.failed);
    cJSON_AddStringToObject(root, "message", status.message);
    cJSON_AddNumberToObject(root, "messages", (double)status.messages);
    cJSON_AddStringToObject(root, "stage", status.stage);
    cJSON_AddNumberToObject(root, "done", status.done);
    cJSON_AddStringToObject(root, "camera", camera ? camera : "");
    cJSON_AddStringToObject(root, "effects", effects);
    add_settings(root, &settings);
    char *text = root ? trip_json_print(root, false) : NULL;
    cJSON_Delete(root);
    free(camera);
    return text;
}
