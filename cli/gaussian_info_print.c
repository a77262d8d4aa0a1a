#include "gaussian_info_print.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>

#include "json.h"
#include "report.h"
#include "size_print.h"
#include "text.h"

bool gaussian_info_wanted(triptych *t, const char *path)
{
    return triptych_is_gaussians(t, path) == 1;
}

static void add_corner(cJSON *corners, const double corner[3])
{
    cJSON_AddItemToArray(corners, cJSON_CreateDoubleArray(corner, 3));
}

static int print_json(const triptych_gaussians *g, const char *path)
{
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "kind", "Gaussian scene");
    cJSON_AddStringToObject(root, "format", g->format);
    cJSON_AddNumberToObject(root, "gaussians", (double)g->count);
    cJSON_AddNumberToObject(root, "left_out", (double)g->left_out);
    cJSON_AddNumberToObject(root, "degree", g->degree);
    cJSON_AddBoolToObject(root, "antialiased", g->antialiased);
    cJSON_AddBoolToObject(root, "flat", g->flat);
    cJSON_AddStringToObject(root, "up", g->up);
    cJSON_AddStringToObject(root, "trainer", g->trainer);
    cJSON *corners = cJSON_AddArrayToObject(root, "bounds");
    add_corner(corners, g->lo);
    add_corner(corners, g->hi);
    return trip_json_put(root, "info", path);
}

static void print_text(const triptych_gaussians *g, const char *path)
{
    char lo[32], hi[32];
    printf("%-12s ", "scene");
    trip_text_write(stdout, path);
    printf("\n%-12s %s\n", "format", g->format);
    printf("%-12s %llu%s\n", "Gaussians", (unsigned long long)g->count,
           g->flat ? ", flat (surfels)" : "");
    if (g->left_out)
        printf("%-12s %llu\n", "left out", (unsigned long long)g->left_out);
    printf("%-12s spherical harmonics of degree %d\n", "colour", g->degree);
    printf("%-12s", "centres");
    for (int a = 0; a < 3; a++)
        printf("%s %c %s to %s", a ? "," : "", 'x' + a, size_print_number(g->lo[a], lo),
               size_print_number(g->hi[a], hi));
    printf("\n%-12s %s\n", "up", g->up);
    if (g->antialiased)
        printf("%-12s opacity is compensated for the blur of a pixel\n", "antialiased");
    if (*g->trainer) {
        printf("%-12s ", "comments");
        trip_text_write(stdout, g->trainer);
        putchar('\n');
    }
}

int gaussian_info_print(triptych *t, const char *path, bool options, bool json)
{
    triptych_gaussians g;
    if (options)
        return trip_fail(TRIP_USAGE, "info", path,
                         "is a Gaussian scene, and options of volumes do not apply");
    int status = triptych_describe_gaussians(t, path, &g);
    if (status == 0 && json)
        return print_json(&g, path);
    if (status == 0)
        print_text(&g, path);
    return status;
}

/* ---- data sets ---- */

static void add_box(cJSON *root, const char *name, const double lo[3], const double hi[3])
{
    cJSON *corners = cJSON_AddArrayToObject(root, name);
    add_corner(corners, lo);
    add_corner(corners, hi);
}

static int print_scene_json(const triptych_scene *s, const cJSON *notes, const char *path,
                            bool verified)
{
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "kind", "Gaussian scene");
    cJSON_AddNumberToObject(root, "gaussians", (double)s->gaussians);
    cJSON_AddNumberToObject(root, "degree", s->degree);
    cJSON_AddBoolToObject(root, "antialiased", s->antialiased);
    cJSON_AddBoolToObject(root, "flat", s->flat);
    cJSON_AddBoolToObject(root, "y_down", s->y_down);
    cJSON_AddBoolToObject(root, "z_up", s->z_up);
    add_box(root, "bounds", s->lo, s->hi);
    add_box(root, "typical_bounds", s->typical_lo, s->typical_hi);
    cJSON_AddNumberToObject(root, "bytes", (double)s->bytes);
    cJSON_AddNumberToObject(root, "bricks", (double)s->bricks);
    cJSON_AddNumberToObject(root, "coarse_gaussians", (double)s->coarse);
    if (verified)
        cJSON_AddTrueToObject(root, "verified");
    cJSON_AddItemToObject(root, "source", cJSON_Duplicate(notes, true));
    return trip_json_put(root, "info", path);
}

static void print_box(const char *label, const double lo[3], const double hi[3])
{
    char from[32], to[32];
    printf("%-12s", label);
    for (int a = 0; a < 3; a++)
        printf("%s %c %s to %s", a ? "," : "", 'x' + a, size_print_number(lo[a], from),
               size_print_number(hi[a], to));
    putchar('\n');
}

static void print_note(const char *label, const cJSON *notes, const char *key)
{
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(notes, key));
    if (!text)
        return;
    printf("%-12s ", label);
    trip_text_write(stdout, text);
    putchar('\n');
}

static void print_scene_text(const triptych_scene *s, const cJSON *notes, const char *path,
                             bool verified)
{
    char bytes[32];
    printf("%-12s ", "data set");
    trip_text_write(stdout, path);
    printf("\n%-12s %llu%s\n", "Gaussians", (unsigned long long)s->gaussians,
           s->flat ? ", flat (surfels)" : "");
    printf("%-12s spherical harmonics of degree %d\n", "colour", s->degree);
    print_box("centres", s->lo, s->hi);
    print_box("typical", s->typical_lo, s->typical_hi);
    printf("%-12s %s\n", "up", s->z_up ? "z" : s->y_down ? "-y" : "y");
    if (s->antialiased)
        printf("%-12s opacity is compensated for the blur of a pixel\n", "antialiased");
    printf("%-12s %s in three lists of %llu bricks\n", "size", trip_format_bytes(s->bytes, bytes),
           (unsigned long long)s->bricks);
    printf("%-12s %llu Gaussians of coarse levels\n", "levels", (unsigned long long)s->coarse);
    print_note("source", notes, "input");
    print_note("file format", notes, "format");
    print_note("comments", notes, "trainer");
    print_note("made by", notes, "program");
    printf("%-12s triptych render ", "to draw it");
    trip_text_write_word(stdout, path);
    puts(" -o NAME.png");
    if (verified)
        printf("%-12s every page and record is intact\n", "verified");
}

int gaussian_info_print_scene(triptych *t, const char *path, bool json, bool verified)
{
    triptych_scene scene;
    trip_json notes = { 0 };
    int status = triptych_get_scene(t, &scene);
    if (status == 0)
        status = trip_json_parse(&notes, scene.notes, path, NULL);
    if (status == 0 && json)
        status = print_scene_json(&scene, notes.root, path, verified);
    else if (status == 0)
        print_scene_text(&scene, notes.root, path, verified);
    trip_json_free(&notes);
    return status;
}
