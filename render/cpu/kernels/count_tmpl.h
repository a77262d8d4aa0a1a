/* Counts the splats in view and the splats that meet a pixel. The kernels here use the footprints
 * of project() and the arithmetic of blending and of the weights, so that the counts match the
 * drawing. Included by table_tmpl.h after merge_tmpl.h. */
#ifndef TRIP_CPU_COUNT_TMPL_H
#define TRIP_CPU_COUNT_TMPL_H

#include "cpu/kernels/blend_tmpl.h"
#include "cpu/kernels/kernels.h"
#include "cpu/kernels/merge_tmpl.h"
#include "cpu/kernels/project_tmpl.h"

/* Returns whether a pixel of the stamp lies in the image, in the support of `splat`, and where the
 * view's layer has weight. `splat` is local to the pane (make_local()). */
static bool touches_stamp(trip_cpu_scratch *s, const trip_cpu_splat *splat, unsigned number)
{
    const trip_cpu_view *view = s->view;
    int column = (int)number % STAMPS_ACROSS, row = (int)number / STAMPS_ACROSS;
    if (!(s->rays_known[number / 64] >> number % 64 & 1))
        set_rays(s, number);
    patch p = { .x = stamp_x(number),
                .y = stamp_y(number),
                .ray = v_load(s->rays + 2 * V * number),
                .pane = s };
    vm in = in_image(&view->splat.camera, s->x, s->y, column, row);
    if (is_near(splat)) {
        ray_lengths of = rays_of_near(&p, splat, TRIP_CPU_PERSPECTIVE);
        in = vm_and(in, v_gt(nearness_by(&p, splat, of.g), v_set(0)));
        in = vm_and(in, v_gt(front_of(&p, splat, of.g), v_set(0)));
    } else {
        in = vm_and(in, v_gt(nearness(&p, splat, TRIP_CPU_PERSPECTIVE), v_set(0)));
    }
    return vm_any(in) &&
           vm_any(vm_and(in, v_gt(layer_weight(view, s->x, s->y, column, row), v_set(0))));
}

/* Returns whether touches_stamp() holds for a stamp of the pane at (x, y). */
static bool touches_pane(trip_cpu_scratch *s, const trip_cpu_splat *splat, int x, int y)
{
    const int mask = ~(TRIP_CPU_PANE - 1), last = TRIP_CPU_PANE - 1;
    trip_cpu_splat local;
    int right = splat->x1 - x < last ? splat->x1 - x : last;
    int bottom = splat->y1 - y < last ? splat->y1 - y : last;
    int left = splat->x0 > x ? splat->x0 - x : 0, top = splat->y0 > y ? splat->y0 - y : 0;
    make_local(&local, splat, (int4){ x - (splat->x0 & mask), y - (splat->y0 & mask), 0, 0 });
    if (s->x != x || s->y != y)
        memset(s->rays_known, 0, sizeof s->rays_known);
    s->x = x;
    s->y = y;
    for (int row = top / STAMP_ROWS; row <= bottom / STAMP_ROWS; row++)
        for (int column = left / 4; column <= right / 4; column++)
            if (touches_stamp(s, &local, (unsigned)(row * STAMPS_ACROSS + column)))
                return true;
    return false;
}

static bool is_drawn(trip_cpu_scratch *s, const trip_cpu_splat *splat)
{
    const int mask = ~(TRIP_CPU_PANE - 1);
    for (int y = splat->y0 & mask; y <= splat->y1; y += TRIP_CPU_PANE)
        for (int x = splat->x0 & mask; x <= splat->x1; x += TRIP_CPU_PANE)
            if (touches_pane(s, splat, x, y))
                return true;
    return false;
}

static uint32_t drawn(const trip_cpu_view *view, trip_cpu_scratch *s, const trip_cpu_splat *splats,
                      uint32_t count)
{
    uint32_t n = 0;
    s->view = view;
    memset(s->rays_known, 0, sizeof s->rays_known);
    for (uint32_t i = 0; i < count; i++)
        n += is_drawn(s, &splats[i]);
    return n;
}

/* Returns the square of trip_splat.radius / (radius of the kernel). With u as in footprint_of(),
 * the largest eigenvalue of S^-1 is u times the largest eigenvalue of u S, divided by |u S|. */
INLINE vf growth2(const perspective *p, const trip_splat_frame *f, const trip_cpu_lanes *lanes,
                  uint32_t at)
{
    vf x = ((v_load(lanes->whole_x + at) - p->middle_x) + v_load(lanes->x + at)) * p->step;
    vf y = ((v_load(lanes->whole_y + at) - p->middle_y) + v_load(lanes->y + at)) * p->step;
    vf rx = v_fma(x, p->XX, v_fma(y, p->XY, p->rX)), ry = v_fma(x, p->XY, v_fma(y, p->YY, p->rY));
    vf rr = v_fma(x, p->rX + rx, v_fma(y, p->rY + ry, p->rr));
    vf u = p->inverse_sigma * v_load(lanes->z + at), half = v_set(0.5f);
    vf sxx = v_fnma(ry, ry, rr * p->YY), syy = v_fnma(rx, rx, rr * p->XX);
    vf sxy = v_fnma(rr, p->XY, rx * ry), apart = half * (sxx - syy);
    vf largest = v_fma(half, sxx + syy, v_sqrt(v_fma(apart, apart, sxy * sxy)));
    return v_fma(v_set((float)f->low_pass2) * u * u, largest / (p->det * rr), v_set(1));
}

/* Evaluates trip_weight_may_reach() for V voxels. */
INLINE vm may_reach(const trip_cpu_view *view, const trip_cpu_reach *reach, const perspective *p,
                    const trip_cpu_staged *staged, const trip_cpu_lanes *lanes, uint32_t at)
{
    const double room = view->affine ? TRIP_SPLAT_AFFINE_REACH : 1;
    const float kernel = (float)(room * view->splat.sigma * sqrt(view->splat.cutoff2));
    vf u = v_abs(offset(widen_int(vi_load(staged->u + at)), view->eye[0])) * v_set(reach->scale[0]);
    vf v = v_abs(offset(widen_int(vi_load(staged->v + at)), view->eye[1])) * v_set(reach->scale[1]);
    vf s = v_abs(offset(widen_int(vi_load(staged->sheet + at)), view->eye[2])) *
           v_set(reach->scale[2]);
    vf radius = v_sqrt(growth2(p, &view->splat, lanes, at)) * v_set(kernel * reach->across);
    vf bound = v_fnma(v_set(reach->h), v_max(s, v_max(u, v)), s) + radius;
    return reach->inclusive ? v_ge(bound, v_set(0)) : v_gt(bound, v_set(0));
}

static void reaching(const trip_cpu_view *view, const trip_cpu_reach *reach,
                     const trip_cpu_staged *staged, uint32_t count, trip_cpu_lanes *lanes)
{
    perspective persp = perspective_of(view);
    for (uint32_t i = 0; i < count; i += V) {
        position(view, staged, i, lanes);
        vm precise = view->splat.camera.ortho ? v_ge(v_load(lanes->z + i), v_set(view->near))
                                              : footprint_of(&persp, view, lanes, NULL, i).precise;
        unsigned front = vm_bits(vm_first(count - i)) &
                         ~vm_bits(v_ge(v_set(view->behind), v_load(lanes->z + i)));
        unsigned by_lanes = view->coordinates ? 0 : vm_bits(precise);
        lanes->kept[i / V] = front & by_lanes;
        lanes->scalar[i / V] = front & ~by_lanes;
        if (reach->bounded)
            lanes->kept[i / V] &= vm_bits(may_reach(view, reach, &persp, staged, lanes, i));
    }
}

#endif
