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
#include "json.h"
#include "library.h"
#include "options.h"
#include "plain_disk.h"
#include "report.h"
#include "text.h"
#include "volume_options.h"

enum { MAX_FUNCTIONS = 64, MAX_RANGES = 64 };

enum key {
    KEY_GRID = 256,
    KEY_LEVEL_SET,
    KEY_SIZE,
    KEY_TYPE,
    KEY_SPACING,
    KEY_AXES,
    KEY_COORDINATES,
    KEY_ENDIAN,
    KEY_OFFSET,
    KEY_ALLOW_GAPS,
    KEY_TF,
    KEY_RANGE,
    KEY_KEEP_ALL,
    KEY_REGION,
    KEY_CODE_BITS,
    KEY_NORMALS,
    KEY_HALO,
    KEY_LEVELS,
    KEY_LEVELS_FOR,
    KEY_TILE,
    KEY_SLAB_SHEETS,
    KEY_MEMORY,
    KEY_THREADS,
    KEY_FORCE,
    KEY_RESUME,
    KEY_DRY_RUN,
    KEY_LIMITS,
    KEY_JSON,
};

typedef struct options {
    const char *volume, *output;
    triptych_brick_options brick;
    const char *functions[MAX_FUNCTIONS];
    triptych_range ranges[MAX_RANGES];
    char *default_output; /* freed at the end */
    bool quiet, json, dry_run, limits;
} options;

static const struct argp_option option_table[] = {
    { NULL, 0, NULL, 0, "Input:", 1 },
    { "grid", KEY_GRID, "NAME", 0,
      "Selects a grid of an OpenVDB file or a variable of a netCDF file (default: density, else "
      "the first fog volume or grid of scalars; the netCDF variable with the most numbers)",
      1 },
    { "level-set", KEY_LEVEL_SET, "HOW", 0,
      "Selects how an OpenVDB level set becomes a density: filled or band (default: filled)", 1 },
    { "spacing", KEY_SPACING, "X,Y,Z", 0,
      "Sets the distance of neighbouring voxels along each axis (default: the distance in the "
      "file, else 1)",
      1 },
    { "axes", KEY_AXES, "PIR", 0,
      "Gives the orientation of a patient if the file does not: where x, y and z point to, here "
      "posterior, inferior and right",
      1 },
    { "coordinates", KEY_COORDINATES, "X.txt,Y.txt,Z.txt", 0,
      "Reads the position of each voxel along each axis from files of numbers; an axis without a "
      "file is even",
      1 },
    { "allow-gaps", KEY_ALLOW_GAPS, NULL, 0,
      "Accepts a stack with missing slices, as if the neighbours of a gap touched", 1 },
    { NULL, 0, NULL, 0, "Raw data:", 2 },
    { "endian", KEY_ENDIAN, "little|big", 0,
      "Sets the byte order (default: the order of this machine)", 2 },
    { "offset", KEY_OFFSET, "BYTES", 0,
      "Sets the position of the first voxel in the file (default: 0)", 2 },
    { "size", KEY_SIZE, "X,Y,Z", 0,
      "Sets the number of voxels along each axis, the fastest axis first (default: from the name "
      "of the file)",
      2 },
    { "type", KEY_TYPE, "TYPE", 0,
      "Sets the type of a voxel: uint8, int16, float, ... (default: from the name of the file)",
      2 },
    { NULL, 0, NULL, 0,
      "Kept voxels (default: the voxels that an automatic transfer function shows):", 3 },
    { "keep-all", KEY_KEEP_ALL, NULL, 0, "Keeps every finite value; excludes --range", 3 },
    { "range", KEY_RANGE, "LO:HI", 0,
      "Keeps the values from LO to HI; an empty side is open; several ranges add up", 3 },
    { "region", KEY_REGION, "I0:I1,J0:J1,K0:K1", 0,
      "Keeps only the voxels from I0 to before I1 along the first axis, and so on; an empty side "
      "is open. `triptych render A.trip B.trip` draws regions of one volume together",
      3 },
    { "tf", KEY_TF, "NAME|FILE", 0,
      "Keeps the values that this transfer function shows; several transfer functions add up", 3 },
    { NULL, 0, NULL, 0, "Output:", 4 },
    { "dry-run", KEY_DRY_RUN, NULL, 0,
      "Only estimates size and time, from parts of the input; excludes --resume", 4 },
    { "force", KEY_FORCE, NULL, 0, "Replaces an existing data set", 4 },
    { "json", KEY_JSON, NULL, 0, "Prints the summary as JSON", 4 },
    { "limits", KEY_LIMITS, NULL, 0,
      "Prints the time of each stage beside a plain read and a plain write of the same bytes; "
      "excludes --quiet and --dry-run",
      4 },
    { "output", 'o', "NAME.trip", 0,
      "Names the data set (default: the name of the input, in the current folder)", 4 },
    { "quiet", 'q', NULL, 0, "Prints no progress and no summary; excludes --json", 4 },
    { "resume", KEY_RESUME, NULL, 0, "Continues the same command after it was killed", 4 },
    { NULL, 0, NULL, 0, "Memory and threads:", 5 },
    TRIP_OPTION_MEMORY(KEY_MEMORY, 5),
    { "threads", KEY_THREADS, "N", 0,
      "Sets the number of threads, 1 to 256 (default: one per processor)", 5 },
    { NULL, 0, NULL, 0, "Stored form:", 6 },
    { "code-bits", KEY_CODE_BITS, "8|16|auto", 0,
      "Sets the bits that store a value; 8 rounds to 256 codes; auto is 8 if these are exact, else "
      "16 (default: auto)",
      6 },
    { "halo", KEY_HALO, "0|1", 0,
      "Keeps the transparent neighbours of kept voxels, for interpolation (default: 1)", 6 },
    { "levels", KEY_LEVELS, "N|auto", 0,
      "Sets the number of coarse levels, 0 to 24, each with half the resolution of the one before; "
      "auto goes down to one brick (default: auto)",
      6 },
    { "levels-for", KEY_LEVELS_FOR, "post|pre|both|auto", 0,
      "Selects the classification that can draw the coarse levels; auto is post, or pre with "
      "--halo 0 (default: auto)",
      6 },
    { "normals", KEY_NORMALS, "HOW", 0,
      "Selects how normals are stored, for the shading of splats: compact (3 bytes), full (4 "
      "bytes), none or auto, which is compact if no colour changes by half of 1/255 (default: "
      "auto)",
      6 },
    { "slab-sheets", KEY_SLAB_SHEETS, "N", 0,
      "Sets the number of sheets per brick, 1 to 64 (default: 8)", 6 },
    { "tile", KEY_TILE, "N", 0,
      "Sets the edge of a tile in voxels: 16, 32, 64 or 128 (default: 64)", 6 },
    { 0 },
};

/* Parses "256,256,128" or "256x256x128". */
static int parse_size(const char *text, int64_t dims[3])
{
    char commas[128];
    double numbers[3];
    int count;
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

static int parse_offset(const char *text, uint64_t *bytes)
{
    double number;
    if (!trip_text_to_double(text, &number) || number != floor(number) || number < 0 ||
        number > 0x1p62)
        return trip_option_fail("--offset", "takes a whole number of bytes, 0 or more");
    *bytes = (uint64_t)number;
    return 0;
}

/* Parses "LO:HI"; an empty side is open. */
static int parse_range(options *o, const char *text)
{
    triptych_range *r = &o->ranges[o->brick.range_count];
    const char *colon = strchr(text, ':');
    char lo[64] = "";
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
static int parse_region(const char *text, triptych_brick_options *o)
{
    bool good = true;
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

static int add_function(options *o, const char *path)
{
    if (o->brick.function_count == MAX_FUNCTIONS)
        return trip_option_fail("--tf",
                                "given too often; at most 64 transfer functions are possible");
    o->functions[o->brick.function_count++] = path;
    return 0;
}

static int parse_tile(const char *text, unsigned *tile)
{
    static const char *const names[] = { "16", "32", "64", "128", NULL };
    int choice;
    int status = trip_option_choice("--tile", text, names, &choice);
    if (status == 0)
        *tile = 16u << choice;
    return status;
}

static int parse_code_bits(const char *text, triptych_code_bits *bits)
{
    static const char *const names[] = { "auto", "8", "16", NULL };
    int choice = 0;
    int status = trip_option_choice("--code-bits", text, names, &choice);
    *bits = (triptych_code_bits)choice; /* names[] has the order of the enum */
    return status;
}

static int parse_normals(const char *text, triptych_normals *normals)
{
    static const char *const names[] = { "auto", "compact", "full", "none", NULL };
    int choice = 0;
    int status = trip_option_choice("--normals", text, names, &choice);
    *normals = (triptych_normals)choice; /* names[] has the order of the enum */
    return status;
}

static int parse_halo(const char *text, int *no_halo)
{
    static const char *const names[] = { "0", "1", NULL };
    int choice = 1;
    int status = trip_option_choice("--halo", text, names, &choice);
    *no_halo = choice == 0;
    return status;
}

static int parse_levels(const char *text, int *levels)
{
    int number = 0;
    int status = strcmp(text, "auto") ? trip_option_integer("--levels", text, 0, 24, &number) : 0;
    if (status == 0)
        *levels = !strcmp(text, "auto") ? 0 : number ? number : -1;
    return status;
}

static int parse_levels_for(const char *text, triptych_levels_for *levels_for)
{
    int choice = 0;
    int status = trip_option_choice("--levels-for", text, trip_levels_for_names, &choice);
    *levels_for = (triptych_levels_for)choice;
    return status;
}

static int parse_unsigned(const char *option, const char *text, int hi, unsigned *out)
{
    int number;
    int status = trip_option_integer(option, text, 1, hi, &number);
    if (status == 0)
        *out = (unsigned)number;
    return status;
}

static int parse_endian(const char *text, triptych_endian *endian)
{
    static const char *const names[] = { "little", "big", NULL };
    int choice = 0;
    int status = trip_option_choice("--endian", text, names, &choice);
    *endian = choice ? TRIPTYCH_ENDIAN_BIG : TRIPTYCH_ENDIAN_LITTLE;
    return status;
}

static error_t parse_input_option(int key, char *argument, triptych_brick_options *v)
{
    switch (key) {
    case KEY_GRID:
        return trip_option_grid(argument, &v->grid);
    case KEY_LEVEL_SET:
        return trip_option_level_set(argument, &v->level_set);
    case KEY_SIZE:
        return parse_size(argument, v->raw_dims);
    case KEY_TYPE:
        v->raw_type = argument;
        return triptych_is_raw_type(argument)
                   ? 0
                   : trip_option_fail("--type",
                                      "unknown type; use for example uint8, int16 or float");
    case KEY_SPACING:
        return trip_option_spacing(argument, v->spacing);
    case KEY_AXES:
        return trip_option_axes(argument, &v->axes);
    case KEY_ENDIAN:
        return parse_endian(argument, &v->raw_endian);
    case KEY_OFFSET:
        return parse_offset(argument, &v->raw_offset_bytes);
    case KEY_COORDINATES:
        v->coordinates = argument;
        return 0;
    case KEY_ALLOW_GAPS:
        v->allow_gaps = true;
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static error_t parse_output_option(int key, char *argument, options *o)
{
    switch (key) {
    case 'o':
        o->output = argument;
        return 0;
    case KEY_FORCE:
        o->brick.replace = true;
        return 0;
    case KEY_RESUME:
        o->brick.resume = true;
        return 0;
    case KEY_CODE_BITS:
        return parse_code_bits(argument, &o->brick.code_bits);
    case KEY_NORMALS:
        return parse_normals(argument, &o->brick.normals);
    case KEY_HALO:
        return parse_halo(argument, &o->brick.no_halo);
    case KEY_LEVELS:
        return parse_levels(argument, &o->brick.levels);
    case KEY_LEVELS_FOR:
        return parse_levels_for(argument, &o->brick.levels_for);
    case KEY_TILE:
        return parse_tile(argument, &o->brick.tile_voxels);
    case KEY_SLAB_SHEETS:
        return parse_unsigned("--slab-sheets", argument, 64, &o->brick.slab_sheets);
    case KEY_LIMITS:
        o->limits = true;
        return 0;
    case KEY_JSON:
        o->json = true;
        return 0;
    case 'q':
        o->quiet = true;
        return 0;
    default:
        return parse_input_option(key, argument, &o->brick);
    }
}

static error_t check_options(const options *o)
{
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
    if (o->limits && (o->quiet || o->dry_run))
        return trip_option_fail("--limits", "does not apply with --quiet or --dry-run");
    if (o->quiet && o->json)
        return trip_option_fail("--json", "does not apply with --quiet");
    return 0;
}

static error_t parse_option(int key, char *argument, struct argp_state *state)
{
    options *o = state->input;
    switch (key) {
    case KEY_TF:
        return add_function(o, argument);
    case KEY_RANGE:
        return parse_range(o, argument);
    case KEY_KEEP_ALL:
        o->brick.keep_all = true;
        return 0;
    case KEY_REGION:
        return parse_region(argument, &o->brick);
    case KEY_DRY_RUN:
        o->dry_run = true;
        return 0;
    case KEY_MEMORY:
        return trip_option_memory(argument, &o->brick.memory_bytes);
    case KEY_THREADS:
        return parse_unsigned("--threads", argument, 256, &o->brick.threads);
    case ARGP_KEY_ARG:
        if (o->volume)
            return trip_option_fail(argument, TRIP_ONE_VOLUME);
        o->volume = argument;
        return 0;
    case ARGP_KEY_END:
        return check_options(o);
    default:
        return parse_output_option(key, argument, o);
    }
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
    char *text = trip_json_print(root, true);
    cJSON_Delete(root);
    if (!text)
        return trip_fail(TRIP_ERROR, "brick", o->output, "out of memory");
    puts(text);
    free(text);
    return 0;
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
    char bytes[32], temporary[32], peak[32], promise[32];
    double seconds = brick_seconds(s), kept = (double)s->kept, voxels = (double)s->voxels;
    print_name("data set", o->output);
    printf("%-9s %lld x %lld x %lld, spacing %.6g x %.6g x %.6g\n", "grid", (long long)s->dims[0],
           (long long)s->dims[1], (long long)s->dims[2], s->spacing[0], s->spacing[1],
           s->spacing[2]);
    printf("%-9s %llu read, values %.7g to %.7g\n", "voxels", (unsigned long long)s->voxels,
           s->value_min, s->value_max);
    printf("%-9s %s\n", "kind", s->kind_title);
    printf("%-9s %llu (%.3g %%)\n", "kept", (unsigned long long)s->kept, 100 * kept / voxels);
    if (s->halo)
        printf("%-9s %llu neighbours of kept voxels, %s\n", "halo", (unsigned long long)s->halo,
               trip_format_bytes(s->halo_bytes, bytes));
    if (s->levels)
        printf("%-9s %u coarse, %s\n", "levels", s->levels,
               trip_format_bytes(s->level_bytes, bytes));
    printf("%-9s %s, %.3g bytes per kept voxel%s%s\n", "written",
           trip_format_bytes(s->bytes, bytes),
           (double)(s->bytes - s->halo_bytes - s->level_bytes) / kept,
           s->halo ? " without the halo" : "", s->levels ? " at level 0" : "");
    printf("%-9s codes %u, normals %u\n", "bytes", s->code_bytes, s->normal_bytes);
    if (s->temporary_bytes)
        printf("%-9s %s\n", "spilled", trip_format_bytes(s->temporary_bytes, temporary));
    printf("%-9s %.2f s (scan %.2f, read %.2f, merge %.2f, levels %.2f, finish %.2f), %.0f MB/s of "
           "input\n",
           "time", seconds, s->stages[TRIPTYCH_STAGE_SCAN].seconds,
           s->stages[TRIPTYCH_STAGE_READ].seconds, s->stages[TRIPTYCH_STAGE_MERGE].seconds,
           s->stages[TRIPTYCH_STAGE_LEVELS].seconds, s->stages[TRIPTYCH_STAGE_FINISH].seconds,
           (double)s->input_bytes / 1e6 / (seconds > 0 ? seconds : 1));
    printf("%-9s %s resident at peak, %s limit for data\n", "memory",
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
    char bytes[32], temporary[32], there[32];
    print_name("data set", o->output);
    printf("%-9s about %.3g of %.3g voxels, and %.3g halo voxels\n", "keeps", (double)e->kept,
           (double)e->voxels, (double)e->halo);
    printf("%-9s about %s, and %s of temporary data; %s are free\n", "takes",
           trip_format_bytes(e->bytes, bytes), trip_format_bytes(e->temporary_bytes, temporary),
           trip_format_bytes(e->free_bytes, there));
    printf("%-9s about %.3g s\n", "time", e->seconds);
}

static int dry_run(triptych *t, const options *o)
{
    triptych_brick_estimate e;
    int status = triptych_estimate(t, o->volume, o->output, &o->brick, &e);
    if (status < 0 || o->quiet)
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
    if (status < 0 || o->quiet)
        return status;
    if (summary.note[0])
        trip_note(o->volume, "%s", summary.note);
    if (o->json)
        return print_json(o, &summary, &limits);
    print_text(o, &summary);
    if (o->limits)
        brick_limits_print(&limits, &summary);
    return 0;
}

static int run(options *o)
{
    triptych *t = NULL;
    trip_progress progress = trip_progress_start(o->quiet);
    o->brick.functions = o->functions;
    o->brick.ranges = o->ranges;
    int status = library_create(&t, &progress);
    if (!status)
        status = o->dry_run ? dry_run(t, o) : brick(t, o);
    trip_progress_end(&progress);
    triptych_destroy(t);
    return status;
}

int trip_command_brick(int argc, char **argv)
{
    static const struct argp argp = {
        .options = option_table,
        .parser = parse_option,
        .args_doc = "INPUT",
        .doc = "Converts a volume into a data set that is drawn from disk: three lists of its "
               "visible voxels, sorted along X, Y and Z.",
    };
    options o = { 0 };
    int status = trip_options_parse(&argp, argc, argv, &o);
    if (status == 0)
        status = choose_output(&o);
    if (status == 0)
        status = run(&o);
    free(o.default_output);
    return trip_exit_status(status);
}
