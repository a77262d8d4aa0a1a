/* Reads and writes camera paths as JSON. */
#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "camera_path.h"
#include "clipping.h"
#include "exact_json.h"
#include "input_file.h"
#include "json.h"
#include "new_file.h"
#include "report.h"

enum { MAX_BYTES = 64 << 20, VERSION = 1 };

#define FAR 1e300
#define MAX_SECONDS 1e6
#define MAX_FPS 1000
#define MAX_HEIGHT 1e100

/* ---- to text ---- */

static void add_clip(cJSON *key, const triptych_clip *c)
{
    cJSON *clip = cJSON_AddObjectToObject(key, "clip");
    double box[6];
    memcpy(box, c->box_lo, sizeof c->box_lo);
    memcpy(box + 3, c->box_hi, sizeof c->box_hi);
    if (c->box)
        cJSON_AddItemToObject(clip, "box", trip_exact_numbers(box, 6));
    if (c->box)
        cJSON_AddBoolToObject(clip, "voxels", c->box_of_voxels);
    cJSON *planes = c->planes ? cJSON_AddArrayToObject(clip, "planes") : NULL;
    for (int i = 0; planes && i < c->planes; i++)
        cJSON_AddItemToArray(planes, trip_exact_numbers(c->plane[i], 4));
}

static void add_key(cJSON *keys, const trip_path_key *k)
{
    cJSON *key = cJSON_CreateObject();
    const trip_navigation *n = &k->camera;
    bool parallel = n->ortho_height > 0;
    cJSON_AddItemToArray(keys, key);
    cJSON_AddItemToObject(key, "seconds", trip_exact_number(k->seconds));
    cJSON_AddItemToObject(key, "eye", trip_exact_numbers(n->eye, 3));
    cJSON_AddItemToObject(key, "look", trip_exact_numbers(n->look, 3));
    cJSON_AddItemToObject(key, "up", trip_exact_numbers(n->up, 3));
    cJSON_AddItemToObject(key, parallel ? "ortho" : "fov",
                          trip_exact_number(parallel ? n->ortho_height : n->fov_degrees));
    if (k->text)
        cJSON_AddStringToObject(key, "function_text", k->text);
    else if (k->function)
        cJSON_AddStringToObject(key, "function", k->function);
    if (k->has_clip)
        add_clip(key, &k->clip);
}

char *trip_camera_path_print(const trip_camera_path *p)
{
    cJSON *root = cJSON_CreateObject();
    cJSON_AddItemToObject(root, "triptych_path", trip_exact_number(VERSION));
    if (p->frames_per_second > 0)
        cJSON_AddItemToObject(root, "frames_per_second", trip_exact_number(p->frames_per_second));
    if (p->loop_seconds > 0)
        cJSON_AddItemToObject(root, "loop", trip_exact_number(p->loop_seconds));
    cJSON *keys = cJSON_AddArrayToObject(root, "keys");
    for (size_t i = 0; keys && i < p->count; i++)
        add_key(keys, &p->keys[i]);
    char *text = root ? trip_json_print(root, true) : NULL;
    cJSON_Delete(root);
    return text;
}

int trip_camera_path_save(const trip_camera_path *p, const char *path)
{
    char *text = trip_camera_path_print(p);
    int status = text ? trip_new_file_of_text("write", path, text)
                      : trip_fail(TRIP_ERROR, "write", path, "out of memory");
    free(text);
    return status;
}

/* ---- from text ---- */

static int fail_at(const char *name, size_t key, const char *why)
{
    return trip_fail(TRIP_ERROR, "path", name, "key %zu: %s", key + 1, why);
}

static const cJSON *item_of(const cJSON *object, const char *key)
{
    return cJSON_GetObjectItemCaseSensitive(object, key);
}

/* Refuses unknown members, which are likely misspelt. `where` names the part of the path. */
static int check_members(const cJSON *object, const char *const *known, const char *name,
                         const char *where)
{
    const cJSON *member;
    cJSON_ArrayForEach(member, object)
    {
        int which = 0;
        while (known[which] && strcmp(known[which], member->string))
            which++;
        if (!known[which])
            return trip_fail(TRIP_ERROR, "path", name, "%sunknown member \"%s\"", where,
                             member->string);
        if (item_of(object, member->string) != member)
            return trip_fail(TRIP_ERROR, "path", name, "%sduplicate member \"%s\"", where,
                             member->string);
    }
    return 0;
}

static int check_key_members(const cJSON *key, const char *name, size_t number)
{
    static const char *const of_key[] = { "seconds", "eye",      "look",          "up",   "fov",
                                          "ortho",   "function", "function_text", "clip", NULL };
    static const char *const of_clip[] = { "box", "voxels", "planes", NULL };
    char where[48];
    snprintf(where, sizeof where, "key %zu: ", number + 1);
    int status = check_members(key, of_key, name, where);
    snprintf(where, sizeof where, "key %zu, \"clip\": ", number + 1);
    return status ? status : check_members(item_of(key, "clip"), of_clip, name, where);
}

/* Returns the fault of a key's view, or NULL. */
static const char *read_camera(trip_navigation *n, const cJSON *key)
{
    const cJSON *fov = item_of(key, "fov"), *ortho = item_of(key, "ortho");
    if (!trip_exact_read_numbers(item_of(key, "eye"), 3, -FAR, FAR, n->eye) ||
        !trip_exact_read_numbers(item_of(key, "look"), 3, -FAR, FAR, n->look) ||
        !trip_exact_read_numbers(item_of(key, "up"), 3, -FAR, FAR, n->up))
        return "\"eye\", \"look\" and \"up\" must be three numbers each";
    if (!fov == !ortho)
        return "must have either \"fov\" or \"ortho\"";
    if (fov &&
        !trip_exact_read(fov, TRIPTYCH_FOV_MIN_DEGREES, TRIPTYCH_FOV_MAX_DEGREES, &n->fov_degrees))
        return "\"fov\" must be from 1e-6 to 179.999 degrees";
    if (ortho && !trip_exact_read(ortho, 1 / MAX_HEIGHT, MAX_HEIGHT, &n->ortho_height))
        return "\"ortho\" must be a height above 0";
    trip_navigation_axes axes = trip_navigation_get_axes(n);
    double length = hypot(hypot(axes.up[0], axes.up[1]), axes.up[2]);
    return fabs(length - 1) < 1e-6 ? NULL
                                   : "is no view: where to look, or what is up, is not clear";
}

static const char *read_function(trip_path_key *k, const cJSON *key)
{
    const cJSON *function = item_of(key, "function"), *text = item_of(key, "function_text");
    if ((function && !cJSON_IsString(function)) || (text && !cJSON_IsString(text)) ||
        (function && text))
        return "\"function\" and \"function_text\" must be texts, and exclude one another";
    k->function = function ? strdup(function->valuestring) : NULL;
    k->text = text ? strdup(text->valuestring) : NULL;
    return (function && !k->function) || (text && !k->text) ? "out of memory" : NULL;
}

static const char *read_clip(trip_path_key *k, const cJSON *key)
{
    const cJSON *clip = item_of(key, "clip"), *box = item_of(clip, "box"), *plane;
    const cJSON *planes = item_of(clip, "planes"), *voxels = item_of(clip, "voxels");
    triptych_clip *c = &k->clip;
    double corners[6];
    k->has_clip = clip != NULL;
    if ((clip && !cJSON_IsObject(clip)) || (voxels && !cJSON_IsBool(voxels)) ||
        (planes && (!cJSON_IsArray(planes) || cJSON_GetArraySize(planes) > TRIP_CLIPPING_PLANES)))
        return "\"clip\" may have a \"box\", a boolean \"voxels\" and up to 6 \"planes\"";
    c->box = box != NULL;
    c->box_of_voxels = cJSON_IsTrue(voxels);
    if (box && !trip_exact_read_numbers(box, 6, -FAR, FAR, corners))
        return "the \"box\" of \"clip\" must be six numbers";
    for (int a = 0; a < 3 && box; a++) {
        c->box_lo[a] = corners[a];
        c->box_hi[a] = corners[3 + a];
    }
    cJSON_ArrayForEach(plane, planes)
    {
        if (!trip_exact_read_numbers(plane, 4, -FAR, FAR, c->plane[c->planes++]))
            return "a plane of \"clip\" must be four numbers";
    }
    return trip_clipping_is_sound(c) ? NULL
                                     : "its \"clip\" leaves no box, or has a plane without "
                                       "direction";
}

static const char *read_key(trip_camera_path *p, const cJSON *key)
{
    trip_path_key *k = &p->keys[p->count];
    *k = (trip_path_key){ 0 };
    const trip_path_key *before = p->count ? k - 1 : NULL;
    if (!cJSON_IsObject(key))
        return "is not an object";
    if (!trip_exact_read(item_of(key, "seconds"), -MAX_SECONDS, MAX_SECONDS, &k->seconds))
        return "\"seconds\" must be a time";
    if (before && !(k->seconds > before->seconds))
        return "must be later than the key before";
    const char *fault = read_camera(&k->camera, key);
    if (fault)
        return fault;
    if (before && (before->camera.ortho_height > 0) != (k->camera.ortho_height > 0))
        return "all keys must be parallel (\"ortho\") or all perspective (\"fov\")";
    fault = read_clip(k, key);
    if (fault)
        return fault;
    fault = read_function(k, key);
    p->count++; /* the path now owns the key's texts */
    return fault;
}

static int read_keys(trip_camera_path *p, const cJSON *keys, const char *name)
{
    int count = cJSON_IsArray(keys) ? cJSON_GetArraySize(keys) : 0;
    if (count < 1 || count > TRIP_CAMERA_PATH_KEYS)
        return trip_fail(TRIP_ERROR, "path", name, "must have 1 to %d \"keys\"",
                         TRIP_CAMERA_PATH_KEYS);
    p->keys = calloc((size_t)count, sizeof *p->keys);
    if (!p->keys)
        return trip_fail(TRIP_ERROR, "path", name, "out of memory");
    const cJSON *key;
    cJSON_ArrayForEach(key, keys)
    {
        size_t number = p->count;
        const char *fault = read_key(p, key);
        const int status =
            fault ? fail_at(name, number, fault) : check_key_members(key, name, number);
        if (status)
            return status;
    }
    return 0;
}

static int read_root(trip_camera_path *p, const cJSON *root, const char *name)
{
    const cJSON *fps = item_of(root, "frames_per_second"), *loop = item_of(root, "loop");
    double version;
    if (!cJSON_IsObject(root) || !trip_exact_read(item_of(root, "triptych_path"), 0, FAR, &version))
        return trip_fail(TRIP_ERROR, "path", name,
                         "is not a camera path: \"triptych_path\" is missing");
    if (version != VERSION)
        return trip_fail(TRIP_ERROR, "path", name, "has version %g; this program reads version %d",
                         version, VERSION);
    if (fps && !trip_exact_read(fps, 1e-3, MAX_FPS, &p->frames_per_second))
        return trip_fail(TRIP_ERROR, "path", name, "\"frames_per_second\" must be from 0.001 to %d",
                         MAX_FPS);
    if (loop && !trip_exact_read(loop, 1e-3, MAX_SECONDS, &p->loop_seconds))
        return trip_fail(TRIP_ERROR, "path", name, "\"loop\" must be a time above 0");
    static const char *const known[] = { "triptych_path", "frames_per_second", "loop", "keys",
                                         NULL };
    int status = read_keys(p, item_of(root, "keys"), name);
    if (!status)
        status = check_members(root, known, name, "");
    if (!status && trip_camera_path_frames(p) == TRIP_CAMERA_PATH_FRAMES)
        return trip_fail(TRIP_ERROR, "path", name,
                         "has %d frames or more; shorten it or lower \"frames_per_second\"",
                         TRIP_CAMERA_PATH_FRAMES);
    return status;
}

/* Checks that the text is exactly one JSON value. */
static int check_text(const trip_json *json, const char *name, const char *text)
{
    const char *end = json->end + (json->root ? strspn(json->end, " \t\r\n") : 0);
    long line = 1;
    for (const char *c = text; c < end; c++)
        line += *c == '\n';
    if (!json->root)
        return trip_fail_line("path", name, line, *end ? "invalid JSON" : "incomplete JSON");
    return *end ? trip_fail_line("path", name, line, "text after the end of the path") : 0;
}

int trip_camera_path_parse(trip_camera_path *p, const char *name, const char *text)
{
    trip_json json;
    int status = trip_json_parse(&json, text, name, NULL);
    if (!status)
        status = check_text(&json, name, text);
    if (!status)
        status = read_root(p, json.root, name);
    trip_json_free(&json);
    if (status)
        trip_camera_path_release(p);
    return status;
}

int trip_camera_path_load(trip_camera_path *p, const char *path)
{
    int fd = trip_input_open(path);
    char *text = fd < 0 ? NULL : malloc(MAX_BYTES + 1);
    ssize_t bytes = text ? trip_input_read(fd, text, MAX_BYTES + 1) : -1;
    int status = 0;
    if (bytes < 0)
        status = trip_fail_errno("path", path, "cannot read");
    else if (bytes > MAX_BYTES)
        status = trip_fail(TRIP_ERROR, "path", path, "is longer than %d MiB", MAX_BYTES >> 20);
    else
        text[bytes] = 0;
    if (fd >= 0)
        close(fd);
    if (!status)
        status = trip_camera_path_parse(p, path, text);
    free(text);
    return status;
}
