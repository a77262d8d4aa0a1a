#include "placed_input.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "json.h"
#include "report.h"
#include "text.h"

/* Finds or makes the data set of object `i`. Objects with the same path share it. */
static int find_data(placed_input *p, triptych *t, unsigned i,
                     const triptych_brick_options *options)
{
    const char *path = p->given[i].path;
    const cached_wish wish = { .options = *options };
    p->objects[i].name = path;
    for (unsigned k = 0; k < i; k++)
        if (!strcmp(p->given[k].path, path)) {
            p->objects[i].path = p->objects[k].path;
            return 0;
        }
    if (!cached_volume_wanted(path))
        return 0;
    if (!triptych_is_gaussians(t, path))
        return trip_fail(TRIP_USAGE, "read", path,
                         "is no Gaussian scene; a scene file places Gaussian scenes only");
    const int status = cached_volume_open(&p->volumes[i], t, path, &wish);
    p->objects[i].path = p->volumes[i].path;
    p->bricked += p->volumes[i].seconds > 0;
    p->seconds += p->volumes[i].seconds;
    return status;
}

int placed_input_read(placed_input *p, triptych *t, const char *path,
                      const triptych_brick_options *options)
{
    int status = library_check_scene_options(options);
    if (!status)
        status = triptych_read_scene_file(t, path, &p->given, &p->count);
    if (status)
        return status;
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
    return triptych_is_gaussians(t, path) ? "Gaussian scene"
           : cached_volume_wanted(path)   ? "other"
                                          : "data set";
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
