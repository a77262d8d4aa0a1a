/* The reference renderer defines the picture. In double precision it tests every splat of every
 * batch against every pixel of its bounds, exactly as splat.h, weight.h and shade.h say.
 * reference_sheets.c does so for the layers of `post`. It is slow, and written to be read. */
#include "renderer.h"

#include <limits.h>
#include <string.h>

#include "emission.h"
#include "layer.h"
#include "light_map.h"
#include "normal.h"
#include "pixels.h"
#include "reference_sheets.h"
#include "report.h"
#include "shade.h"
#include "splat.h"
#include "debug_view.h"
#include "weight.h"

/* One pixel: the layer being drawn, and the sum over the layers before it. For splats only. */
typedef struct pixel {
    double layer[TRIP_CHANNELS_MAX]; /* composited with *over*; depths are distances here */
    double sheet[TRIP_CHANNELS_MAX]; /* sums of optical depth times channel over the open sheet, if
                                        splats are summed */
    double weight;                   /* weight of the layer at this pixel */
    trip_way way;                    /* direction of the pixel's ray along the layer's axis */
    double stretch;    /* world units per index length of the current list, along the ray */
    double ray_length; /* |J r(p)| of the current list */
    double merged[TRIP_CHANNELS_MAX]; /* sum of w^2 layer over the finished layers */
    double merged_weight;             /* sum of w^2 over the finished layers */
} pixel;

typedef struct reference {
    trip_renderer base;
    trip_budget *budget;
    const trip_frame *frame;
    const trip_plan_list *list;    /* current list; NULL before the first of a layer */
    unsigned number;               /* its index in the data set */
    trip_splat_frame constants;    /* of the current list */
    const trip_splat_frame *splat; /* frame of the current splat: `constants` or `local` */
    trip_splat_frame local;        /* used with uneven spacing */
    unsigned channels;             /* per layer */
    double gradient_full;
    double early_termination;
    trip_effects_view effects;
    trip_compact_normals compact; /* for normals of 3 bytes */
    pixel *pixels;
    size_t pixels_bytes;
    trip_reference_sheets *sheets; /* for `post`; else NULL */
    trip_image_sheets *slabs;      /* for image-aligned sheets; else NULL */
    int axis;                      /* of the current layer; -1 before the first */
    trip_way way;                  /* direction of the rays that take part in the current pass */
    bool sums;                     /* splats are summed sheet by sheet */
    int64_t sheet;                 /* the open sheet, in the level of `list` */
    trip_pixels rows;              /* rows that the open sheet may have changed */
    bool front_to_back;            /* order of the last splats */
    bool broken;                   /* a splat's numbers are not finite */
    trip_list_stats *stats;        /* by list of the data set; room for stats_room */
    unsigned stats_room;
    uint32_t voxels[TRIP_RUN_RECORDS_MAX], normals[TRIP_RUN_RECORDS_MAX]; /* of one run */
} reference;

static void destroy(trip_renderer *base)
{
    reference *r = (reference *)base;
    trip_budget *budget = r->budget;
    trip_reference_sheets_destroy(r->sheets);
    trip_image_sheets_destroy(r->slabs);
    trip_budget_release(budget, r->pixels, r->pixels_bytes);
    trip_budget_release(budget, r->stats, r->stats_room * sizeof *r->stats);
    trip_budget_release(budget, r, sizeof *r);
}

static const char *device(const trip_renderer *base)
{
    (void)base;
    return "CPU, double precision";
}

/* Makes room for `count` pixels, reusing the memory if the size is the same. */
static int take_pixels(reference *r, size_t count)
{
    size_t bytes = count * sizeof(pixel);
    if (bytes != r->pixels_bytes) {
        trip_budget_release(r->budget, r->pixels, r->pixels_bytes);
        r->pixels_bytes = 0;
        r->pixels = trip_budget_take(r->budget, bytes);
        if (!r->pixels)
            return trip_fail(TRIP_ERROR, "render", "reference renderer",
                             "%zu bytes of pixels do not fit the memory given; "
                             "raise --memory or draw a smaller image",
                             bytes);
        r->pixels_bytes = bytes;
    }
    return 0;
}

/* Makes room for the counts of `lists` lists and clears them. */
static int take_stats(reference *r, unsigned lists)
{
    if (lists > r->stats_room) {
        trip_budget_release(r->budget, r->stats, r->stats_room * sizeof *r->stats);
        r->stats_room = 0;
        r->stats = trip_budget_take(r->budget, lists * sizeof *r->stats);
        if (!r->stats)
            return trip_fail(TRIP_ERROR, "render", "reference renderer",
                             "%u lists do not fit the memory given; raise --memory", lists);
        r->stats_room = lists;
    }
    memset(r->stats, 0, lists * sizeof *r->stats);
    return 0;
}

static const trip_pixels no_rows = { INT_MAX, -1 };

static pixel *row_of(const reference *r, int y)
{
    return &r->pixels[(size_t)y * (size_t)r->frame->camera->width];
}

static int clear_pixels(reference *r)
{
    const trip_camera *camera = r->frame->camera;
    int status = take_pixels(r, (size_t)camera->width * (size_t)camera->height);
    for (int y = 0; y < camera->height && !status; y++) {
        memset(row_of(r, y), 0, (size_t)camera->width * sizeof(pixel));
        status = trip_frame_poll();
    }
    return status;
}

static int begin_frame(trip_renderer *base, const trip_frame *frame)
{
    reference *r = (reference *)base;
    const trip_file_header *header = &frame->data->header;
    trip_reference_sheets_destroy(r->sheets);
    trip_image_sheets_destroy(r->slabs);
    r->sheets = NULL;
    r->slabs = NULL;
    r->frame = frame;
    r->channels = trip_layer_channels(frame->settings);
    r->early_termination = trip_settings_early_termination(frame->settings);
    r->gradient_full =
        trip_shade_gradient_full(header, frame->settings, frame->camera->voxel_world, 0);
    r->compact = trip_compact_normals_make(&frame->data->index_to_world, header->gradient_full,
                                           header->gradient_step);
    r->effects = trip_effects_view_make(frame->settings, frame->camera, header->dims);
    trip_light_map_view(frame->light, &r->effects);
    if (frame->settings->effects.emission)
        r->effects.emission = trip_emission_view_of(frame->emission);
    r->axis = -1;
    r->broken = false;
    r->sums = trip_settings_sum_sheets(frame->settings);
    r->rows = no_rows;
    int status = take_stats(r, frame->data->list_count);
    if (status)
        return status;
    if (frame->settings->classify == TRIP_CLASSIFY_POST)
        return trip_reference_sheets_create(&r->sheets, frame, r->budget);
    if (frame->settings->method == TRIP_METHOD_IMAGE)
        status = trip_image_sheets_create(&r->slabs, frame->camera, frame->settings, header->dims,
                                          r->budget);
    return status ? status : clear_pixels(r);
}

/* Composites a fragment behind a layer (front to back) or over it. */
static void composite(const reference *r, double layer[TRIP_CHANNELS_MAX],
                      const double fragment[TRIP_CHANNELS_MAX], double alpha, bool front_to_back)
{
    double keep = 1 - alpha, add = alpha;
    if (front_to_back) {
        double through = 1 - layer[TRIP_CHANNEL_ALPHA];
        keep = 1;
        add = alpha * through;
        if (through < r->early_termination)
            return;
    }
    for (unsigned c = 0; c < r->channels; c++)
        layer[c] = layer[c] * keep + fragment[c] * add;
}

/* Composites the sums of the open sheet at a pixel into the layer. */
static void composite_sheet(const reference *r, const double sheet[TRIP_CHANNELS_MAX],
                            double layer[TRIP_CHANNELS_MAX])
{
    double depth = sheet[TRIP_CHANNEL_ALPHA], mean[TRIP_CHANNELS_MAX];
    if (!(depth > 0))
        return;
    for (unsigned c = 0; c < r->channels; c++)
        mean[c] = sheet[c] / depth;
    composite(r, layer, mean, -expm1(-depth), r->front_to_back);
}

static void end_sheet(reference *r)
{
    if (!r->sums)
        return;
    for (int y = r->rows.first; y <= r->rows.last; y++) {
        pixel *row = row_of(r, y);
        for (int x = 0; x < r->frame->camera->width; x++) {
            composite_sheet(r, row[x].sheet, row[x].layer);
            memset(row[x].sheet, 0, sizeof row[x].sheet);
        }
    }
    r->rows = no_rows;
}

/* Adds a layer to the merge (Hofsetz, Max & Bastos 2008, equation 3). */
static void add_layer(const reference *r, const double layer[TRIP_CHANNELS_MAX], double weight,
                      double merged[TRIP_CHANNELS_MAX])
{
    for (unsigned c = 0; c < r->channels; c++)
        merged[c] += weight * weight * layer[c];
}

static int fold_layer(reference *r)
{
    const trip_camera *camera = r->frame->camera;
    int status = 0;
    if (r->axis < 0)
        return 0;
    end_sheet(r);
    for (int y = 0; y < camera->height && !status; y++) {
        pixel *row = row_of(r, y);
        for (int x = 0; x < camera->width; x++) {
            add_layer(r, row[x].layer, row[x].weight, row[x].merged);
            row[x].merged_weight += row[x].weight * row[x].weight;
        }
        status = trip_frame_poll();
    }
    return status;
}

static int begin_layer(trip_renderer *base, int axis)
{
    reference *r = (reference *)base;
    const trip_camera *camera = r->frame->camera;
    if (r->sheets)
        return 0;
    int status = fold_layer(r);
    r->axis = axis;
    r->list = NULL;
    for (int y = 0; y < camera->height && !status; y++) {
        for (int x = 0; x < camera->width; x++) {
            pixel *p = &row_of(r, y)[x];
            trip_vec3 ray = trip_camera_ray(camera, x + 0.5, y + 0.5);
            memset(p->layer, 0, sizeof p->layer);
            p->way = trip_ray_goes(ray, axis);
            p->weight = 0; /* with vertex_weights: until a splat is drawn there */
            if (!r->frame->settings->vertex_weights)
                p->weight =
                    trip_weight(r->frame->settings, r->frame->plan->axis_of_view, ray, axis);
        }
        status = trip_frame_poll();
    }
    return status;
}

/* Makes the list of the next splats the current one. */
static int use_list(reference *r, const trip_list *of)
{
    const trip_plan_list *list = &r->frame->plan->lists[of->index];
    int status = 0;
    if (list == r->list)
        return 0;
    if (!r->list || r->frame->data->lists[r->number].level != of->level)
        end_sheet(r); /* lists of one level share sheets */
    r->list = list;
    r->number = of->index;
    r->constants = trip_splat_frame_make(&list->camera, r->frame->settings);
    for (int y = 0; y < list->camera.height && !status; y++) {
        for (int x = 0; x < list->camera.width; x++) {
            pixel *p = &row_of(r, y)[x];
            p->stretch = trip_splat_stretch(&r->constants, x + 0.5, y + 0.5);
            p->ray_length = trip_camera_ray_length(&list->camera, x + 0.5, y + 0.5);
        }
        status = trip_frame_poll();
    }
    return status;
}

/* Composites a splat's fragment, or adds it to its sheet. */
static void put_fragment(const reference *r, pixel *p, const double fragment[TRIP_CHANNELS_MAX],
                         double depth)
{
    if (!r->sums)
        composite(r, p->layer, fragment, -expm1(-depth), r->front_to_back);
    for (unsigned c = 0; c < r->channels && r->sums; c++)
        p->sheet[c] += depth * fragment[c];
}

/* Computes the weights at the corners of a splat's bounds: upper left, upper right, lower left,
 * lower right. They are negative where the list has no weight. Returns false if no corner has
 * weight. Near splats must not use it: their bounds may span the picture, where a linear weight is
 * far from the weight of a ray. */
static bool weigh_corners(const reference *r, const trip_splat *s, double weights[4])
{
    bool some = false;
    for (int i = 0; i < 4; i++) {
        trip_vec3 ray =
            trip_camera_ray(r->frame->camera, i & 1 ? s->x1 : s->x0, i & 2 ? s->y1 : s->y0);
        weights[i] = trip_weight_signed(r->frame->settings, ray, r->axis);
        some |= weights[i] > 0;
    }
    return some;
}

/* Interpolates the weight linearly over each of two triangles, which share the edge from the upper
 * right to the lower left corner. It is limited to 0 from below, as in a depth buffer. */
static double weight_within(const trip_splat *s, const double w[4], double x, double y)
{
    double u = (x - s->x0) / (s->x1 - s->x0), v = (y - s->y0) / (s->y1 - s->y0);
    if (u + v <= 1)
        return fmax(0, w[0] + u * (w[1] - w[0]) + v * (w[2] - w[0]));
    return fmax(0, w[3] + (1 - u) * (w[2] - w[3]) + (1 - v) * (w[1] - w[3]));
}

/* Returns the weight of the layer that a splat sets at a pixel. */
static double vertex_weight(const reference *r, const trip_splat *s, const double corners[4],
                            double x, double y)
{
    const trip_frame *frame = r->frame;
    if (!s->near)
        return weight_within(s, corners, x, y);
    return trip_weight(frame->settings, frame->plan->axis_of_view,
                       trip_camera_ray(frame->camera, x, y), r->axis);
}

/* Draws a pixel in the support of a splat. */
static void draw_pixel(reference *r, const trip_splat *s, trip_vec3 voxel, int x, int y,
                       double fragment[TRIP_CHANNELS_MAX], double extinction)
{
    pixel *p = &row_of(r, y)[x];
    double m = trip_splat_radius2(r->splat, s, x + 0.5, y + 0.5);
    double footprint = s->amplitude * (exp(-m / 2) - r->constants.edge);
    double stretch =
        r->splat == &r->local ? trip_splat_stretch(r->splat, x + 0.5, y + 0.5) : p->stretch;
    double depth = extinction * (s->affine ? 1 : stretch) * footprint;
    fragment[TRIP_CHANNEL_DEPTH] = fmax(0, s->z) * p->ray_length;
    if (r->slabs)
        trip_image_sheets_add(r->slabs, &r->constants, voxel, x, y, fragment, depth);
    else
        put_fragment(r, p, fragment, depth * trip_splat_front(r->splat, s, x + 0.5, y + 0.5));
}

/* Whether a pixel's ray takes part in the pass, and the layer may have weight there. */
static bool takes_part(const reference *r, const pixel *p)
{
    return (r->way == TRIP_WAY_ANY || r->way == p->way) &&
           (p->weight > 0 || r->frame->settings->vertex_weights);
}

/* Draws a splat. Returns true if its support contains the centre of a pixel that takes part. */
static bool draw_footprint(reference *r, const trip_splat *s, trip_vec3 voxel,
                           double fragment[TRIP_CHANNELS_MAX], double extinction)
{
    const trip_camera *camera = r->frame->camera;
    const bool by_vertices = r->frame->settings->vertex_weights;
    trip_pixels columns = trip_pixels_within(s->x0, s->x1, camera->width);
    trip_pixels rows = trip_pixels_within(s->y0, s->y1, camera->height);
    double corners[4] = { 0 };
    bool touched = false;
    if (by_vertices && !s->near && !weigh_corners(r, s, corners))
        return false;
    r->rows.first = rows.first < r->rows.first ? rows.first : r->rows.first;
    r->rows.last = rows.last > r->rows.last ? rows.last : r->rows.last;
    for (int y = rows.first; y <= rows.last && !trip_interrupted(); y++) {
        for (int x = columns.first; x <= columns.last; x++) {
            pixel *p = &row_of(r, y)[x];
            double m = trip_splat_radius2(r->splat, s, x + 0.5, y + 0.5);
            if (!(takes_part(r, p) && m <= r->constants.cutoff2))
                continue;
            touched = true;
            if (by_vertices)
                p->weight = vertex_weight(r, s, corners, x + 0.5, y + 0.5);
            draw_pixel(r, s, voxel, x, y, fragment, extinction);
        }
    }
    return touched;
}

/* Unpacks the world-space gradient of a voxel. */
static void unpack(const reference *r, uint32_t normal, double gradient[3])
{
    const trip_file_header *header = &r->frame->data->header;
    if (header->normal_bytes == 3)
        trip_compact_normal_unpack(&r->compact, normal, gradient);
    else
        trip_normal_unpack(normal, header->gradient_full, gradient);
}

static void colour(const reference *r, trip_vec3 voxel, const trip_tf_entry *entry,
                   const uint32_t *normal, double rgb[3])
{
    const trip_frame *frame = r->frame;
    rgb[0] = entry->r;
    rgb[1] = entry->g;
    rgb[2] = entry->b;
    trip_debug_view_of(frame->settings, r->axis, frame->data->lists[r->number].level, rgb);
    const bool shaded = frame->settings->shading && normal;
    if (!shaded && !trip_effects_some(&frame->settings->effects))
        return;
    double gradient[3];
    if (shaded)
        unpack(r, *normal, gradient);
    const trip_light light =
        trip_light_at(frame->settings, &r->list->camera, r->gradient_full, voxel);
    trip_effects_colour(&r->effects, &light, trip_list_grid_point(&r->list->grid, voxel),
                        shaded ? gradient : NULL, rgb);
}

/* Whether a ray with weight may pass through a splat, tested in the grid of level 0. */
static bool may_reach(const reference *r, trip_vec3 voxel, double radius)
{
    const trip_frame *frame = r->frame;
    const trip_list_grid *grid = &r->list->grid;
    trip_vec3 from_eye = trip_list_grid_vector(grid, trip_sub(voxel, r->list->camera.eye));
    if (frame->settings->two_point_culling && frame->settings->method == TRIP_METHOD_MERGE &&
        !frame->camera->ortho) {
        const trip_vec3 right = trip_normalize(r->list->camera.rx);
        const trip_vec3 beside = trip_scale(right, 0.5 * frame->settings->kernel_radius);
        return trip_weight_of_two_points(frame->settings, r->axis, from_eye,
                                         trip_list_grid_vector(grid, beside));
    }
    return trip_weight_may_reach(frame->settings, frame->camera, frame->plan->axis_of_view, r->axis,
                                 from_eye, radius * trip_list_grid_growth(grid));
}

static trip_flattening flattening(const reference *r, const uint32_t *normal)
{
    double gradient[3];
    if (!normal || !(r->constants.flatten > 0))
        return (trip_flattening){ 0 };
    unpack(r, *normal, gradient);
    return trip_splat_flattening(r->splat, gradient, r->gradient_full);
}

static void draw_splat(reference *r, trip_vec3 voxel, uint32_t record, const uint32_t *normal)
{
    trip_list_stats *stats = &r->stats[r->number];
    trip_splat s;
    stats->splats_read++;
    const trip_coordinates *coordinates = &r->frame->data->coordinates;
    trip_vec3 centre = voxel;
    double growth = 1;
    r->splat = &r->constants;
    if (trip_coordinates_uneven(coordinates)) {
        centre = trip_splat_position(&r->constants, coordinates, voxel, &r->local, &growth);
        voxel = trip_coordinates_point(coordinates, voxel);
        r->splat = &r->local;
    }
    trip_flattening flat = flattening(r, normal);
    bool seen = trip_splat_project_flat(r->splat, centre, &flat, &s);
    r->broken |= trip_splat_is_broken(&s);
    if (!seen || !may_reach(r, voxel, growth * s.radius))
        return;
    stats->splats_projected++;

    const trip_tf_entry *entry = &r->list->table[trip_voxel_code(record)];
    double fragment[TRIP_CHANNELS_MAX] = { [TRIP_CHANNEL_ALPHA] = 1 };
    colour(r, voxel, entry, normal, fragment);
    stats->splats_drawn += draw_footprint(r, &s, voxel, fragment, entry->extinction);
}

/* Returns the index position of a record: the sheet along the list's axis, u and v along the next
 * two axes. */
static trip_vec3 voxel_position(int axis, const trip_run *run, uint32_t record)
{
    double p[3];
    p[axis] = run->sheet;
    p[(axis + 1) % 3] = run->u + (int)trip_voxel_u(record);
    p[(axis + 2) % 3] = run->v + (int)trip_voxel_v(record);
    return trip_v3(p[0], p[1], p[2]);
}

static void draw_run(reference *r, const trip_batch *batch, const trip_run *run)
{
    if (run->sheet != r->sheet)
        end_sheet(r);
    r->sheet = run->sheet;
    const trip_block block = trip_block_of(batch, run);
    trip_block_voxels(&block, 0, run->count, r->voxels);
    if (block.normals)
        trip_block_normals(&block, 0, run->count, r->normals);
    const trip_list *list = trip_batch_list(batch, run);
    for (uint32_t k = 0; k < run->count && !trip_interrupted(); k++) {
        uint32_t at = batch->pass->descending ? run->count - 1 - k : k;
        if (r->list->by_level && !trip_lod_has(&r->frame->plan->lod, list, run->sheet,
                                               run->u + (int64_t)trip_voxel_u(r->voxels[at]),
                                               run->v + (int64_t)trip_voxel_v(r->voxels[at])))
            continue;
        trip_vec3 position = voxel_position(r->axis, run, r->voxels[at]);
        if (trip_clip_has(&r->list->clip,
                          trip_coordinates_point(&r->frame->data->coordinates, position)))
            draw_splat(r, position, r->voxels[at], block.normals ? &r->normals[at] : NULL);
    }
}

static int put_batch(reference *r, const trip_batch *batch)
{
    int status = trip_frame_poll();
    for (size_t i = 0; i < batch->run_count && !status; i++) {
        const trip_run *run = &batch->runs[i];
        status = trip_reference_sheets_put(r->sheets, batch, run);
        r->stats[trip_batch_list(batch, run)->index].splats_read += run->count;
    }
    return status;
}

static int draw(trip_renderer *base, const trip_batch *batch, bool front_to_back)
{
    reference *r = (reference *)base;
    if (r->sheets)
        return put_batch(r, batch);
    if (front_to_back != r->front_to_back)
        end_sheet(r);
    r->front_to_back = front_to_back;
    r->way = trip_plan_way(r->frame->plan, r->axis, batch->pass->descending);
    for (size_t i = 0; i < batch->run_count; i++) {
        const trip_run *run = &batch->runs[i];
        int status = use_list(r, trip_batch_list(batch, run));
        if (status)
            return status;
        draw_run(r, batch, run);
    }
    return r->broken ? trip_splat_fail() : trip_frame_poll();
}

/* Returns the divisor of the merge. Layers that were not drawn count as empty ones. */
static double weight_sum(const reference *r, int x, int y)
{
    const trip_frame *frame = r->frame;
    if (frame->settings->vertex_weights) {
        const pixel *p = &row_of(r, y)[x];
        double all = p->merged_weight + p->weight * p->weight;
        return all > 0 ? all : 1; /* no splat was drawn here */
    }
    trip_vec3 ray = trip_camera_ray(frame->camera, x + 0.5, y + 0.5);
    double sum = 0;
    for (int axis = 0; axis < 3; axis++) {
        double w = trip_weight(frame->settings, frame->plan->axis_of_view, ray, axis);
        sum += w * w;
    }
    return sum;
}

static float mean_depth(const double merged[TRIP_CHANNELS_MAX])
{
    double alpha = merged[TRIP_CHANNEL_ALPHA];
    return alpha > 0 ? (float)(merged[TRIP_CHANNEL_DEPTH] / alpha) : INFINITY;
}

/* Divides the merged layers by the sum of the weights, and puts them over the background. */
static void finish_colour(const reference *r, const double merged[4], double sum, float rgba[4])
{
    const double *background = r->frame->settings->background;
    const double behind[4] = { background[0] * background[3], background[1] * background[3],
                               background[2] * background[3], background[3] };
    double transmittance = 1 - merged[TRIP_CHANNEL_ALPHA] / sum;
    for (int c = 0; c < 4; c++)
        rgba[c] = (float)(merged[c] / sum + transmittance * behind[c]);
}

static void merge_sheets(const reference *r, int x, int y, double merged[TRIP_CHANNELS_MAX])
{
    const trip_frame *frame = r->frame;
    trip_vec3 ray = trip_camera_ray(frame->camera, x + 0.5, y + 0.5);
    for (int axis = 0; axis < 3; axis++) {
        double w = trip_weight(frame->settings, frame->plan->axis_of_view, ray, axis);
        double layer[TRIP_CHANNELS_MAX];
        if (!(w > 0))
            continue;
        trip_reference_sheets_layer(r->sheets, axis, x, y, layer);
        add_layer(r, layer, w, merged);
    }
}

/* Merges the splats drawn so far at a pixel. */
static void merge_splats(const reference *r, int x, int y, double merged[TRIP_CHANNELS_MAX])
{
    const pixel *p = &row_of(r, y)[x];
    double layer[TRIP_CHANNELS_MAX];
    memcpy(layer, p->layer, sizeof layer);
    composite_sheet(r, p->sheet, layer);
    for (int n = 0; r->slabs && n < trip_image_sheets_count(r->slabs); n++)
        composite_sheet(r, trip_image_sheets_at(r->slabs, x, y, n), layer);
    memcpy(merged, p->merged, sizeof p->merged);
    add_layer(r, layer, p->weight, merged);
}

static int picture(trip_renderer *base, float *rgba, float *depth)
{
    reference *r = (reference *)base;
    const trip_camera *camera = r->frame->camera;
    int status = r->sheets ? trip_reference_sheets_prepare(r->sheets) : 0;
    for (int y = 0; y < camera->height && !status; y++) {
        for (int x = 0; x < camera->width && !trip_interrupted(); x++) {
            double merged[TRIP_CHANNELS_MAX] = { 0 };
            if (r->sheets)
                merge_sheets(r, x, y, merged);
            else
                merge_splats(r, x, y, merged);
            finish_colour(r, merged, weight_sum(r, x, y), rgba);
            rgba += 4;
            if (depth)
                *depth++ = mean_depth(merged);
        }
        status = trip_frame_poll();
    }
    return status;
}

static trip_list_stats stats(const trip_renderer *base, unsigned list)
{
    return ((const reference *)base)->stats[list];
}

static const trip_renderer_ops reference_ops = {
    .name = "reference",
    .classifies_post = true,
    .blurs = true,
    .effects = 1u << TRIP_CLASSIFY_PRE | 1u << TRIP_CLASSIFY_POST,
    .forms = TRIP_DRAWS_FIXED | TRIP_DRAWS_VERTEX_WEIGHTS | TRIP_DRAWS_IMAGE_SHEETS,
    .destroy = destroy,
    .device = device,
    .begin_frame = begin_frame,
    .begin_layer = begin_layer,
    .draw = draw,
    .picture = picture,
    .stats = stats,
};

int trip_reference_create(trip_renderer **out, trip_budget *budget)
{
    reference *r = trip_budget_take(budget, sizeof *r);
    *out = NULL;
    if (!r)
        return trip_fail(TRIP_ERROR, "render", "reference renderer", "out of memory");
    r->base.ops = &reference_ops;
    r->budget = budget;
    *out = &r->base;
    return 0;
}
