/* Follows rays through the boxes of voxels (sheet.h, `Nearest value`). Included by sheet_tmpl.h. A
 * segment lies in the boxes of one sheet. It is divided where a ray leaves a box along u or v. */
#ifndef TRIP_CPU_NEAREST_H
#define TRIP_CPU_NEAREST_H

/* The walk of the rays through a segment. Positions are relative to pane_path.base of the segment's
 * first sample plane. With uneven spacing `from` and `way` are positions of trip_coordinates. */
typedef struct box_walk {
    vf from[2], way[2]; /* at the first sample plane, and from there to the second */
    vf inverse[2];      /* 1 / way, or 0 */
    vf box[2], step[2]; /* the voxels of the current boxes; 1 or -1 in the direction of the ray */
    remnant part;       /* the rest of the segment */
} box_walk;

/* Returns the voxels nearest to positions along u (a = 0) or v. With uneven spacing the voxels are
 * counted from the grid's first. */
INLINE vf voxels_near(const pane_path *path, unsigned n, int a, vf at)
{
    if (!is_uneven(path))
        return v_from_int(v_floor_within(at + v_set(0.5f)));
    int32_t near = 0;
    for (int i = 0; i < V; i++) {
        const double position = path->base[a][n] + (double)at[i];
        at[i] = (float)floor(index_near(path, a, position, &near) + path->corner[a] + 0.5);
    }
    return at;
}

/* Returns the positions of the faces where the rays leave their boxes. */
INLINE vf faces_of(const pane_path *path, unsigned n, int a, const box_walk *w)
{
    if (!is_uneven(path))
        return v_fma(v_set(0.5f), w->step[a], w->box[a]);
    vf faces = w->box[a];
    for (int i = 0; i < V; i++)
        faces[i] =
            (float)(trip_coordinates_position(path->coordinates, path->axes[a],
                                              (double)w->box[a][i] + 0.5 * (double)w->step[a][i]) -
                    path->base[a][n]);
    return faces;
}

/* Begins the walk in the part of segment n that is not clipped, and cuts it at the sides of the
 * grid. */
static box_walk begin_boxes(const trip_cpu_sheet_view *view, const trip_cpu_group *g,
                            const pane_path *path, const stamp_rays *l, unsigned n, remnant part)
{
    const int64_t origin[2] = { is_uneven(path) ? 0 : g->first_u,
                                is_uneven(path) ? 0 : g->first_v };
    const vf zero = v_set(0), one = v_set(1);
    box_walk w = { .part = part };
    for (int a = 0; a < 2; a++) {
        const int32_t base = path->base[a][n];
        const vf at =
            v_fma(l->slope[a], v_set(path->along[n]), v_set(path->first[a][n]) + l->shift[a]);
        const vf end = v_fma(l->slope[a], v_set(path->along[n + 1]),
                             v_set(path->first[a][n + 1]) + l->shift[a]);
        const vf way = (end - at) + v_set((float)(path->base[a][n + 1] - base));
        const vm up = v_gt(way, zero), moves = v_gt(v_abs(way), v_set(1e-12f));
        const vf lo = v_set((float)(-origin[a] - base));
        const vf hi = v_set((float)(view->voxels[a] - 1 - origin[a] - base));
        const vf inverse = v_select(moves, one / v_select(moves, way, one), zero);
        const vf enter = (v_select(up, lo, hi) - at) * inverse;
        const vf leave = (v_select(up, hi, lo) - at) * inverse;
        const vm inside = vm_and(v_ge(at, lo), v_ge(hi, at)); /* of rays that do not move */
        w.from[a] = at;
        w.way[a] = v_select(moves, way, zero);
        w.inverse[a] = inverse;
        w.step[a] = v_select(up, one, v_set(-1));
        w.part.from = v_select(moves, v_max(w.part.from, enter), w.part.from);
        w.part.to =
            v_select(moves, v_min(w.part.to, leave), v_select(inside, w.part.to, v_set(-1)));
    }
    w.part.some = vm_and(vm_and(l->along, part.some), v_gt(w.part.to, w.part.from));
    for (int a = 0; a < 2; a++)
        w.box[a] = voxels_near(path, n, a, v_fma(w.part.from, w.way[a], w.from[a]));
    return w;
}

/* Takes the next box of each ray, and returns the part of the segment in it. Near a corner rounding
 * may leave a part empty. */
static remnant next_box(const pane_path *path, unsigned n, box_walk *w)
{
    const vf never = v_set(2), zero = v_set(0);
    vf face[2];
    for (int a = 0; a < 2; a++) {
        const vm moves = v_gt(v_abs(w->inverse[a]), zero);
        face[a] = v_select(moves, (faces_of(path, n, a, w) - w->from[a]) * w->inverse[a], never);
    }
    const vf end = v_max(w->part.from, v_min(w->part.to, v_min(face[0], face[1])));
    const remnant box = { w->part.from, end, vm_and(w->part.some, v_gt(end, w->part.from)) };
    const vm by_u = v_ge(face[1], face[0]);
    w->part.from = end;
    w->part.some = vm_and(w->part.some, v_gt(w->part.to, v_min(face[0], face[1])));
    w->box[0] = v_select(by_u, w->box[0] + w->step[0], w->box[0]);
    w->box[1] = v_select(by_u, w->box[1], w->box[1] + w->step[1]);
    return box;
}

/* Returns numbers that are not 0 for the rays that lack a corner of their cells on a sheet. `at`
 * are the offsets of the first corners in the pool, in 16-bit numbers. */
INLINE vi lacking(const trip_cpu_group *g, const int32_t at[V])
{
    int32_t lack[V];
    for (int i = 0; i < V; i++) {
        const int16_t *top = (const int16_t *)g->pool + at[i];
        const int16_t *bottom = top + TRIP_CPU_RASTER_STRIDE;
        lack[i] = (top[0] == TRIP_CPU_CODE_MISSING) | (top[1] == TRIP_CPU_CODE_MISSING) |
                  (bottom[0] == TRIP_CPU_CODE_MISSING) | (bottom[1] == TRIP_CPU_CODE_MISSING);
    }
    return vi_load(lack);
}

/* Returns the offsets of the first corners of the cells in one sheet of a segment. */
INLINE vi first_corners(const trip_cpu_group *g, const int32_t *rasters, const patch_path *area,
                        unsigned n, const corners *c, const vi whole[2])
{
    if (area->raster[n] >= 0)
        return c->whole[1] * TRIP_CPU_RASTER_STRIDE + c->whole[0] +
               (area->within[n] + rasters[area->raster[n]] * RASTER_NUMBERS);
    return raster_starts(g, rasters, whole) + position_in_raster(whole);
}

/* Returns the cells of the rays in their boxes, at TRIP_SHEET_BOX_POINT. */
INLINE corners box_cells(const pane_path *path, unsigned n, const box_walk *w, const remnant *box)
{
    const vf point = v_fma(v_set((float)TRIP_SHEET_BOX_POINT), box->to - box->from, box->from);
    corners c;
    for (int a = 0; a < 2; a++) {
        const vf at = v_fma(point, w->way[a], w->from[a]);
        c.whole[a] = v_floor_within(at);
        c.part[a] = at - v_from_int(c.whole[a]);
    }
    return is_uneven(path) ? uneven_corners(path, n, c, (int32_t[2]){ 0 }) : c;
}

/* Computes the sample of a box: the nearest corner of its cell. Its index is the
 * entry of the transfer function's table. */
static void nearest_at(const trip_cpu_sheet_view *view, const trip_cpu_group *g,
                       const pane_path *path, const patch_path *area, unsigned n, const box_walk *w,
                       const remnant *box, sample *s)
{
    const corners c = box_cells(path, n, w, box);
    const trip_cpu_pair *pair = &g->nearest[n];
    vi whole[2];
    find_cells(g, path, n, &c, whole);
    const vi near = first_corners(g, pair->near->rasters, area, n, &c, whole);
    const vi other = first_corners(g, pair->other, area, n, &c, whole);
    int32_t at[V], beside[V], codes[V];
    vi_store(at, near);
    vi_store(beside, other);
    s->there = vi_is_0(lacking(g, at) | lacking(g, beside));
    s->gradient_at = near + v_truncate(c.part[0] + v_set(0.5f)) +
                     v_truncate(c.part[1] + v_set(0.5f)) * TRIP_CPU_RASTER_STRIDE;
    /* Rays without a box may lie outside of the raster. They take its first voxel. */
    vi_store(at, s->gradient_at);
    for (int i = 0; i < V; i++) {
        if (at[i] < 0 || at[i] % RASTER_NUMBERS >= TRIP_CPU_RASTER_VOXELS)
            at[i] = 0;
        codes[i] = ((const int16_t *)g->pool)[at[i]];
    }
    s->gradient_at = vi_load(at);
    s->index = ((vi_load(codes) + TRIP_CPU_CODE_BIAS) >> view->code_shift) + view->code_first;
    s->lit = 0;
    s->summed = false;
}

/* Lets rays that see nothing read the gradient of the missing raster. Another thread may be making
 * the gradients of their own squares. */
INLINE void forget_closed(sample *s, vm open)
{
    const vf opens = v_select(open, v_set(1), v_set(0));
    int32_t at[V];
    vi_store(at, s->gradient_at);
    for (int i = 0; i < V; i++)
        at[i] = opens[i] > 0 ? at[i] : 0;
    s->gradient_at = vi_load(at);
}

/* The gradients of a raster lie behind its codes. */
INLINE void find_nearest_gradients(const trip_cpu_group *g, sample *s)
{
    int32_t at[V], gradients[3][V];
    vi_store(at, s->gradient_at);
    for (int i = 0; i < V; i++) {
        const int32_t raster = at[i] / RASTER_NUMBERS;
        const trip_cpu_gradient *of = &g->pool[raster].gradients[at[i] - raster * RASTER_NUMBERS];
        for (int k = 0; k < 3; k++)
            gradients[k][i] = of->along[k] * (1 << WEIGHT_LOG2);
    }
    for (int k = 0; k < 3; k++)
        s->gradient[k] = vi_load(gradients[k]);
}

#endif
