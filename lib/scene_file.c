#include "scene_file.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "gaussian_file.h"
#include "json.h"
#include "other_file.h"
#include "point_file.h"
#include "report.h"

enum { BYTES_MAX = 16 << 20 };

/* A file being read. `object` is the number of the object in hand, from 1; 0 for the file. */
typedef struct reading {
    const char *path;
    unsigned object;
} reading;

static int fail(const reading *r, const char *why, const char *what)
{
    char where[32] = "";
    if (r->object)
        snprintf(where, sizeof where, "object %u: ", r->object);
    return trip_fail(TRIP_ERROR, "read", r->path, "%s%s%s", where, what, why);
}

bool trip_scene_file_is(const char *path)
{
    const size_t length = strlen(path);
    unsigned char head[TRIP_OTHER_HEAD_BYTES];
    char text[TRIP_OTHER_TEXT_BYTES];
    struct stat st;
    if (length <= 5 || strcasecmp(path + length - 5, ".json") != 0 || stat(path, &st) < 0 ||
        !S_ISREG(st.st_mode) || trip_gaussian_file_is(path) || trip_point_file_is(path))
        return false;
    FILE *f = fopen(path, "re");
    const size_t got = f ? fread(head, 1, sizeof head, f) : 0;
    if (f)
        fclose(f);
    return trip_other_file_tell(path, head, got, text) <= TRIP_OTHER_FOREIGN;
}

/* Returns the text for free(), or NULL after a reported failure. */
static char *read_text(const reading *r)
{
    char *text = malloc(BYTES_MAX + 1);
    FILE *f = text ? fopen(r->path, "re") : NULL;
    const size_t got = f ? fread(text, 1, BYTES_MAX + 1, f) : 0;
    const char *why = NULL;
    if (!f || ferror(f))
        trip_fail_errno("read", r->path, "cannot read");
    else if (got > BYTES_MAX)
        why = "is larger than 16 MiB; a scene file places at most 16384 objects";
    else if (memchr(text, 0, got))
        why = "is not JSON: it has a byte 0";
    else
        text[got] = 0;
    const bool bad = !f || ferror(f) || why;
    if (why)
        fail(r, why, "");
    if (f)
        fclose(f);
    if (!bad)
        return text;
    free(text);
    return NULL;
}

/* ---- members ---- */

/* Refuses unknown and repeated members. `names` ends with NULL. */
static int check_members(const reading *r, const cJSON *of, const char *const *names)
{
    int status = 0;
    for (const cJSON *m = of->child; m && !status; m = m->next) {
        bool known = false;
        for (const char *const *name = names; *name; name++)
            known |= !strcmp(*name, m->string);
        if (!known)
            status = fail(r, " is no member of a scene file", m->string);
        else if (cJSON_GetObjectItemCaseSensitive(of, m->string) != m)
            status = fail(r, " is given twice", m->string);
    }
    return status;
}

/* Reads an array of numbers. An absent member does not change `out`. */
static int get_numbers(const reading *r, const cJSON *of, const char *name, int count, double *out)
{
    const cJSON *array = cJSON_GetObjectItemCaseSensitive(of, name);
    char why[64];
    bool good = !array || (cJSON_IsArray(array) && cJSON_GetArraySize(array) == count);
    int i = 0;
    for (const cJSON *n = array && good ? array->child : NULL; n; n = n->next) {
        good &= cJSON_IsNumber(n) && isfinite(n->valuedouble);
        out[i++] = n->valuedouble;
    }
    snprintf(why, sizeof why, " must be %d finite numbers", count);
    return good ? 0 : fail(r, why, name);
}

static int get_number(const reading *r, const cJSON *of, const char *name, double *out)
{
    const cJSON *n = cJSON_GetObjectItemCaseSensitive(of, name);
    if (n && !(cJSON_IsNumber(n) && isfinite(n->valuedouble)))
        return fail(r, " must be a finite number", name);
    if (n)
        *out = n->valuedouble;
    return 0;
}

/* ---- placement ---- */

/* Sets the matrix of a turn about an axis (Rodrigues). */
static void set_turn(double m[3][4], const double axis[3], double degrees)
{
    const double length = hypot(hypot(axis[0], axis[1]), axis[2]);
    const double u[3] = { axis[0] / length, axis[1] / length, axis[2] / length };
    const double angle = degrees * (M_PI / 180);
    /* Quarter turns are exact. */
    const double quarters = degrees / 90, whole = nearbyint(quarters);
    static const double exact[4] = { 1, 0, -1, 0 };
    const bool is_quarter = fabs(quarters - whole) <= 0;
    const int turn = is_quarter ? (int)(fmod(whole, 4) + 4) % 4 : 0;
    const double c = is_quarter ? exact[turn] : cos(angle);
    const double s = is_quarter ? exact[(turn + 3) % 4] : sin(angle);
    const double cross[3][3] = { { 0, -u[2], u[1] }, { u[2], 0, -u[0] }, { -u[1], u[0], 0 } };
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            m[i][k] = (i == k ? c : 0) + s * cross[i][k] + (1 - c) * u[i] * u[k];
}

static int get_turn(const reading *r, const cJSON *of, double m[3][4])
{
    static const char *const names[] = { "axis", "degrees", NULL };
    const cJSON *turn = cJSON_GetObjectItemCaseSensitive(of, "rotate");
    double axis[3] = { 0, 0, 0 }, degrees = NAN;
    if (!turn)
        return 0;
    if (!cJSON_IsObject(turn))
        return fail(r, " must have an axis and degrees", "rotate");
    int status = check_members(r, turn, names);
    if (!status)
        status = get_numbers(r, turn, "axis", 3, axis);
    if (!status)
        status = get_number(r, turn, "degrees", &degrees);
    if (!status && !isfinite(degrees))
        status = fail(r, " has no degrees", "rotate");
    const double length = hypot(hypot(axis[0], axis[1]), axis[2]);
    if (!status && !(length > 0 && isfinite(length)))
        status = fail(r, " needs an axis with a length", "rotate");
    if (!status)
        set_turn(m, axis, degrees);
    return status;
}

static int get_matrix(const reading *r, const cJSON *of, double m[3][4])
{
    static const char *const others[] = { "translate", "rotate", "scale" };
    double n[16];
    for (int i = 0; i < 3; i++)
        if (cJSON_GetObjectItemCaseSensitive(of, others[i]))
            return fail(r, " and matrix exclude each other", others[i]);
    int status = get_numbers(r, of, "matrix", 16, n);
    if (status)
        return status;
    if (fabs(n[12]) > 0 || fabs(n[13]) > 0 || fabs(n[14]) > 0 || fabs(n[15] - 1) > 0)
        return fail(r, " is given by rows, and its last row must be 0, 0, 0, 1", "matrix");
    memcpy(m, n, 12 * sizeof *n);
    return 0;
}

static int get_placement(const reading *r, const cJSON *of, double m[3][4])
{
    double move[3] = { 0, 0, 0 }, scale = 1;
    if (cJSON_GetObjectItemCaseSensitive(of, "matrix"))
        return get_matrix(r, of, m);
    int status = get_turn(r, of, m);
    if (!status)
        status = get_numbers(r, of, "translate", 3, move);
    if (!status)
        status = get_number(r, of, "scale", &scale);
    if (!status && !(scale > 0))
        status = fail(r, " must be above 0", "scale");
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            m[i][k] *= scale;
        m[i][3] = move[i];
    }
    return status;
}

/* ---- objects ---- */

/* Returns the path for free(): relative to the file's folder. */
static char *path_of(const char *file, const char *data)
{
    const char *slash = *data == '/' ? NULL : strrchr(file, '/');
    char *path = NULL;
    if (asprintf(&path, "%.*s%s", slash ? (int)(slash - file) + 1 : 0, file, data) < 0)
        return NULL;
    return path;
}

/* Returns a preset, or a path relative to the file's folder, for free(). A path has a '.' or a '/'.
 */
static char *function_of(const char *file, const char *tf)
{
    return strpbrk(tf, "./") ? path_of(file, tf) : strdup(tf);
}

static int read_object(const reading *r, const cJSON *from, triptych_object *out)
{
    static const char *const names[] = { "data",   "translate", "rotate", "scale",
                                         "matrix", "tf",        NULL };
    const cJSON *tf = cJSON_GetObjectItemCaseSensitive(from, "tf");
    struct stat st;
    if (!cJSON_IsObject(from))
        return fail(r, "is no JSON object", "");
    int status = check_members(r, from, names);
    const cJSON *data = cJSON_GetObjectItemCaseSensitive(from, "data");
    if (!status && !(cJSON_IsString(data) && *data->valuestring))
        status = fail(r, " must be the path of a file", "data");
    if (!status && !(out->path = path_of(r->path, data->valuestring)))
        status = fail(r, "out of memory", "");
    if (!status && tf && !(cJSON_IsString(tf) && *tf->valuestring))
        status = fail(r, " must be a preset or the path of a file", "tf");
    if (!status && tf && !(out->function = function_of(r->path, tf->valuestring)))
        status = fail(r, "out of memory", "");
    if (!status)
        status = get_placement(r, from, out->matrix);
    if (!status && stat(out->path, &st) < 0)
        status = trip_fail_errno("read", out->path, "cannot open");
    if (!status && trip_scene_file_is(out->path))
        status = fail(r, " is a scene file itself; list its objects here", data->valuestring);
    return status;
}

static int read_objects(reading *r, const cJSON *root, triptych_object **objects, unsigned *count)
{
    static const char *const names[] = { "objects", NULL };
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(root, "objects");
    if (!cJSON_IsObject(root))
        return fail(r, "is no scene file: it must be an object with a list \"objects\"", "");
    int status = check_members(r, root, names);
    const int size = cJSON_IsArray(list) ? cJSON_GetArraySize(list) : 0;
    if (!status && (size < 1 || size > TRIPTYCH_OBJECTS_MAX))
        status = fail(r, " must be a list of 1 to 16384 objects", "objects");
    if (status)
        return status;
    *objects = calloc((size_t)size, sizeof **objects);
    if (!*objects)
        return fail(r, "out of memory", "");
    const cJSON *from = list->child;
    for (; from && !status; from = from->next) {
        triptych_object *o = &(*objects)[*count];
        *o = (triptych_object){ .matrix = TRIPTYCH_UNPLACED };
        r->object = ++*count;
        status = read_object(r, from, o);
    }
    return status;
}

int trip_scene_file_read(const char *path, triptych_object **objects, unsigned *count)
{
    reading r = { .path = path };
    trip_json json = { 0 };
    char *text = read_text(&r);
    int status = text ? trip_json_parse(&json, text, path, NULL) : TRIP_ERROR;
    *objects = NULL;
    *count = 0;
    if (!status && !json.root)
        status = trip_fail(TRIP_ERROR, "read", path, "is not JSON: the fault is at byte %td of %zu",
                           json.end - text + 1, strlen(text));
    if (!status && json.end[strspn(json.end, " \t\r\n")])
        status = fail(&r, "has text behind its JSON", "");
    if (!status)
        status = read_objects(&r, json.root, objects, count);
    trip_json_free(&json);
    free(text);
    if (status) {
        trip_scene_file_free(*objects, *count);
        *objects = NULL;
        *count = 0;
    }
    return status;
}

void trip_scene_file_free(triptych_object *objects, unsigned count)
{
    for (unsigned i = 0; i < count; i++) {
        char *path; /* not const: path_of() made it */
        memcpy(&path, &objects[i].path, sizeof path);
        free(path);
        memcpy(&path, &objects[i].function, sizeof path);
        free(path);
    }
    free(objects);
}
