#include "volume_info_print.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "anatomy.h"
#include "budget.h"
#include "geometry.h"
#include "json.h"
#include "library.h"
#include "report.h"
#include "size_print.h"
#include "text.h"

/* From this size on, a data set of one's own is worth making. */
#define LARGE_BYTES 4e9

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

void print_orientation(const char *from)
{
    static const struct {
        const char *name, *words;
    } sources[] = {
        { "space", "from the space of the patient in the file" },
        { "file", "from the directions in the file" },
        { "axes", "from --axes" },
        { "program", "from the program that wrote the file" },
        { "symmetry", "guessed from the mirror symmetry" },
        { "voxels", "guessed from the long voxels" },
        { "base", "guessed from the level base" },
        { "length", "guessed from the longest side" },
        { "format", "guessed from the format" },
        { "values", "not in the file; drawing guesses it from the values" },
        { "none", "not in the file; z is up by default" },
    };
    for (size_t i = 0; from && i < sizeof sources / sizeof *sources; i++)
        if (!strcmp(from, sources[i].name))
            printf("%-12s %s\n", "orientation", sources[i].words);
}

/* Returns the size of all values. */
static double bytes_of(const triptych_description *d)
{
    static const char *const types[] = { "int8",   "uint8", "int16", "uint16", "half",  "int32",
                                         "uint32", "float", "int64", "uint64", "double" };
    static const int bytes[] = { 1, 1, 2, 2, 2, 4, 4, 4, 8, 8, 8 };
    double size = 0;
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        size = strcmp(d->type, types[i]) ? size : bytes[i];
    return size * (double)d->dims[0] * (double)d->dims[1] * (double)d->dims[2];
}

static int print_json(const triptych_description *d, const triptych_values *v, const char *path,
                      const char *fill, cJSON *series)
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
    cJSON_AddStringToObject(root, "orientation", d->orientation);
    if (d->grid[0])
        cJSON_AddStringToObject(root, "grid", d->grid);
    cJSON_AddNumberToObject(root, "value_bytes", bytes_of(d));
    if (v->share > 0) {
        cJSON_AddNumberToObject(root, "value_min", v->value_min);
        cJSON_AddNumberToObject(root, "value_max", v->value_max);
        cJSON_AddNumberToObject(root, "typical_min", v->typical_min);
        cJSON_AddNumberToObject(root, "typical_max", v->typical_max);
        cJSON_AddNumberToObject(root, "share_read", v->share);
        if (v->fill_count)
            add_numbers(root, "fills", v->fills, (int)v->fill_count);
    }
    if (d->modality[0])
        cJSON_AddStringToObject(root, "modality", d->modality);
    if (d->note[0])
        cJSON_AddStringToObject(root, "note", d->note);
    if (fill)
        cJSON_AddStringToObject(root, "fill", fill);
    cJSON_AddItemReferenceToObject(root, "series", series);
    return trip_json_put(root, "info", path);
}

static void print_line(const char *label, const char *text)
{
    printf("%-12s ", label);
    trip_text_write(stdout, text);
    putchar('\n');
}

static void print_values(const triptych_values *v)
{
    if (!(v->share > 0))
        return;
    printf("%-12s %.7g to %.7g", "values", v->value_min, v->value_max);
    if (v->typical_min > v->value_min || v->typical_max < v->value_max)
        printf(", most from %.7g to %.7g", v->typical_min, v->typical_max);
    if (v->share < 1)
        printf(v->share >= 0.01 ? "; in the %.0f %% that were read" : "; in the few that were read",
               100 * v->share);
    for (unsigned i = 0; i < v->fill_count; i++)
        printf("%s%.7g", i ? " and " : "; ", v->fills[i]);
    if (v->fill_count)
        printf(" count%s as absent, --fill none keeps %s", v->fill_count > 1 ? "" : "s",
               v->fill_count > 1 ? "them" : "it");
    putchar('\n');
}

/* Prints the command that draws the volume. */
static void print_command(const triptych_description *d, const char *path)
{
    const bool is_large = bytes_of(d) > LARGE_BYTES;
    printf("%-12s triptych %s ", "to draw it", is_large ? "brick" : "render");
    trip_text_write_word(stdout, path);
    puts(is_large ? " -o NAME.trip; triptych render NAME.trip -o NAME.png" : " -o NAME.png");
}

static void print_text(const triptych_description *d, const triptych_values *v, const char *path,
                       const char *fill, const cJSON *series)
{
    char words[TRIP_ANATOMY_WORDS], bytes[32], a[32], b[32], c[32], t[32];
    print_line("volume", path);
    print_line("format", cJSON_GetArraySize(series) ? "images (DICOM)" : d->format);
    if (d->grid[0])
        print_line("grid name", d->grid);
    printf("%-12s %lld x %lld x %lld voxels, %s\n", "grid", (long long)d->dims[0],
           (long long)d->dims[1], (long long)d->dims[2], d->type);
    printf("%-12s %.7g x %.7g x %.7g\n", "spacing", trip_length(direction(d, 0)),
           trip_length(direction(d, 1)), trip_length(direction(d, 2)));
    for (int axis = 0; axis < 3; axis++)
        if (d->spacing_min[axis] < d->spacing_max[axis])
            printf("%c %-10s %.7g to %.7g apart\n", 'i' + axis, "voxels", d->spacing_min[axis],
                   d->spacing_max[axis]);
    for (int row = 0; row < 3; row++) {
        const double *m = d->index_to_world[row];
        printf("world %c      = %s i + %s j + %s k + %s\n", 'x' + row, size_print_number(m[0], a),
               size_print_number(m[1], b), size_print_number(m[2], c), size_print_number(m[3], t));
    }
    print_orientation(d->orientation);
    if (d->space[0])
        print_line("space", d->space);
    for (int axis = 0; axis < 3 && d->space[0]; axis++)
        printf("%c %-10s %s\n", 'i' + axis, "points to",
               trip_anatomy_words(d->space, direction(d, axis), words));
    print_values(v);
    printf("%-12s %s of values; `--memory` limits what drawing takes\n", "memory",
           trip_format_bytes((uint64_t)bytes_of(d), bytes));
    if (d->modality[0])
        print_line("modality", d->modality);
    if (fill)
        print_line("fill", fill);
    const cJSON *line;
    cJSON_ArrayForEach(line, series) print_line("series", line->valuestring);
    if (d->note[0])
        print_line("note", d->note);
    print_command(d, path);
}

int volume_info_print(triptych *t, const char *path, const triptych_brick_options *options,
                      bool json)
{
    triptych_description d;
    triptych_values v = { 0 };
    cJSON *series = cJSON_CreateArray();
    if (!series)
        return trip_fail(TRIP_ERROR, "info", path, "out of memory");
    int status = triptych_describe(t, path, options, &d, add_series, series);
    if (status == 0)
        library_sample_values(t, path, options, &v);
    if (status == 0 && json)
        status = print_json(&d, &v, path, options->fill, series);
    else if (status == 0)
        print_text(&d, &v, path, options->fill, series);
    cJSON_Delete(series);
    return status;
}
