#include "bench_frame.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "cpu/cpu_renderer.h"
#include "machine.h"
#include "report.h"
#include "sheet_samples.h"
#include "splat.h"

const char *bench_classified(const trip_settings *settings)
{
    return settings->classify == TRIP_CLASSIFY_POST          ? "post"
           : settings->compositing == TRIP_COMPOSITING_SHEET ? "pre, by sheets"
                                                             : "pre, by splats";
}

unsigned bench_planes(const session *s, const trip_settings *settings)
{
    unsigned planes = 1u << TRIP_PLANE_VOXELS;
    if (settings->shading && settings->classify == TRIP_CLASSIFY_PRE)
        planes |= s->data->header.planes & 1u << TRIP_PLANE_NORMALS;
    return planes;
}

static bool is_occluded(void *user, const trip_selection *selection, const trip_run *run)
{
    trip_renderer *occluder = *(trip_renderer **)user;
    return occluder && trip_cpu_occluded(occluder, selection, run);
}

int bench_reader_create(const session *s, trip_reader **out, const bench_options *o,
                        trip_engine engine, trip_renderer *renderer, trip_renderer **occluder)
{
    return session_make_reader(s, out,
                               &(session_reader){ .engine = engine,
                                                  .planes = bench_planes(s, &o->settings),
                                                  .threads = o->threads[0],
                                                  .renderer = renderer,
                                                  .skip = occluder ? is_occluded : NULL,
                                                  .skip_user = occluder });
}

/* Returns the sprite size of a splat in the middle of the volume, which the views of the tables
 * look at. */
static double sprite_px(const trip_dataset *data, const trip_camera *camera,
                        const trip_settings *settings)
{
    const uint64_t *dims = data->header.dims;
    return trip_splat_sprite_px(camera, settings,
                                trip_v3(0.5 * ((double)dims[0] - 1), 0.5 * ((double)dims[1] - 1),
                                        0.5 * ((double)dims[2] - 1)));
}

static int draw_planned(const bench_frame *f, const trip_camera *camera, bool count,
                        bench_cost *cost)
{
    trip_plan plan;
    trip_settings settings = f->settings;
    if (!settings.samples_per_sheet)
        settings.samples_per_sheet =
            trip_sheet_samples_of_view(camera, f->session->data->header.dims).samples_per_sheet;
    if (settings.footprint == TRIP_FOOTPRINT_FIXED)
        settings.sprite_px = sprite_px(f->session->data, camera, &settings);
    if (f->occluder)
        *f->occluder = count ? NULL : f->renderer;
    double start = trip_now_ms();
    const trip_tf_entry *table =
        session_table(f->session, trip_settings_interpolates(&settings, false));
    int status = trip_plan_make_next(&plan, f->session->data, camera, &settings, table,
                                     session_classified(f->session, 0), NULL, f->session->budget);
    if (status)
        return status;
    double planned = trip_now_ms();
    trip_frame frame = {
        .data = f->session->data,
        .camera = camera,
        .settings = &settings,
        .plan = &plan,
        .table = table,
        .count = count,
    };
    status = trip_frame_draw(f->renderer, f->reader, &frame, f->rgba, NULL, &cost->stats);
    cost->ms = trip_now_ms() - start;
    cost->plan_ms = planned - start;
    cost->wait_ms = cost->stats.read_ms;
    cost->draw_ms = cost->stats.draw_ms;
    cost->merge_ms = cost->stats.merge_ms;
    trip_plan_release(&plan, f->session->budget);
    return status;
}

static void show_step(const bench_frame *f, bool count)
{
    char text[48];
    snprintf(text, sizeof text, "frame of %s%s", f->renderer->ops->name, count ? ", counted" : "");
    measure_progress_step(f->progress, text);
}

int bench_frame_draw(const bench_frame *f, bool count, bench_cost *cost)
{
    trip_camera camera;
    show_step(f, count);
    int status = trip_camera_make(&camera, &f->view, &f->session->data->index_to_world);
    return status ? status : draw_planned(f, &camera, count, cost);
}

int bench_runs_take(bench_runs *r, const bench_frame *frames, int count, int repeat)
{
    *r = (bench_runs){ count, repeat, calloc((size_t)count * (size_t)repeat, sizeof *r->costs) };
    if (!r->costs)
        return trip_fail(TRIP_ERROR, "bench", "runs", "out of memory");
    int status = 0;
    for (int run = 0; run < repeat; run++)
        for (int i = 0; i < count && !status; i++)
            if (frames[i].renderer)
                status = bench_frame_draw(&frames[i], false, &r->costs[i * repeat + run]);
    return status;
}

void bench_runs_free(bench_runs *r)
{
    free(r->costs);
}

static int by_time(const void *a, const void *b)
{
    double x = ((const bench_cost *)a)->ms, y = ((const bench_cost *)b)->ms;
    return (x > y) - (x < y);
}

/* Sorts the runs of a frame by time and returns the median, or the faster of two middle runs. */
static const bench_cost *median(bench_runs *r, int frame)
{
    bench_cost *costs = &r->costs[frame * r->repeat];
    qsort(costs, (size_t)r->repeat, sizeof *costs, by_time);
    return &costs[(r->repeat - 1) / 2];
}

/* Names the largest part of a frame and its share, for example "drawing 93 %". */
static void bound(const bench_cost *c, char text[48])
{
    const struct {
        const char *name;
        double ms;
    } parts[] = { { "planning", c->plan_ms },
                  { "waiting for data", c->wait_ms },
                  { "drawing", c->draw_ms },
                  { "merging", c->merge_ms } };
    int max = 0;
    for (int i = 1; i < 4; i++)
        if (parts[i].ms > parts[max].ms)
            max = i;
    snprintf(text, 48, "%s %.0f %%", parts[max].name, 100 * parts[max].ms / c->ms);
}

void bench_runs_describe(bench_runs *r, int frame, int base, const bench_cost *counted, double kept,
                         cJSON *row)
{
    char text[48];
    const bench_cost *middle = median(r, frame), *runs = &r->costs[frame * r->repeat];
    const trip_list_stats *all = &counted->stats.all;
    measure_add(row, { "splats_read", (double)all->splats_read },
                { "splats_drawn", (double)all->splats_drawn });
    if (kept > 0)
        cJSON_AddNumberToObject(row, "multiple", (double)all->splats_drawn / kept);
    bound(middle, text);
    measure_add(row, { "ms", middle->ms }, { "ms_min", runs[0].ms },
                { "ms_max", runs[r->repeat - 1].ms }, { "fps", 1e3 / middle->ms },
                { "plan_ms", middle->plan_ms }, { "wait_ms", middle->wait_ms },
                { "draw_ms", middle->draw_ms }, { "merge_ms", middle->merge_ms });
    cJSON_AddStringToObject(row, "bound_by", text);
    cJSON_AddNumberToObject(row, "speed", median(r, base)->ms / middle->ms);
}

/* Keeps the last reported line instead of printing it. An interruption is printed, because it ends
 * the program and is reported once. */
static void keep_line(const char *line, void *user)
{
    static const char prefix[] = "triptych: ";
    if (trip_interrupted()) {
        trip_report_line(line);
        return;
    }
    size_t skip = strncmp(line, prefix, sizeof prefix - 1) ? 0 : sizeof prefix - 1;
    snprintf(user, 256, "%.*s", (int)strcspn(line + skip, "\n"), line + skip);
}

void bench_keep_report(char *why)
{
    trip_report_redirect(why ? keep_line : NULL, why);
}

int bench_renderer_create(const session *s, trip_renderer **out, trip_renderer_kind kind,
                          int threads, bool needed, char why[256])
{
    *out = NULL;
    why[0] = 0;
    if (!needed)
        bench_keep_report(why);
    int status = trip_renderer_create(out, kind, (unsigned)threads, s->budget);
    if (!needed)
        bench_keep_report(NULL);
    if (!status || needed)
        return status;
    *out = NULL;
    return 0;
}

void bench_renderer_destroy(trip_renderer *r)
{
    if (r)
        r->ops->destroy(r);
}

int bench_scene_open(bench_scene *b, const session *s, const bench_options *o, bool from_disk,
                     bench_report *r)
{
    char why[256];
    *b = (bench_scene){ .frame = { .session = s, .settings = o->settings, .progress = o->progress },
                        .size = { o->sizes[0][0], o->sizes[0][1] } };
    bench_frame *f = &b->frame;
    f->occluder = from_disk && !o->draw_occluded ? &b->occluder : NULL;
    int status = session_take_image(s, b->size[0], b->size[1], &f->rgba);
    if (!status)
        status = bench_renderer_create(s, &f->renderer, o->renderers[0], o->threads[0], true, why);
    measure_progress_expect(o->progress, 1);
    measure_progress_step(o->progress, from_disk ? "data set" : "data set to memory");
    if (!status)
        status = bench_reader_create(s, &f->reader, o, from_disk ? o->engine : TRIP_ENGINE_NULL,
                                     f->renderer, f->occluder);
    if (status)
        return status;
    measure_describe_renderer(r->machine, f->renderer->ops->name,
                              f->renderer->ops->device(f->renderer),
                              trip_reader_engine_name(f->reader));
    if (o->threads[0])
        cJSON_AddNumberToObject(r->machine, "threads", o->threads[0]);
    return 0;
}

void bench_scene_close(bench_scene *b)
{
    bench_frame *f = &b->frame;
    if (f->reader)
        trip_reader_destroy(f->reader);
    bench_renderer_destroy(f->renderer);
    session_release_image(f->session, b->size[0], b->size[1], f->rgba);
}
