#include "gaussians_reference.h"

#include "gaussian_footprint.h"
#include "pixels.h"
#include "renderer.h"

typedef struct pixel {
    double rgb[3], transmittance, depth; /* depth: sum of T alpha z */
    bool done;
} pixel;

struct trip_gaussians_reference {
    trip_camera camera;
    trip_gaussian_settings settings;
    trip_budget *budget;
    pixel *pixels;
    size_t count;
};

int trip_gaussians_reference_begin(trip_gaussians_reference **out, const trip_camera *camera,
                                   const trip_gaussian_settings *settings, trip_budget *budget)
{
    const size_t count = (size_t)camera->width * (size_t)camera->height;
    trip_gaussians_reference *r = *out = trip_budget_take(budget, sizeof *r);
    pixel *pixels = r ? trip_budget_take(budget, count * sizeof *pixels) : NULL;
    if (!pixels) {
        trip_budget_release(budget, r, sizeof *r);
        *out = NULL;
        return trip_fail(TRIP_ERROR, "render", "memory",
                         "a picture of %d x %d px does not fit; raise --memory or draw a smaller "
                         "picture",
                         camera->width, camera->height);
    }
    *r = (trip_gaussians_reference){ *camera, *settings, budget, pixels, count };
    for (size_t i = 0; i < count; i++)
        pixels[i].transmittance = 1;
    return 0;
}

void trip_gaussians_reference_end(trip_gaussians_reference *r)
{
    if (!r)
        return;
    trip_budget *budget = r->budget;
    trip_budget_release(budget, r->pixels, r->count * sizeof *r->pixels);
    trip_budget_release(budget, r, sizeof *r);
}

static void composite(const trip_gaussians_reference *r, pixel *p, double alpha,
                      const double rgb[3], double z)
{
    const double after = p->transmittance * (1 - alpha);
    p->done = after < trip_gaussian_termination(&r->settings);
    if (p->done)
        return;
    for (int c = 0; c < 3; c++)
        p->rgb[c] += p->transmittance * alpha * rgb[c];
    p->depth += p->transmittance * alpha * z;
    p->transmittance = after;
}

static void draw(trip_gaussians_reference *r, const trip_gaussian *g)
{
    const trip_camera *c = &r->camera;
    trip_gaussian_footprint f;
    if (!trip_gaussian_footprint_of(c, &r->settings, g, &f))
        return;
    double rgb[3];
    trip_gaussian_colour(g, r->settings.degree, trip_gaussian_direction(c, g), rgb);
    const trip_pixels columns = trip_pixels_within(f.lo[0], f.hi[0], c->width);
    const trip_pixels rows = trip_pixels_within(f.lo[1], f.hi[1], c->height);
    for (int y = rows.first; y <= rows.last; y++)
        for (int x = columns.first; x <= columns.last; x++) {
            pixel *p = &r->pixels[(size_t)y * (size_t)c->width + (size_t)x];
            const double q = trip_gaussian_radius2(&f, x + 0.5 - f.x, y + 0.5 - f.y);
            const double alpha = fmin(TRIP_GAUSSIAN_ALPHA_MAX, f.opacity * exp(-0.5 * q));
            if (!p->done && alpha >= TRIP_GAUSSIAN_ALPHA_MIN)
                composite(r, p, alpha, rgb, f.z);
        }
}

int trip_gaussians_reference_add(trip_gaussians_reference *r, const trip_gaussian *gaussians,
                                 size_t count)
{
    int status = 0;
    for (size_t i = 0; i < count && !status; i++) {
        draw(r, &gaussians[i]);
        if (i % 64 == 63)
            status = trip_frame_poll();
    }
    return status;
}

void trip_gaussians_reference_picture(const trip_gaussians_reference *r, float *rgba, float *depth)
{
    const trip_camera *c = &r->camera;
    const double *behind = r->settings.background;
    for (size_t i = 0; i < r->count; i++) {
        const pixel *p = &r->pixels[i];
        const double rest = p->transmittance * behind[3], opacity = 1 - p->transmittance;
        for (int k = 0; k < 3; k++)
            rgba[4 * i + (size_t)k] = (float)(p->rgb[k] + rest * behind[k]);
        rgba[4 * i + 3] = (float)(opacity + rest);
        if (depth) {
            const double x = (double)(i % (size_t)c->width) + 0.5;
            const double y = (double)(i / (size_t)c->width) + 0.5;
            depth[i] = (float)(opacity > 0 ? p->depth / opacity * trip_camera_ray_length(c, x, y)
                                           : INFINITY);
        }
    }
}
