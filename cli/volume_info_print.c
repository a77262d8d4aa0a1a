#include "volume_info_print.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>

#include "anatomy.h"
#include "geometry.h"
#include "json.h"
#include "report.h"
#include "text.h"

static int add_series(void *user, const char *text)
{
    return cJSON_AddItemToArray(user, cJSON_CreateString(text)) ? 0 : TRIP_ERROR;
}

static trip_vec3 direction(const triptych_description *d, int axis)
{
    return trip_v3(d->index_to_world[0][axis], d->index_to_world[1][axis],
                   d->index_to_world[2][axis]);
}

static void add_numbers(cJSON *root, const char *name, const double *values, int count)
{
    cJSON_AddItemToObject(root, name, cJSON_CreateDoubleArray(values, count));
}

static int print_json(const triptych_description *d, const char *path, const char *fill,
                      cJSON *series)
{
    cJSON *root = cJSON_CreateObject();
    const double dims[3] = { (double)d->dims[0], (double)d->dims[1], (double)d->dims[2] };
    cJSON_AddStringToObject(root, "format", d->format);
    cJSON_AddStringToObject(root, "type", d->type);
    add_numbers(root, "dims", dims, 3);
    add_numbers(root, "spacing_min", d->spacing_min, 3);
    add_numbers(root, "spacing_max", d->spacing_max, 3);
    cJSON *rows = cJSON_AddArrayToObject(root, "index_to_world");
    for (int row = 0; row < 3; row++)
        cJSON_AddItemToArray(rows, cJSON_CreateDoubleArray(d->index_to_world[row], 4));
    if (d->space[0])
        cJSON_AddStringToObject(root, "space", d->space);
    if (d->modality[0])
        cJSON_AddStringToObject(root, "modality", d->modality);
    if (d->note[0])
        cJSON_AddStringToObject(root, "note", d->note);
    if (fill)
        cJSON_AddStringToObject(root, "fill", fill);
    cJSON_AddItemReferenceToObject(root, "series", series);
    char *text = trip_json_print(root, true);
    cJSON_Delete(root);
    if (!text)
        return trip_fail(TRIP_ERROR, "info", path, "out of memory");
    puts(text);
    free(text);
    return 0;
}

static void print_line(const char *label, const char *text)
{
    printf("%-12s ", label);
    trip_text_write(stdout, text);
    putchar('\n');
}

static void print_text(const triptych_description *d, const char *path, const char *fill,
                       const cJSON *series)
{
    char words[TRIP_ANATOMY_WORDS];
    print_line("volume", path);
    print_line("format", d->format);
    printf("%-12s %lld x %lld x %lld voxels, %s\n", "grid", (long long)d->dims[0],
           (long long)d->dims[1], (long long)d->dims[2], d->type);
    printf("%-12s %.7g x %.7g x %.7g\n", "spacing", trip_length(direction(d, 0)),
           trip_length(direction(d, 1)), trip_length(direction(d, 2)));
    for (int a = 0; a < 3; a++)
        if (d->spacing_min[a] < d->spacing_max[a])
            printf("%c %-10s %.7g to %.7g apart\n", 'i' + a, "voxels", d->spacing_min[a],
                   d->spacing_max[a]);
    for (int row = 0; row < 3; row++)
        printf("world %c      = %.7g i + %.7g j + %.7g k + %.7g\n", 'x' + row,
               d->index_to_world[row][0], d->index_to_world[row][1], d->index_to_world[row][2],
               d->index_to_world[row][3]);
    if (d->space[0])
        print_line("space", d->space);
    for (int a = 0; a < 3 && d->space[0]; a++)
        printf("%c %-10s %s\n", 'i' + a, "points to",
               trip_anatomy_words(d->space, direction(d, a), words));
    if (d->modality[0])
        print_line("modality", d->modality);
    if (fill)
        print_line("fill", fill);
    const cJSON *line;
    cJSON_ArrayForEach(line, series) print_line("series", line->valuestring);
    if (d->note[0])
        print_line("note", d->note);
}

int volume_info_print(triptych *t, const char *path, const triptych_brick_options *options,
                      bool json)
{
    triptych_description d;
    cJSON *series = cJSON_CreateArray();
    if (!series)
        return trip_fail(TRIP_ERROR, "info", path, "out of memory");
    int status = triptych_describe(t, path, options, &d, add_series, series);
    if (status == 0 && json)
        status = print_json(&d, path, options->fill, series);
    else if (status == 0)
        print_text(&d, path, options->fill, series);
    cJSON_Delete(series);
    return status;
}
