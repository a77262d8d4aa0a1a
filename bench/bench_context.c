#include "bench_context.h"

#include <math.h>
#include <string.h>

#include "clock.h"
#include "report.h"

/* Reports the error of the context if a call failed. */
static int check(const bench_context *c, int status)
{
    if (status)
        trip_report_line(triptych_error(c->t));
    return status;
}

triptych_renderer bench_context_renderer(const bench_options *o)
{
    switch (o->renderers[0]) {
    case TRIP_RENDERER_GL:
        return TRIPTYCH_RENDERER_GL;
    case TRIP_RENDERER_CPU:
        return TRIPTYCH_RENDERER_CPU;
    case TRIP_RENDERER_REFERENCE:
        return TRIPTYCH_RENDERER_REFERENCE;
    default:
        return TRIPTYCH_RENDERER_AUTO;
    }
}

static draw_settings settings_of(const trip_settings *s)
{
    const bool post = s->classify == TRIP_CLASSIFY_POST;
    draw_settings to = {
        .all = { .classify = post ? TRIPTYCH_CLASSIFY_POST : TRIPTYCH_CLASSIFY_PRE,
                 .early_termination = s->early_termination < 0    ? 0
                                      : s->early_termination == 0 ? TRIPTYCH_ZERO
                                                                  : s->early_termination },
        .sheet = { .samples = post ? s->samples_per_sheet : 0 },
        .light = { .no_shading = !s->shading },
        .has_background = 1, /* transparent */
    };
    if (!post)
        to.splat =
            (triptych_splat_settings){ .compositing = s->compositing == TRIP_COMPOSITING_SHEET
                                                          ? TRIPTYCH_COMPOSITING_SHEET
                                                          : TRIPTYCH_COMPOSITING_SPLAT,
                                       .kernel_radius = s->kernel_radius };
    return to;
}

int bench_context_open(bench_context *c, const char *path, const bench_options *o)
{
    const triptych_resources resources = { .memory_bytes = o->memory_bytes,
                                           .threads = (unsigned)o->threads[0],
                                           .renderer = bench_context_renderer(o),
                                           .keep_pages = 1 };
    *c = (bench_context){ .settings = settings_of(&o->settings), .progress = o->progress };
    if (triptych_create(&c->t))
        return trip_fail(TRIP_ERROR, "bench", path, "out of memory");
    int status = triptych_open(c->t, path, &resources);
    if (!status)
        status =
            triptych_set_transfer_function(c->t, &(triptych_transfer_function){ .name = o->tf });
    return check(c, status);
}

void bench_context_close(bench_context *c)
{
    triptych_destroy(c->t);
    c->t = NULL;
}

int bench_context_find(bench_context *c, const triptych_view *view, triptych_camera *camera)
{
    int status = triptych_set_view(c->t, view);
    if (!status)
        status = triptych_get_camera(c->t, camera);
    return check(c, status);
}

int bench_context_look(bench_context *c, const triptych_camera *camera)
{
    const triptych_view view = { .width = camera->width,
                                 .height = camera->height,
                                 .eye = camera->eye,
                                 .look = camera->look,
                                 .up = camera->up,
                                 .fov_degrees = camera->fov_degrees,
                                 .ortho_height = camera->ortho_height };
    return check(c, triptych_set_view(c->t, &view));
}

int bench_context_picture(bench_context *c, int width, int height, float **rgba)
{
    return check(c, triptych_new_picture(c->t, width, height, 4, rgba));
}

int bench_context_draw(bench_context *c, double lod_px, int samples, float *rgba, double *ms)
{
    measure_progress_step(c->progress, lod_px > 0 ? "coarse levels" : "finest level");
    c->settings.lod.voxel_px = lod_px > 0 ? lod_px : TRIPTYCH_ZERO;
    c->settings.all.samples = samples;
    draw_settings_drop_kind(&c->settings, triptych_is_scene(c->t));
    int status = draw_settings_use(c->t, &c->settings);
    const double start = trip_now_ms();
    if (!status)
        status = triptych_draw(c->t, rgba);
    if (ms)
        *ms = trip_now_ms() - start;
    return check(c, status);
}

int bench_context_voxel(bench_context *c, double *width)
{
    triptych_info info;
    int status = triptych_get_info(c->t, &info);
    *width = 0;
    for (int a = 0; a < 3 && !status; a++)
        *width = fmax(*width, hypot(hypot(info.index_to_world[0][a], info.index_to_world[1][a]),
                                    info.index_to_world[2][a]));
    return check(c, status);
}

int bench_context_levels(bench_context *c, unsigned *levels)
{
    int status = triptych_count_levels(c->t, c->settings.all.classify, levels);
    return check(c, status);
}
