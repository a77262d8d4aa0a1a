/* Which splats meet a pixel: by the numbers that project() gave them and the arithmetic that blends
 * and weighs, so that what is counted is what the kernels do. Included by table_tmpl.h after
 * merge_tmpl.h. */
#ifndef TRIP_CPU_COUNT_TMPL_H
#define TRIP_CPU_COUNT_TMPL_H

#include "cpu/kernels/blend_tmpl.h"
#include "cpu/kernels/kernels.h"
#include "cpu/kernels/merge_tmpl.h"

/* Whether some pixel of a stamp of the pane at hand lies in the image, in the support of `splat`,
 * which is local to the pane, and where the list has weight. */
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
    vm in = vm_and(v_gt(nearness(&p, splat, TRIP_CPU_PERSPECTIVE), v_set(0)),
                   in_image(&view->splat.camera, s->x, s->y, column, row));
    if (splat->panes & TRIP_CPU_PANES_NEAR)
        in = vm_and(in, v_gt(front_of(&p, splat, TRIP_CPU_PERSPECTIVE), v_set(0)));
    return vm_any(in) &&
           vm_any(vm_and(in, v_gt(weight(view, view->axis, s->x, s->y, column, row), v_set(0))));
}

/* Whether some pixel of the pane at (x, y) does. */
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

#endif
