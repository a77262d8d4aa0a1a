#include "state_file.h"

#include <cjson/cJSON.h>
#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include "exact_json.h"
#include "input_file.h"
#include "json.h"
#include "new_file.h"
#include "report.h"
#include "text.h"
#include "transfer_function.h"

enum { MAX_BYTES = 16 << 20, VERSION = 2 };

/* The numbers of a state: name, offset, type and range. */
typedef enum kind { NUMBERS, YES_OR_NO } kind;

typedef struct entry {
    const char *key;
    size_t at;
    kind kind;
    int count; /* of NUMBERS; above 1 means an array */
    double lo, hi;
} entry;

#define FAR 1e300
#define CAMERA(name) offsetof(trip_view_state, navigation.name)

static const entry camera_entries[] = {
    { "eye", CAMERA(eye), NUMBERS, 3, -FAR, FAR },
    { "look", CAMERA(look), NUMBERS, 3, -FAR, FAR },
    { "up", CAMERA(up), NUMBERS, 3, -FAR, FAR },
    { "upright", CAMERA(upright), NUMBERS, 3, -1, 1 },
    { "fov_degrees", CAMERA(fov_degrees), NUMBERS, 1, TRIPTYCH_FOV_MIN_DEGREES,
      TRIPTYCH_FOV_MAX_DEGREES },
    { "ortho_height", CAMERA(ortho_height), NUMBERS, 1, 0, 1e100 },
};

static const entry other_entries[] = {
    { "opacity_scale", offsetof(trip_view_state, opacity_scale), NUMBERS, 1, 1e-6, 1e6 },
    { "clips", offsetof(trip_view_state, clips), YES_OR_NO, 1, 0, 1 },
    { "panel", offsetof(trip_view_state, panel), YES_OR_NO, 1, 0, 1 },
    { "box", offsetof(trip_view_state, box), YES_OR_NO, 1, 0, 1 },
    { "axes", offsetof(trip_view_state, axes), YES_OR_NO, 1, 0, 1 },
    { "scale_bar", offsetof(trip_view_state, scale_bar), YES_OR_NO, 1, 0, 1 },
};

#define ENTRIES(table) table, sizeof table / sizeof *table

/* ---- to text ---- */

static cJSON *value_of(const trip_view_state *s, const entry *e)
{
    const void *at = (const char *)s + e->at;
    if (e->kind == YES_OR_NO)
        return cJSON_CreateBool(*(const bool *)at);
    return e->count > 1 ? trip_exact_numbers(at, e->count) : trip_exact_number(*(const double *)at);
}

static void add_entries(cJSON *object, const trip_view_state *s, const entry *entries, size_t count)
{
    for (size_t i = 0; object && i < count; i++)
        cJSON_AddItemToObject(object, entries[i].key, value_of(s, &entries[i]));
}

/* Returns the transfer function's text with invalid UTF-8 bytes replaced by question marks, one
 * each. So no line exceeds the limit when the file is read again. */
static void add_function_text(cJSON *root, const char *text)
{
    char *valid = strdup(text);
    for (char *at = valid; at && *at;) {
        const trip_text_character c = trip_text_next(at);
        if (c.code == 0xfffd && c.bytes == 1)
            *at = '?';
        at += c.bytes;
    }
    if (valid)
        cJSON_AddStringToObject(root, "function_text", valid);
    free(valid);
}

char *trip_view_state_print(const trip_view_state *s, const char *data)
{
    cJSON *root = cJSON_CreateObject();
    cJSON_AddItemToObject(root, "triptych_view", trip_exact_number(VERSION));
    cJSON_AddStringToObject(root, "data", data);
    if (s->has_navigation)
        add_entries(cJSON_AddObjectToObject(root, "camera"), s, ENTRIES(camera_entries));
    if (s->text)
        add_function_text(root, s->text);
    else if (s->function)
        cJSON_AddStringToObject(root, "function", s->function);
    if (s->heat)
        cJSON_AddStringToObject(root, "heat", s->heat);
    char *settings = draw_settings_text(&s->settings);
    cJSON_AddStringToObject(root, "settings", settings ? settings : "");
    free(settings);
    add_entries(root, s, ENTRIES(other_entries));
    char *text = root ? trip_json_print(root, true) : NULL;
    cJSON_Delete(root);
    return text;
}

/* ---- from text ---- */

static bool read_entry(trip_view_state *s, const cJSON *item, const entry *e)
{
    void *at = (char *)s + e->at;
    if (e->kind == NUMBERS && e->count > 1)
        return trip_exact_read_numbers(item, e->count, e->lo, e->hi, at);
    if (e->kind == NUMBERS)
        return trip_exact_read(item, e->lo, e->hi, at);
    *(bool *)at = cJSON_IsTrue(item);
    return cJSON_IsBool(item);
}

/* Missing numbers keep their value, unless all are required. */
static int read_entries(trip_view_state *s, const cJSON *object, const entry *entries, size_t count,
                        bool all, const char *path)
{
    for (size_t i = 0; i < count; i++) {
        const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, entries[i].key);
        if ((item || all) && !(item && read_entry(s, item, &entries[i])))
            return trip_fail(TRIP_ERROR, "read", path, "\"%s\" is missing or has an invalid value",
                             entries[i].key);
    }
    return 0;
}

static double length_of(const double v[3])
{
    return hypot(hypot(v[0], v[1]), v[2]);
}

static int read_camera(trip_view_state *s, const cJSON *camera, const char *path)
{
    trip_navigation *n = &s->navigation;
    if (!camera)
        return 0;
    int status = read_entries(s, camera, ENTRIES(camera_entries), true, path);
    if (status)
        return status;
    trip_navigation_axes axes = trip_navigation_get_axes(n);
    s->has_navigation = true;
    if (fabs(length_of(n->upright) - 1) < 1e-6 && fabs(length_of(axes.up) - 1) < 1e-6)
        return 0;
    return trip_fail(TRIP_ERROR, "read", path, "the camera is invalid");
}

/* Returns a copy of a string for free(), or NULL if there is none. */
static int read_string(const cJSON *root, const char *key, char **out, const char *path)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(root, key);
    *out = NULL;
    if (!item)
        return 0;
    if (!cJSON_IsString(item))
        return trip_fail(TRIP_ERROR, "read", path, "\"%s\" must be a text", key);
    *out = strdup(item->valuestring);
    return *out ? 0 : trip_fail(TRIP_ERROR, "read", path, "out of memory");
}

static int read_function(trip_view_state *s, const cJSON *root, const char *path)
{
    trip_tf *tf = NULL;
    int status = read_string(root, "function", &s->function, path);
    if (!status)
        status = read_string(root, "function_text", &s->text, path);
    if (!status && s->text)
        status = trip_tf_parse(&tf, path, s->text, strlen(s->text));
    trip_tf_destroy(tf);
    return status;
}

static int read_settings(trip_view_state *s, const cJSON *root, const char *path)
{
    char *text;
    int status = read_string(root, "settings", &text, path);
    if (status || !text)
        return status;
    s->settings = (draw_settings){ 0 };
    status = draw_settings_read_text(&s->settings, text);
    if (!status)
        status = draw_settings_check_ranges(&s->settings);
    free(text);
    return status ? TRIP_ERROR : 0;
}

static int read_root(trip_view_state *s, const cJSON *root, const char *path)
{
    int status = read_function(s, root, path);
    if (!status)
        status = read_string(root, "heat", &s->heat, path);
    if (!status)
        status = read_camera(s, cJSON_GetObjectItemCaseSensitive(root, "camera"), path);
    if (!status)
        status = read_settings(s, root, path);
    if (!status)
        status = read_entries(s, root, ENTRIES(other_entries), false, path);
    return status;
}

/* Returns whether the state has this version and data set, or a reported failure if it is no state.
 */
static int check_root(const cJSON *root, const char *data, const char *path)
{
    const cJSON *version = cJSON_GetObjectItemCaseSensitive(root, "triptych_view");
    const char *of = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(root, "data"));
    if (!cJSON_IsObject(root) || !cJSON_IsNumber(version) || !of)
        return trip_fail(TRIP_ERROR, "read", path, "is not a state file of the viewer");
    return version->valuedouble == VERSION && !strcmp(of, data);
}

int trip_view_state_parse(trip_view_state *s, const char *data, const char *text, const char *path)
{
    trip_json json;
    trip_view_state next = *s;
    next.function = next.text = next.heat = NULL;
    next.has_navigation = false;
    int status = trip_json_parse(&json, text, path, NULL);
    if (status)
        return status;
    int same = check_root(json.root, data, path);
    status = same > 0 ? read_root(&next, json.root, path) : same;
    trip_json_free(&json);
    trip_view_state_release(same > 0 && !status ? s : &next);
    if (same > 0 && !status)
        *s = next;
    return status ? status : same;
}

void trip_view_state_release(trip_view_state *s)
{
    free(s->function);
    free(s->text);
    free(s->heat);
    s->function = s->text = s->heat = NULL;
}

/* ---- files ---- */

/* Returns the data set's canonical path, for free(). */
static char *real_path(const char *data)
{
    char *real = realpath(data, NULL);
    return real ? real : strdup(data);
}

static int fail_of_memory(const char *data)
{
    return trip_fail(TRIP_ERROR, "view", data, "out of memory");
}

int trip_state_file_path(char **path, const char *data)
{
    const char *state = getenv("XDG_STATE_HOME"), *home = getenv("HOME");
    bool own = state && state[0] == '/'; /* the XDG specification says to ignore relative paths */
    char *real = real_path(data);
    *path = NULL;
    if (!real)
        return fail_of_memory(data);
    unsigned long long hash = XXH3_64bits(real, strlen(real));
    free(real);
    if (!own && !(home && home[0] == '/'))
        return trip_fail(TRIP_ERROR, "view", "HOME",
                         "is not set: set XDG_STATE_HOME to a folder for the state of "
                         "the viewer");
    if (asprintf(path, "%s%s/triptych/%016llx.json", own ? state : home, own ? "" : "/.local/state",
                 hash) < 0) {
        *path = NULL;
        return fail_of_memory(data);
    }
    return 0;
}

/* Creates the file's folders, which a new account lacks. */
static int make_folders(char *path)
{
    for (char *slash = strchr(path + 1, '/'); slash; slash = strchr(slash + 1, '/')) {
        *slash = 0;
        int made = mkdir(path, 0700);
        if (made < 0 && errno != EEXIST && errno != EROFS && errno != EACCES && errno != EPERM) {
            trip_fail_errno("view", path, "cannot make");
            return TRIP_ERROR;
        }
        *slash = '/';
    }
    return 0;
}

int trip_state_file_save(const trip_view_state *s, const char *data)
{
    char *path, *real = real_path(data);
    char *text = real ? trip_view_state_print(s, real) : NULL;
    free(real);
    int status = trip_state_file_path(&path, data);
    if (!status && !text)
        status = fail_of_memory(data);
    if (!status)
        status = make_folders(path);
    if (!status)
        status = trip_new_file_of_text("write", path, text);
    free(text);
    free(path);
    return status;
}

/* Reads the text, for free(). Returns 1, 0 if there is no file, or a reported failure. */
static int read_file(const char *path, char **text)
{
    int fd = trip_input_open(path);
    struct stat st;
    *text = NULL;
    if (fd < 0)
        return errno == ENOENT ? 0 : trip_fail_errno("read", path, "cannot open");
    bool regular = fstat(fd, &st) == 0 && S_ISREG(st.st_mode) && st.st_size <= MAX_BYTES;
    size_t room = regular ? (size_t)st.st_size : 0;
    char *bytes = regular ? calloc(room + 1, 1) : NULL;
    ssize_t got = bytes ? trip_input_read(fd, bytes, room) : -1;
    close(fd);
    if (got >= 0) {
        *text = bytes;
        return 1;
    }
    free(bytes);
    return trip_fail(TRIP_ERROR, "read", path, "cannot be read, or exceeds %d MiB",
                     MAX_BYTES >> 20);
}

int trip_state_file_load(trip_view_state *s, const char *data)
{
    char *path, *text = NULL, *real = real_path(data);
    int status = real ? trip_state_file_path(&path, data) : fail_of_memory(data);
    if (status) {
        free(real);
        return status;
    }
    status = read_file(path, &text);
    if (status > 0)
        status = trip_view_state_parse(s, real, text, path);
    free(text);
    free(path);
    free(real);
    return status;
}
