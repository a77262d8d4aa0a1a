/* Which projected splats lie over saturated texels alone (trip_cpu_mask), V at a time: included by
 * project_tmpl.h. Saturated pixels never change, so that those splats can be left out; texels may
 * become saturated meanwhile, and never open again. */
#ifndef TRIP_CPU_SATURATED_H
#define TRIP_CPU_SATURATED_H

#include "cpu/kernels/kernels.h"
#include "cpu/kernels/simd_tmpl.h"

/* The texels of four panes, two by two, that each lane's support may touch. */
typedef struct texels {
    vi pane;              /* the first; in lanes without pixels any, or that beyond the last */
    vi columns;           /* bits: eight of the first pane, eight of the one to the right */
    vi top, bottom;       /* rows, counted from the first pane's */
    vi any_right, across; /* 1 and a row of panes where the support goes there, else 0 */
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

/* Rows of a pane's words: of the first pane from `top` to `bottom`, of the one below from its first
 * to `bottom`. */
INLINE vw rows_of_first(vw top, vw bottom)
{
    vw last = (bottom & 7) | -(bottom >> 3) >> 61; /* at most 7 */
    return vw_set(UINT64_MAX) << 8 * top & vw_set(UINT64_MAX) >> (56 - 8 * last);
}

INLINE vw rows_of_below(vw bottom)
{
    vw half = 4 * ((bottom & 7) + 1) & -(bottom >> 3); /* bits, halved: all 64 are too many */
    return ~(vw_set(UINT64_MAX) << half << half);
}

/* The lanes, a bit each, with an open texel among those of one of the four panes. */
INLINE unsigned open_in(const _Atomic uint64_t *open, vi pane, vi columns, vw rows_low,
                        vw rows_high)
{
    vi bytes = (vi)((vu)(columns & 0xff) * 0x01010101u);
    vw low = vw_low(bytes), high = vw_high(bytes);
    low = (low | low << 32) & rows_low & vw_gather(open, vw_low(pane));
    high = (high | high << 32) & rows_high & vw_gather(open, vw_high(pane));
    return vw_not_0(low) | vw_not_0(high) << V / 2;
}

/* The lanes, a bit each, that may touch an open texel; `open` is a word a pane, as in
 * trip_cpu_mask. Those without pixels give any bit. */
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
