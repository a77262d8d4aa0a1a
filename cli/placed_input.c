#include "placed_input.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "command_line.h"
#include "json.h"
#include "report.h"
#include "text.h"

static int fail_function(const char *scene)
{
    return trip_fail(TRIP_USAGE, "read", scene,
                     "is a Gaussian scene with colours of its own; leave out tf");
}

/* Finds or makes the data set of object `i`. Objects with the same path and function share it. */
static int find_data(placed_input *p, triptych *t, unsigned i,
                     const triptych_brick_options *options)
{
    const triptych_object *given = &p->given[i];
    const char *path = given->path;
    const bool is_scene = triptych_is_gaussians(t, path) != 0;
    cached_wish wish = { .options = *options };
    p->objects[i].name = path;
    if (given->function && is_scene)
        return fail_function(path);
    if (!cached_volume_wanted(path))
        return 0;
    for (unsigned k = 0; k < i; k++)
        if (!strcmp(p->given[k].path, path) && (is_scene || !given->function)) {
            p->objects[i].path = p->objects[k].path;
            return 0;
        }
    if (given->function) {
        wish.options.functions = &given->function;
        wish.options.function_count = 1;
    }
    const int status = cached_volume_open(&p->volumes[i], t, path, &wish);
    p->objects[i].path = p->volumes[i].path;
    p->bricked += p->volumes[i].seconds > 0;
    p->seconds += p->volumes[i].seconds;
    return status;
}

static int find_all(placed_input *p, triptych *t, const char *path,
                    const triptych_brick_options *options)
{
    int status = library_check_scene_options(options);
    p->objects = calloc(p->count, sizeof *p->objects);
    p->volumes = calloc(p->count, sizeof *p->volumes);
    if (!p->objects || !p->volumes)
        return trip_fail(TRIP_ERROR, "read", path, "out of memory");
    for (unsigned i = 0; i < p->count && !status; i++) {
        p->objects[i] = p->given[i];
        status = find_data(p, t, i, options);
    }
    return status;
}

int placed_input_read(placed_input *p, triptych *t, const char *path,
                      const triptych_brick_options *options)
{
    const int status = triptych_read_scene_file(t, path, &p->given, &p->count);
    return status ? status : find_all(p, t, path, options);
}

/* Reads X,Y,Z[,SCALE] up to a ';' or the end. Empty text places nothing. */
static int read_place(const char **text, double m[3][4])
{
    double n[4] = { 0, 0, 0, 1 };
    int count = 0, used = 0;
    while (**text && **text != ';' && count < 4 &&
           sscanf(*text, count ? ",%lf%n" : "%lf%n", &n[count], &used) == 1) {
        count++;
        *text += used;
    }
    const bool bad = (**text && **text != ';') || (count > 0 && count < 3) ||
                     !isfinite(n[0] + n[1] + n[2] + n[3]) || !(n[3] > 0);
    if (bad)
        return trip_option_fail("--place", "must be X,Y,Z or X,Y,Z,SCALE for each input, with ';' "
                                           "between inputs and a SCALE above 0");
    *text += **text == ';';
    for (int a = 0; a < 3; a++) {
        m[a][a] = n[3];
        m[a][3] = n[a];
    }
    return 0;
}

int placed_input_list(placed_input *p, triptych *t, const char *const *paths, unsigned count,
                      const char *places, const triptych_brick_options *options)
{
    int status = 0;
    const char *text = places ? places : "";
    p->given = calloc(count, sizeof *p->given);
    if (!p->given)
        return trip_fail(TRIP_ERROR, "read", paths[0], "out of memory");
    for (; p->count < count && !status; p->count++) {
        triptych_object *o = &p->given[p->count];
        *o = (triptych_object){ .path = strdup(paths[p->count]), .matrix = TRIPTYCH_UNPLACED };
        if (triptych_is_scene_file(paths[p->count]))
            return trip_option_fail(paths[p->count],
                                    "is a scene file; give it alone, or list its objects");
        status = o->path ? read_place(&text, o->matrix)
                         : trip_fail(TRIP_ERROR, "read", paths[0], "out of memory");
    }
    if (!status && *text)
        status = trip_option_fail("--place", "has more places than there are inputs");
    return status ? status : find_all(p, t, paths[0], options);
}

/* Whether the picture is more than one data set that stays where it is. */
static bool is_moved(const placed_input *p)
{
    static const triptych_object unplaced = { .matrix = TRIPTYCH_UNPLACED };
    return p->count > 1 || memcmp(p->given->matrix, unplaced.matrix, sizeof unplaced.matrix) != 0;
}

int placed_input_check(const placed_input *p, triptych *t, const draw_settings *settings,
                       const triptych_resources *resources,
                       const triptych_transfer_function *function)
{
    unsigned scenes = 0, captured = 0; /* the library checks data sets, which may hold clouds */
    for (unsigned i = 0; i < p->count; i++) {
        const int is_scene = triptych_is_gaussians(t, p->given[i].path);
        if (is_scene && p->given[i].function)
            return fail_function(p->given[i].path);
        scenes += is_scene != 0;
        captured += is_scene == 1;
    }
    const bool moved = is_moved(p);
    const draw_kind kind = scenes == p->count ? (captured ? DRAW_KIND_SCENE : DRAW_KIND_CLOUD)
                           : moved || p->given->function ? DRAW_KIND_OBJECTS
                                                         : DRAW_KIND_VOLUME;
    int status = draw_settings_check_kind(settings, resources, kind);
    if (!status && settings->scene.order == TRIPTYCH_ORDER_SHEETS && moved)
        status = trip_option_fail("--order", "sheets draws one scene alone, where it lies");
    if (!status && scenes == p->count && (function->name || function->window > 0))
        status = library_fail_scene_option(function->name ? "tf" : "window");
    return status;
}

int placed_input_open(const placed_input *p, triptych *t, const char *path,
                      const triptych_resources *resources)
{
    return p->count ? triptych_open_objects(t, p->objects, p->count, resources)
                    : triptych_open(t, path, resources);
}

void placed_input_close(placed_input *p)
{
    for (unsigned i = 0; i < p->count && p->volumes; i++)
        cached_volume_close(&p->volumes[i]);
    triptych_free_objects(p->given, p->count);
    free(p->volumes);
    free(p->objects);
    *p = (placed_input){ 0 };
}

/* ---- description ---- */

static const char *kind_of(triptych *t, const char *path)
{
    return triptych_is_gaussians(t, path) ? "Gaussian scene" : "volume";
}

static int print_json(triptych *t, const char *path, const triptych_object *objects, unsigned count)
{
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "kind", "scene file");
    cJSON *list = cJSON_AddArrayToObject(root, "objects");
    for (unsigned i = 0; i < count; i++) {
        const triptych_object *from = &objects[i];
        cJSON *o = cJSON_CreateObject();
        cJSON_AddStringToObject(o, "data", from->path);
        cJSON_AddStringToObject(o, "kind", kind_of(t, from->path));
        if (from->function)
            cJSON_AddStringToObject(o, "tf", from->function);
        double m[16] = { [15] = 1 };
        memcpy(m, from->matrix, sizeof from->matrix);
        cJSON_AddItemToObject(o, "matrix", cJSON_CreateDoubleArray(m, 16));
        cJSON_AddItemToArray(list, o);
    }
    return trip_json_put(root, "info", path);
}

/* Returns the scale of a similarity. */
static double scale_of(const double m[3][4])
{
    return sqrt(m[0][0] * m[0][0] + m[1][0] * m[1][0] + m[2][0] * m[2][0]);
}

/* Returns the angle of the rotation of a similarity, from its trace. */
static double degrees_of(const double m[3][4])
{
    const double c = ((m[0][0] + m[1][1] + m[2][2]) / scale_of(m) - 1) / 2;
    return acos(fmax(-1, fmin(1, c))) * (180 / M_PI);
}

static void print_text(triptych *t, const char *path, const triptych_object *objects,
                       unsigned count)
{
    printf("%-12s ", "scene file");
    trip_text_write(stdout, path);
    printf("\n%-12s %u\n", "objects", count);
    for (unsigned i = 0; i < count; i++) {
        const triptych_object *o = &objects[i];
        printf("%-12s ", kind_of(t, o->path));
        trip_text_write(stdout, o->path);
        printf("\n%-12s scaled by %.6g, turned by %.6g degrees, moved by %.6g, %.6g, %.6g\n", "",
               scale_of(o->matrix), degrees_of(o->matrix), o->matrix[0][3], o->matrix[1][3],
               o->matrix[2][3]);
    }
    printf("%-12s triptych render ", "to draw it");
    trip_text_write_word(stdout, path);
    puts(" -o NAME.png");
}

int placed_input_print(triptych *t, const char *path, bool options, bool json)
{
    triptych_object *objects;
    unsigned count;
    if (options)
        return trip_fail(TRIP_USAGE, "info", path,
                         "is a scene file, and options of volumes do not apply");
    int status = triptych_read_scene_file(t, path, &objects, &count);
    if (!status && json)
        status = print_json(t, path, objects, count);
    else if (!status)
        print_text(t, path, objects, count);
    triptych_free_objects(objects, count);
    return status;
}
