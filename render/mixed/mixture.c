#include "mixture.h"

#include <math.h>
#include <stdlib.h>

/* Alpha up to which a slab counts as transparent: its optical depth then equals its alpha. */
#define THIN 1e-6
/* The greatest alpha of a slab; its optical depth is finite. */
#define OPAQUE (1 - 0x1p-24)

/* ---- slabs ---- */

trip_depth_range trip_mixture_depths(const trip_camera *camera, const double lo[3],
                                     const double hi[3])
{
    trip_depth_range r = { INFINITY, -INFINITY };
    for (int i = 0; i < 8; i++) {
        const trip_vec3 corner =
            trip_v3(i & 1 ? hi[0] : lo[0], i & 2 ? hi[1] : lo[1], i & 4 ? hi[2] : lo[2]);
        const double z = trip_dot(camera->forward, trip_sub(corner, camera->eye));
        r.lo = fmin(r.lo, z);
        r.hi = fmax(r.hi, z);
    }
    r.lo = fmax(r.lo, 0);
    return r;
}

bool trip_mixture_meet(trip_depth_range a, trip_depth_range b)
{
    return fmax(a.lo, b.lo) < fmin(a.hi, b.hi);
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* Returns whether a volume and another object are both in the range. */
static bool is_shared(const trip_depth_range *volumes, unsigned count, trip_depth_range centres,
                      trip_depth_range in)
{
    unsigned there = 0;
    for (unsigned i = 0; i < count; i++)
        there += trip_mixture_meet(volumes[i], in);
    return there > 1 || (there && trip_mixture_meet(centres, in));
}

unsigned trip_mixture_cut(const trip_depth_range *volumes, unsigned count, trip_depth_range centres,
                          double cuts[TRIP_MIXTURE_CUTS_MAX])
{
    double ends[2 * (TRIP_MIXTURE_VOLUMES_MAX + 1)], shared = 0;
    unsigned ended = 0, cut = 0;
    trip_depth_range all = { INFINITY, -INFINITY };
    for (unsigned i = 0; i < count; i++)
        if (volumes[i].lo < volumes[i].hi) {
            ends[ended++] = volumes[i].lo;
            ends[ended++] = volumes[i].hi;
            all = (trip_depth_range){ fmin(all.lo, volumes[i].lo), fmax(all.hi, volumes[i].hi) };
        }
    if (!ended)
        return 0;
    if (centres.lo > all.lo && centres.lo < all.hi)
        ends[ended++] = centres.lo;
    if (centres.hi > all.lo && centres.hi < all.hi)
        ends[ended++] = centres.hi;
    qsort(ends, ended, sizeof *ends, ascending);
    for (unsigned i = 0; i + 1 < ended; i++) {
        const trip_depth_range in = { ends[i], ends[i + 1] };
        if (is_shared(volumes, count, centres, in))
            shared += in.hi - in.lo;
    }
    cuts[cut++] = ends[0];
    for (unsigned i = 0; i + 1 < ended; i++) {
        const trip_depth_range in = { ends[i], ends[i + 1] };
        if (!(in.lo < in.hi))
            continue;
        const double parts = is_shared(volumes, count, centres, in)
                                 ? ceil(TRIP_MIXTURE_SLABS * (in.hi - in.lo) / shared - 1e-9)
                                 : 1;
        for (int k = 1; k < (int)parts; k++)
            cuts[cut++] = in.lo + (in.hi - in.lo) * k / parts;
        cuts[cut++] = in.hi;
    }
    return cut;
}

/* ---- pixels ---- */

void trip_mixture_begin(trip_mixture_pixel *pixels, size_t count)
{
    for (size_t i = 0; i < count; i++)
        pixels[i] = (trip_mixture_pixel){ .transmittance = 1 };
}

void trip_mixture_add(trip_mixture_pixel *pixels, const float *rgba, size_t count)
{
    for (size_t i = 0; i < count; i++, rgba += 4) {
        const double alpha = fmin(OPAQUE, fmax(0, (double)rgba[3]));
        const double tau = -log1p(-alpha), factor = alpha > THIN ? tau / alpha : 1;
        for (int c = 0; c < 3; c++)
            pixels[i].light[c] += (float)(factor * (double)rgba[c]);
        pixels[i].tau += (float)tau;
    }
}

/* Composites a share of the slab's matter, behind the Gaussians with this transmittance. */
static void advance(trip_mixture_pixel *p, double share, double gaussians)
{
    const double tau = share * (double)p->tau, alpha = -expm1(-tau);
    const double seen =
        (double)p->transmittance * gaussians * share * (tau > THIN ? alpha / tau : 1);
    for (int c = 0; c < 3; c++)
        p->rgb[c] += (float)(seen * (double)p->light[c]);
    p->transmittance *= (float)(1 - alpha);
}

/* Returns the share of the slab in front of the Gaussians that `now` adds. Adds these. */
static double place(trip_mixture_pixel *p, const float now[4], double depth, trip_depth_range slab)
{
    const double sum = now[3] > 0 ? (double)now[3] * depth : 0;
    const double alpha = (double)(now[3] - p->before[3]), z = (sum - (double)p->depth) / alpha;
    p->depth = (float)sum;
    return alpha > 0 && isfinite(slab.hi) ? fmin(1, fmax(0, (z - slab.lo) / (slab.hi - slab.lo)))
                                          : 1;
}

void trip_mixture_end_slab(trip_mixture_pixel *pixels, const trip_camera *camera,
                           trip_depth_range slab, const float *gaussians, const float *distances)
{
    trip_mixture_pixel *p = pixels;
    for (int y = 0; y < camera->height; y++)
        for (int x = 0; x < camera->width; x++, p++) {
            const size_t at = (size_t)(p - pixels);
            const double before = 1 - (double)p->before[3];
            double share = 1;
            if (gaussians && gaussians[4 * at + 3] > p->before[3])
                share = place(
                    p, gaussians + 4 * at,
                    (double)distances[at] / trip_camera_ray_length(camera, x + 0.5, y + 0.5), slab);
            advance(p, share, before);
            if (gaussians)
                for (int c = 0; c < 4; c++) {
                    if (c < 3)
                        p->rgb[c] +=
                            p->transmittance * (gaussians[4 * at + (size_t)c] - p->before[c]);
                    p->before[c] = gaussians[4 * at + (size_t)c];
                }
            if (share < 1)
                advance(p, 1 - share, 1 - (double)p->before[3]);
            for (int c = 0; c < 3; c++)
                p->light[c] = 0;
            p->tau = 0;
        }
}

void trip_mixture_picture(const trip_mixture_pixel *pixels, size_t count, float *rgba)
{
    for (size_t i = 0; i < count; i++, rgba += 4) {
        for (int c = 0; c < 3; c++)
            rgba[c] = pixels[i].rgb[c];
        rgba[3] = 1 - pixels[i].transmittance * (1 - pixels[i].before[3]);
    }
}
