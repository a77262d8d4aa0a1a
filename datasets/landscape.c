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

typedef struct scene {
    trip_gaussian *gaussians;
    uint64_t count;
    trip_upright upright;
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

static int add_scene(landscape *l, const char *path)
{
    char up[3];
    scene *s = &l->scenes[l->scene_count++];
    int status = read_scene(path, s, up);
    return status ? status
                  : trip_upright_find(&s->upright, s->gaussians->centre, sizeof *s->gaussians,
                                      s->count, up, path);
}

/* ---- the cells ---- */

static const scene *scene_of(const landscape *l, uint64_t cell)
{
    return &l->scenes[trip_scatter_hash(cell * 8) % (unsigned)l->scene_count];
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
    const double d = 1e-4, h = trip_landscape_height(x, z);
    const double along_x = (trip_landscape_height(x + d, z) - h) / d;
    const double along_z = (trip_landscape_height(x, z + d) - h) / d;
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
    double colour[3];
    trip_ground_colour(x, z, colour);
    for (int i = 0; i < 3; i++)
        g.sh[0][i] = (float)((colour[i] - 0.5) / 0.28209479177387814);
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
    double m[3][4];
    trip_cell_transform(cell, x, z, &s->upright, m);
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
