/* The integral renderer computes the picture that the other renderers approximate. A frame's
 * batches hold all voxels of one list, and the halo. They fill a field, which is kept for later
 * frames. The picture is then integrated ray by ray. */
#include "renderer.h"

#include <assert.h>
#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "cpu/pool.h"
#include "emission.h"
#include "field_fill.h"
#include "integrand.h"
#include "pixel_area.h"
#include "report.h"
#include "shade.h"

/* The share of a mean's tolerance that its rays may use. Rays that end early in opaque parts err to
 * the same side, and many squares share them. So the share is small. */
#define RAY_SHARE (1.0 / 16)

typedef struct integral {
    trip_renderer base;
    trip_budget *budget;
    trip_cpu_pool *pool;
    trip_classes *classes;
    trip_splat_hits *hits; /* by thread */

    /* The field of field_data, filled from batches, with or without the halo. */
    trip_field *field;
    const trip_dataset *field_data;
    unsigned planes; /* that the field was filled from */
    bool has_halo, complete;
    trip_draw_codes draw; /* of the field */
    uint64_t put;

    const trip_frame *frame;
    trip_integrand in;
    uint64_t splats[TRIP_KINDS]; /* records received, by the kind of their list */
    float *rgba;                 /* of the current picture */
    int pane_px, panes_x;        /* threads share the picture in squares of pane_px */
    int first_squares;           /* along each side of a pixel (pixel_area.h) */
    _Atomic bool failed;         /* set by any thread to give up the picture */
    _Atomic uint64_t done;       /* pixels, added by any thread */
    trip_field_fill fill;
} integral;

static void drop_field(integral *r)
{
    trip_field_destroy(r->field);
    r->field = NULL;
    r->complete = false;
    r->put = 0;
}

static void destroy(trip_renderer *base)
{
    integral *r = (integral *)base;
    trip_budget *budget = r->budget;
    drop_field(r);
    for (unsigned i = 0; r->hits && i < trip_cpu_pool_threads(r->pool); i++)
        trip_splat_hits_free(&r->hits[i]);
    if (r->hits)
        trip_budget_release(budget, r->hits, trip_cpu_pool_threads(r->pool) * sizeof *r->hits);
    if (r->classes)
        trip_budget_release(budget, r->classes, sizeof *r->classes);
    trip_cpu_pool_destroy(r->pool);
    trip_budget_release(budget, r, sizeof *r);
}

static const char *device(const trip_renderer *base)
{
    (void)base;
    return "CPU, double precision";
}

static bool is_of_splats(const integral *r)
{
    return r->frame->settings->field == TRIP_FIELD_SPLATS;
}

/* Begins a field unless the last one fits. A field of splats has no halo, which would count as
 * splats. */
static int begin_field(integral *r)
{
    const trip_dataset *data = r->frame->data;
    bool halo = !is_of_splats(r);
    unsigned planes = r->frame->plan->planes;
    const trip_draw_codes *draw = &r->frame->plan->draw;
    bool same = r->field_data == data && r->has_halo == halo && r->planes == planes &&
                r->draw.lo == draw->lo && r->draw.hi == draw->hi &&
                !r->draw.of_stored == !draw->of_stored;
    if (r->frame->field || (r->complete && same))
        return 0;
    drop_field(r);
    const int64_t dims[3] = { (int64_t)data->header.dims[0], (int64_t)data->header.dims[1],
                              (int64_t)data->header.dims[2] };
    r->field_data = data;
    r->has_halo = halo;
    r->planes = planes;
    r->draw = *draw;
    int status = trip_field_create(&r->field, dims, r->budget);
    if (!status)
        trip_field_fill_begin(&r->fill, data, draw, r->field, planes);
    return status;
}

static int check_frame(const trip_frame *frame)
{
    if (frame->settings->depth)
        return trip_fail(TRIP_USAGE, "render", "depth",
                         "the integral renderer computes no depth; use another renderer");
    if (frame->settings->field == TRIP_FIELD_SPLATS && trip_effects_some(&frame->settings->effects))
        return trip_fail(TRIP_USAGE, "render", "effects",
                         "the integral renderer applies effects to values only; use field values");
    if (frame->settings->field == TRIP_FIELD_VALUES)
        return trip_plan_check_cells(frame->data, "--field splats");
    return 0;
}

static bool is_of_areas(const trip_frame *frame)
{
    return frame->settings->samples == 0;
}

static int begin_frame(trip_renderer *base, const trip_frame *frame)
{
    integral *r = (integral *)base;
    const trip_file_header *header = &frame->data->header;
    const bool nearest = frame->settings->kernel == TRIP_KERNEL_NEAREST &&
                         frame->settings->field == TRIP_FIELD_VALUES;
    const double tolerance = frame->settings->tolerance * (is_of_areas(frame) ? RAY_SHARE : 1);
    r->frame = frame;
    memset(r->splats, 0, sizeof r->splats);
    int status = check_frame(frame);
    if (!status)
        status = begin_field(r);
    base->resident = r->complete;
    trip_classes_make(r->classes, frame->table, frame->camera->voxel_world, tolerance);
    r->in = (trip_integrand){
        .coordinates = &frame->data->coordinates,
        .classes = r->classes,
        .settings = frame->settings,
        .camera = frame->camera,
        .clip = &frame->plan->clip,
        .tolerance = tolerance,
        .shaded = frame->settings->shading && (frame->settings->field == TRIP_FIELD_VALUES ||
                                               header->planes >> TRIP_PLANE_NORMALS & 1),
        .nearest = nearest,
        .gradient_full = nearest ? trip_shade_outline_full(&frame->camera->index_to_world,
                                                           frame->data->coordinates.widest)
                                 : trip_shade_gradient_full(header, frame->settings,
                                                            frame->camera->voxel_world, 0),
        .effects = trip_effects_view_make(frame->settings, frame->camera, header->dims),
    };
    trip_affine_invert(&frame->camera->index_to_world, &r->in.to_index); /* checked on opening */
    if (frame->settings->effects.emission)
        r->in.effects.emission = trip_emission_view_of(frame->emission);
    return status;
}

static int begin_layer(trip_renderer *base, int axis)
{
    (void)base;
    (void)axis;
    return 0;
}

static int draw(trip_renderer *base, const trip_batch *batch, bool front_to_back)
{
    integral *r = (integral *)base;
    int status = 0;
    (void)front_to_back;
    for (size_t i = 0; i < batch->run_count && !status; i++) {
        const trip_run *run = &batch->runs[i];
        r->splats[trip_batch_list(batch, run)->kind] += run->count;
        if (base->resident)
            continue;
        status = trip_field_fill_run(&r->fill, batch, run);
        r->put += run->count;
    }
    return status;
}

/* Completes the field once all voxels are present. */
static int complete_field(integral *r)
{
    const trip_file_header *header = &r->frame->data->header;
    if (r->complete || r->put < trip_plan_splats(r->frame->plan))
        return 0;
    const bool by_table = !r->draw.of_stored && !trip_codes_even(&r->draw.stored);
    int status = trip_field_finish(
        r->field,
        &(trip_field_map){ .index_to_world = r->frame->data->index_to_world,
                           .coordinates = &r->frame->data->coordinates,
                           .value_per_code = by_table ? 1 : trip_draw_value_per_code(&r->draw),
                           .stored = by_table ? &r->draw.stored : NULL,
                           .signless = header->normal_bytes == 3 });
    r->complete = status == 0;
    return status;
}

/* A thread's way to the picture's function. */
typedef struct painter {
    integral *r;
    trip_splat_hits *hits;
} painter;

/* Writes colour and opacity of the ray at a position. Returns TRIP_INTERRUPTED without a message.
 */
static int ray_at(void *user, double x, double y, double rgba[4])
{
    const painter *p = user;
    if (trip_interrupted())
        return TRIP_INTERRUPTED;
    const trip_integrand *in = &p->r->in;
    const trip_ray ray = trip_ray_make(in->camera, x, y);
    trip_ray_sum sum;
    int status = 0;
    if (is_of_splats(p->r))
        status = trip_integrate_splats(in, &ray, p->hits, &sum);
    else
        sum = trip_integrate_values(in, &ray);
    if (status)
        return status;
    memcpy(rgba, sum.rgb, sizeof sum.rgb);
    rgba[3] = 1 - sum.transmittance;
    return 0;
}

/* Computes the mean over a grid of positions in the pixel. */
static int mean_of_rays(painter *p, int x, int y, double rgba[4])
{
    const int samples = p->r->in.settings->samples;
    memset(rgba, 0, 4 * sizeof *rgba);
    for (int n = 0; n < samples * samples; n++) {
        double one[4];
        int status =
            ray_at(p, x + (n % samples + 0.5) / samples, y + (n / samples + 0.5) / samples, one);
        if (status)
            return status;
        for (int c = 0; c < 4; c++)
            rgba[c] += one[c] / (samples * samples);
    }
    return 0;
}

static void put_pixel(integral *r, int x, int y, const double rgba[4])
{
    const double *background = r->in.settings->background;
    float *out = r->rgba + ((size_t)y * (size_t)r->in.camera->width + (size_t)x) * 4;
    const double through = (1 - rgba[3]) * background[3];
    for (int c = 0; c < 3; c++)
        out[c] = (float)(rgba[c] + through * background[c]);
    out[3] = (float)(rgba[3] + through);
}

static int smaller(int a, int b)
{
    return a < b ? a : b;
}

/* Reports progress from the first thread, which draws the frame. */
static void show_progress(integral *r, uint64_t pixels, unsigned thread)
{
    const trip_frame *frame = r->frame;
    uint64_t total = (uint64_t)r->in.camera->width * (uint64_t)r->in.camera->height;
    uint64_t done = atomic_fetch_add(&r->done, pixels) + pixels;
    if (thread == 0 && frame->progress)
        frame->progress(frame->progress_user, "integrate", done, total);
}

enum { PANE_PX_MIN = 8, PANE_PX_MAX = 128, MAX_PANES = 1 << 19 };

/* The values at the corners of a row of squares: corner [i] belongs to squares i - 1 and i. */
enum { SQUARES_MAX = 1024 };
typedef double corner_row[SQUARES_MAX + 1][4];

static int fill_corners(painter *p, int x0, int squares, double y, corner_row row)
{
    int status = 0;
    for (int i = 0; i <= squares && !status; i++)
        status = ray_at(p, x0 + (double)i / p->r->first_squares, y, row[i]);
    return status;
}

/* Returns the number of squares along each side of a pixel that are smaller than a voxel at the far
 * end of the volume, at least 1. */
static int first_squares(const integral *r)
{
    const int most = SQUARES_MAX / r->pane_px < 64 ? SQUARES_MAX / r->pane_px : 64;
    const trip_camera *c = r->in.camera;
    const trip_file_header *h = &r->frame->data->header;
    double farthest = 1;
    for (int i = 0; i < 8 && !c->ortho; i++) {
        const trip_vec3 corner = { i & 1 ? (double)h->dims[0] - 1 : 0,
                                   i & 2 ? (double)h->dims[1] - 1 : 0,
                                   i & 4 ? (double)h->dims[2] - 1 : 0 };
        farthest = fmax(farthest, trip_dot(c->forward, trip_sub(corner, c->eye)));
    }
    const double voxels = farthest * fmax(trip_length(c->rx), trip_length(c->ry));
    /* A square is at most two thirds of a voxel wide, or there is one more square than voxels. */
    const double squares = fmin(ceil(1.5 * voxels), ceil(voxels) + 1);
    return (int)fmax(1, fmin(most, squares));
}

/* Adds the means over a row of squares to the pixels of a row. `above` and `below` are the corners.
 */
static int add_squares(const trip_pixel_area *area, int x0, int squares, double y, corner_row above,
                       corner_row below, double (*pixels)[4])
{
    int status = 0;
    for (int i = 0; i < squares && !status; i++) {
        const double *const corners[4] = { above[i], above[i + 1], below[i], below[i + 1] };
        double mean[4];
        status = trip_pixel_area_square(area, x0 + (double)i / area->first, y, corners, mean);
        for (int c = 0; c < 4 && !status; c++)
            pixels[i / area->first][c] += mean[c] / (area->first * area->first);
    }
    return status;
}

static int make_areas(painter *p, int x0, int x1, int y0, int y1)
{
    corner_row rows[2] = { { { 0 } } };
    const trip_pixel_area area = {
        .function = ray_at,
        .user = p,
        .tolerance = p->r->in.settings->tolerance * (1 - RAY_SHARE),
        .first = p->r->first_squares,
    };
    const int squares = (x1 - x0) * area.first;
    int status = fill_corners(p, x0, squares, y0, rows[0]);
    for (int y = y0, row = 0; y < y1 && !status && !p->r->failed; y++) {
        double pixels[PANE_PX_MAX][4] = { { 0 } };
        for (int v = 0; v < area.first && !status; v++, row ^= 1) {
            const double top = y + (double)v / area.first;
            status = fill_corners(p, x0, squares, y + (v + 1.0) / area.first, rows[row ^ 1]);
            if (!status)
                status = add_squares(&area, x0, squares, top, rows[row], rows[row ^ 1], pixels);
        }
        for (int x = x0; x < x1 && !status; x++)
            put_pixel(p->r, x, y, pixels[x - x0]);
    }
    return status;
}

static int make_rays(painter *p, int x0, int x1, int y0, int y1)
{
    int status = 0;
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1 && !status && !p->r->failed; x++) {
            double rgba[4];
            status = mean_of_rays(p, x, y, rgba);
            if (!status)
                put_pixel(p->r, x, y, rgba);
        }
    return status;
}

static void make_background(integral *r, int x0, int x1, int y0, int y1)
{
    static const double nothing[4] = { 0 };
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++)
            put_pixel(r, x, y, nothing);
}

static void make_pane(void *context, unsigned pane, unsigned thread)
{
    integral *r = context;
    painter p = { r, &r->hits[thread] };
    const trip_camera *c = r->in.camera;
    const int x0 = (int)pane % r->panes_x * r->pane_px, y0 = (int)pane / r->panes_x * r->pane_px;
    const int x1 = smaller(x0 + r->pane_px, c->width), y1 = smaller(y0 + r->pane_px, c->height);
    int status = 0;
    if (!r->in.field)
        make_background(r, x0, x1, y0, y1);
    else
        status = (is_of_areas(r->frame) ? make_areas : make_rays)(&p, x0, x1, y0, y1);
    if (status && status != TRIP_INTERRUPTED)
        r->failed = true;
    show_progress(r, (uint64_t)(x1 - x0) * (uint64_t)(y1 - y0), thread);
}

/* Divides the picture into panes. They are small, so that all threads stay busy to the end, but not
 * more than the pool allows. */
static unsigned divide_picture(integral *r)
{
    const trip_camera *c = r->in.camera;
    int64_t panes;
    static_assert((int64_t)TRIP_PICTURE_MAX_PX / PANE_PX_MAX *
                          (TRIP_PICTURE_MAX_PX / PANE_PX_MAX) <=
                      MAX_PANES,
                  "the largest picture has few enough of the largest panes");
    r->pane_px = PANE_PX_MIN / 2;
    do {
        r->pane_px *= 2;
        r->panes_x = (c->width + r->pane_px - 1) / r->pane_px;
        panes = (int64_t)r->panes_x * ((c->height + r->pane_px - 1) / r->pane_px);
    } while (panes > MAX_PANES);
    return (unsigned)panes;
}

/* Writes the picture. It shows the background alone until all voxels are present. */
static int picture(trip_renderer *base, float *rgba, float *depth)
{
    integral *r = (integral *)base;
    (void)depth;
    int status = r->frame->field ? 0 : complete_field(r);
    if (status)
        return status;
    r->in.field = r->frame->field ? r->frame->field : r->complete ? r->field : NULL;
    r->rgba = rgba;
    r->failed = false;
    r->done = 0;
    trip_cpu_job job = { .run = make_pane, .context = r, .tasks = divide_picture(r) };
    r->first_squares = first_squares(r);
    trip_cpu_pool_start(r->pool, &job);
    trip_cpu_pool_wait(r->pool, &job);
    return r->failed ? TRIP_ERROR : trip_frame_poll();
}

static trip_list_stats stats(const trip_renderer *base, unsigned list)
{
    const integral *r = (const integral *)base;
    const trip_plan_list *planned = &r->frame->plan->lists[list];
    const bool read = planned->drawn && r->splats[r->frame->data->lists[list].kind] > 0;
    return (trip_list_stats){ .splats_read = read ? planned->splats_selected : 0 };
}

static const trip_renderer_ops integral_ops = {
    .name = "integral",
    .effects = 1u << TRIP_CLASSIFY_PRE | 1u << TRIP_CLASSIFY_POST,
    .destroy = destroy,
    .device = device,
    .begin_frame = begin_frame,
    .begin_layer = begin_layer,
    .draw = draw,
    .picture = picture,
    .stats = stats,
};

static int take_memory(integral *r)
{
    unsigned threads = trip_cpu_pool_threads(r->pool);
    r->classes = trip_budget_take(r->budget, sizeof *r->classes);
    r->hits = trip_budget_take(r->budget, threads * sizeof *r->hits);
    if (!r->classes || !r->hits)
        return trip_fail(TRIP_ERROR, "render", "integral", "out of memory; raise --memory");
    for (unsigned i = 0; i < threads; i++)
        r->hits[i].budget = r->budget;
    return 0;
}

int trip_integral_create(trip_renderer **out, trip_budget *budget, unsigned threads)
{
    integral *r = trip_budget_take(budget, sizeof *r);
    *out = NULL;
    if (!r)
        return trip_fail(TRIP_ERROR, "render", "integral", "out of memory; raise --memory");
    r->base.ops = &integral_ops;
    r->budget = budget;
    int status = trip_cpu_pool_create(&r->pool, threads);
    if (!status)
        status = take_memory(r);
    if (status)
        destroy(&r->base);
    else
        *out = &r->base;
    return status;
}
