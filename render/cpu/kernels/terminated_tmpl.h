/* Finds projected splats that lie over terminated texels (trip_cpu_mask) only, V at a time.
 * Included by project_tmpl.h. The renderer can leave out these splats, because terminated pixels
 * never change. Texels may become terminated at the same time, but never open again. */
#ifndef TRIP_CPU_TERMINATED_H
#define TRIP_CPU_TERMINATED_H

#include "cpu/kernels/kernels.h"
#include "cpu/kernels/simd_tmpl.h"

/* The texels of four panes, two by two, that each lane's support may touch. */
typedef struct texels {
    vi pane;    /* the first pane; lanes without pixels may hold any pane, or one past the last */
    vi columns; /* bit mask: eight columns of the first pane, eight of the pane to its right */
    vi top, bottom;       /* rows, counted from the top of the first pane */
    vi any_right, across; /* 1 or 0: the support reaches the pane to the right; panes_across or 0:
                             the pane below */
} texels;

INLINE texels texels_of_lanes(const trip_cpu_lanes *lanes, uint32_t at, int panes_across)
{
    vi first = vi_load(lanes->first + at), last = vi_load(lanes->last + at);
    vi panes = vi_load(lanes->panes + at);
    vi x0 = first & 0xffff, y0 = v_shift_right(first, 16);
    vi x1 = last & 0xffff, y1 = v_shift_right(last, 16);
    static_assert(TRIP_CPU_PANE == 32, "eight texels of four pixels, in the shifts below");
    vi left = x0 >> 2 & 7, right = ((x1 >> 2) - (x0 >> 5) * 8) & 15;
    panes &= (vi)(x0 <= x1) & (vi)(y0 <= y1);
    return (texels){
        .pane = panes & TRIP_CPU_PANES_FIRST,
        .columns = (vi_set(0xffff) << left) & (vi_set(0xffff) >> (15 - right)),
        .top = y0 >> 2 & 7,
        .bottom = ((y1 >> 2) - (y0 >> 5) * 8) & 15,
        .any_right = v_shift_right(panes, TRIP_CPU_PANES_RIGHT_SHIFT) & 1,
        .across = -(v_shift_right(panes, TRIP_CPU_PANES_BELOW_SHIFT) & 1) & panes_across,
    };
}

/* Returns the bits of rows `top` to min(`bottom`, 7) in the word of the first pane. */
INLINE vw rows_of_first(vw top, vw bottom)
{
    vw last = (bottom & 7) | -(bottom >> 3) >> 61; /* at most 7 */
    return vw_set(UINT64_MAX) << 8 * top & vw_set(UINT64_MAX) >> (56 - 8 * last);
}

/* Returns the bits of rows 8 to `bottom` in the word of the pane below; 0 if `bottom` is at most 7.
 */
INLINE vw rows_of_below(vw bottom)
{
    /* Half of the bits at a time, because a shift by 64 is undefined. */
    vw half = 4 * ((bottom & 7) + 1) & -(bottom >> 3);
    return ~(vw_set(UINT64_MAX) << half << half);
}

/* Returns the lanes, a bit each, with an open texel in one of the four panes. */
INLINE unsigned open_in(const _Atomic uint64_t *open, vi pane, vi columns, vw rows_low,
                        vw rows_high)
{
    vi bytes = (vi)((vu)(columns & 0xff) * 0x01010101u);
    vw low = vw_low(bytes), high = vw_high(bytes);
    low = (low | low << 32) & rows_low & vw_gather(open, vw_low(pane));
    high = (high | high << 32) & rows_high & vw_gather(open, vw_high(pane));
    return vw_not_0(low) | vw_not_0(high) << V / 2;
}

/* Returns the lanes, a bit each, that may touch an open texel. `open` holds one word per pane, as
 * in trip_cpu_mask. The bits of lanes without pixels are undefined. */
INLINE unsigned over_open_texels(const trip_cpu_lanes *lanes, uint32_t at,
                                 const _Atomic uint64_t *open, int panes_across)
{
    texels b = texels_of_lanes(lanes, at, panes_across);
    vw bottom_low = vw_low(b.bottom), bottom_high = vw_high(b.bottom);
    vw low = rows_of_first(vw_low(b.top), bottom_low);
    vw high = rows_of_first(vw_high(b.top), bottom_high);
    unsigned seen = open_in(open, b.pane, b.columns, low, high);
    vi beyond = v_shift_right(vi_load(lanes->panes + at), TRIP_CPU_PANES_RIGHT_SHIFT);
    if (!vm_any(v_gt(v_from_int(beyond), v_set(0))))
        return seen;
    static_assert(TRIP_CPU_PANES_MORE >> TRIP_CPU_PANES_RIGHT_SHIFT == 4, "more than both");
    seen |= vm_bits(v_gt(v_from_int(beyond), v_set(3)));
    seen |= open_in(open, b.pane + b.any_right, v_shift_right(b.columns, 8), low, high);
    low = rows_of_below(bottom_low);
    high = rows_of_below(bottom_high);
    seen |= open_in(open, b.pane + b.across, b.columns, low, high);
    return seen |
           open_in(open, b.pane + b.across + b.any_right, v_shift_right(b.columns, 8), low, high);
}

#endif
