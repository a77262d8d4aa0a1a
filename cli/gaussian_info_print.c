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
    return triptych_is_gaussians(t, path);
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
    char *text = trip_json_print(root, true);
    cJSON_Delete(root);
    if (!text)
        return trip_fail(TRIP_ERROR, "info", path, "out of memory");
    puts(text);
    free(text);
    return 0;
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
