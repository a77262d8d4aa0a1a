/* Samples the nearest value (sheet.h). Included by sheet_tmpl.h. A segment has one sample, at its
 * middle. The sample is a corner of the cell there, and all eight corners must be present. */
#ifndef TRIP_CPU_NEAREST_H
#define TRIP_CPU_NEAREST_H

/* The first corners of the rays' cells on a sheet, as offsets in the pool, in 16-bit numbers.
 * `lack` is not 0 for the rays that lack a corner there. */
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

/* Returns the offsets of the first corners of the cells in one sheet of a segment. `starts` are the
 * offsets of their rasters if the patch has no common raster. */
INLINE vi first_corners(const trip_cpu_group *g, const int32_t *rasters, const patch_path *area,
                        unsigned n, const corners *c, const vi whole[2])
{
    if (area->raster[n] >= 0)
        return c->whole[1] * TRIP_CPU_RASTER_STRIDE + c->whole[0] +
               (area->within[n] + rasters[area->raster[n]] * RASTER_NUMBERS);
    return raster_starts(g, rasters, whole) + position_in_raster(whole);
}

INLINE void nearest_at(const trip_cpu_group *g, const trip_cpu_integrals *in, const pane_path *path,
                       const patch_path *area, const stamp_rays *l, unsigned n, sample *s)
{
    const corners c = middle_of(path, l, n);
    const trip_cpu_pair *pair = &g->nearest[n];
    vi whole[2];
    find_cells(g, path, n, &c, whole);
    const vi near = first_corners(g, pair->near->rasters, area, n, &c, whole);
    const vi other = first_corners(g, pair->other, area, n, &c, whole);
    int32_t at[V], beside[V], codes[V];
    vi_store(at, near);
    vi_store(beside, other);
    s->there = vi_is_0(lacking(g, at) | lacking(g, beside));
    const vi corner = v_truncate(c.part[0] + v_set(0.5f)) +
                      v_truncate(c.part[1] + v_set(0.5f)) * TRIP_CPU_RASTER_STRIDE;
    vi_store(at, near + corner);
    for (int i = 0; i < V; i++)
        codes[i] = ((const int16_t *)g->pool)[at[i]];
    s->index = index_of(in, vi_load(codes) * (1 << WEIGHT_LOG2));
    s->gradient_at = near + corner; /* of the code; find_nearest_gradients() finds the raster */
    s->lit = s->summed = false;
}

/* The gradients of a raster lie behind its codes. */
INLINE void find_nearest_gradients(const trip_cpu_group *g, sample *s)
{
    int32_t at[V];
    vi_store(at, s->gradient_at);
    for (int i = 0; i < V; i++) {
        const int32_t raster = at[i] / RASTER_NUMBERS;
        const trip_cpu_gradient *of = &g->pool[raster].gradients[at[i] - raster * RASTER_NUMBERS];
        for (int k = 0; k < 3; k++)
            s->gradient[k][i] = of->along[k] * (1 << WEIGHT_LOG2);
    }
}

#endif
