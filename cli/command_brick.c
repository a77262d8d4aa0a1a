/* triptych brick: converts a volume into a data set. */
#include "commands.h"

#include <cjson/cJSON.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "brick_limits.h"
#include "budget.h"
#include "clock.h"
#include "json.h"
#include "library.h"
#include "draw_options.h"
#include "plain_disk.h"
#include "report.h"
#include "size_print.h"
#include "text.h"

enum { MAX_FUNCTIONS = 64, MAX_RANGES = 64 };

typedef struct options {
    const char *volume, *output;
    triptych_brick_options brick;
    const char *functions[MAX_FUNCTIONS];
    triptych_range ranges[MAX_RANGES];
    char *default_output; /* freed at the end */
    int json, dry_run, limits;
} options;

/* Parses "256,256,128" or "256x256x128". */
static int read_size(const trip_option *row, const char *text, void *base)
{
    int64_t *dims = ((options *)base)->brick.raw_dims;
    char commas[128];
    double numbers[3];
    int count;
    (void)row;
    snprintf(commas, sizeof commas, "%s", text);
    for (char *x = commas; (x = strchr(x, 'x'));)
        *x = ',';
    int status = trip_option_numbers("--size", commas, 3, 3, numbers, &count);
    for (int a = 0; a < 3 && status == 0; a++) {
        if (!(numbers[a] >= 1) || numbers[a] > INT32_MAX || numbers[a] != floor(numbers[a]))
            return trip_option_fail("--size",
                                    "takes three whole numbers, each 1 or more, as X,Y,Z");
        dims[a] = (int64_t)numbers[a];
    }
    return status;
}

static int read_offset(const trip_option *row, const char *text, void *base)
{
    double number;
    (void)row;
    if (!trip_text_to_double(text, &number) || number != floor(number) || number < 0 ||
        number > 0x1p62)
        return trip_option_fail("--offset", "takes a whole number of bytes, 0 or more");
    ((options *)base)->brick.raw_offset_bytes = (uint64_t)number;
    return 0;
}

/* Parses "LO:HI"; an empty side is open. */
static int read_range(const trip_option *row, const char *text, void *base)
{
    options *o = base;
    triptych_range *r = &o->ranges[o->brick.range_count];
    const char *colon = strchr(text, ':');
    char lo[64] = "";
    (void)row;
    if (o->brick.range_count == MAX_RANGES)
        return trip_option_fail("--range", "given too often; at most 64 ranges are possible");
    if (!colon || colon - text >= (int)sizeof lo)
        return trip_option_fail("--range", "takes two values with a colon between them, LO:HI");
    memcpy(lo, text, (size_t)(colon - text));
    *r = (triptych_range){ -FLT_MAX, FLT_MAX };
    if ((*lo && !trip_text_to_double(lo, &r->lo)) ||
        (colon[1] && !trip_text_to_double(colon + 1, &r->hi)) || r->lo > r->hi)
        return trip_option_fail("--range", "takes two numbers, the smaller first, as LO:HI");
    o->brick.range_count++;
    return 0;
}

/* Parses the index of a voxel; an empty text keeps the value of *index. */
static bool parse_index(const char *text, int64_t *index)
{
    double number;
    if (!*text)
        return true;
    bool good = trip_text_to_double(text, &number) && number >= 0 && number <= INT32_MAX &&
                number == floor(number);
    *index = good ? (int64_t)number : 0;
    return good;
}

/* Parses "I0:I1" and moves *text past it. */
static bool parse_side(const char **text, int64_t *first, int64_t *past)
{
    char side[64];
    size_t length = strcspn(*text, ",");
    if (length >= sizeof side)
        return false;
    memcpy(side, *text, length);
    side[length] = 0;
    *text += length;
    char *colon = strchr(side, ':');
    if (!colon)
        return false;
    *colon = 0;
    return parse_index(side, first) && parse_index(colon + 1, past) &&
           (!colon[1] || *first < *past);
}

/* Parses "I0:I1,J0:J1,K0:K1"; an empty side is open. */
static int read_region(const trip_option *row, const char *text, void *base)
{
    triptych_brick_options *o = &((options *)base)->brick;
    bool good = true;
    (void)row;
    for (int a = 0; a < 3 && good; a++) {
        o->region_first[a] = o->region_past[a] = 0;
        good = parse_side(&text, &o->region_first[a], &o->region_past[a]) &&
               *text == (a < 2 ? ',' : 0);
        text += good && a < 2;
    }
    return good ? 0
                : trip_option_fail("--region",
                                   "takes voxel ranges I0:I1,J0:J1,K0:K1, each from the first "
                                   "voxel to before the second; empty sides are open");
}

static int read_tf(const trip_option *row, const char *path, void *base)
{
    options *o = base;
    (void)row;
    if (o->brick.function_count == MAX_FUNCTIONS)
        return trip_option_fail("--tf",
                                "given too often; at most 64 transfer functions are possible");
    o->functions[o->brick.function_count++] = path;
    return 0;
}

static int read_tile(const trip_option *row, const char *text, void *base)
{
    static const char *const names[] = { "16", "32", "64", "128", NULL };
    int choice = 0, status = trip_option_choice("--tile", text, names, &choice);
    (void)row;
    ((options *)base)->brick.tile_voxels = 16u << choice;
    return status;
}

static int read_levels(const trip_option *row, const char *text, void *base)
{
    const bool automatic = !strcmp(text, "auto");
    int number = 0, status = automatic ? 0 : trip_option_integer("--levels", text, 0, 24, &number);
    (void)row;
    ((options *)base)->brick.levels = automatic ? 0 : number ? number : -1;
    return status;
}

static int read_type(const trip_option *row, const char *text, void *base)
{
    (void)row;
    ((options *)base)->brick.raw_type = text;
    return triptych_is_raw_type(text)
               ? 0
               : trip_option_fail("--type", "unknown type; use for example uint8, int16 or float");
}

/* ---- the table ---- */

static const char *const endians[] = { "little", "big", NULL };
static const char *const code_bits[] = { "auto", "8", "16", NULL };
static const char *const normals[] = { "auto", "compact", "full", "none", "stored", NULL };
static const char *const harmonics[] = { "auto", "palette", "whole", NULL };
static const char *const halos[] = { "1", "0", NULL };

/* The names are in the order of the library's values. */
_Static_assert(TRIPTYCH_CODE_BITS_AUTO == 0 && TRIPTYCH_CODE_BITS_16 == 2, "code_bits");
_Static_assert(TRIPTYCH_NORMALS_AUTO == 0 && TRIPTYCH_NORMALS_STORED == 4, "normals");
_Static_assert(TRIPTYCH_STORED_HARMONICS_AUTO == 0 && TRIPTYCH_STORED_HARMONICS_WHOLE == 2,
               "harmonics");
_Static_assert(TRIPTYCH_LEVELS_FOR_AUTO == 0 && TRIPTYCH_LEVELS_FOR_BOTH == 3, "levels_for");

#define AT(member) .at = offsetof(options, member)
#define CUSTOM(function) .type = TRIP_OPTION_CUSTOM, .read = (function)
#define CHOICE(names) .type = TRIP_OPTION_CHOICE, .choices = (names)
#define FLAG .type = TRIP_OPTION_FLAG

static const trip_option rows[] = {
    { "endian", "little|big", "Sets the byte order", "the order of this machine",
      .group = DRAW_GROUP_RAW, AT(brick.raw_endian), CHOICE(endians),
      .first = TRIPTYCH_ENDIAN_LITTLE },
    { "offset", "BYTES", "Sets the position of the first voxel in the file", "0",
      .group = DRAW_GROUP_RAW, AT(brick.raw_offset_bytes), CUSTOM(read_offset) },
    { "size", "X,Y,Z", "Sets the number of voxels along each axis, the fastest axis first",
      "from the name of the file", .brief = "Sets the voxels along each axis of raw data",
      .group = DRAW_GROUP_RAW, AT(brick.raw_dims), CUSTOM(read_size) },
    { "type", "TYPE", "Sets the type of a voxel: uint8, int16, float, ...",
      "from the name of the file", .brief = "Sets the type of a voxel: uint8, int16, float, ...",
      .group = DRAW_GROUP_RAW, AT(brick.raw_type), CUSTOM(read_type) },
    { "keep-all", NULL, "Keeps every finite value", NULL, "excludes --range",
      .brief = "Keeps every finite value", .group = DRAW_GROUP_KEPT, FLAG, AT(brick.keep_all) },
    { "range", "LO:HI",
      "Keeps the values from LO to HI; an empty side is open; several ranges add up",
      .brief = "Keeps the values from LO to HI", .group = DRAW_GROUP_KEPT, AT(brick.range_count),
      CUSTOM(read_range) },
    { "region", "I0:I1,J0:J1,K0:K1",
      "Keeps only the voxels from I0 to before I1 along the first axis, and so on; an empty side "
      "is open. `triptych render A.trip B.trip` draws regions of one volume together",
      .group = DRAW_GROUP_KEPT, AT(brick.region_past), CUSTOM(read_region) },
    { "tf", "NAME|FILE",
      "Keeps the values that this transfer function shows; several transfer functions add up",
      .brief = "Keeps the values that this transfer function shows", .group = DRAW_GROUP_KEPT,
      AT(brick.function_count), CUSTOM(read_tf) },
    { "dry-run", NULL, "Only estimates size and time, from parts of the input", NULL,
      "excludes --resume", .brief = "Only estimates size and time", .group = DRAW_GROUP_OUTPUT,
      FLAG, AT(dry_run) },
    { "force", NULL, "Replaces an existing data set", .brief = "Replaces an existing data set",
      .group = DRAW_GROUP_OUTPUT, FLAG, AT(brick.replace) },
    { "json", NULL, "Prints the summary as JSON", .group = DRAW_GROUP_OUTPUT, FLAG, AT(json) },
    { "limits", NULL,
      "Prints the time of each stage beside a plain read and a plain write of the same bytes", NULL,
      "excludes --dry-run", .group = DRAW_GROUP_OUTPUT, FLAG, AT(limits) },
    { "output", "NAME.trip", "Names the data set", "the name of the input, in the current folder",
      .brief = "Names the data set", .short_name = 'o', .group = DRAW_GROUP_OUTPUT,
      .type = TRIP_OPTION_TEXT, AT(output) },
    { "resume", NULL, "Continues the same command after it was killed",
      .brief = "Continues the same command after it was killed", .group = DRAW_GROUP_OUTPUT, FLAG,
      AT(brick.resume) },
    { "memory", "SIZE", "Limits the memory for data, for example 256M (MiB) or 2G (GiB)",
      "a quarter of the memory that the process may use",
      .brief = "Limits the memory for data, for example 2G", .group = DRAW_GROUP_RENDERER,
      .type = TRIP_OPTION_BYTES_64, AT(brick.memory_bytes) },
    { "threads", "N", "Sets the number of threads", "one per processor",
      .brief = "Sets the number of threads (default: all processors)", .group = DRAW_GROUP_RENDERER,
      .type = TRIP_OPTION_INTEGER, AT(brick.threads), .lo = 1, .hi = 256 },
    { "code-bits", "8|16|auto",
      "Sets the bits that store a value; 8 rounds to 256 codes; auto is 8 if these are exact, else "
      "16",
      "auto", .group = DRAW_GROUP_STORED, AT(brick.code_bits), CHOICE(code_bits) },
    { "halo", "0|1", "Keeps the transparent neighbours of kept voxels, for interpolation", "1",
      .group = DRAW_GROUP_STORED, AT(brick.no_halo), CHOICE(halos) },
    { "harmonics", "palette|whole|auto",
      "Stores the harmonics of a Gaussian scene by a palette (2 bytes a Gaussian) or whole (a byte "
      "a "
      "coefficient); auto is palette if colours change by less than 0.5 of 255, else whole",
      "auto", .group = DRAW_GROUP_STORED, AT(brick.harmonics), CHOICE(harmonics) },
    { "levels", "N|auto",
      "Sets the number of coarse levels, 0 to 24, each with half the resolution of the one before; "
      "auto goes down to one brick",
      "auto", .group = DRAW_GROUP_STORED, AT(brick.levels), CUSTOM(read_levels) },
    { "levels-for", "post|pre|both|auto",
      "Selects the classification that can draw the coarse levels; auto is post, or pre with "
      "--halo 0",
      "auto", .group = DRAW_GROUP_STORED, AT(brick.levels_for), CHOICE(trip_levels_for_names) },
    { "normals", "HOW",
      "Selects how normals are stored, for the shading of splats: compact (3 bytes), full (4 "
      "bytes), stored (compact if no colour changes by half of 1/255, else full), none, or auto: "
      "none if drawing can compute them from values, else stored",
      "auto", .group = DRAW_GROUP_STORED, AT(brick.normals), CHOICE(normals) },
    { "slab-sheets", "N", "Sets the number of sheets per brick", "8", .group = DRAW_GROUP_STORED,
      .type = TRIP_OPTION_INTEGER, AT(brick.slab_sheets), .lo = 1, .hi = 64 },
    { "tile", "N", "Sets the edge of a tile in voxels: 16, 32, 64 or 128", "64",
      .group = DRAW_GROUP_STORED, AT(brick.tile_voxels), CUSTOM(read_tile) },
};

static const trip_option_table brick_table = { rows, sizeof rows / sizeof *rows };

static int check_options(void *user)
{
    const options *o = user;
    const triptych_brick_options *p = &o->brick;
    if (!o->volume)
        return trip_option_fail("INPUT",
                                "no volume given; use `triptych brick VOLUME -o NAME.trip`");
    if (p->keep_all && p->range_count)
        return trip_option_fail("--range", "does not apply with --keep-all");
    if (o->dry_run && p->resume)
        return trip_option_fail("--resume", "does not apply with --dry-run");
    if (p->levels < 0 && p->levels_for)
        return trip_option_fail("--levels-for", "does not apply with --levels 0");
    if (o->limits && o->dry_run)
        return trip_option_fail("--limits", "does not apply with --dry-run");
    return 0;
}

static int add_input(void *user, char *path)
{
    options *o = user;
    if (o->volume)
        return trip_option_fail(path, TRIP_ONE_VOLUME);
    o->volume = path;
    return 0;
}

/* The default output is the input's name up to its first dot, with .trip, in the current folder. */
static int choose_output(options *o)
{
    const char *input = o->volume;
    size_t length = strlen(input);
    if (o->output)
        return 0;
    while (length > 1 && input[length - 1] == '/')
        length--;
    size_t begin = length;
    while (begin > 0 && input[begin - 1] != '/')
        begin--;
    size_t stem = 0;
    while (begin + stem < length && (stem == 0 || input[begin + stem] != '.'))
        stem++;
    if (stem == 0 || asprintf(&o->default_output, "%.*s.trip", (int)stem, input + begin) < 0) {
        o->default_output = NULL;
        return trip_option_fail("--output",
                                "cannot be derived from the name of the input; use -o NAME.trip");
    }
    o->output = o->default_output;
    return 0;
}

static void add_number(cJSON *object, const char *name, double value)
{
    char text[32];
    cJSON_AddItemToObject(object, name, cJSON_CreateRaw(trip_text_from_double(value, text)));
}

static int print_object(cJSON *root, const options *o)
{
    return trip_json_put(root, "brick", o->output);
}

static int print_json(const options *o, const triptych_brick_summary *s, const brick_limits *limits)
{
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "output", o->output);
    cJSON *dims = cJSON_AddArrayToObject(root, "dims");
    cJSON *spacing = cJSON_AddArrayToObject(root, "spacing");
    for (int a = 0; a < 3; a++) {
        cJSON_AddItemToArray(dims, cJSON_CreateNumber((double)s->dims[a]));
        cJSON_AddItemToArray(spacing, cJSON_CreateNumber(s->spacing[a]));
    }
    cJSON_AddStringToObject(root, "function_kind", s->kind);
    add_number(root, "value_min", s->value_min);
    add_number(root, "value_max", s->value_max);
    add_number(root, "voxels", (double)s->voxels);
    add_number(root, "kept", (double)s->kept);
    add_number(root, "halo", (double)s->halo);
    add_number(root, "not_finite", (double)s->not_finite);
    add_number(root, "input_bytes", (double)s->input_bytes);
    add_number(root, "bytes", (double)s->bytes);
    add_number(root, "halo_bytes", (double)s->halo_bytes);
    add_number(root, "levels", s->levels);
    add_number(root, "level_bytes", (double)s->level_bytes);
    add_number(root, "code_bytes", s->code_bytes);
    add_number(root, "normal_bytes", s->normal_bytes);
    add_number(root, "temporary_bytes", (double)s->temporary_bytes);
    cJSON_AddBoolToObject(root, "resumed", s->resumed);
    add_number(root, "scan_seconds", s->stages[TRIPTYCH_STAGE_SCAN].seconds);
    add_number(root, "read_seconds", s->stages[TRIPTYCH_STAGE_READ].seconds);
    add_number(root, "merge_seconds", s->stages[TRIPTYCH_STAGE_MERGE].seconds);
    add_number(root, "levels_seconds", s->stages[TRIPTYCH_STAGE_LEVELS].seconds);
    add_number(root, "finish_seconds", s->stages[TRIPTYCH_STAGE_FINISH].seconds);
    add_number(root, "seconds", brick_seconds(s));
    add_number(root, "memory_bytes", (double)s->memory_bytes);
    add_number(root, "peak_memory_bytes", (double)s->peak_memory_bytes);
    add_number(root, "peak_rss_bytes", (double)trip_memory_peak_rss_bytes());
    if (o->limits)
        cJSON_AddItemToObject(root, "limits", brick_limits_to_json(limits, s));
    return print_object(root, o);
}

static void print_name(const char *label, const char *name)
{
    printf("%-9s ", label);
    trip_text_write(stdout, name);
    putchar('\n');
}

static void print_text(const options *o, const triptych_brick_summary *s)
{
    char temporary[32], peak[32], promise[32], low[32], high[32];
    double seconds = brick_seconds(s), kept = (double)s->kept, voxels = (double)s->voxels;
    print_name("data set", o->output);
    printf("%-9s %lld x %lld x %lld voxels, spacing %.6g x %.6g x %.6g\n", "grid",
           (long long)s->dims[0], (long long)s->dims[1], (long long)s->dims[2], s->spacing[0],
           s->spacing[1], s->spacing[2]);
    printf("%-9s %llu read, values %s to %s\n", "voxels", (unsigned long long)s->voxels,
           size_print_number(s->value_min, low), size_print_number(s->value_max, high));
    printf("%-9s %s\n", "kind", s->kind_title);
    printf("%-9s %llu voxels (%.3g %%)\n", "kept", (unsigned long long)s->kept,
           100 * kept / voxels);
    if (s->halo)
        printf("%-9s %llu neighbours of kept voxels, for interpolation\n", "halo",
               (unsigned long long)s->halo);
    if (s->levels)
        printf("%-9s %u coarse, each with half the resolution of the one before\n", "levels",
               s->levels);
    printf("%-9s ", "size");
    size_print(&(data_set_size){ s->bytes, s->halo_bytes, s->level_bytes });
    printf("%-9s ", "stored as");
    size_print_each(s->code_bytes, s->normal_bytes);
    putchar('\n');
    if (s->temporary_bytes)
        printf("%-9s %s, removed again\n", "temporary",
               trip_format_bytes(s->temporary_bytes, temporary));
    printf("%-9s %.2f s (scan %.2f, read %.2f, merge %.2f, levels %.2f, finish %.2f), %.0f MB/s of "
           "input\n",
           "time", seconds, s->stages[TRIPTYCH_STAGE_SCAN].seconds,
           s->stages[TRIPTYCH_STAGE_READ].seconds, s->stages[TRIPTYCH_STAGE_MERGE].seconds,
           s->stages[TRIPTYCH_STAGE_LEVELS].seconds, s->stages[TRIPTYCH_STAGE_FINISH].seconds,
           (double)s->input_bytes / 1e6 / (seconds > 0 ? seconds : 1));
    printf("%-9s %s at peak; at most %s for data\n", "memory",
           trip_format_bytes(trip_memory_peak_rss_bytes(), peak),
           trip_format_bytes(s->memory_bytes, promise));
}

static int print_estimate_json(const options *o, const triptych_brick_estimate *e)
{
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "output", o->output);
    add_number(root, "voxels", (double)e->voxels);
    add_number(root, "kept", (double)e->kept);
    add_number(root, "halo", (double)e->halo);
    add_number(root, "bytes", (double)e->bytes);
    add_number(root, "temporary_bytes", (double)e->temporary_bytes);
    add_number(root, "free_bytes", (double)e->free_bytes);
    add_number(root, "seconds", e->seconds);
    return print_object(root, o);
}

static void print_estimate(const options *o, const triptych_brick_estimate *e)
{
    char bytes[32], temporary[32], there[32], voxels[32], kept[32], halo[32];
    print_name("data set", o->output);
    printf("%-9s about %s of %s voxels, and %s halo voxels\n", "keeps",
           size_print_count(e->kept, kept), size_print_count(e->voxels, voxels),
           size_print_count(e->halo, halo));
    printf("%-9s about %s on disk, and %s of temporary files; %s are free\n", "size",
           trip_format_bytes(e->bytes, bytes), trip_format_bytes(e->temporary_bytes, temporary),
           trip_format_bytes(e->free_bytes, there));
    printf("%-9s about %.2f s, with reading and writing at the speed of the disk\n", "time",
           e->seconds);
}

static int dry_run(triptych *t, const options *o)
{
    triptych_brick_estimate e;
    int status = triptych_estimate(t, o->volume, o->output, &o->brick, &e);
    if (status < 0)
        return status;
    if (o->json)
        return print_estimate_json(o, &e);
    print_estimate(o, &e);
    return 0;
}

static int brick(triptych *t, const options *o)
{
    triptych_brick_summary summary;
    brick_limits limits;
    if (o->limits)
        plain_disk_forget(o->volume);
    int status = triptych_brick(t, o->volume, o->output, &o->brick, &summary);
    if (status == 0 && o->limits)
        status = brick_limits_measure(&limits, o->volume, o->output, &summary);
    if (status < 0)
        return status;
    if (summary.note[0])
        trip_note(o->volume, "%s", summary.note);
    if (o->json)
        return print_json(o, &summary, &limits);
    if (!command_line_quiet())
        print_text(o, &summary);
    if (o->limits)
        brick_limits_print(&limits, &summary);
    return 0;
}

/* ---- Gaussian scenes ---- */

/* Refuses options that bricking a scene would ignore. */
static int check_scene_options(const options *o, bool cloud)
{
    const char *const used[] = { "force",  "json",    "output",
                                 "memory", "threads", cloud ? "threads" : "harmonics" };
    for (size_t i = 0; i < brick_table.count; i++) {
        bool is_used = !trip_option_is_set(&rows[i], o);
        for (size_t n = 0; n < sizeof used / sizeof *used; n++)
            is_used |= !strcmp(rows[i].name, used[n]);
        if (!is_used)
            return library_fail_scene_option(rows[i].name);
    }
    return cloud ? library_check_cloud_options(&o->brick) : library_check_scene_options(&o->brick);
}

static int print_scene(const options *o, const triptych_gaussians *g, uint64_t bytes,
                       double seconds)
{
    char count[32], size[32], peak[32];
    if (o->json) {
        cJSON *root = cJSON_CreateObject();
        cJSON_AddStringToObject(root, "output", o->output);
        cJSON_AddStringToObject(root, "format", g->format);
        add_number(root, "gaussians", (double)g->count);
        add_number(root, "left_out", (double)g->left_out);
        add_number(root, "outliers", (double)g->outliers);
        add_number(root, "degree", g->degree);
        add_number(root, "coarse_gaussians", (double)g->coarse);
        add_number(root, "palette_entries", (double)g->palette);
        add_number(root, "palette_error", g->palette_error);
        add_number(root, "bytes", (double)bytes);
        add_number(root, "seconds", seconds);
        add_number(root, "peak_rss_bytes", (double)trip_memory_peak_rss_bytes());
        return print_object(root, o);
    }
    if (command_line_quiet())
        return 0;
    print_name("data set", o->output);
    printf("%-9s %s Gaussians, harmonics up to degree %d (%s)\n", "scene",
           size_print_count(g->count, count), g->degree, g->format);
    if (g->palette)
        printf("%-9s a palette of %s entries; colours change by %.2f of 255 on average\n",
               "harmonics", size_print_count(g->palette, count), 255 * g->palette_error);
    else if (g->palette_error > 0)
        printf("%-9s whole; a palette would change colours by %.2f of 255 on average\n",
               "harmonics", 255 * g->palette_error);
    printf("%-9s %s on disk, in three lists\n", "size", trip_format_bytes(bytes, size));
    printf("%-9s %.2f s, %.2f million Gaussians/s\n", "time", seconds,
           (double)g->count / 1e6 / (seconds > 0 ? seconds : 1));
    printf("%-9s %s at peak\n", "memory", trip_format_bytes(trip_memory_peak_rss_bytes(), peak));
    return 0;
}

static int brick_scene(triptych *t, const options *o, bool cloud)
{
    triptych_gaussians made;
    triptych_scene scene;
    int status = check_scene_options(o, cloud);
    const double begun = trip_now_seconds();
    if (!status)
        status = triptych_brick_gaussians(t, o->volume, o->output, &o->brick, &made);
    const double seconds = trip_now_seconds() - begun;
    if (!status)
        status = triptych_open(t, o->output, NULL);
    if (!status)
        status = triptych_get_scene(t, &scene);
    return status ? status : print_scene(o, &made, scene.bytes, seconds);
}

static int run(options *o)
{
    triptych *t = NULL;
    trip_progress progress = trip_progress_start();
    o->brick.functions = o->functions;
    o->brick.ranges = o->ranges;
    int status = library_create(&t, &progress);
    const int scene = status ? 0 : triptych_is_gaussians(t, o->volume);
    if (scene == 2)
        status = trip_fail(TRIP_USAGE, "usage", o->volume,
                           "is a data set already; `triptych render` draws it");
    if (!status && !scene && triptych_is_scene_file(o->volume))
        status = library_fail_scene(o->volume);
    if (!status)
        status = scene ? brick_scene(t, o, scene == 3) : o->dry_run ? dry_run(t, o) : brick(t, o);
    trip_progress_end(&progress);
    triptych_destroy(t);
    return status;
}

int trip_command_brick(int argc, char **argv)
{
    options o = { 0 };
    option_set sets[] = { { .table = &volume_options_table, .base = &o.brick },
                          { .table = &point_options_table, .base = &o.brick },
                          { .table = &brick_table, .base = &o } };
    const command_line c = {
        .args_doc = "INPUT",
        .doc = "Converts a volume, a Gaussian scene or a cloud of points into a data set that is "
               "drawn from disk: three "
               "lists of its visible voxels or Gaussians, sorted along X, Y and Z.",
        .sets = sets,
        .set_count = 3,
        .argument = add_input,
        .end = check_options,
        .user = &o,
    };
    int status = command_line_parse(&c, argc, argv);
    if (status == 0)
        status = choose_output(&o);
    if (status == 0)
        status = run(&o);
    free(o.default_output);
    return trip_exit_status(status);
}
