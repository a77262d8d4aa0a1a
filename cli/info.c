/* triptych info: what is in a data set, for people or as JSON, and whether it is sound. */
#include "commands.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "anatomy.h"
#include "dataset.h"
#include "json.h"
#include "options.h"
#include "report.h"
#include "text.h"

typedef struct options {
    const char *path;
    bool verify, json;
} options;

static const struct argp_option option_table[] = {
    { "verify", 'v', NULL, 0, "Read everything and check it", 0 },
    { "json", 'j', NULL, 0, "Print JSON", 0 },
    { 0 },
};

static error_t parse_option(int key, char *argument, struct argp_state *state)
{
    options *o = state->input;
    switch (key) {
    case 'v':
        o->verify = true;
        return 0;
    case 'j':
        o->json = true;
        return 0;
    case ARGP_KEY_ARG:
        if (o->path)
            return trip_option_fail(argument, "one data set at a time");
        o->path = argument;
        return 0;
    case ARGP_KEY_END:
        return o->path
                   ? 0
                   : trip_option_fail("NAME.trip", "no data set given: `triptych info NAME.trip`");
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* Along index axis `axis`, of world space. */
static trip_vec3 direction(const trip_dataset *d, int axis)
{
    const double(*m)[4] = d->index_to_world.m;
    return trip_v3(m[0][axis], m[1][axis], m[2][axis]);
}

/* The anatomical convention of world space; NULL where the data set gives none. */
static const char *space_of(const cJSON *text)
{
    const char *space = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(text, "space"));
    return trip_anatomy_known(space) ? space : NULL;
}

/* The box of world space about voxels lo to hi, from edge to edge. */
static void world_bounds(const trip_dataset *d, const double lo[3], const double hi[3],
                         double bounds[2][3])
{
    for (int corner = 0; corner < 8; corner++) {
        trip_vec3 p =
            trip_v3(corner & 1 ? hi[0] + 0.5 : lo[0] - 0.5, corner & 2 ? hi[1] + 0.5 : lo[1] - 0.5,
                    corner & 4 ? hi[2] + 0.5 : lo[2] - 0.5);
        p = trip_affine_point(&d->index_to_world, p);
        for (int a = 0; a < 3; a++) {
            double v = trip_component(p, a);
            bounds[0][a] = corner ? fmin(bounds[0][a], v) : v;
            bounds[1][a] = corner ? fmax(bounds[1][a], v) : v;
        }
    }
}

static void grid_bounds(const trip_dataset *d, double bounds[2][3])
{
    const double lo[3] = { 0, 0, 0 };
    double hi[3];
    for (int a = 0; a < 3; a++)
        hi[a] = (double)d->header.dims[a] - 1;
    world_bounds(d, lo, hi, bounds);
}

static void kept_bounds(const trip_dataset *d, double bounds[2][3])
{
    double lo[3], hi[3];
    trip_dataset_kept_bounds(d, lo, hi);
    world_bounds(d, lo, hi, bounds);
}

/* Every byte count below is exact in a double: files are far smaller than 2^53 bytes. */
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

static uint64_t list_bytes(const trip_list *list)
{
    return list->plane_bytes[TRIP_PLANE_VOXELS] + list->plane_bytes[TRIP_PLANE_NORMALS];
}

static uint64_t halo_bytes(const trip_dataset *d)
{
    uint64_t bytes = 0;
    for (unsigned i = 0; i < d->list_count; i++)
        bytes += d->lists[i].kind == TRIP_KIND_HALO ? list_bytes(&d->lists[i]) : 0;
    return bytes;
}

static void add_matrix(cJSON *root, const trip_affine *index_to_world)
{
    cJSON *rows = cJSON_AddArrayToObject(root, "index_to_world");
    for (int row = 0; row < 3; row++)
        cJSON_AddItemToArray(rows, numbers(index_to_world->m[row], 4));
}

static cJSON *list_to_json(const trip_list *list)
{
    const char axis[2] = { (char)('x' + list->axis), 0 };
    double dims[3] = { (double)list->dims[0], (double)list->dims[1], (double)list->dims[2] };
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "axis", axis);
    cJSON_AddItemToObject(root, "level", number(list->level));
    cJSON_AddStringToObject(root, "kind", trip_kind_of(list->kind)->name);
    cJSON_AddItemToObject(root, "dims", numbers(dims, 3));
    add_matrix(root, &list->index_to_world);
    cJSON_AddItemToObject(root, "sheet_first", number(list->sheet_first));
    cJSON_AddItemToObject(root, "sheet_step", number(list->sheet_step));
    cJSON_AddItemToObject(root, "records", number((double)list->records));
    cJSON_AddItemToObject(root, "slabs", number((double)list->slab_count));
    cJSON_AddItemToObject(root, "bricks", number((double)list->brick_count));
    cJSON_AddItemToObject(root, "bytes", number((double)list_bytes(list)));
    return root;
}

static void add_lists(cJSON *root, const trip_dataset *d)
{
    cJSON *lists = cJSON_AddArrayToObject(root, "lists");
    for (unsigned i = 0; i < d->list_count; i++)
        cJSON_AddItemToArray(lists, list_to_json(&d->lists[i]));
}

static void add_bounds(cJSON *root, const char *name, double bounds[2][3])
{
    cJSON *corners = cJSON_AddArrayToObject(root, name);
    cJSON_AddItemToArray(corners, numbers(bounds[0], 3));
    cJSON_AddItemToArray(corners, numbers(bounds[1], 3));
}

/* Where the volume lies: its map, its bounds and, of a patient, the ends that its axes point to. */
static void add_world(cJSON *root, const trip_dataset *d, const cJSON *text)
{
    const char *space = space_of(text);
    double bounds[2][3];
    add_matrix(root, &d->index_to_world);
    grid_bounds(d, bounds);
    add_bounds(root, "bounds", bounds);
    kept_bounds(d, bounds);
    add_bounds(root, "kept_bounds", bounds);
    if (!space)
        return;
    cJSON_AddStringToObject(root, "space", space);
    cJSON *axes = cJSON_AddArrayToObject(root, "axes");
    for (int a = 0; a < 3; a++) {
        char ends[4];
        trip_anatomy_ends(space, direction(d, a), ends);
        cJSON_AddItemToArray(axes, cJSON_CreateString(ends));
    }
}

static cJSON *to_json(const trip_dataset *d, const trip_json *source, bool verified)
{
    const trip_file_header *h = &d->header;
    double dims[3], steps[3];
    cJSON *root = cJSON_CreateObject();
    for (int a = 0; a < 3; a++) {
        dims[a] = (double)h->dims[a];
        steps[a] = trip_length(direction(d, a));
    }
    cJSON_AddItemToObject(root, "format_version", number(h->version));
    cJSON_AddItemToObject(root, "dims", numbers(dims, 3));
    cJSON_AddItemToObject(root, "spacing", numbers(steps, 3));
    add_world(root, d, source->root);
    cJSON_AddItemToObject(root, "value_min", number(h->value_min));
    cJSON_AddItemToObject(root, "value_max", number(h->value_max));
    cJSON_AddItemToObject(root, "code_lo", number(h->code_lo));
    cJSON_AddItemToObject(root, "code_hi", number(h->code_hi));
    if (h->normal_bytes == 4)
        cJSON_AddItemToObject(root, "gradient_scale", number(h->gradient_scale));
    if (h->normal_bytes == 3) {
        cJSON_AddItemToObject(root, "gradient_step", numbers(h->gradient_step, 3));
        cJSON_AddItemToObject(root, "gradient_full", number(h->gradient_full));
    }
    cJSON_AddItemToObject(root, "voxels", number((double)h->voxels));
    cJSON_AddItemToObject(root, "kept", number((double)h->kept));
    cJSON_AddItemToObject(root, "halo", number((double)h->halo));
    cJSON_AddItemToObject(root, "bytes", number((double)d->bytes));
    cJSON_AddItemToObject(root, "halo_bytes", number((double)halo_bytes(d)));
    cJSON_AddItemToObject(root, "index_bytes", number((double)h->index_bytes));
    cJSON_AddBoolToObject(root, "normals", h->planes >> TRIP_PLANE_NORMALS & 1);
    cJSON_AddItemToObject(root, "code_bytes", number(h->code_bytes));
    cJSON_AddItemToObject(root, "normal_bytes", number(h->normal_bytes));
    cJSON_AddItemToObject(root, "tile_voxels", number(1u << h->tile_log2));
    cJSON_AddItemToObject(root, "slab_sheets", number(h->slab_sheets));
    cJSON_AddItemToObject(root, "page_bytes", number(1u << h->page_log2));
    if (verified)
        cJSON_AddTrueToObject(root, "verified");
    add_lists(root, d);
    if (source->root)
        cJSON_AddItemReferenceToObject(root, "source", source->root);
    else
        cJSON_AddStringToObject(root, "source", d->text);
    return root;
}

static int print_json(const trip_dataset *d, const trip_json *source, bool verified)
{
    cJSON *root = to_json(d, source, verified);
    char *text = trip_json_print(root, true);
    cJSON_Delete(root);
    if (!text)
        return trip_fail(TRIP_ERROR, "info", d->path, "out of memory");
    puts(text);
    free(text);
    return TRIP_OK;
}

static const char *shortest(double value, char *text)
{
    snprintf(text, 32, "%.7g", value);
    return text;
}

static void print_range(const char *label, double lo, double hi)
{
    char a[32], b[32];
    printf("%-12s %s to %s\n", label, shortest(lo, a), shortest(hi, b));
}

static void print_bounds(const char *label, double bounds[2][3])
{
    char lo[32], hi[32];
    printf("%-12s", label);
    for (int a = 0; a < 3; a++)
        printf("%s %c %s to %s", a ? "," : "", 'x' + a, shortest(bounds[0][a], lo),
               shortest(bounds[1][a], hi));
    putchar('\n');
}

static void print_world(const trip_dataset *d)
{
    char a[32], b[32], c[32], t[32];
    double bounds[2][3];
    printf("%-12s %s x %s x %s\n", "spacing", shortest(trip_length(direction(d, 0)), a),
           shortest(trip_length(direction(d, 1)), b), shortest(trip_length(direction(d, 2)), c));
    for (int row = 0; row < 3; row++) {
        const double *m = d->index_to_world.m[row];
        printf("%-12s %12s %12s %12s %12s\n", row ? "" : "to world", shortest(m[0], a),
               shortest(m[1], b), shortest(m[2], c), shortest(m[3], t));
    }
    grid_bounds(d, bounds);
    print_bounds("bounds", bounds);
    kept_bounds(d, bounds);
    print_bounds("kept in", bounds);
}

/* Where x, y and z of the world, and i, j and k of the grid point in the patient. */
static void print_anatomy(const trip_dataset *d, const char *space)
{
    char words[TRIP_ANATOMY_WORDS];
    printf("%-12s %s: x to %s, y to %s, z to %s\n", "space", space, trip_anatomy_end_name(space[0]),
           trip_anatomy_end_name(space[1]), trip_anatomy_end_name(space[2]));
    for (int a = 0; a < 3; a++)
        printf("%c %-10s %s\n", 'i' + a, "points to",
               trip_anatomy_words(space, direction(d, a), words));
}

/* The top-level texts and numbers of the notes that brick left. */
static void print_notes(const cJSON *root)
{
    for (const cJSON *item = root ? root->child : NULL; item; item = item->next)
        if (cJSON_IsString(item) && strlen(item->valuestring) < 200 && strlen(item->string) < 200 &&
            !strchr(item->valuestring, '\n') && strcmp(item->string, "space") != 0) {
            trip_text_write(stdout, item->string);
            for (size_t i = strlen(item->string); i < 12; i++)
                putchar(' ');
            putchar(' ');
            trip_text_write(stdout, item->valuestring);
            putchar('\n');
        }
}

static void print_sizes(const trip_dataset *d)
{
    const trip_file_header *h = &d->header;
    char bytes[32], index[32], halo[32];
    double kept = h->kept ? (double)h->kept : 1, around = (double)halo_bytes(d);
    printf("%-12s %s, %.4g per kept voxel", "size", trip_format_bytes(d->bytes, bytes),
           ((double)d->bytes - around) / kept);
    if (h->halo)
        printf(" and %s of halo, %.4g with it", trip_format_bytes(halo_bytes(d), halo),
               (double)d->bytes / kept);
    printf("; index %s (%.2g %%)\n", trip_format_bytes(h->index_bytes, index),
           100.0 * (double)h->index_bytes / (double)d->bytes);
    printf("%-12s %u byte%s a code", "planes", h->code_bytes, h->code_bytes > 1 ? "s" : "");
    if (h->normal_bytes)
        printf(", %u a normal", h->normal_bytes);
    putchar('\n');
}

/* Length of a step along an index axis of a list's grid, in those of the data set's. */
static double ratio(const trip_dataset *d, const trip_list *list, int axis)
{
    const double(*m)[4] = list->index_to_world.m;
    return trip_length(trip_v3(m[0][axis], m[1][axis], m[2][axis])) /
           trip_length(direction(d, axis));
}

/* A list; its grid where that is not the data set's. */
static void print_list(const trip_dataset *d, const trip_list *list)
{
    char bytes[32], name[32], text[3][32];
    snprintf(name, sizeof name, "%c%u %s", 'x' + list->axis, list->level,
             trip_kind_of(list->kind)->name);
    printf("%-12s %llu records, %llu bricks, %s", name, (unsigned long long)list->records,
           (unsigned long long)list->brick_count, trip_format_bytes(list_bytes(list), bytes));
    if (list->level > 0)
        printf("; %lld x %lld x %lld, %s x %s x %s voxels of level 0 each",
               (long long)list->dims[0], (long long)list->dims[1], (long long)list->dims[2],
               shortest(ratio(d, list, 0), text[0]), shortest(ratio(d, list, 1), text[1]),
               shortest(ratio(d, list, 2), text[2]));
    putchar('\n');
}

static void print_text(const trip_dataset *d, const trip_json *source)
{
    const trip_file_header *h = &d->header;
    double voxels = h->voxels ? (double)h->voxels : 1;
    printf("%-12s ", "data set");
    trip_text_write(stdout, d->path);
    printf(" (format version %u)\n", h->version);
    printf("%-12s %llu x %llu x %llu\n", "grid", (unsigned long long)h->dims[0],
           (unsigned long long)h->dims[1], (unsigned long long)h->dims[2]);
    print_world(d);
    if (space_of(source->root))
        print_anatomy(d, space_of(source->root));
    print_range("values", h->value_min, h->value_max);
    print_range("stored as", h->code_lo, h->code_hi);
    printf("%-12s %llu\n", "voxels", (unsigned long long)h->voxels);
    printf("%-12s %llu (%.3g %%), in each of three lists\n", "kept", (unsigned long long)h->kept,
           100.0 * (double)h->kept / voxels);
    if (h->halo)
        printf("%-12s %llu neighbours of those, likewise\n", "halo", (unsigned long long)h->halo);
    print_sizes(d);
    printf("%-12s tiles of %u x %u voxels over %u sheets\n", "bricks", 1u << h->tile_log2,
           1u << h->tile_log2, h->slab_sheets);
    for (unsigned i = 0; i < d->list_count; i++)
        print_list(d, &d->lists[i]);
    print_notes(source->root);
}

static int show(const options *o, trip_budget *budget)
{
    trip_dataset *d;
    trip_json source = { 0 };
    int status = trip_dataset_open(&d, o->path, budget);
    if (status == TRIP_OK && o->verify)
        status = trip_dataset_verify(d, budget);
    if (status == TRIP_OK)
        status = trip_json_parse(&source, d->text, d->path, budget);
    if (status == TRIP_OK && o->json)
        status = print_json(d, &source, o->verify);
    else if (status == TRIP_OK)
        print_text(d, &source);
    if (status == TRIP_OK && o->verify && !o->json)
        printf("%-12s every page and record is as it was written\n", "verified");
    trip_json_free(&source);
    trip_dataset_close(d);
    return status;
}

int trip_command_info(int argc, char **argv)
{
    static const struct argp argp = {
        .options = option_table,
        .parser = parse_option,
        .args_doc = "NAME.trip",
        .doc = "Show what is in a data set: grid, values, sizes, where it came from.",
    };
    options o = { 0 };
    trip_budget *budget = NULL;
    int status = trip_options_parse(&argp, argc, argv, &o);
    if (status == 0)
        status = trip_budget_create(&budget, 0);
    if (status < 0)
        return trip_exit_status(status);
    status = show(&o, budget);
    trip_budget_destroy(budget);
    return trip_exit_status(status);
}
