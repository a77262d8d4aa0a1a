/* triptych-generate: writes a volume of any size with values from formulas, or a Gaussian scene or
 * cloud of points of any size (landscape.h). It holds only a few slices or one cube at a time, so
 * memory use does not grow with the volume. */
#include <argp.h>
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "fields.h"
#include "interrupt.h"
#include "landscape.h"
#include "new_file.h"
#include "porous.h"
#include "report.h"
#include "text.h"
#include "tree.h"
#include "write_vdb.h"

enum { ROWS_PER_TASK = 8, MAX_THREADS = 64, SLICES = 8, PIECE = 256 };

#define POROUS "porous"
#define LANDSCAPE "landscape"
#define TREE "tree"

typedef enum sample_type { SAMPLE_U8, SAMPLE_U16, SAMPLE_F32, SAMPLE_DEFAULT } sample_type;

static const struct {
    const char *name;
    size_t bytes;
} sample_types[] = { { "uint8", 1 }, { "uint16", 2 }, { "float", 4 } };

typedef struct job {
    const trip_field *field; /* or NULL for the porous scan */
    const char *name, *output;
    long dims[3]; /* 0: the default of the field */
    sample_type type;
    double detail;
    long threads;
    const char *scenes[TRIP_LANDSCAPE_SCENES_MAX]; /* of the landscape */
    int scene_count;
    uint64_t count; /* of the Gaussians or points */
} job;

/* A part of the volume. Threads take its rows from `next`. */
typedef struct box {
    const job *job;
    long first[3], size[3];
    long next;
    void *values; /* i fastest; row r starts at number r * stride */
    size_t stride;
} box;

/* Maps an index to the cube. The longest axis spans [-1, 1] between its first and last voxel
 * centres. */
static trip_vec3 position(const job *j, long x, long y, long z)
{
    long longest = 2;
    for (int a = 0; a < 3; a++)
        longest = j->dims[a] > longest ? j->dims[a] : longest;
    double step = 2.0 / (double)(longest - 1);
    return trip_v3(((double)x - (double)(j->dims[0] - 1) / 2) * step,
                   ((double)y - (double)(j->dims[1] - 1) / 2) * step,
                   ((double)z - (double)(j->dims[2] - 1) / 2) * step);
}

/* Stores a value in [0, 1] as voxel number `at`. */
static void store(const box *b, size_t at, double v)
{
    if (b->job->type == SAMPLE_U8)
        ((uint8_t *)b->values)[at] = (uint8_t)lrint(v * 255);
    else if (b->job->type == SAMPLE_U16)
        ((uint16_t *)b->values)[at] = (uint16_t)lrint(v * 65535);
    else
        ((float *)b->values)[at] = (float)v;
}

/* Floats of the scan are values of 16 bits before rounding. */
static void porous_row(const box *b, long y, long z, size_t start)
{
    float piece[PIECE];
    for (long x = 0; x < b->size[0]; x += PIECE) {
        long left = b->size[0] - x, n = left < PIECE ? left : PIECE;
        trip_porous_row(b->job->dims, b->job->detail, b->first[0] + x, y, z, n, piece);
        for (long i = 0; i < n; i++)
            if (b->job->type == SAMPLE_F32)
                ((float *)b->values)[start + (size_t)(x + i)] = piece[i];
            else
                store(b, start + (size_t)(x + i), (double)piece[i] / TRIP_POROUS_MAX);
    }
}

static void sample_row(const box *b, long row)
{
    const job *j = b->job;
    long y = b->first[1] + row % b->size[1], z = b->first[2] + row / b->size[1];
    size_t start = (size_t)row * b->stride;
    if (!j->field) {
        porous_row(b, y, z, start);
        return;
    }
    for (long x = 0; x < b->size[0]; x++)
        store(b, start + (size_t)x,
              j->field->sample(position(j, b->first[0] + x, y, z), j->detail, NULL));
}

static void *sample_rows(void *user)
{
    box *b = user;
    long rows = b->size[1] * b->size[2];
    for (;;) {
        long first = __atomic_fetch_add(&b->next, ROWS_PER_TASK, __ATOMIC_RELAXED);
        if (first >= rows)
            return NULL;
        for (long row = first; row < rows && row < first + ROWS_PER_TASK; row++)
            sample_row(b, row);
    }
}

static int sample_box(box *b)
{
    pthread_t threads[MAX_THREADS];
    long started = 0;
    if (trip_interrupted())
        return trip_fail(TRIP_INTERRUPTED, "generate", b->job->output, "interrupted");
    b->next = 0;
    while (started < b->job->threads - 1 &&
           pthread_create(&threads[started], NULL, sample_rows, b) == 0)
        started++;
    sample_rows(b);
    for (long t = 0; t < started; t++)
        pthread_join(threads[t], NULL);
    return TRIP_OK;
}

static int write_box(const box *b, FILE *file)
{
    size_t count = (size_t)b->size[0] * (size_t)b->size[1] * (size_t)b->size[2];
    if (fwrite(b->values, sample_types[b->job->type].bytes, count, file) != count)
        return trip_fail_errno("generate", b->job->output, "cannot write");
    return TRIP_OK;
}

/* Writes a few whole slices at a time. */
static int write_slices(const job *j, FILE *file)
{
    const long *dims = j->dims;
    size_t slice_values = (size_t)dims[0] * (size_t)dims[1];
    box b = { .job = j,
              .size = { dims[0], dims[1], SLICES },
              .stride = (size_t)dims[0],
              .values = malloc(slice_values * SLICES * sample_types[j->type].bytes) };
    int status = b.values ? TRIP_OK
                          : trip_fail(TRIP_ERROR, "generate", j->output,
                                      "out of memory for %d slices", SLICES);
    for (; status == TRIP_OK && b.first[2] < dims[2]; b.first[2] += SLICES) {
        long left = dims[2] - b.first[2];
        b.size[2] = left < SLICES ? left : SLICES;
        status = sample_box(&b);
        if (status == TRIP_OK)
            status = write_box(&b, file);
    }
    free(b.values);
    return status;
}

static int write_dense(const job *j, const char *path, bool header)
{
    FILE *file = fopen(path, "wb");
    if (!file)
        return trip_fail_errno("generate", path, "cannot create");
    if (header)
        fprintf(file,
                "NRRD0004\n# %s, detail %g\ntype: %s\ndimension: 3\nsizes: %ld %ld %ld\n"
                "spacings: 1 1 1\nendian: little\nencoding: raw\n\n",
                j->name, j->detail, sample_types[j->type].name, j->dims[0], j->dims[1], j->dims[2]);
    int status = write_slices(j, file);
    if (fclose(file) != 0 && status == TRIP_OK)
        status = trip_fail_errno("generate", path, "cannot write");
    return status;
}

static int sample_cube(void *user, const int64_t first[3], const int64_t size[3], float *values)
{
    box b = { .job = user, .values = values, .stride = TRIP_VDB_CUBE };
    for (int a = 0; a < 3; a++) {
        b.first[a] = (long)first[a];
        b.size[a] = (long)size[a];
    }
    return sample_box(&b);
}

static int write_sparse(job *j, const char *path)
{
    return trip_vdb_write(path, (int64_t[3]){ j->dims[0], j->dims[1], j->dims[2] }, sample_cube, j);
}

static bool ends_with(const char *text, const char *end)
{
    size_t n = strlen(text), m = strlen(end);
    return n > m && strcmp(text + n - m, end) == 0;
}

static bool is_landscape(const job *j)
{
    return strcmp(j->name, LANDSCAPE) == 0;
}

static bool is_tree(const job *j)
{
    return strcmp(j->name, TREE) == 0;
}

/* Whether the output holds Gaussians or points, not voxels. */
static bool is_splats(const job *j)
{
    return is_landscape(j) || is_tree(j);
}

static bool is_scene_file(const job *j)
{
    return is_landscape(j) && ends_with(j->output, ".json");
}

static int generate_splats(const job *j)
{
    if (is_scene_file(j))
        return trip_scene_landscape_write(j->output, j->scenes, j->scene_count, j->count);
    if (ends_with(j->output, ".las") && !is_tree(j))
        return trip_cloud_landscape_write(j->output, j->scenes, j->scene_count, j->count);
    if (!ends_with(j->output, ".ply"))
        return trip_fail(TRIP_USAGE, "generate", j->output, "the name must end in .ply%s",
                         is_tree(j) ? "" : ", .las or .json");
    return is_tree(j) ? trip_tree_write(j->output, j->count)
                      : trip_landscape_write(j->output, j->scenes, j->scene_count, j->count);
}

static int generate(job *j)
{
    if (is_splats(j))
        return generate_splats(j);
    trip_new_file file;
    bool sparse = ends_with(j->output, ".vdb"), header = ends_with(j->output, ".nrrd");
    if (!sparse && !header && !ends_with(j->output, ".raw"))
        return trip_fail(TRIP_USAGE, "generate", j->output,
                         "the name must end in .nrrd, .raw or .vdb");
    int status = trip_new_file_begin(&file, "generate", j->output);
    if (status != TRIP_OK)
        return status;
    if (sparse) {
        j->type = SAMPLE_F32;
        status = write_sparse(j, file.temporary);
    } else {
        status = write_dense(j, file.temporary, header);
    }
    if (status == TRIP_OK)
        return trip_new_file_finish(&file);
    trip_new_file_abandon(&file);
    return status;
}

static int parse_size(const char *text, long dims[3])
{
    int used = 0, n = sscanf(text, "%ldx%ldx%ld%n", &dims[0], &dims[1], &dims[2], &used);
    if (n == 1 && sscanf(text, "%ld%n", &dims[0], &used) == 1)
        dims[1] = dims[2] = dims[0];
    else if (n != 3)
        return -1;
    for (int a = 0; a < 3; a++)
        if (dims[a] < 1 || dims[a] > 1 << 20)
            return -1;
    return text[used] == 0 ? 0 : -1;
}

static int parse_type(const char *text, sample_type *type)
{
    for (int t = SAMPLE_U8; t <= SAMPLE_F32; t++) {
        if (strcmp(text, sample_types[t].name) == 0) {
            *type = (sample_type)t;
            return 0;
        }
    }
    return -1;
}

static void parse_argument(job *j, const char *arg, struct argp_state *state)
{
    if (state->arg_num == 0) {
        j->name = arg;
        j->field = trip_field_find(arg);
        if (!j->field && strcmp(arg, POROUS) != 0 && !is_splats(j))
            argp_error(state,
                       "unknown field '%s'; use marschner-lobb, cloud, shells, filaments, " POROUS
                       ", " LANDSCAPE " or " TREE,
                       arg);
    } else if (!is_landscape(j)) {
        argp_error(state, "'%s' is one argument too many; only " LANDSCAPE " takes files", arg);
    } else if (j->scene_count == TRIP_LANDSCAPE_SCENES_MAX) {
        argp_error(state, "a landscape has at most %d scenes", TRIP_LANDSCAPE_SCENES_MAX);
    } else {
        j->scenes[j->scene_count++] = arg;
    }
}

static void check_together(const job *j, struct argp_state *state)
{
    if (!j->name || !j->output)
        argp_error(state, "FIELD and -o FILE are required");
    if (is_splats(j) && (j->dims[0] || j->type != SAMPLE_DEFAULT || j->detail > 0 || j->threads))
        argp_error(state, "--size, --type, --detail and --threads do not apply to %s", j->name);
    if (is_landscape(j) && !j->scene_count)
        argp_error(state, LANDSCAPE " needs at least one SCENE");
    if (!is_splats(j) && j->count)
        argp_error(state, "--count applies to " LANDSCAPE " and " TREE " only");
}

static error_t parse_option(int key, char *arg, struct argp_state *state)
{
    job *j = state->input;
    char *end = NULL;
    double count;
    switch (key) {
    case 'h':
        argp_state_help(state, stdout, ARGP_HELP_STD_HELP);
        return 0;
    case 'o':
        j->output = arg;
        return 0;
    case 's':
        if (parse_size(arg, j->dims) != 0)
            argp_error(state, "invalid value '%s' for --size; use N or NXxNYxNZ", arg);
        return 0;
    case 't':
        if (parse_type(arg, &j->type) != 0)
            argp_error(state, "invalid value '%s' for --type; use uint8, uint16 or float", arg);
        return 0;
    case 'd':
        if (!trip_text_to_double(arg, &j->detail) || !(j->detail > 0 && j->detail < 1e6))
            argp_error(state, "invalid value '%s' for --detail; use a positive number", arg);
        return 0;
    case 'j':
        j->threads = strtol(arg, &end, 10);
        if (*end || j->threads < 1 || j->threads > MAX_THREADS)
            argp_error(state, "invalid value '%s' for --threads; use a number from 1 to %d", arg,
                       MAX_THREADS);
        return 0;
    case 'n':
        if (!trip_text_to_double(arg, &count) || !(count >= 1 && count <= 1e12))
            argp_error(state, "invalid value '%s' for --count; use a number from 1 to 1e12", arg);
        j->count = (uint64_t)count;
        return 0;
    case ARGP_KEY_ARG:
        parse_argument(j, arg, state);
        return 0;
    case ARGP_KEY_END:
        check_together(j, state);
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static const struct argp_option options[] = {
    { "output", 'o', "FILE", 0,
      "Writes this file: .nrrd, .raw or .vdb (sparse); .ply, .las or .json (a landscape); .ply (a "
      "tree)",
      0 },
    { "count", 'n', "N", 0,
      "Sets the number of Gaussians or points of a landscape or tree (default: 1000000), or of the "
      "copies in a scene file (default: 1000)",
      0 },
    { "size", 's', "N|NXxNYxNZ", 0,
      "Sets the number of voxels along each axis (default: 256; porous: 1024x1024x300)", 0 },
    { "type", 't', "TYPE", 0,
      "Sets the type of a voxel: uint8, uint16 or float (default: uint8; porous: uint16); .vdb is "
      "always float",
      0 },
    { "detail", 'd', "X", 0,
      "Sets the fineness of the structure (default: longest side / 256, at least 1)", 0 },
    { "threads", 'j', "N", 0, "Sets the number of threads, 1 to 64 (default: one per processor)",
      0 },
    { "help", 'h', NULL, 0, "Prints this help", -1 },
    { 0 },
};

static void choose_defaults(job *j)
{
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    if (j->threads == 0)
        j->threads = processors < MAX_THREADS ? processors : MAX_THREADS;
    if (j->count == 0)
        j->count = is_scene_file(j) ? 1000 : 1000000;
    static const long scan[3] = { 1024, 1024, 300 };
    long longest = 0;
    for (int a = 0; a < 3; a++) {
        if (j->dims[a] == 0)
            j->dims[a] = j->field ? 256 : scan[a];
        longest = j->dims[a] > longest ? j->dims[a] : longest;
    }
    if (j->type == SAMPLE_DEFAULT)
        j->type = j->field ? SAMPLE_U8 : SAMPLE_U16;
    if (j->detail == 0)
        j->detail = fmax(1, (double)longest / 256);
}

int main(int argc, char **argv)
{
    job j = { .type = SAMPLE_DEFAULT };
    struct argp argp = {
        options,
        parse_option,
        "FIELD\nlandscape SCENE...\ntree",
        "Writes a volume of a function in closed form. FIELD is marschner-lobb (dense), cloud "
        "(about half empty), shells or filaments (almost empty), or porous. porous is like a CT "
        "scan "
        "of a porous solid: solid 32000, pores 12000, and noise with the standard deviation 900.\n"
        "landscape writes copies of SCENEs that stand on hills: scenes of 3D Gaussians to a .ply "
        "file, clouds of points to a .las file, or places for both to a .json scene file. tree "
        "writes a .ply file of points with normals "
        "and colours: a tree with leaves.",
        NULL,
        NULL,
        NULL
    };
    argp_err_exit_status = 2;
    argp_parse(&argp, argc, argv, ARGP_NO_HELP, NULL, &j);
    choose_defaults(&j);
    trip_interrupt_install();
    int status = generate(&j);
    return status == TRIP_OK ? 0 : status == TRIP_USAGE ? 2 : 1;
}
