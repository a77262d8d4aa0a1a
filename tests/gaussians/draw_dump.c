/* Draws a scene that a test wrote as numbers, and writes the picture as numbers.
 *
 *     draw_dump IN OUT RENDERER [THREADS [BATCH [ISA [REPEATS]]]]
 *
 * IN holds little-endian doubles.
 * - A view: width, height, ortho height, fov, eye, look, up.
 * - Settings: degree, antialiased, opacity scale, depth, shape.
 * - Each Gaussian in the order of drawing: centre, deviations, rotation, opacity, 48 coefficients.
 *
 * OUT gets 4 floats for each pixel, then the distances with depth. RENDERER is cpu, gl or
 * reference. With REPEATS it draws again and prints the times. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "gaussians_cpu.h"
#include "gaussians_reference.h"
#include "pool_runner.h"
#include "renderer.h"

enum { HEADER = 18, NUMBERS = 59 };

typedef struct run {
    trip_camera camera;
    trip_gaussian_settings settings;
    trip_budget *budget;
    trip_gaussian *gaussians;
    size_t count, batch;
    trip_task_runner runner;
    const trip_tile_device *device;
    const char *isa;
    float *rgba, *depth;
} run;

static void die(const char *what)
{
    fprintf(stderr, "draw_dump: %s\n", what);
    exit(1);
}

static trip_vec3 vector(const double *n)
{
    return trip_v3(n[0], n[1], n[2]);
}

static void read_gaussian(trip_gaussian *g, const double *n)
{
    *g = (trip_gaussian){ 0 };
    for (int i = 0; i < 3; i++) {
        g->centre[i] = n[i];
        g->deviations[i] = (float)n[3 + i];
    }
    for (int i = 0; i < 4; i++)
        g->rotation[i] = (float)n[6 + i];
    g->opacity = (float)n[10];
    for (int i = 0; i < 48; i++)
        g->sh[i / 3][i % 3] = (float)n[11 + i];
}

static void read_scene(run *r, const char *path)
{
    FILE *in = fopen(path, "rb");
    double h[HEADER];
    if (!in || fread(h, sizeof *h, HEADER, in) != HEADER)
        die("cannot read the scene");
    const trip_camera_params params = {
        .width = (int)h[0],
        .height = (int)h[1],
        .ortho_height = h[2],
        .fov_degrees = h[3],
        .eye = vector(h + 4),
        .look = vector(h + 7),
        .up = vector(h + 10),
    };
    const trip_affine identity = trip_affine_identity();
    if (trip_camera_make(&r->camera, &params, &identity))
        exit(1);
    r->settings = (trip_gaussian_settings){ .degree = (int)h[13],
                                            .antialiased = h[14] != 0,
                                            .opacity_scale = h[15],
                                            .depth = h[16] != 0,
                                            .shape = (trip_gaussian_shape)h[17] };
    double n[NUMBERS];
    for (size_t room = 0; fread(n, sizeof *n, NUMBERS, in) == NUMBERS; r->count++) {
        if (r->count == room) {
            room = 2 * room + 1024;
            r->gaussians = realloc(r->gaussians, room * sizeof *r->gaussians);
            if (!r->gaussians)
                die("no memory");
        }
        read_gaussian(&r->gaussians[r->count], n);
    }
    fclose(in);
}

static void draw_cpu(run *r, bool times)
{
    const uint64_t began = trip_now_ns();
    trip_gaussians_cpu *g;
    if (trip_gaussians_cpu_begin(&g, &(trip_gaussians_cpu_params){ .camera = &r->camera,
                                                                   .settings = &r->settings,
                                                                   .budget = r->budget,
                                                                   .runner = &r->runner,
                                                                   .device = r->device,
                                                                   .isa = r->isa }))
        exit(1);
    const uint64_t added = trip_now_ns();
    for (size_t i = 0; i < r->count; i += r->batch)
        if (trip_gaussians_cpu_add(g, r->gaussians + i,
                                   r->batch < r->count - i ? r->batch : r->count - i))
            exit(1);
    const uint64_t drawn = trip_now_ns();
    if (trip_gaussians_cpu_picture(g, r->rgba, r->depth))
        exit(1);
    const uint64_t done = trip_now_ns();
    const trip_gaussians_cpu_stats s = trip_gaussians_cpu_get_stats(g);
    if (times)
        printf("total %.1f ms: begin %.1f, project %.1f, bin %.1f, composite %.1f, picture %.1f; "
               "%llu drawn, %llu pairs, %.1f MB\n",
               (double)(done - began) * 1e-6, (double)(added - began) * 1e-6,
               (double)s.project_ns * 1e-6, (double)s.bin_ns * 1e-6, (double)s.composite_ns * 1e-6,
               (double)(done - drawn) * 1e-6, (unsigned long long)s.drawn,
               (unsigned long long)s.pairs, (double)trip_budget_peak_bytes(r->budget) * 1e-6);
    trip_gaussians_cpu_end(g);
}

static void draw_reference(run *r)
{
    trip_gaussians_reference *g;
    if (trip_gaussians_reference_begin(&g, &r->camera, &r->settings, r->budget) ||
        trip_gaussians_reference_add(g, r->gaussians, r->count))
        exit(1);
    trip_gaussians_reference_picture(g, r->rgba, r->depth);
    trip_gaussians_reference_end(g);
}

int main(int argc, char **argv)
{
    run r = { .batch = SIZE_MAX };
    if (argc < 4)
        die("usage: draw_dump IN OUT RENDERER [THREADS [BATCH [ISA [REPEATS]]]]");
    const unsigned threads = argc > 4 ? (unsigned)atoi(argv[4]) : 1;
    if (argc > 5 && atoi(argv[5]) > 0)
        r.batch = (size_t)atoi(argv[5]);
    r.isa = argc > 6 ? argv[6] : NULL;
    const int repeats = argc > 7 ? atoi(argv[7]) : 0;
    trip_cpu_pool *pool;
    if (trip_cpu_pool_create(&pool, threads) || trip_budget_create(&r.budget, 1u << 30))
        exit(1);
    r.runner = (trip_task_runner){ run_all, pool };
    read_scene(&r, argv[1]);
    const size_t pixels = (size_t)r.camera.width * (size_t)r.camera.height;
    r.rgba = calloc(pixels, 5 * sizeof *r.rgba);
    if (!r.rgba)
        die("no memory");
    r.depth = r.settings.depth ? r.rgba + 4 * pixels : NULL;
    trip_renderer *gl = NULL;
    if (strcmp(argv[3], "gl") == 0) {
        if (trip_gl_create(&gl, r.budget))
            exit(1);
        r.device = gl->ops->tile_device(gl);
    }
    for (int i = 0; i < (repeats ? repeats : 1); i++)
        if (strcmp(argv[3], "reference") == 0)
            draw_reference(&r);
        else
            draw_cpu(&r, repeats > 0);
    FILE *out = fopen(argv[2], "wb");
    const size_t numbers = pixels * (r.settings.depth ? 5 : 4);
    if (!out || fwrite(r.rgba, sizeof *r.rgba, numbers, out) != numbers || fclose(out))
        die("cannot write the picture");
    free(r.rgba);
    free(r.gaussians);
    if (gl)
        gl->ops->destroy(gl);
    trip_cpu_pool_destroy(pool);
    trip_budget_destroy(r.budget);
    return 0;
}
