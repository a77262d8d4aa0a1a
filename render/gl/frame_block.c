#include "gl/frame_block.h"

#include <math.h>

#include "block.h"
#include "effects.h"
#include "layer.h"
#include "mean.h"
#include "normal.h"
#include "shade.h"
#include "splat.h"
#include "debug_view.h"
#include "weight.h"

/* Returns the components of a vector in list axes. The axes are permuted evenly, so cross products
 * keep their sign. */
static trip_gl_double4 in_list_axes(trip_vec3 v, int axis, double w)
{
    return (trip_gl_double4){ { trip_component(v, axis), trip_component(v, (axis + 1) % 3),
                                trip_component(v, (axis + 2) % 3), w } };
}

static trip_gl_double4 as_it_is(trip_vec3 v, double w)
{
    return (trip_gl_double4){ { v.x, v.y, v.z, w } };
}

/* Sets the coefficients of scale |r0 + x rx + y ry|^2. a holds the terms (1, x, y, x x), and b
 * holds (x y, y y). */
static void square(trip_gl_double4 *a, trip_gl_double4 *b, trip_vec3 r0, trip_vec3 rx, trip_vec3 ry,
                   double scale)
{
    *a = (trip_gl_double4){ { scale * trip_dot(r0, r0), scale * 2 * trip_dot(r0, rx),
                              scale * 2 * trip_dot(r0, ry), scale * trip_dot(rx, rx) } };
    *b = (trip_gl_double4){ { scale * 2 * trip_dot(rx, ry), scale * trip_dot(ry, ry), 0, 0 } };
}

/* Scales the pixel steps to a length of about 1, so that the squares of components fit a float in
 * any view, however narrow. */
static void set_steps(trip_gl_frame_double *f, int axis, trip_vec3 forward, trip_vec3 r0,
                      trip_vec3 rx, trip_vec3 ry, double sigma)
{
    double step = fmax(trip_length(rx), trip_length(ry));
    trip_vec3 x = trip_scale(rx, 1 / step), y = trip_scale(ry, 1 / step);
    double volume = trip_dot(r0, trip_cross(x, y));
    f->forward = in_list_axes(forward, axis, step * volume / sigma);
    f->ray_x = in_list_axes(x, axis, step);
    f->ray_y = in_list_axes(y, axis, volume * volume);
}

/* Returns the length by which set_projection() divides all rays. */
static double centre_length(const trip_camera *c)
{
    return c->ortho ? 1 : trip_length(trip_camera_ray(c, 0.5 * c->width, 0.5 * c->height));
}

/* Sets the rays relative to the image centre, scaled so that the ray at the centre has length 1.
 * Projected numbers do not depend on this scale, and floats stay far from their limits for any
 * world unit. */
static void set_projection(trip_gl_frame_double *f, const trip_camera *c, int axis, double sigma,
                           double flatten)
{
    double px = 0.5 * c->width, py = 0.5 * c->height;
    f->screen = (trip_gl_double4){ { px, py, c->width, c->height } };
    trip_vec3 r0 = trip_camera_ray(c, px, py);
    double length = centre_length(c);
    trip_vec3 forward = trip_scale(c->forward, length);
    trip_vec3 to_x = trip_scale(c->to_x, length), to_y = trip_scale(c->to_y, length);
    trip_vec3 rx = trip_scale(c->rx, 1 / length), ry = trip_scale(c->ry, 1 / length);
    r0 = trip_scale(r0, 1 / length);
    if (!c->ortho) {
        to_x = trip_sub(to_x, trip_scale(forward, px));
        to_y = trip_sub(to_y, trip_scale(forward, py));
    }
    set_steps(f, axis, forward, r0, rx, ry, sigma);
    f->ray_0 = in_list_axes(r0, axis, 0);
    f->to_x = in_list_axes(to_x, axis, flatten);
    f->to_y = in_list_axes(to_y, axis, 0);
    if (c->ortho)
        rx = ry = trip_v3(0, 0, 0); /* all rays are parallel */
    square(&f->ray2_a, &f->ray2_b, r0, rx, ry, 1);

    const trip_affine *j = &c->index_to_world;
    square(&f->world2_a, &f->world2_b, trip_affine_vector(j, r0), trip_affine_vector(j, rx),
           trip_affine_vector(j, ry), 1 / (c->voxel_world * c->voxel_world));
}

/* Sets the constants of footprints of one size in perspective. */
static void set_fixed(trip_gl_frame_double *f, const trip_splat_frame *constants)
{
    const trip_camera *c = &constants->camera;
    double exact2 = constants->fixed * constants->fixed, wide2 = exact2 + constants->low_pass2;
    double reach = sqrt(constants->cutoff2 * wide2);
    double amplitude = constants->amplitude * c->voxel_world;
    f->parallel = (trip_gl_double4){ { 1 / wide2, 0, 1 / wide2, amplitude * (exact2 / wide2) } };
    f->parallel_size = (trip_gl_double4){
        { reach, reach, reach * sqrt(constants->rxrx + constants->ryry) / centre_length(c), 0 }
    };
}

/* In parallel views all splats have the same footprint and the same world length along the ray. */
static void set_parallel(trip_gl_frame_double *f, const trip_splat_frame *constants)
{
    trip_splat s;
    const trip_camera *c = &constants->camera;
    if (constants->fixed > 0 && !c->ortho) {
        set_fixed(f, constants);
        return;
    }
    if (!c->ortho || !trip_splat_project(constants, trip_add(c->eye, c->r0), &s))
        return;
    double world = trip_splat_stretch(constants, 0, 0);
    f->parallel = (trip_gl_double4){ { s.conic_xx, s.conic_xy, s.conic_yy, s.amplitude * world } };
    f->parallel_size = (trip_gl_double4){ { 0.5 * (s.x1 - s.x0), 0.5 * (s.y1 - s.y0), s.radius,
                                            constants->amplitude * world } };
}

static void set_world(trip_gl_frame_double *f, const trip_frame *frame, const trip_camera *c,
                      int axis)
{
    const trip_file_header *header = &frame->data->header;
    trip_gl_double4 *columns[3] = { &f->world_0, &f->world_1, &f->world_2 };
    for (int i = 0; i < 3; i++) {
        int a = (axis + i) % 3;
        const double(*m)[4] = c->index_to_world.m;
        *columns[i] =
            as_it_is(trip_scale(trip_v3(m[0][a], m[1][a], m[2][a]), 1 / c->voxel_world), 0);
    }
    double full = trip_shade_gradient_full(header, frame->settings, frame->camera->voxel_world, 0);
    f->light = as_it_is(frame->settings->light_direction, 0);
    if (frame->settings->point_light)
        f->light = in_list_axes(
            trip_sub(trip_light_position(frame->settings, &c->index_to_world), c->eye), axis, 1);
    f->to_eye =
        as_it_is(trip_scale(c->world_forward, -1), fmin(header->gradient_full / full, 1e30));
}

static void set_compact_normals(trip_gl_frame_double *f, const trip_frame *frame)
{
    const trip_file_header *h = &frame->data->header;
    double full = trip_shade_gradient_full(h, frame->settings, frame->camera->voxel_world, 0);
    trip_gl_double4 *columns[3] = { &f->compact_0, &f->compact_1, &f->compact_2 };
    if (h->normal_bytes != 3)
        return;
    trip_compact_normals c =
        trip_compact_normals_make(&frame->data->index_to_world, h->gradient_full, h->gradient_step);
    for (int j = 0; j < 3; j++)
        *columns[j] =
            as_it_is(trip_scale(trip_v3(c.to_world[0][j], c.to_world[1][j], c.to_world[2][j]),
                                c.step[j] / full),
                     c.full / full);
}

static void make(trip_gl_frame_double *out, const trip_frame *frame, const trip_camera *c, int axis)
{
    const trip_settings *s = frame->settings;
    const trip_camera *whole = frame->camera;
    trip_splat_frame constants = trip_splat_frame_make(c, s);
    trip_vec3 none = { 0, 0, 0 };
    *out = (trip_gl_frame_double){ 0 };
    set_projection(out, c, axis, constants.sigma, constants.flatten);
    set_parallel(out, &constants);
    set_world(out, frame, c, axis);
    set_compact_normals(out, frame);
    out->camera_r0 = as_it_is(whole->r0, 0);
    out->camera_rx = as_it_is(whole->ortho ? none : whole->rx, 0);
    out->camera_ry = as_it_is(whole->ortho ? none : whole->ry, 0);
    out->kernel =
        (trip_gl_double4){ { constants.sigma * constants.sigma, constants.cutoff2,
                             constants.low_pass2, constants.amplitude * c->voxel_world } };
    out->edge.v[0] = constants.edge;
    out->edge.v[1] = 1;
    out->edge.v[2] = 0.5 * constants.front;
    out->depth = (trip_gl_double4){ { trip_layer_depth_unit(c, whole) * centre_length(whole) /
                                          centre_length(c),
                                      whole->voxel_world } };
    double h = trip_weight_h(s);
    out->to_grid = (trip_gl_double4){ { 1, 1, 1, 1 } };
    out->weight = (trip_gl_double4){ { h, sqrt(1 + h * h), axis, frame->plan->axis_of_view } };
    const double *b = s->background;
    out->background = (trip_gl_double4){ { b[0], b[1], b[2], b[3] } };
}

static void set_debug_view(trip_gl_frame_double *out, const trip_settings *s, int axis,
                           unsigned level)
{
    double rgb[3];
    if (trip_debug_view_of(s, axis, level, rgb))
        out->debug_colour = (trip_gl_double4){ { rgb[0], rgb[1], rgb[2], 1 } };
}

/* Returns the length of a voxel along an axis in world units. */
static double world_length(const trip_camera *c, int axis)
{
    const double(*m)[4] = c->index_to_world.m;
    return trip_length(trip_v3(m[0][axis], m[1][axis], m[2][axis]));
}

static void set_means(trip_gl_frame_double *out, const trip_dataset *d, double length)
{
    const trip_mean_scale scale =
        trip_mean_scale_make(d->header.typical_min, d->header.typical_max, &d->codes);
    out->means = (trip_gl_double4){ { length, scale.lo, scale.width } };
}

void trip_gl_frame_make(trip_gl_frame_double *out, const trip_frame *frame, const trip_list *list)
{
    const trip_plan_list *planned = &frame->plan->lists[list->index];
    const double *scale = planned->grid.scale;
    make(out, frame, &planned->camera, list->axis);
    set_debug_view(out, frame->settings, list->axis, list->level);
    const trip_block_form form = trip_block_form_of(&frame->data->header, list->kind);
    out->edge.v[1] = trip_block_step(&form);
    if (trip_kind_of(list->kind)->axis_bits > 0)
        set_means(out, frame->data, world_length(&planned->camera, list->axis));
    out->to_grid = in_list_axes(trip_v3(scale[0], scale[1], scale[2]), list->axis,
                                trip_list_grid_growth(&planned->grid));
}

void trip_gl_frame_make_layer(trip_gl_frame_double *out, const trip_frame *frame, int axis)
{
    make(out, frame, frame->camera, axis);
    set_debug_view(out, frame->settings, axis, frame->plan->level);
}

void trip_gl_frame_round(trip_gl_frame_float *out, const trip_gl_frame_double *in)
{
    const double *from = (const double *)in;
    float *to = (float *)out;
    for (size_t i = 0; i < sizeof *in / sizeof *from; i++)
        to[i] = (float)from[i];
}

unsigned trip_gl_frame_placed(const trip_settings *settings)
{
    const trip_effects *e = &settings->effects;
    return (e->shadows ? TRIP_GL_SHADOWS : 0) | (e->occlusion ? TRIP_GL_OCCLUSION : 0) |
           (e->emission ? TRIP_GL_EMISSION : 0) | (e->cueing > 0 ? TRIP_GL_CUED : 0);
}

unsigned trip_gl_frame_effects(const trip_frame *frame, const trip_camera *camera, int axis)
{
    const trip_settings *s = frame->settings;
    const bool uneven = trip_coordinates_uneven(&frame->data->coordinates);
    unsigned effects = uneven ? TRIP_GL_UNEVEN : 0;
    if (camera->ortho)
        effects |= TRIP_GL_PARALLEL;
    else if (uneven || !trip_affine_is_similarity(&camera->index_to_world))
        effects |= TRIP_GL_ANISOTROPIC;
    bool normals = frame->plan->planes & 1u << TRIP_PLANE_NORMALS;
    if (normals && s->shading)
        effects |= TRIP_GL_SHADED | (s->headlight ? TRIP_GL_HEADLIGHT : 0);
    if (normals && s->flatten > 1)
        effects |= TRIP_GL_FLATTENED;
    if (effects & (TRIP_GL_SHADED | TRIP_GL_FLATTENED) && frame->data->header.normal_bytes == 3)
        effects |= TRIP_GL_COMPACT;
    if (trip_settings_stays(s))
        effects |= TRIP_GL_INDEXED | (s->indexed ? 0 : TRIP_GL_RESIDENT);
    if (s->two_point_culling && s->method == TRIP_METHOD_MERGE && !camera->ortho)
        effects |= TRIP_GL_TWO_POINTS;
    if (s->depth)
        effects |= TRIP_GL_DEPTH;
    effects |= trip_gl_frame_placed(s);
    if (trip_settings_sum_sheets(s))
        effects |= TRIP_GL_SUMMED;
    if (s->footprint == TRIP_FOOTPRINT_EWA && !camera->ortho)
        effects |= TRIP_GL_AFFINE;
    if (s->footprint == TRIP_FOOTPRINT_FIXED && !camera->ortho)
        effects |= TRIP_GL_AFFINE | TRIP_GL_FIXED;
    if (trip_weight_is_everywhere(s, frame->camera, frame->plan->axis_of_view, axis))
        effects |= TRIP_GL_UNCULLED;
    return effects;
}

/* Let r_max and r_min be the largest and smallest |ray| of the image and of its plane. With S'_xx
 * and g >= (r_min / r_max)^2 of splat.h the reach of a support within the image is bounded. It is
 * at most this many pixels from its centre along x:
 *     k sigma |ry| r_max / (K depth) + k low-pass r_max / r_min
 * The bound along y is analogous.
 *
 * The ray of an affine support's centre is at most 1 / (1 - TRIP_SPLAT_AFFINE) times as long as the
 * ray of the pixel. The two rays differ by at most TRIP_SPLAT_AFFINE / (1 - TRIP_SPLAT_AFFINE)
 * lengths of the pixel's ray, measured in the index space in which the kernel is round. In the
 * index space of the list they differ by up to `ratio` times as much.
 *
 * For exact supports and ratio > 1 the low-pass term depends on ray lengths in the kernel's own
 * space, and no bound of it is known. The result is then infinite. */
double trip_gl_frame_sprite_depth(const trip_settings *settings, const trip_camera *c, double ratio,
                                  double point_size_px)
{
    double half = 0.5 * (point_size_px - 2);
    if (fmax(c->width, c->height) <= point_size_px)
        return 0;
    if (settings->footprint == TRIP_FOOTPRINT_FIXED)
        return trip_splat_fixed_radius_px(settings) <= half ? 0 : HUGE_VAL;
    if (c->ortho) {
        trip_splat s;
        trip_splat_frame constants = trip_splat_frame_make(c, settings);
        bool fits = trip_splat_project(&constants, trip_add(c->eye, c->r0), &s) &&
                    fmax(s.x1 - s.x0, s.y1 - s.y0) <= 2 * half;
        return fits ? 0 : HUGE_VAL;
    }
    if (ratio > 1 && settings->footprint != TRIP_FOOTPRINT_EWA)
        return HUGE_VAL;
    double r_max = 0;
    for (int i = 0; i < 4; i++)
        r_max = fmax(r_max,
                     trip_length(trip_camera_ray(c, i & 1 ? c->width : 0, i & 2 ? c->height : 0)));
    trip_vec3 normal = trip_cross(c->rx, c->ry);
    double k = fabs(trip_dot(c->r0, normal)), r_min = k / trip_length(normal);
    if (settings->footprint == TRIP_FOOTPRINT_EWA)
        r_max *= 1 + ratio * TRIP_SPLAT_AFFINE / (1 - TRIP_SPLAT_AFFINE);
    double room = half - TRIP_CUTOFF * trip_settings_low_pass_px(settings) * r_max / r_min;
    double wide = fmax(trip_length(c->rx), trip_length(c->ry));
    return room > 0 ? settings->kernel_radius * wide * r_max / (k * room) : HUGE_VAL;
}

double trip_gl_frame_ratio(const trip_coordinates *coordinates)
{
    return coordinates->widest / coordinates->nearest;
}

/* Returns trip_splat_parallel_near(), or an upper bound of it for kernels of other widths. The
 * bound assumes pixel steps parallel to the rays, which maximises the slopes. */
static double parallel_near(const trip_splat_frame *f, double ratio)
{
    const trip_camera *c = &f->camera;
    trip_splat s;
    if (ratio <= 1)
        return trip_splat_parallel_near(f);
    trip_splat_project(f, trip_add(c->eye, c->r0), &s);
    return (sqrt(f->cutoff2) * f->sigma +
            0.5 * ratio * (sqrt(f->rxrx) * (s.x1 - s.x0) + sqrt(f->ryry) * (s.y1 - s.y0))) /
           trip_length(c->r0);
}

/* Let r = |r_c|, and let r_min be the minimum |ray| of the image plane. A splat of
 * depth z is not near if (see render/cpu/kernels/project_tmpl.h)
 *     (z r)^2 >= 2 R^2 (r^2 / r_min^2 + 1) + 2 k^2 low-pass^2 z^2 (rx.rx + ry.ry)
 * For affine splats 1 / TRIP_SPLAT_AFFINE^2 replaces the factor 2. Let w be the
 * minimum width of a kernel. In the index space in which it is round, rays are at most 1 / w times
 * and at least 1 / (w ratio) times as long. */
double trip_gl_frame_near_depth(const trip_settings *settings, const trip_camera *c, double ratio)
{
    const trip_splat_frame f = trip_splat_frame_make(c, settings);
    if (c->ortho)
        return parallel_near(&f, ratio);
    if (settings->footprint == TRIP_FOOTPRINT_FIXED)
        return -HUGE_VAL; /* no splat is near */
    trip_vec3 normal = trip_cross(c->rx, c->ry);
    double r_min2 = pow(trip_dot(c->r0, normal), 2) / trip_dot(normal, normal);
    double times = f.affine ? 1 / (TRIP_SPLAT_AFFINE * TRIP_SPLAT_AFFINE) : 2;
    double apart2 = ratio * ratio * (f.rxrx + f.ryry) / r_min2;
    double room = 1 - times * f.cutoff2 * f.low_pass2 * apart2;
    return room > 0 ? settings->kernel_radius * sqrt(2 * times / (r_min2 * room)) : HUGE_VAL;
}
