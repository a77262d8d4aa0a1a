#include "point_info_print.h"

#include <cjson/cJSON.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "json.h"
#include "report.h"
#include "text.h"

static const struct {
    unsigned bit;
    const char *name;
} attributes[] = {
    { TRIPTYCH_POINT_COLOUR, "colour" },
    { TRIPTYCH_POINT_NORMAL, "normal" },
    { TRIPTYCH_POINT_RADIUS, "radius" },
    { TRIPTYCH_POINT_INTENSITY, "intensity" },
    { TRIPTYCH_POINT_CLASSIFICATION, "classification" },
    { TRIPTYCH_POINT_RETURNS, "returns" },
    { TRIPTYCH_POINT_TIME, "gps time" },
    { TRIPTYCH_POINT_SCAN, "scan" },
    { TRIPTYCH_POINT_UNCERTAINTY, "uncertainty" },
};

enum { ATTRIBUTES = sizeof attributes / sizeof *attributes };

/* The names of the classes in LAS 1.4, table 17. */
static const char *class_name(int class)
{
    static const char *const names[] = {
        "never classified",  "unclassified",    "ground",         "low vegetation",
        "medium vegetation", "high vegetation", "building",       "low noise",
        "model key",         "water",           "rail",           "road",
        "overlap",           "wire guard",      "wire conductor", "tower",
        "connector",         "bridge",          "high noise",
    };
    return class < (int)(sizeof names / sizeof *names) ? names[class] : "other";
}

/* Coordinates keep their millimetres beside millions of metres. */
static cJSON *number(double value)
{
    char text[32];
    return cJSON_CreateRaw(trip_text_from_double(value, text));
}

static cJSON *numbers(const double *values, int count)
{
    cJSON *array = cJSON_CreateArray();
    for (int i = 0; i < count; i++)
        cJSON_AddItemToArray(array, number(values[i]));
    return array;
}

static void add_range(cJSON *root, const char *name, double lo, double hi)
{
    cJSON_AddItemToObject(root, name, numbers((double[]){ lo, hi }, 2));
}

static void add_attributes(cJSON *root, const triptych_points *p)
{
    cJSON *names = cJSON_AddArrayToObject(root, "attributes");
    for (int i = 0; i < ATTRIBUTES; i++)
        if (p->attributes & attributes[i].bit)
            cJSON_AddItemToArray(names, cJSON_CreateString(attributes[i].name));
    if (p->attributes & TRIPTYCH_POINT_INTENSITY)
        add_range(root, "intensity", p->intensity_min, p->intensity_max);
    if (p->attributes & TRIPTYCH_POINT_TIME)
        add_range(root, "gps_time", p->time_min, p->time_max);
    if (p->attributes & TRIPTYCH_POINT_RETURNS)
        cJSON_AddItemToObject(root, "returns_max", number(p->returns_max));
    if (!(p->attributes & TRIPTYCH_POINT_CLASSIFICATION))
        return;
    cJSON *classes = cJSON_AddObjectToObject(root, "classes");
    for (int i = 0; i < 256; i++) {
        char key[8];
        snprintf(key, sizeof key, "%d", i);
        if (p->classes[i])
            cJSON_AddItemToObject(classes, key, number((double)p->classes[i]));
    }
}

static int print_json(const triptych_points *p, const char *path)
{
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "kind", "cloud of points");
    cJSON_AddStringToObject(root, "format", p->format);
    cJSON_AddItemToObject(root, "points", number((double)p->points));
    cJSON_AddItemToObject(root, "left_out", number((double)p->left_out));
    cJSON_AddItemToObject(root, "empty", number((double)p->empty));
    add_attributes(root, p);
    cJSON_AddStringToObject(root, "extras", p->extras);
    cJSON *corners = cJSON_AddArrayToObject(root, "bounds");
    cJSON_AddItemToArray(corners, numbers(p->lo, 3));
    cJSON_AddItemToArray(corners, numbers(p->hi, 3));
    cJSON_AddItemToObject(root, "scans", number(p->scans));
    cJSON_AddItemToObject(root, "posed_scans", number(p->posed_scans));
    if (p->width)
        cJSON_AddItemToObject(root, "grid",
                              numbers((double[]){ (double)p->width, (double)p->height }, 2));
    cJSON_AddStringToObject(root, "comments", p->comments);
    cJSON *notes = cJSON_AddArrayToObject(root, "notes");
    for (unsigned i = 0; i < p->notes; i++)
        cJSON_AddItemToArray(notes, cJSON_CreateString(p->note[i]));
    return trip_json_put(root, "info", path);
}

static void print_line(const char *label, const char *text)
{
    printf("%-12s ", label);
    trip_text_write(stdout, text);
    putchar('\n');
}

static void print_attributes(const triptych_points *p)
{
    const char *between = "";
    printf("%-12s ", "attributes");
    for (int i = 0; i < ATTRIBUTES; i++)
        if (p->attributes & attributes[i].bit) {
            printf("%s%s", between, attributes[i].name);
            between = ", ";
        }
    puts(*between ? "" : "positions only");
    if (*p->extras)
        print_line("further", p->extras);
    if (p->attributes & TRIPTYCH_POINT_INTENSITY)
        printf("%-12s %.9g to %.9g\n", "intensity", p->intensity_min, p->intensity_max);
    if (p->attributes & TRIPTYCH_POINT_TIME)
        printf("%-12s %.15g to %.15g\n", "gps time", p->time_min, p->time_max);
    if (p->attributes & TRIPTYCH_POINT_RETURNS)
        printf("%-12s up to %u of a pulse\n", "returns", p->returns_max);
    for (int i = 0; i < 256 && p->attributes & TRIPTYCH_POINT_CLASSIFICATION; i++)
        if (p->classes[i])
            printf("class %-6d %" PRIu64 " (%s)\n", i, p->classes[i], class_name(i));
}

static void print_scans(const triptych_points *p)
{
    if (p->width)
        printf("%-12s %" PRIu64 " x %" PRIu64 "\n", "range grid", p->width, p->height);
    if (p->scans > 1 || p->posed_scans)
        printf("%-12s %u, of these %u with a pose\n", "scans", p->scans, p->posed_scans);
}

static void print_text(const triptych_points *p, const char *path)
{
    print_line("cloud", path);
    print_line("format", p->format);
    printf("%-12s %" PRIu64 "\n", "points", p->points);
    if (p->left_out)
        printf("%-12s %" PRIu64 "\n", "left out", p->left_out);
    if (p->empty)
        printf("%-12s %" PRIu64 "\n", "empty cells", p->empty);
    print_attributes(p);
    printf("%-12s", "bounds");
    for (int a = 0; a < 3; a++)
        printf("%s %c %.12g to %.12g", a ? "," : "", 'x' + a, p->lo[a], p->hi[a]);
    putchar('\n');
    print_scans(p);
    if (*p->comments)
        print_line("comments", p->comments);
    for (unsigned i = 0; i < p->notes; i++)
        print_line("note", p->note[i]);
}

int point_info_print(triptych *t, const char *path, bool options, bool json)
{
    if (options)
        return trip_fail(TRIP_USAGE, "info", path,
                         "is a cloud of points, and options of volumes do not apply");
    triptych_points *p = malloc(sizeof *p);
    int status = p ? triptych_describe_points(t, path, p)
                   : trip_fail(TRIP_ERROR, "info", path, "out of memory");
    if (status == 0 && json)
        status = print_json(p, path);
    else if (status == 0)
        print_text(p, path);
    free(p);
    return status;
}
