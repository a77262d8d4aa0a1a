#include "cpu/cpu_scalar.h"

#include <string.h>

#include "pixels.h"

uint32_t trip_cpu_panes(const trip_cpu_splat *s, int panes_across)
{
    uint32_t x = s->x0 / TRIP_CPU_PANE, y = s->y0 / TRIP_CPU_PANE;
    uint32_t right = s->x1 / TRIP_CPU_PANE - x, below = s->y1 / TRIP_CPU_PANE - y;
    uint32_t more = right > 1 || below > 1 ? TRIP_CPU_PANES_MORE : 0;
    return (y * (uint32_t)panes_across + x) | more |
           (uint32_t)(right > 0) << TRIP_CPU_PANES_RIGHT_SHIFT |
           (uint32_t)(below > 0) << TRIP_CPU_PANES_BELOW_SHIFT;
}

/* Sets the forms a and b of a near splat. The input forms start at the image's corner, the output
 * forms at the pane's corner. Rotating (a, b) makes b independent of x and keeps a^2 + b^2. */
static void set_near(const trip_splat *s, trip_cpu_splat *out)
{
    double length = hypot(s->a[1], s->b[1]), c = length > 0 ? s->a[1] / length : 1;
    double sine = length > 0 ? s->b[1] / length : 0, form[2][3];
    for (int i = 0; i < 3; i++) {
        form[0][i] = (c * s->a[i] + sine * s->b[i]) / TRIP_CUTOFF;
        form[1][i] = (c * s->b[i] - sine * s->a[i]) / TRIP_CUTOFF;
    }
    double x = out->x0 / TRIP_CPU_PANE * TRIP_CPU_PANE, y = out->y0 / TRIP_CPU_PANE * TRIP_CPU_PANE;
    out->l11 = (float)form[0][1];
    out->l21 = (float)form[0][2];
    out->l22 = (float)form[1][2];
    out->l1 = (float)(form[0][0] + form[0][1] * x + form[0][2] * y);
    out->l2 = (float)(form[1][0] + form[1][2] * y);
}

void trip_cpu_set_conic(const trip_splat *s, trip_cpu_splat *out)
{
    double unit = s->ray2 / (TRIP_CUTOFF * TRIP_CUTOFF);
    double xx = s->conic_xx * unit, xy = s->conic_xy * unit, yy = s->conic_yy * unit;
    double l11 = sqrt(xx), l21 = xy / l11;
    out->l11 = (float)l11;
    out->l21 = (float)l21;
    out->l22 = (float)sqrt(fmax(0, yy - l21 * l21));
}

/* Sets the forms of a splat that is not near, from its conic and centre. */
static void set_centre(const trip_splat *s, trip_cpu_splat *out)
{
    trip_cpu_set_conic(s, out);
    double x = s->x - out->x0 / TRIP_CPU_PANE * TRIP_CPU_PANE;
    double y = s->y - out->y0 / TRIP_CPU_PANE * TRIP_CPU_PANE;
    out->l1 = (float)-((double)out->l11 * x + (double)out->l21 * y);
    out->l2 = (float)-((double)out->l22 * y);
}

/* Slack for rounding in the bounds of a support. */
#define SLACK 1e-3

/* Returns false if no pixel lies within the bounds. */
static bool pixels(double lo, double hi, int size, uint16_t *first, uint16_t *last)
{
    double slack = SLACK * (1 + 0.5 * (hi - lo)) + 1e-6 * fmax(fabs(lo), fabs(hi));
    trip_pixels p = trip_pixels_within(lo - slack, hi + slack, size);
    *first = (uint16_t)p.first;
    *last = (uint16_t)p.last;
    return p.first <= p.last;
}

/* The polynomial approximates the opacity 1 - exp(-A (exp(-m / 2) - edge)). Its error is at most
 * 4e-4 A, and at most 1.5e-4 A for A up to 0.1; so it is at most 1.2e-4. The relative error of the
 * integral over the plane, where area is proportional to m, is at most 1e-6. So the errors of many
 * faint splats do not add up.
 *
 * The coefficients come from least squares over u and A together, with this integral as a
 * condition. Reweighting evened out the error at each A. */
const float trip_cpu_thin[TRIP_CPU_TERMS][4] = {
    { 0.159756631f, -0.168852314f, -0.0508883893f, 0.346433312f },
    { 0.0594277196f, 1.73690438f, 0.0941105708f, -2.60230803f },
    { 0.759691179f, -5.79509068f, 0.645263553f, 6.28719616f },
    { -0.622695327f, 7.89423943f, -1.71902728f, -6.14846611f },
    { 0.641818106f, -3.9144907f, 1.08012068f, 2.11197734f },
};

static void set_opacity(const trip_cpu_view *view, double depth, int sheet, trip_cpu_splat *out)
{
    if (view->sums) {
        out->peak = (float)depth;
        out->sheet = sheet;
        return;
    }
    bool thick = depth > (double)view->thin || out->panes & TRIP_CPU_PANES_NEAR;
    if (thick)
        out->panes |= 1u << TRIP_CPU_PANES_THICK_SHIFT;
    if (thick || view->rays == TRIP_CPU_STRETCHED) {
        double min = log2(depth) + 127 - (double)view->cutoff / TRIP_CPU_EXP_UNIT;
        out->c[TRIP_CPU_MIN] = (float)(min * TRIP_CPU_EXP_UNIT);
        out->c[TRIP_CPU_EDGE] = (float)(depth * view->splat.edge);
        return;
    }
    for (int i = 0; i < TRIP_CPU_TERMS; i++) {
        double c = 0;
        for (int j = 3; j >= 0; j--)
            c = c * depth + (double)trip_cpu_thin[i][j];
        out->c[i] = (float)(c * sqrt(depth));
    }
}

/* Returns a vector in the order X, Y, Z. */
static trip_vec3 in_data_axes(const trip_cpu_view *view, double u, double v, double sheet)
{
    double p[3];
    p[view->u_axis] = u;
    p[view->v_axis] = v;
    p[view->axis] = sheet;
    return trip_v3(p[0], p[1], p[2]);
}

/* The index space in which a voxel's kernel is round. With even spacing it is the view's index
 * space. */
typedef struct splat_space {
    trip_splat_frame frame;
    trip_vec3 centre, width;
    double
        ray; /* factor of the length of the ray through the voxel, against the view's index space */
} splat_space;

static splat_space space_of(const trip_cpu_view *view, trip_vec3 voxel)
{
    const trip_coordinates *c = &view->of->data->coordinates;
    const trip_camera *camera = &view->splat.camera;
    splat_space s = { .width = { 1, 1, 1 }, .ray = 1 };
    double growth;
    s.centre = trip_splat_position(&view->splat, c, voxel, &s.frame, &growth);
    if (!view->coordinates)
        return s;
    s.width = trip_coordinates_widths(c, voxel);
    trip_vec3 ray =
        camera->ortho ? camera->r0 : trip_sub(trip_coordinates_point(c, voxel), camera->eye);
    double length = trip_length(ray);
    s.ray = length > 0 ? trip_length(trip_vec3_over(ray, s.width)) / length : 1;
    return s;
}

/* Divides the forms of a near, summed splat, so that they take rays in the view's index space. `by`
 * is the ray's factor at the centre of the splat; all rays of the splat use this factor. */
static void divide_forms(trip_splat *s, double by)
{
    for (int i = 0; i < 3; i++) {
        s->a[i] /= by;
        s->b[i] /= by;
        s->along[i] /= by;
    }
}

/* Returns |c|^2 / sigma^2 of a near splat. If the whole splat lies in front of the eye, `along`
 * serves only for the length of the ray. The low-pass filter has scaled a and b down, on average by
 * sqrt(wider); `along` and the result are scaled to match. */
static double set_own_rays(const splat_space *space, trip_splat *s)
{
    const trip_vec3 away = trip_sub(space->centre, space->frame.camera.eye);
    const double away2 = trip_dot(away, away) / (space->frame.sigma * space->frame.sigma);
    const double wider = space->frame.amplitude / s->amplitude;
    if (!s->near || !(away2 > 4 * space->frame.cutoff2))
        return away2;
    for (int i = 0; i < 3; i++)
        s->along[i] /= sqrt(wider);
    return away2 / wider;
}

bool trip_cpu_project_scalar(const trip_cpu_view *view, int u, int v, int sheet, double extinction,
                             const float flat[4], trip_cpu_splat *out, bool *broken)
{
    const trip_camera *camera = &view->splat.camera;
    const splat_space space = space_of(view, in_data_axes(view, u, v, sheet));
    trip_flattening flattening = { 0 };
    if (flat)
        flattening = (trip_flattening){
            trip_normalize(trip_vec3_times(
                in_data_axes(view, (double)flat[0], (double)flat[1], (double)flat[2]),
                space.width)),
            (double)flat[3]
        };
    trip_splat s;
    memset(out, 0, sizeof *out);
    const bool own = trip_cpu_own_rays(view);
    bool drawn = own && !view->affine
                     ? trip_splat_project_near(&space.frame, space.centre, &s)
                     : trip_splat_project_flat(&space.frame, space.centre, &flattening, &s);
    if (s.near && !camera->ortho && !own)
        divide_forms(&s, space.ray);
    const double away2 = own ? set_own_rays(&space, &s) : 0;
    if (trip_splat_is_broken(&s))
        *broken = true;
    if (!drawn || !pixels(s.x0, s.x1, camera->width, &out->x0, &out->x1) ||
        !pixels(s.y0, s.y1, camera->height, &out->y0, &out->y1))
        return false;
    /* Keeps the depth within the exponents of floats. A splat at the limit is opaque. */
    double stretch = s.affine ? 1 : view->stretch / (own ? 1 : space.ray);
    double depth = fmin(0x1p90, extinction * s.amplitude * stretch);
    out->panes = trip_cpu_panes(out, view->panes_across);
    if (s.near) {
        out->panes |= TRIP_CPU_PANES_NEAR;
        for (int i = 0; i < 3; i++)
            out->c[TRIP_CPU_ALONG + i] = (float)s.along[i];
    }
    if (s.near && !camera->ortho)
        set_near(&s, out);
    else
        set_centre(&s, out);
    set_opacity(view, depth, sheet, out);
    if (s.near && own)
        out->c[TRIP_CPU_AWAY2] = (float)away2;
    return depth > 0x1p-60;
}
