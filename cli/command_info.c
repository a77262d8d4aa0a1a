/* triptych info: prints the contents of a data set, as text or JSON, and verifies it. */
#include "commands.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "anatomy.h"
#include "budget.h"
#include "cached_volume.h"
#include "draw_options.h"
#include "gaussian_info_print.h"
#include "geometry.h"
#include "json.h"
#include "library.h"
#include "own_file_info.h"
#include "placed_input.h"
#include "point_info_print.h"
#include "command_line.h"
#include "report.h"
#include "size_print.h"
#include "text.h"
#include "transfer_function.h"
#include "volume_info_print.h"

typedef struct options {
    const char *path;
    int verify, json;
    triptych_brick_options volume;
} options;

#define AT(member) .at = offsetof(options, member)

static const trip_option info_rows[] = {
    { "json", NULL, "Prints JSON", .short_name = 'j', .type = TRIP_OPTION_FLAG, AT(json) },
    { "verify", NULL, "Reads all bytes and checks them", .short_name = 'v',
      .type = TRIP_OPTION_FLAG, AT(verify) },
};
#undef AT

static const trip_option_table info_table = { info_rows, sizeof info_rows / sizeof *info_rows };

enum { OWN, VOLUME, SETS };

typedef struct parse {
    options *o;
    option_set sets[SETS];
} parse;

static int add_input(void *user, char *path)
{
    options *o = ((parse *)user)->o;
    if (o->path)
        return trip_option_fail(path, "only one data set or volume is possible at a time");
    o->path = path;
    return 0;
}

static int check(void *user)
{
    const parse *p = user;
    const options *o = p->o;
    if (!o->path)
        return trip_option_fail("NAME.trip",
                                "no data set or volume given; use `triptych info NAME.trip`");
    if (o->verify && cached_volume_wanted(o->path))
        return trip_option_fail("--verify", "applies to data sets only");
    return p->sets[VOLUME].given ? cached_volume_check_options(o->path) : 0;
}

/* The data set to print. */
typedef struct data_set {
    const char *path;
    triptych *t;
    triptych_info info;
    triptych_list *lists; /* array of info.lists elements */
    trip_json source;     /* the notes, if they are JSON */
} data_set;

/* Returns the step along axis `axis` of a grid in world space. */
static trip_vec3 direction(const double m[3][4], int axis)
{
    return trip_v3(m[0][axis], m[1][axis], m[2][axis]);
}

/* Returns the anatomical convention of world space, or NULL if the data set gives none. */
static const char *space_of(const cJSON *text)
{
    const char *space = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(text, "space"));
    return trip_anatomy_known(space) ? space : NULL;
}

/* Returns the source of the orientation, a key of FORMAT.md, or NULL. */
static const char *orientation_of(const cJSON *text)
{
    return cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(text, "orientation"));
}

/* Computes the axis-aligned box in world space that contains the whole grid, including the outer
 * halves of its border voxels. */
static void grid_bounds(const triptych_info *info, double bounds[2][3])
{
    trip_affine map;
    memcpy(map.m, info->index_to_world, sizeof map.m);
    for (int corner = 0; corner < 8; corner++) {
        double p[3];
        for (int a = 0; a < 3; a++)
            p[a] = info->grid_edges[corner >> a & 1][a];
        trip_vec3 world = trip_affine_point(&map, trip_v3(p[0], p[1], p[2]));
        for (int a = 0; a < 3; a++) {
            double v = trip_component(world, a);
            bounds[0][a] = corner ? fmin(bounds[0][a], v) : v;
            bounds[1][a] = corner ? fmax(bounds[1][a], v) : v;
        }
    }
}

static void kept_bounds(const triptych_info *info, double bounds[2][3])
{
    memcpy(bounds[0], info->lo, sizeof info->lo);
    memcpy(bounds[1], info->hi, sizeof info->hi);
}

/* Numbers are doubles. Byte counts are exact in them, because files are far smaller than 2^53
 * bytes. */
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

static uint64_t halo_bytes(const data_set *d)
{
    uint64_t bytes = 0;
    for (unsigned i = 0; i < d->info.lists; i++)
        bytes += strcmp(d->lists[i].kind, "halo") ? 0 : d->lists[i].bytes;
    return bytes;
}

static uint64_t level_bytes(const data_set *d)
{
    uint64_t bytes = 0;
    for (unsigned i = 0; i < d->info.lists; i++)
        bytes += d->lists[i].level > 0 ? d->lists[i].bytes : 0;
    return bytes;
}

static void add_matrix(cJSON *root, const double index_to_world[3][4])
{
    cJSON *rows = cJSON_AddArrayToObject(root, "index_to_world");
    for (int row = 0; row < 3; row++)
        cJSON_AddItemToArray(rows, numbers(index_to_world[row], 4));
}

static cJSON *list_to_json(const triptych_list *list)
{
    const char axis[2] = { (char)('x' + list->axis), 0 };
    double dims[3] = { (double)list->dims[0], (double)list->dims[1], (double)list->dims[2] };
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "axis", axis);
    cJSON_AddItemToObject(root, "level", number(list->level));
    cJSON_AddStringToObject(root, "kind", list->kind);
    cJSON_AddItemToObject(root, "dims", numbers(dims, 3));
    add_matrix(root, list->index_to_world);
    cJSON_AddItemToObject(root, "sheet_first", number(list->sheet_first));
    cJSON_AddItemToObject(root, "sheet_step", number(list->sheet_step));
    cJSON_AddItemToObject(root, "records", number((double)list->records));
    cJSON_AddItemToObject(root, "slabs", number((double)list->slabs));
    cJSON_AddItemToObject(root, "bricks", number((double)list->bricks));
    cJSON_AddItemToObject(root, "bytes", number((double)list->bytes));
    cJSON_AddItemToObject(root, "deviation_bytes", number((double)list->deviation_bytes));
    return root;
}

static void add_lists(cJSON *root, const data_set *d)
{
    cJSON *lists = cJSON_AddArrayToObject(root, "lists");
    for (unsigned i = 0; i < d->info.lists; i++)
        cJSON_AddItemToArray(lists, list_to_json(&d->lists[i]));
}

static void add_bounds(cJSON *root, const char *name, double bounds[2][3])
{
    cJSON *corners = cJSON_AddArrayToObject(root, name);
    cJSON_AddItemToArray(corners, numbers(bounds[0], 3));
    cJSON_AddItemToArray(corners, numbers(bounds[1], 3));
}

/* Adds the index-to-world map and the bounds. For a patient, adds the anatomical directions of the
 * axes. */
static void add_world(cJSON *root, const triptych_info *info, const cJSON *text)
{
    const char *space = space_of(text);
    double bounds[2][3];
    add_matrix(root, info->index_to_world);
    grid_bounds(info, bounds);
    add_bounds(root, "bounds", bounds);
    kept_bounds(info, bounds);
    add_bounds(root, "kept_bounds", bounds);
    if (orientation_of(text))
        cJSON_AddStringToObject(root, "orientation", orientation_of(text));
    if (!space)
        return;
    cJSON_AddStringToObject(root, "space", space);
    cJSON *axes = cJSON_AddArrayToObject(root, "axes");
    for (int a = 0; a < 3; a++) {
        char ends[4];
        trip_anatomy_ends(space, direction(info->index_to_world, a), ends);
        cJSON_AddItemToArray(axes, cJSON_CreateString(ends));
    }
}

static void add_normals(cJSON *root, const triptych_info *info)
{
    if (info->normal_bytes == 3)
        cJSON_AddItemToObject(root, "gradient_step", numbers(info->gradient_step, 3));
    if (info->normal_bytes)
        cJSON_AddItemToObject(root, "gradient_full", number(info->gradient_full));
}

static bool is_uneven(const triptych_info *info)
{
    for (int a = 0; a < 3; a++)
        if (info->spacing_min[a] < info->spacing_max[a])
            return true;
    return false;
}

/* Returns the number of values outside of the typical range. */
static double outside(const cJSON *root)
{
    const cJSON *histogram = cJSON_GetObjectItemCaseSensitive(root, "histogram");
    const cJSON *below = cJSON_GetObjectItemCaseSensitive(histogram, "below");
    const cJSON *above = cJSON_GetObjectItemCaseSensitive(histogram, "above");
    return (cJSON_IsNumber(below) ? below->valuedouble : 0) +
           (cJSON_IsNumber(above) ? above->valuedouble : 0);
}

static cJSON *to_json(const data_set *d, bool verified)
{
    const triptych_info *info = &d->info;
    double dims[3], steps[3];
    cJSON *root = cJSON_CreateObject();
    for (int a = 0; a < 3; a++) {
        dims[a] = (double)info->dims[a];
        steps[a] = trip_length(direction(info->index_to_world, a));
    }
    cJSON_AddItemToObject(root, "format_version", number(info->format_version));
    cJSON_AddItemToObject(root, "dims", numbers(dims, 3));
    cJSON_AddItemToObject(root, "spacing", numbers(steps, 3));
    if (is_uneven(info)) {
        cJSON_AddItemToObject(root, "spacing_min", numbers(info->spacing_min, 3));
        cJSON_AddItemToObject(root, "spacing_max", numbers(info->spacing_max, 3));
    }
    add_world(root, info, d->source.root);
    cJSON_AddItemToObject(root, "value_min", number(info->value_min));
    cJSON_AddItemToObject(root, "value_max", number(info->value_max));
    cJSON_AddItemToObject(root, "typical_min", number(info->typical_min));
    cJSON_AddItemToObject(root, "typical_max", number(info->typical_max));
    cJSON_AddItemToObject(root, "outside", number(outside(d->source.root)));
    cJSON_AddItemToObject(root, "code_lo", number(info->code_lo));
    cJSON_AddItemToObject(root, "code_hi", number(info->code_hi));
    cJSON_AddStringToObject(root, "codes", info->codes);
    cJSON_AddItemToObject(root, "code_step_min", number(info->code_step_min));
    cJSON_AddItemToObject(root, "code_step_max", number(info->code_step_max));
    if (info->ids)
        cJSON_AddItemToObject(root, "ids", number(info->ids));
    add_normals(root, info);
    cJSON_AddItemToObject(root, "voxels", number((double)info->voxels));
    cJSON_AddItemToObject(root, "kept", number((double)info->kept));
    cJSON_AddItemToObject(root, "halo", number((double)info->halo));
    cJSON_AddItemToObject(root, "bytes", number((double)info->bytes));
    cJSON_AddItemToObject(root, "halo_bytes", number((double)halo_bytes(d)));
    cJSON_AddItemToObject(root, "index_bytes", number((double)info->index_bytes));
    cJSON_AddBoolToObject(root, "normals", info->normal_bytes > 0);
    cJSON_AddItemToObject(root, "code_bytes", number(info->code_bytes));
    cJSON_AddItemToObject(root, "normal_bytes", number(info->normal_bytes));
    cJSON_AddItemToObject(root, "tile_voxels", number(info->tile_voxels));
    cJSON_AddItemToObject(root, "slab_sheets", number(info->slab_sheets));
    cJSON_AddItemToObject(root, "page_bytes", number(info->page_bytes));
    if (verified)
        cJSON_AddTrueToObject(root, "verified");
    add_lists(root, d);
    if (d->source.root)
        cJSON_AddItemReferenceToObject(root, "source", d->source.root);
    else
        cJSON_AddStringToObject(root, "source", info->notes);
    return root;
}

static int print_json(const data_set *d, bool verified)
{
    cJSON *root = to_json(d, verified);
    char *text = trip_json_print(root, true);
    cJSON_Delete(root);
    if (!text)
        return trip_fail(TRIP_ERROR, "info", d->path, "out of memory");
    puts(text);
    free(text);
    return TRIP_OK;
}

static void print_range(const char *label, double lo, double hi)
{
    char a[32], b[32];
    printf("%-12s %s to %s\n", label, size_print_number(lo, a), size_print_number(hi, b));
}

static void print_bounds(const char *label, double bounds[2][3])
{
    char lo[32], hi[32];
    printf("%-12s", label);
    for (int a = 0; a < 3; a++)
        printf("%s %c %s to %s", a ? "," : "", 'x' + a, size_print_number(bounds[0][a], lo),
               size_print_number(bounds[1][a], hi));
    putchar('\n');
}

static void print_world(const triptych_info *info)
{
    char a[32], b[32], c[32], t[32];
    double bounds[2][3];
    printf("%-12s %s x %s x %s\n", "spacing",
           size_print_number(trip_length(direction(info->index_to_world, 0)), a),
           size_print_number(trip_length(direction(info->index_to_world, 1)), b),
           size_print_number(trip_length(direction(info->index_to_world, 2)), c));
    for (int axis = 0; axis < 3; axis++)
        if (info->spacing_min[axis] < info->spacing_max[axis])
            printf("%c %-10s %s to %s apart\n", 'i' + axis, "voxels",
                   size_print_number(info->spacing_min[axis], a),
                   size_print_number(info->spacing_max[axis], b));
    for (int row = 0; row < 3; row++) {
        const double *m = info->index_to_world[row];
        printf("world %c      = %s i + %s j + %s k + %s\n", 'x' + row, size_print_number(m[0], a),
               size_print_number(m[1], b), size_print_number(m[2], c), size_print_number(m[3], t));
    }
    grid_bounds(info, bounds);
    print_bounds("bounds", bounds);
    kept_bounds(info, bounds);
    print_bounds("kept in", bounds);
}

/* Prints the anatomical directions of x, y, z in the world and of i, j, k in the grid. */
static void print_anatomy(const triptych_info *info, const char *space)
{
    char words[TRIP_ANATOMY_WORDS];
    printf("%-12s %s: x to %s, y to %s, z to %s\n", "space", space, trip_anatomy_end_name(space[0]),
           trip_anatomy_end_name(space[1]), trip_anatomy_end_name(space[2]));
    for (int a = 0; a < 3; a++)
        printf("%c %-10s %s\n", 'i' + a, "points to",
               trip_anatomy_words(space, direction(info->index_to_world, a), words));
}

/* Other lines say the same in words. */
static bool is_for_people(const char *key)
{
    static const char *const others[] = { "space", "mirror", "footing", "up" };
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        if (!strcmp(key, others[i]))
            return false;
    return true;
}

/* Returns the label of a note. The data set has a grid and a format of its own. */
static const char *label_of(const char *key)
{
    static const char *const labels[][2] = { { "function_kind", "kind" },
                                             { "source_path", "source path" },
                                             { "format", "file format" },
                                             { "grid", "grid name" } };
    for (size_t i = 0; i < sizeof labels / sizeof *labels; i++)
        if (!strcmp(key, labels[i][0]))
            return labels[i][1];
    return key;
}

/* Prints the top-level strings of the notes that `triptych brick` stored. */
static void print_notes(const cJSON *root)
{
    for (const cJSON *item = root ? root->child : NULL; item; item = item->next)
        if (is_for_people(item->string) && cJSON_IsString(item) &&
            strlen(item->valuestring) < 1024 && strlen(item->string) < 200 &&
            !strchr(item->valuestring, '\n') && strcmp(item->string, "orientation") != 0) {
            const bool is_kind = !strcmp(item->string, "function_kind");
            const char *label = label_of(item->string);
            trip_text_write(stdout, label);
            for (size_t i = strlen(label); i < 12; i++)
                putchar(' ');
            putchar(' ');
            trip_text_write(stdout,
                            is_kind ? trip_tf_kind_title(trip_tf_kind_from_name(item->valuestring))
                                    : item->valuestring);
            putchar('\n');
        }
}

static void print_sizes(const data_set *d)
{
    const triptych_info *info = &d->info;
    printf("%-12s ", "size");
    size_print(&(data_set_size){ info->bytes, halo_bytes(d), level_bytes(d) });
}

/* Returns the step along an axis of a list's grid, divided by the step of the data set's grid. */
static double ratio(const triptych_info *info, const triptych_list *list, int axis)
{
    return trip_length(direction(list->index_to_world, axis)) /
           trip_length(direction(info->index_to_world, axis));
}

/* Prints a list, and its grid if it belongs to a coarse level. */
static void print_list(const triptych_info *info, const triptych_list *list)
{
    char bytes[32], text[3][32];
    printf("list %c       %s", 'x' + list->axis, list->kind);
    if (list->level > 0)
        printf(" of coarse level %u", list->level);
    printf(": %llu in %llu bricks, %s", (unsigned long long)list->records,
           (unsigned long long)list->bricks, trip_format_bytes(list->bytes, bytes));
    if (list->deviation_bytes > 0)
        printf(", %s of them deviations", trip_format_bytes(list->deviation_bytes, bytes));
    if (list->level > 0)
        printf("; grid of %lld x %lld x %lld, each %s x %s x %s voxels", (long long)list->dims[0],
               (long long)list->dims[1], (long long)list->dims[2],
               size_print_number(ratio(info, list, 0), text[0]),
               size_print_number(ratio(info, list, 1), text[1]),
               size_print_number(ratio(info, list, 2), text[2]));
    putchar('\n');
}

/* Prints the typical range if some values lie outside. */
static void print_typical(const data_set *d)
{
    const triptych_info *info = &d->info;
    char lo[32], hi[32];
    if (info->typical_min == info->value_min && info->typical_max == info->value_max)
        return;
    printf("%-12s %s to %s, without %.0f values far outside\n", "typical",
           size_print_number(info->typical_min, lo), size_print_number(info->typical_max, hi),
           outside(d->source.root));
}

/* Prints the even steps of stored values. A byte stands for every 85th code of 258 such steps and
 * more (FORMAT.md); 16 bits stand for every code. */
static void print_steps(const triptych_info *info)
{
    enum { CODES_PER_BYTE_STEP = 85, FIRST_BYTE_STEP = 258, BYTE_STEPS = 255 };
    const bool byte = info->code_bytes == 1;
    const double step = info->code_step_min * (byte ? CODES_PER_BYTE_STEP : 1);
    const double first = info->code_lo + (byte ? FIRST_BYTE_STEP * step : 0);
    const double steps = byte ? BYTE_STEPS : round((info->code_hi - info->code_lo) / step);
    const bool wider = first < info->value_min || first + steps * step > info->value_max;
    char lo[32], hi[32];
    printf("; %.0f steps of %.3g from %s to %s%s\n", steps, step, size_print_number(first, lo),
           size_print_number(first + steps * step, hi),
           wider && !byte ? ", with a margin around the values" : "");
}

static void print_codes(const triptych_info *info)
{
    char lo[32], hi[32];
    size_print_number(info->code_lo, lo);
    size_print_number(info->code_hi, hi);
    printf("%-12s ", "stored as");
    size_print_each(info->code_bytes, info->normal_bytes);
    if (info->ids)
        printf("; %u whole numbers from %s to %s, exactly\n", info->ids, lo, hi);
    else if (info->code_step_min < info->code_step_max)
        printf(
            "; values from %s to %s in steps of %.3g to %.3g, finer where there are more values\n",
            lo, hi, info->code_step_min, info->code_step_max);
    else
        print_steps(info);
}

static void print_text(const data_set *d)
{
    const triptych_info *info = &d->info;
    double voxels = info->voxels ? (double)info->voxels : 1;
    printf("%-12s ", "data set");
    trip_text_write(stdout, d->path);
    printf(" (format version %u)\n", info->format_version);
    printf("%-12s %lld x %lld x %lld voxels\n", "grid", (long long)info->dims[0],
           (long long)info->dims[1], (long long)info->dims[2]);
    print_world(info);
    if (space_of(d->source.root))
        print_anatomy(info, space_of(d->source.root));
    print_orientation(orientation_of(d->source.root));
    print_range("values", info->value_min, info->value_max);
    print_typical(d);
    print_codes(info);
    printf("%-12s %llu\n", "voxels", (unsigned long long)info->voxels);
    printf("%-12s %llu voxels (%.3g %%)\n", "kept", (unsigned long long)info->kept,
           100.0 * (double)info->kept / voxels);
    if (info->halo)
        printf("%-12s %llu neighbours of kept voxels, for interpolation\n", "halo",
               (unsigned long long)info->halo);
    print_sizes(d);
    printf("%-12s %u x %u x %u voxels each; they are read as a whole\n", "bricks",
           info->tile_voxels, info->tile_voxels, info->slab_sheets);
    for (unsigned i = 0; i < info->lists; i++)
        print_list(info, &d->lists[i]);
    print_notes(d->source.root);
    printf("%-12s triptych render ", "to draw it");
    trip_text_write_word(stdout, d->path);
    puts(" -o NAME.png");
}

static int read_lists(data_set *d)
{
    int status = 0;
    d->lists = calloc(d->info.lists, sizeof *d->lists);
    if (!d->lists)
        return trip_fail(TRIP_ERROR, "info", d->path, "out of memory");
    for (unsigned i = 0; i < d->info.lists && !status; i++)
        status = triptych_get_list(d->t, i, &d->lists[i]);
    return status;
}

static int show(const options *o, data_set *d, trip_budget *budget)
{
    int status = triptych_open(d->t, o->path, NULL);
    if (status == TRIP_OK && o->verify)
        status = triptych_verify(d->t);
    if (status == TRIP_OK && triptych_is_scene(d->t))
        return gaussian_info_print_scene(d->t, o->path, o->json, o->verify);
    if (status == TRIP_OK)
        status = triptych_get_info(d->t, &d->info);
    if (status == TRIP_OK)
        status = read_lists(d);
    if (status == TRIP_OK)
        status = trip_json_parse(&d->source, d->info.notes, o->path, budget);
    if (status == TRIP_OK && o->json)
        status = print_json(d, o->verify);
    else if (status == TRIP_OK)
        print_text(d);
    if (status == TRIP_OK && o->verify && !o->json)
        printf("%-12s every page and record is intact\n", "verified");
    return status;
}

static int show_data_set(const options *o, data_set *d)
{
    trip_budget *budget = NULL;
    int status = trip_budget_create(&budget, 0);
    if (status == 0)
        status = show(o, d, budget);
    trip_json_free(&d->source);
    free(d->lists);
    if (budget)
        trip_budget_destroy(budget);
    return status;
}

int trip_command_info(int argc, char **argv)
{
    options o = { 0 };
    parse p = { .o = &o,
                .sets = { [OWN] = { .table = &info_table, .base = &o },
                          [VOLUME] = { .table = &volume_options_table, .base = &o.volume } } };
    const command_line c = {
        .args_doc = "NAME.trip|VOLUME",
        .doc =
            "Prints the contents of a data set: grid, values, sizes and source. Of a volume, it "
            "prints the grid, a look at the values, and the series of a DICOM folder. Of a "
            "Gaussian scene, it prints count, degree and bounds. Of a cloud of points, it prints "
            "count, attributes and bounds. Of other files, it prints what they are and what "
            "reads them.",
        .sets = p.sets,
        .set_count = SETS,
        .argument = add_input,
        .end = check,
        .user = &p,
    };
    data_set d = { 0 };
    int status = command_line_parse(&c, argc, argv);
    d.path = o.path;
    if (status == 0)
        status = library_create(&d.t, NULL);
    if (status == 0 && gaussian_info_wanted(d.t, o.path))
        status = gaussian_info_print(d.t, o.path, p.sets[VOLUME].given, o.json != 0);
    else if (status == 0 && triptych_is_points(d.t, o.path))
        status = point_info_print(d.t, o.path, p.sets[VOLUME].given, o.json != 0);
    else if (status == 0 && !o.verify && triptych_is_scene_file(o.path))
        status = placed_input_print(d.t, o.path, p.sets[VOLUME].given, o.json != 0);
    else if (status == 0 && !o.verify && own_file_wanted(o.path))
        status = own_file_info(o.path, o.json != 0);
    else if (status == 0)
        status = cached_volume_wanted(o.path)
                     ? volume_info_print(d.t, o.path, &o.volume, o.json != 0)
                     : show_data_set(&o, &d);
    triptych_destroy(d.t);
    return trip_exit_status(status);
}
