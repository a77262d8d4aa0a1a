#include "landscape.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gaussian_file.h"
#include "gaussian_transform.h"
#include "interrupt.h"
#include "new_file.h"
#include "report.h"

enum { FLOATS = 14, BATCH = 4096 };

/* Percentiles bound a scene, since captures have strays far away. */
#define OUTER 0.02

typedef struct scene {
    trip_gaussian *gaussians;
    uint64_t count;
    double upright[3][3]; /* turns the scene so that -y points up */
    double middle[3];     /* upright: the point of the ground below the scene's middle */
    double width;         /* upright: the greater extent along x and z */
} scene;

typedef struct landscape {
    const char *output;
    FILE *file;
    float *records;
    size_t used; /* records that wait for writing */
    uint64_t left;
    scene scenes[TRIP_LANDSCAPE_SCENES_MAX];
    int scene_count;
} landscape;

/* ---- the scenes ---- */

static int read_scene(const char *path, scene *s, char up[3])
{
    trip_gaussian_file *f;
    int status = trip_gaussian_file_open(path, &f);
    if (status)
        return status;
    const trip_gaussian_info *info = trip_gaussian_file_info(f);
    size_t got = 1;
    memcpy(up, info->up, 3);
    s->gaussians = malloc((info->count ? info->count : 1) * sizeof *s->gaussians);
    if (!s->gaussians)
        status = trip_fail(TRIP_ERROR, "generate", path, "out of memory for %llu Gaussians",
                           (unsigned long long)info->count);
    while (!status && got > 0) {
        status = trip_interrupted() ? trip_fail(TRIP_INTERRUPTED, "generate", path, "interrupted")
                                    : trip_gaussian_file_read(f, s->gaussians + s->count,
                                                              info->count - s->count, &got);
        s->count += status ? 0 : got;
    }
    if (!status && s->count == 0)
        status = trip_fail(TRIP_ERROR, "generate", path, "holds no Gaussian with finite values");
    trip_gaussian_file_close(f);
    return status;
}

/* The rows of the matrix are the axes x, y and z of the landscape. */
static void find_upright(const char up[3], double m[3][3])
{
    const int axis = up[up[0] == '-'] - 'x', other = (axis + 1) % 3;
    memset(m, 0, 9 * sizeof m[0][0]);
    m[1][axis] = up[0] == '-' ? 1 : -1;
    m[2][other] = 1;
    for (int i = 0; i < 3; i++) /* y x z is x */
        m[0][i] = m[1][(i + 1) % 3] * m[2][(i + 2) % 3] - m[1][(i + 2) % 3] * m[2][(i + 1) % 3];
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static int find_bounds(scene *s, const char *path)
{
    const size_t low = (size_t)(OUTER * (double)(s->count - 1)), high = s->count - 1 - low;
    double *along = malloc(s->count * sizeof *along);
    if (!along)
        return trip_fail(TRIP_ERROR, "generate", path, "out of memory");
    s->width = 0;
    for (int a = 0; a < 3; a++) {
        for (uint64_t n = 0; n < s->count; n++) {
            const double *c = s->gaussians[n].centre, *m = s->upright[a];
            along[n] = m[0] * c[0] + m[1] * c[1] + m[2] * c[2];
        }
        qsort(along, s->count, sizeof *along, ascending);
        s->middle[a] = a == 1 ? along[high] : (along[low] + along[high]) / 2; /* y points down */
        if (a != 1)
            s->width = fmax(s->width, along[high] - along[low]);
    }
    free(along);
    return s->width > 0 ? 0
                        : trip_fail(TRIP_ERROR, "generate", path,
                                    "has no width, so that it cannot stand on the ground");
}

static int add_scene(landscape *l, const char *path)
{
    char up[3];
    scene *s = &l->scenes[l->scene_count++];
    int status = read_scene(path, s, up);
    if (!status) {
        find_upright(up, s->upright);
        status = find_bounds(s, path);
    }
    return status;
}

/* ---- the cells ---- */

static uint64_t hash(uint64_t x)
{
    x = (x + 0x9e3779b97f4a7c15) * 0xbf58476d1ce4e5b9;
    x = (x ^ x >> 27) * 0x94d049bb133111eb;
    return x ^ x >> 31;
}

/* Returns a number in [0, 1) that depends on a cell and on the use. */
static double chance(uint64_t cell, unsigned use)
{
    return (double)(hash(cell * 8 + use) >> 11) / (double)(UINT64_C(1) << 53);
}

static const scene *scene_of(const landscape *l, uint64_t cell)
{
    return &l->scenes[hash(cell * 8) % (unsigned)l->scene_count];
}

double trip_landscape_height(double x, double z)
{
    return 0.8 * sin(0.35 * x + 0.6) * cos(0.27 * z) + 0.2 * sin(0.9 * z + 0.4 * x);
}

static int flush(landscape *l)
{
    const size_t count = l->used;
    l->used = 0;
    return fwrite(l->records, FLOATS * sizeof(float), count, l->file) == count
               ? 0
               : trip_fail_errno("generate", l->output, "cannot write");
}

static int put(landscape *l, const trip_gaussian *g)
{
    float *r = l->records + FLOATS * l->used;
    const double opacity = fmin(fmax(g->opacity, 1e-6), 1 - 1e-6);
    for (int a = 0; a < 3; a++) {
        r[a] = (float)g->centre[a];
        r[3 + a] = g->sh[0][a];
        r[7 + a] = logf(fmaxf(g->deviations[a], 1e-12f));
    }
    r[6] = (float)log(opacity / (1 - opacity));
    memcpy(r + 10, g->rotation, sizeof g->rotation);
    l->left--;
    return ++l->used < BATCH ? 0 : flush(l);
}

/* One Gaussian of the ground. Its first two axes lie in the surface. */
static int put_ground(landscape *l, double x, double z, double step)
{
    static const double grass[3] = { 0.26, 0.36, 0.14 }, earth[3] = { 0.45, 0.36, 0.25 };
    const double d = 1e-4, h = trip_landscape_height(x, z);
    const double along_x = (trip_landscape_height(x + d, z) - h) / d;
    const double along_z = (trip_landscape_height(x, z + d) - h) / d;
    const double share = 0.5 + 0.5 * sin(7 * x) * sin(5 * z + h);
    /* The turn of +z, the flat axis, to the normal (-along_x, -1, -along_z) / length. */
    const double length = sqrt(1 + along_x * along_x + along_z * along_z);
    const double n[3] = { -along_x / length, -1 / length, -along_z / length };
    double q[4] = { 1 + n[2], -n[1], n[0], 0 },
           norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
    trip_gaussian g = {
        .centre = { x, -h, z },
        .deviations = { (float)(0.8 * step), (float)(0.8 * step), (float)(0.05 * step) },
        .opacity = 0.98f,
    };
    for (int i = 0; i < 4; i++)
        g.rotation[i] = (float)(q[i] / norm);
    for (int i = 0; i < 3; i++)
        g.sh[0][i] =
            (float)((grass[i] + share * (earth[i] - grass[i]) - 0.5) / 0.28209479177387814);
    return put(l, &g);
}

static int put_grounds(landscape *l, double x0, double z0)
{
    const double step = TRIP_LANDSCAPE_CELL / TRIP_LANDSCAPE_GROUND;
    int status = 0;
    for (int i = 0; i < TRIP_LANDSCAPE_GROUND; i++)
        for (int k = 0; k < TRIP_LANDSCAPE_GROUND && l->left > 0 && !status; k++)
            status = put_ground(l, x0 + (i + 0.5) * step, z0 + (k + 0.5) * step, step);
    return status;
}

static int put_copy(landscape *l, uint64_t cell, double x, double z)
{
    const scene *s = scene_of(l, cell);
    const double angle = 2 * M_PI * chance(cell, 1);
    const double scale = (TRIP_LANDSCAPE_SMALLEST +
                          (TRIP_LANDSCAPE_LARGEST - TRIP_LANDSCAPE_SMALLEST) * chance(cell, 2)) /
                         s->width;
    const double turn[3][3] = { { cos(angle), 0, sin(angle) },
                                { 0, 1, 0 },
                                { -sin(angle), 0, cos(angle) } };
    const double at[3] = { x, -trip_landscape_height(x, z), z };
    double m[3][4];
    for (int i = 0; i < 3; i++) {
        m[i][3] = at[i];
        for (int k = 0; k < 3; k++) {
            m[i][k] = 0;
            for (int j = 0; j < 3; j++)
                m[i][k] += scale * turn[i][j] * s->upright[j][k];
            m[i][3] -= scale * turn[i][k] * s->middle[k];
        }
    }
    trip_gaussian_transform t;
    int status = trip_gaussian_transform_make(&t, m)
                     ? 0
                     : trip_fail(TRIP_ERROR, "generate", l->output, "a copy has no place");
    for (uint64_t n = 0; n < s->count && l->left > 0 && !status; n++) {
        trip_gaussian g = s->gaussians[n];
        trip_gaussian_transform_apply(&t, 0, &g);
        status = put(l, &g);
    }
    return status;
}

/* Returns the number of cells along a side that holds all Gaussians. */
static uint64_t side_of(const landscape *l, uint64_t count)
{
    uint64_t side = 0, held = 0;
    while (held < count) {
        side++;
        held = 0;
        for (uint64_t cell = 0; cell < side * side && held < count; cell++)
            held += TRIP_LANDSCAPE_GROUND * TRIP_LANDSCAPE_GROUND + scene_of(l, cell)->count;
    }
    return side;
}

static int put_cells(landscape *l)
{
    const uint64_t side = side_of(l, l->left);
    int status = 0;
    for (uint64_t cell = 0; l->left > 0 && !status; cell++) {
        const double x = TRIP_LANDSCAPE_CELL * (double)(cell / side);
        const double z = TRIP_LANDSCAPE_CELL * (double)(cell % side);
        status = trip_interrupted()
                     ? trip_fail(TRIP_INTERRUPTED, "generate", l->output, "interrupted")
                     : put_grounds(l, x, z);
        if (!status)
            status = put_copy(l, cell, x + TRIP_LANDSCAPE_CELL / 2, z + TRIP_LANDSCAPE_CELL / 2);
    }
    return status ? status : flush(l);
}

/* ---- the file ---- */

static int write_file(landscape *l, const char *path)
{
    l->file = fopen(path, "wb");
    if (!l->file)
        return trip_fail_errno("generate", l->output, "cannot create");
    fprintf(l->file,
            "ply\nformat binary_little_endian 1.0\ncomment generated by triptych-generate\n"
            "element vertex %llu\n",
            (unsigned long long)l->left);
    static const char *const names[FLOATS] = { "x",      "y",       "z",       "f_dc_0",  "f_dc_1",
                                               "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
                                               "rot_0",  "rot_1",   "rot_2",   "rot_3" };
    for (int i = 0; i < FLOATS; i++)
        fprintf(l->file, "property float %s\n", names[i]);
    fprintf(l->file, "end_header\n");
    int status = put_cells(l);
    if (fclose(l->file) != 0 && !status)
        status = trip_fail_errno("generate", l->output, "cannot write");
    return status;
}

int trip_landscape_write(const char *output, const char *const *scenes, int scene_count,
                         uint64_t count)
{
    landscape l = { .output = output, .left = count };
    trip_new_file file;
    int status = 0;
    l.records = malloc(BATCH * FLOATS * sizeof *l.records);
    if (!l.records)
        return trip_fail(TRIP_ERROR, "generate", output, "out of memory");
    for (int n = 0; n < scene_count && !status; n++)
        status = add_scene(&l, scenes[n]);
    if (!status)
        status = trip_new_file_begin(&file, "generate", output);
    if (!status) {
        status = write_file(&l, file.temporary);
        if (!status)
            status = trip_new_file_finish(&file);
        else
            trip_new_file_abandon(&file);
    }
    for (int n = 0; n < l.scene_count; n++)
        free(l.scenes[n].gaussians);
    free(l.records);
    return status;
}
