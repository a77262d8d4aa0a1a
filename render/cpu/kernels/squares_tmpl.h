/* Finds the squares of a region of voxels that may be visible, V at a time. Included by
 * table_tmpl.h after project_tmpl.h. */
#ifndef TRIP_CPU_SQUARES_H
#define TRIP_CPU_SQUARES_H

#include "cpu/kernels/terminated_tmpl.h"
#include "cpu/occlusion.h"
#include "cpu/kernels/project_tmpl.h"

/* Computes the first and last pixel with a centre within `reach` of x. There is none if first >
 * last. */
INLINE void reached(vf x, vf reach, int size, vi *first, vi *last)
{
    const vf zero = v_set(0), edge = v_set((float)size), half = v_set(0.5f);
    *first = v_truncate(v_min(v_max(x - reach + half, zero), edge));
    *last = v_truncate(v_min(v_max(x + reach + half, zero), edge)) - 1;
}

/* Returns the distance along an axis from the region's middle to the middles of squares. `shifted`
 * holds their Morton numbers, shifted so that the axis has the even bits. */
INLINE vf middles(vi shifted)
{
    vi square = (shifted & 1) | (shifted >> 1 & 2) | (shifted >> 2 & 4);
    return v_fma(v_from_int(square), v_set(TRIP_CPU_SQUARE),
                 v_set(-0.5f * (TRIP_CPU_REGION - TRIP_CPU_SQUARE)));
}

INLINE vf place_on(const trip_cpu_line *line, vf u, vf v, vf inverse)
{
    vf from = v_fma(v_set((float)line->by[0]), u, v_set((float)line->by[1]) * v);
    return v_fma(from, inverse, v_set((float)line->middle));
}

static uint64_t squares(const trip_cpu_view *view, const trip_cpu_region *region,
                        const _Atomic uint64_t *open, trip_cpu_lanes *lanes)
{
    const trip_camera *camera = &view->splat.camera;
    uint64_t visible = 0;
    vi lane;
    for (int i = 0; i < V; i++)
        lane[i] = i;
    for (uint32_t i = 0; i < TRIP_CPU_REGION_SQUARES; i += V) {
        vi number = vi_set((int32_t)i) + lane;
        vf u = middles(number), v = middles(number >> 1);
        vf z = v_fma(v_set((float)region->z_by[0]), u,
                     v_fma(v_set((float)region->z_by[1]), v, v_set((float)region->z)));
        vf inverse = v_set(1) / z;
        vi x0, x1, y0, y1;
        reached(place_on(&region->x, u, v, inverse), v_set((float)region->x.reach), camera->width,
                &x0, &x1);
        reached(place_on(&region->y, u, v, inverse), v_set((float)region->y.reach), camera->height,
                &y0, &y1);
        vi_store(lanes->first + i, x0 | y0 << 16);
        vi_store(lanes->last + i, x1 | y1 << 16);
        vi_store(lanes->panes + i, panes_of(x0, y0, x1, y1, view->panes_across));
        unsigned any = vm_bits(vm_and(less_or_equal(x0, x1), less_or_equal(y0, y1)));
        if (any)
            any &= over_open_texels(lanes, i, open, view->panes_across);
        visible |= (uint64_t)any << i;
    }
    return visible;
}

#endif
