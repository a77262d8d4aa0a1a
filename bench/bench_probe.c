#include "bench_probe.h"

#include <string.h>

#include "pixels.h"
#include "splat.h"
#include "weight.h"

static bench_probe *probe_of(trip_renderer *r)
{
    return (bench_probe *)r;
}

static void destroy(trip_renderer *r)
{
    (void)r;
}

static const char *device(const trip_renderer *r)
{
    (void)r;
    return "none";
}

static int begin_frame(trip_renderer *r, const trip_frame *frame)
{
    bench_probe *p = probe_of(r);
    *p = bench_probe_make(p->sample_stride);
    p->frame = frame;
    return 0;
}

static int begin_layer(trip_renderer *r, int axis)
{
    probe_of(r)->axis = axis;
    return 0;
}

/* Counts the pixels with a centre in the support of a splat, where its list has weight. */
static uint64_t covered(const bench_probe *p, const trip_splat_frame *f, const trip_splat *s)
{
    const trip_camera *camera = p->frame->camera;
    uint64_t pixels = 0;
    const trip_pixels columns = trip_pixels_within(s->x0, s->x1, camera->width);
    const trip_pixels rows = trip_pixels_within(s->y0, s->y1, camera->height);
    for (int y = rows.first; y <= rows.last; y++)
        for (int x = columns.first; x <= columns.last; x++) {
            trip_vec3 ray = trip_camera_ray(camera, x + 0.5, y + 0.5);
            pixels +=
                trip_splat_radius2(f, s, x + 0.5, y + 0.5) <= f->cutoff2 &&
                trip_weight(p->frame->settings, p->frame->plan->axis_of_view, ray, p->axis) > 0;
        }
    return pixels;
}

static void look_at(bench_probe *p, const trip_splat_frame *f, const trip_run *run, uint32_t voxel)
{
    double at[3];
    trip_splat s;
    at[p->axis] = run->sheet;
    at[(p->axis + 1) % 3] = run->u + (int)trip_voxel_u(voxel);
    at[(p->axis + 2) % 3] = run->v + (int)trip_voxel_v(voxel);
    p->sampled++;
    if (!trip_splat_project(f, trip_v3(at[0], at[1], at[2]), &s))
        return;
    uint64_t pixels = covered(p, f, &s);
    p->pixels += pixels;
    p->drawn += pixels > 0;
}

static int draw(trip_renderer *r, const trip_batch *batch, bool front_to_back)
{
    bench_probe *p = probe_of(r);
    uint32_t voxels[TRIP_RUN_RECORDS_MAX];
    (void)front_to_back;
    if (!p->sample_stride)
        return 0;
    for (size_t i = 0; i < batch->run_count; i++) {
        const trip_run *run = &batch->runs[i];
        const trip_list *list = trip_batch_list(batch, run);
        trip_splat_frame f =
            trip_splat_frame_make(&p->frame->plan->lists[list->index].camera, p->frame->settings);
        const trip_block block = trip_block_of(batch, run);
        trip_block_voxels(&block, 0, run->count, voxels);
        uint64_t next = (p->sample_stride - p->seen % p->sample_stride) % p->sample_stride;
        for (uint64_t k = next; k < run->count; k += p->sample_stride)
            look_at(p, &f, run, voxels[k]);
        p->seen += run->count;
    }
    return 0;
}

static int picture(trip_renderer *r, float *rgba, float *depth)
{
    (void)r;
    (void)rgba;
    (void)depth;
    return 0;
}

static trip_list_stats stats(const trip_renderer *r, unsigned list)
{
    (void)r;
    (void)list;
    return (trip_list_stats){ 0 };
}

bench_probe bench_probe_make(unsigned sample_stride)
{
    static const trip_renderer_ops ops = {
        .name = "probe",
        .classifies_post = true,
        .destroy = destroy,
        .device = device,
        .begin_frame = begin_frame,
        .begin_layer = begin_layer,
        .draw = draw,
        .picture = picture,
        .stats = stats,
    };
    return (bench_probe){ .base = { &ops }, .sample_stride = sample_stride };
}
