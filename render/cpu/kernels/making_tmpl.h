/* Makes squares of sheets and sample planes when rays first meet them (trip_cpu_making). Included
 * by sheet_tmpl.h. One thread makes each square; other threads that need it wait.
 *
 * Deadlock is impossible: sample planes wait for sheets only, and a square of a sheet waits only
 * for squares to its right and below. */
#ifndef TRIP_CPU_MAKING_H
#define TRIP_CPU_MAKING_H

#include <sched.h>
#include <stdatomic.h>
#include <string.h>

#include "cpu/kernels/kernel_sheets.h"
#include "cpu/kernels/sample_tmpl.h"

static void make_gradients(const trip_cpu_group *g, const trip_cpu_making *m, size_t at,
                           uint64_t squares);

/* Returns a raster of the pool. If `rasters` is NULL, it is the raster in which every voxel is
 * missing. */
INLINE trip_cpu_voxels *raster_of(const trip_cpu_group *g, const int32_t *rasters, size_t at)
{
    return g->pool + (rasters ? rasters[at] : 0);
}

/* Copies gradients from neighbouring rasters into the extra column and row of a raster:
 * - for squares at the right edge, the first column of the raster to the right;
 * - for squares at the lower edge, the first row of the raster below;
 * - for the last square, the first voxel of the raster below and to the right. */
static void repeat_gradients(const trip_cpu_group *g, const trip_cpu_making *m, size_t at,
                             uint64_t squares)
{
    enum { ACROSS = TRIP_CPU_SQUARES_ACROSS, SIDE = TRIP_CPU_RASTER };
    const uint64_t right = (squares & TRIP_CPU_COLUMN_7) >> (ACROSS - 1);
    const uint64_t below = squares >> ACROSS * (ACROSS - 1);
    const size_t down = (size_t)g->across;
    trip_cpu_gradient *to = raster_of(g, m->rasters, at)->gradients;
    if (right && m->rasters[at + 1]) {
        const trip_cpu_gradient *from = raster_of(g, m->rasters, at + 1)->gradients;
        make_gradients(g, m, at + 1, right);
        for (uint64_t rest = right; rest; rest &= rest - 1) {
            const int first = __builtin_ctzll(rest) / ACROSS * 8;
            for (int v = first; v < first + 8; v++)
                to[v * TRIP_CPU_RASTER_STRIDE + SIDE] = from[v * TRIP_CPU_RASTER_STRIDE];
        }
    }
    to += SIDE * TRIP_CPU_RASTER_STRIDE;
    if (below && m->rasters[at + down]) {
        const trip_cpu_gradient *from = raster_of(g, m->rasters, at + down)->gradients;
        make_gradients(g, m, at + down, below);
        for (int u = 0; u < SIDE; u += 8)
            if (below >> u / 8 & 1)
                memcpy(to + u, from + u, 8 * sizeof *to);
    }
    if (squares >> (ACROSS * ACROSS - 1) && m->rasters[at + down + 1]) {
        make_gradients(g, m, at + down + 1, 1);
        to[SIDE] = raster_of(g, m->rasters, at + down + 1)->gradients[0];
    }
}

/* Fetches the memory of the squares' gradients before they are computed. */
INLINE void prefetch_gradients(trip_cpu_voxels *raster, uint64_t squares)
{
    for (uint64_t rest = squares; rest; rest &= rest - 1) {
        const trip_cpu_gradient *at = raster->gradients + square_first(__builtin_ctzll(rest));
        for (int row = 0; row < 8; row++, at += TRIP_CPU_RASTER_STRIDE) {
            __builtin_prefetch(at, 1);
            __builtin_prefetch(at + 7, 1);
        }
    }
}

/* Makes the gradients of squares of a raster. The calling thread has claimed them in `begun`. */
static void make_own_gradients(const trip_cpu_group *g, const trip_cpu_making *m, size_t at,
                               uint64_t squares)
{
    trip_cpu_voxels *raster = raster_of(g, m->rasters, at);
    prefetch_gradients(raster, squares);
    if (!m->from) {
        (TRIP_CPU_NEAREST ? sheet_outlines : sheet_gradients)(
            raster, squares, raster_of(g, m->rasters, at - 1),
            raster_of(g, m->rasters, at - (size_t)g->across), raster_of(g, m->before, at),
            raster_of(g, m->behind, at));
        repeat_gradients(g, m, at, squares);
        return;
    }
    make_gradients(g, m->from, at, squares);
    make_gradients(g, m->to, at, squares);
    sheet_between(raster_of(g, m->from->rasters, at), raster_of(g, m->to->rasters, at), squares,
                  m->weights, TRIP_CPU_PART_GRADIENTS, raster);
}

/* Returns the squares that are not made yet, and claims some of them: *own. */
INLINE uint64_t claim(const trip_cpu_on_demand *d, size_t at, uint64_t squares, uint64_t *own)
{
    const uint64_t to_make = squares & ~atomic_load_explicit(&d->made[at], memory_order_acquire);
    *own = to_make
               ? to_make & ~atomic_fetch_or_explicit(&d->begun[at], to_make, memory_order_relaxed)
               : 0;
    return to_make;
}

/* Announces the squares that the thread has made, and waits for squares of other threads. */
static void finish(const trip_cpu_on_demand *d, size_t at, uint64_t to_make, uint64_t own)
{
    if (own)
        atomic_fetch_or_explicit(&d->made[at], own, memory_order_release);
    while (to_make & ~atomic_load_explicit(&d->made[at], memory_order_acquire))
        sched_yield();
}

static void make_gradients(const trip_cpu_group *g, const trip_cpu_making *m, size_t at,
                           uint64_t squares)
{
    uint64_t own;
    const uint64_t to_make = claim(&m->gradients, at, squares, &own);
    if (!to_make)
        return;
    if (own)
        make_own_gradients(g, m, at, own);
    finish(&m->gradients, at, to_make, own);
}

static void make_between(const trip_cpu_group *g, const trip_cpu_making *m, size_t at,
                         uint64_t squares, unsigned parts)
{
    if (!squares)
        return;
    sheet_between(raster_of(g, m->from->rasters, at), raster_of(g, m->to->rasters, at), squares,
                  m->weights, parts, raster_of(g, m->rasters, at));
    if (TRIP_CPU_BLURRED && parts & TRIP_CPU_PART_CODES)
        sheet_deviations_between(g->deviations[m->from->rasters[at]],
                                 g->deviations[m->to->rasters[at]], squares, m->weights,
                                 g->deviations[m->rasters[at]]);
}

/* Makes the codes of squares of a sample plane, with deviations if the function is blurred. With
 * `gradients` also makes these. */
static void make_plane(const trip_cpu_group *g, const trip_cpu_making *m, bool gradients, size_t at,
                       uint64_t squares)
{
    uint64_t own, lit = 0, to_light = 0;
    const uint64_t to_make = claim(&m->codes, at, squares, &own);
    if (gradients)
        to_light = claim(&m->gradients, at, squares, &lit);
    if (!(to_make | to_light))
        return;
    if (lit) {
        make_gradients(g, m->from, at, lit);
        make_gradients(g, m->to, at, lit);
    }
    make_between(g, m, at, own & lit, TRIP_CPU_PART_CODES | TRIP_CPU_PART_GRADIENTS);
    make_between(g, m, at, own & ~lit, TRIP_CPU_PART_CODES);
    make_between(g, m, at, lit & ~own, TRIP_CPU_PART_GRADIENTS);
    finish(&m->codes, at, to_make, own);
    if (gradients)
        finish(&m->gradients, at, to_light, lit);
}

/* Returns the squares that hold voxels of columns u0 to u1 and rows v0 to v1, inclusive. */
INLINE uint64_t squares_from_to(int32_t u0, int32_t u1, int32_t v0, int32_t v1)
{
    const uint64_t columns = (2u << (u1 >> 3)) - (1u << (u0 >> 3));
    const uint64_t rows = UINT64_MAX << (v0 >> 3) * 8 & UINT64_MAX >> (56 - (v1 >> 3) * 8);
    return columns * TRIP_CPU_COLUMN_0 & rows;
}

/* Returns the squares from which rays of the segments at a sample plane read voxels. */
INLINE uint64_t needed_at(const trip_cpu_group *g, unsigned sample, size_t at)
{
    const uint64_t before = sample > 0 ? g->needed[sample - 1][at] : 0;
    return before | (sample < g->segments ? g->needed[sample][at] : 0);
}

/* Makes squares of a raster at both ends of a segment, or with the nearest value at its sheet. */
INLINE void make_at_ends(const trip_cpu_group *g, bool gradients, unsigned segment, size_t at,
                         uint64_t squares)
{
    if (NEAREST) {
        const trip_cpu_making *m = g->nearest[segment].near;
        if (gradients && m->rasters[at])
            make_gradients(g, m, at, g->leaps ? squares : squares & g->needed[segment][at]);
        return;
    }
    for (unsigned n = segment; n <= segment + 1; n++) {
        const trip_cpu_making *m = g->samples[n].making;
        if (!m->rasters[at])
            continue;
        if (m->from)
            make_plane(g, m, gradients, at, squares & needed_at(g, n, at));
        else if (gradients)
            make_gradients(g, m, at, g->leaps ? squares : squares & needed_at(g, n, at));
    }
}

/* Makes the voxels at both ends of a segment that rays in a box of cells read. The last cells of a
 * raster read its copy of the neighbouring rasters' first voxels. */
static void make_segment(const trip_cpu_group *g, bool gradients, cell_box box, unsigned segment)
{
    const int log2 = TRIP_CPU_RASTER_LOG2, last = TRIP_CPU_RASTER - 1;
    for (int32_t v = box.lo[1]; v <= box.hi[1]; v = (v | last) + 1) {
        const int32_t end_v = lesser_of(v | last, box.hi[1] + 1);
        for (int32_t u = box.lo[0]; u <= box.hi[0]; u = (u | last) + 1) {
            const int32_t end_u = lesser_of(u | last, box.hi[0] + 1);
            const size_t at = (size_t)(v >> log2) * (size_t)g->across + (size_t)(u >> log2);
            make_at_ends(g, gradients, segment, at,
                         squares_from_to(u & last, end_u & last, v & last, end_v & last));
        }
    }
}

/* Makes the gradients at a sample plane that rays in a box of cells read. */
static void make_gradients_of_box(const trip_cpu_group *g, const trip_cpu_making *m, cell_box box)
{
    const int log2 = TRIP_CPU_RASTER_LOG2, last = TRIP_CPU_RASTER - 1;
    for (int32_t v = box.lo[1]; v <= box.hi[1]; v = (v | last) + 1) {
        const int32_t end_v = lesser_of(v | last, box.hi[1] + 1);
        for (int32_t u = box.lo[0]; u <= box.hi[0]; u = (u | last) + 1) {
            const int32_t end_u = lesser_of(u | last, box.hi[0] + 1);
            const size_t at = (size_t)(v >> log2) * (size_t)g->across + (size_t)(u >> log2);
            if (m->rasters[at])
                make_gradients(g, m, at,
                               squares_from_to(u & last, end_u & last, v & last, end_v & last));
        }
    }
}

#endif
