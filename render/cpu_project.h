/* Kernels that turn the voxels of runs into projected splats, V at a time: included by each
 * cpu_isa_*.c after cpu_simd.h. Positions are computed in double precision from the voxel's
 * indices, so that a splat's numbers do not depend on the tile, run or lane it came in; the
 * footprint in single. The few splats near the plane of the eye go through trip_cpu_project_near().
 */
#ifndef TRIP_CPU_PROJECT_H
#define TRIP_CPU_PROJECT_H

#include "cpu_kernels.h"
#include "cpu_near.h"
#include "cpu_simd.h"
#include "shade.h"

/* Splats whose largest optical depth is below 2^-60 are left out: 10^18 of them would not show. */
#define FAINTEST_LOG2 (-60.0f)

#define LOG2_E 1.44269504088896340736

/* ---- staging: runs of voxels to lanes ---- */

INLINE vi load_lanes(const uint32_t *from, uint32_t at, uint32_t lanes, uint32_t count,
                     bool reversed)
{
    if (lanes == V)
        return reversed ? vi_reverse(vi_load(from + count - at - V)) : vi_load(from + at);
    int32_t part[V] = { 0 };
    for (uint32_t i = 0; i < lanes; i++)
        part[i] = (int32_t)(reversed ? from[lanes - 1 - i] : from[at + i]);
    return vi_load(part);
}

static uint32_t stage(const trip_cpu_view *view, const trip_run *run, const uint32_t *voxels,
                      const uint32_t *normals, uint32_t count, bool reversed,
                      trip_cpu_staged *staged, uint32_t filled)
{
    const float *extinction = &view->of->table[0].extinction;
    const vi run_u = vi_set(run->u), run_v = vi_set(run->v), sheet = vi_set(run->sheet);
    for (uint32_t i = 0; i < count; i += V) {
        uint32_t lanes = count - i < V ? count - i : V;
        vi voxel = load_lanes(voxels, i, lanes, count, reversed);
        vi code = v_shift_right(voxel, 16);
        vm seen = vm_and(v_gt(v_gather(extinction, code * 4), v_set(0)), vm_first(lanes));
        vi_store_packed(staged->u + filled, seen, run_u + (voxel & 255));
        vi_store_packed(staged->v + filled, seen, run_v + (v_shift_right(voxel, 8) & 255));
        vi_store_packed(staged->sheet + filled, seen, sheet);
        vi_store_packed(staged->code + filled, seen, code);
        if (normals)
            vi_store_packed(staged->normal + filled, seen,
                            load_lanes(normals, i, lanes, count, reversed));
        filled += (uint32_t)__builtin_popcount(vm_bits(seen));
    }
    return filled;
}

/* ---- the centre ---- */

INLINE vd_pair along(const double c[4], vd_pair u, vd_pair v, vd_pair s)
{
    return (vd_pair){
        vd_fma(u.lo, vd_set(c[0]),
               vd_fma(v.lo, vd_set(c[1]), vd_fma(s.lo, vd_set(c[2]), vd_set(c[3])))),
        vd_fma(u.hi, vd_set(c[0]),
               vd_fma(v.hi, vd_set(c[1]), vd_fma(s.hi, vd_set(c[2]), vd_set(c[3])))),
    };
}

INLINE vd_pair widen_int(vi a)
{
    return (vd_pair){ vd_low_int(a), vd_high_int(a) };
}

/* 1 / z to double precision: a Newton step from the single-precision quotient. */
INLINE vd refine(vd z, vd inverse)
{
    return vd_fma(inverse, vd_fma(-z, inverse, vd_set(1)), inverse);
}

INLINE void split(vd_pair p, vf *whole, vf *part)
{
    *whole = v_from_int(v_truncate(v_narrow(p.lo, p.hi)));
    *part = v_narrow(p.lo - vd_low(*whole), p.hi - vd_high(*whole));
}

INLINE void place(const trip_cpu_view *view, const trip_cpu_staged *staged, uint32_t at,
                  trip_cpu_lanes *lanes)
{
    vd_pair u = widen_int(vi_load(staged->u + at)), v = widen_int(vi_load(staged->v + at));
    vd_pair s = widen_int(vi_load(staged->sheet + at));
    vd_pair x = along(view->along_x, u, v, s), y = along(view->along_y, u, v, s);
    vd_pair zs = along(view->along_z, u, v, s);
    vf z = v_narrow(zs.lo, zs.hi), whole, part;
    v_store(lanes->z + at, z);
    if (!view->splat.camera.ortho) {
        vf inverse = v_set(1) / z;
        vd lo = refine(zs.lo, vd_low(inverse)), hi = refine(zs.hi, vd_high(inverse));
        x = (vd_pair){ x.lo * lo, x.hi * hi };
        y = (vd_pair){ y.lo * lo, y.hi * hi };
        v_store(lanes->inverse_z + at, inverse);
    }
    split(x, &whole, &part);
    v_store(lanes->whole_x + at, whole);
    v_store(lanes->x + at, part);
    split(y, &whole, &part);
    v_store(lanes->whole_y + at, whole);
    v_store(lanes->y + at, part);
}

/* ---- the footprint ---- */

typedef struct footprint {
    vf l11, l21, l22;                    /* as in trip_cpu_splat */
    vf spread;                           /* |S| / |S'| */
    vf shift_x, shift_y, half_x, half_y; /* bounds of the support about the centre */
    vm near;                             /* too near the plane of the eye for these numbers */
} footprint;

/* Constants of a perspective view as floats; rays relative to the image's middle. */
typedef struct perspective {
    vf middle_x, middle_y;
    vf rr, rrx, rry, rxrx, rxry, ryry; /* of r at the middle, rx and ry */
    vf scale;                          /* sigma / (r . rx x ry) */
    vf det;                            /* (r . rx x ry)^2 */
} perspective;

INLINE perspective perspective_of(const trip_splat_frame *f)
{
    const trip_camera *c = &f->camera;
    trip_vec3 r = trip_camera_ray(c, 0.5 * c->width, 0.5 * c->height);
    double volume = trip_dot(r, trip_cross(c->rx, c->ry));
    return (perspective){
        .middle_x = v_set((float)(0.5 * c->width)),
        .middle_y = v_set((float)(0.5 * c->height)),
        .rr = v_set((float)trip_dot(r, r)),
        .rrx = v_set((float)trip_dot(r, c->rx)),
        .rry = v_set((float)trip_dot(r, c->ry)),
        .rxrx = v_set((float)f->rxrx),
        .rxry = v_set((float)f->rxry),
        .ryry = v_set((float)f->ryry),
        .scale = v_set((float)(f->sigma / volume)),
        .det = v_set((float)(volume * volume)),
    };
}

/* Bounds of the support, the ellipse of E and l in splat.h: rough, to be widened by the caller. */
INLINE void bound(footprint *f, vf cxx, vf cxy, vf cyy, vf lx, vf ly, vf k2)
{
    vf inverse = v_rcp_rough(v_fnma(cxy, cxy, cxx * cyy));
    f->shift_x = v_fnma(cxy, ly, cyy * lx) * inverse;
    f->shift_y = v_fnma(cxy, lx, cxx * ly) * inverse;
    vf size = v_fma(lx, f->shift_x, v_fma(ly, f->shift_y, k2)) * inverse;
    vf x2 = size * cyy, y2 = size * cxx;
    f->half_x = x2 * v_rsqrt_rough(x2);
    f->half_y = y2 * v_rsqrt_rough(y2);
}

/* With D = r_c . rx x ry, constant over the image, S = (sigma / (D z))^2 adj [rx x r_c, ry x r_c]
 * and |S| = (sigma / (D z))^4 D^2 |r_c|^2. */
INLINE footprint footprint_of(const perspective *p, const trip_splat_frame *f,
                              const trip_cpu_lanes *lanes, uint32_t at)
{
    footprint out;
    const vf low_pass = v_set((float)f->low_pass2), k2 = v_set((float)f->cutoff2);
    vf x = (v_load(lanes->whole_x + at) - p->middle_x) + v_load(lanes->x + at);
    vf y = (v_load(lanes->whole_y + at) - p->middle_y) + v_load(lanes->y + at);
    vf rx = v_fma(x, p->rxrx, v_fma(y, p->rxry, p->rrx)); /* r_c . rx */
    vf ry = v_fma(x, p->rxry, v_fma(y, p->ryry, p->rry));
    vf rr = v_fma(x, p->rrx + rx, v_fma(y, p->rry + ry, p->rr)); /* |r_c|^2 */
    vf s = p->scale * v_load(lanes->inverse_z + at);
    s = s * s;
    vf sxx = s * v_fnma(ry, ry, rr * p->ryry), syy = s * v_fnma(rx, rx, rr * p->rxrx);
    vf sxy = s * v_fnma(rr, p->rxry, rx * ry);
    vf det_s = s * s * p->det * rr;
    vf det = v_fma(low_pass, sxx + syy + low_pass, det_s);
    sxx = sxx + low_pass;
    syy = syy + low_pass;

    /* q^T S'^-1 q = (syy / det) (x - sxy / syy y)^2 + y^2 / syy */
    vf root_syy = v_inverse_sqrt(syy, 3), root_det = v_inverse_sqrt(det, 3); /* inverse roots */
    vf inverse_det = root_det * root_det, inverse_syy = root_syy * root_syy;
    vf unit = rr * v_set((float)(0.5 * LOG2_E * TRIP_CPU_EXP_UNIT));
    vf root_unit = unit * v_inverse_sqrt(unit, 3);
    out.l22 = root_unit * root_syy;
    out.l11 = syy * out.l22 * root_det;
    out.l21 = -(sxy * inverse_syy) * out.l11;
    out.spread = det_s * inverse_det;

    /* E is S'^-1 less a matrix whose product with S' has this trace times k^2 / |r_c|^2. */
    vf trace = v_fma(p->rxrx, sxx, v_fma(p->ryry, syy, (p->rxry + p->rxry) * sxy));
    out.near = v_gt(trace * k2, rr * v_set(0.5f));
    vf t = k2 * v_rcp_rough(rr);
    bound(&out, v_fnma(t, p->rxrx, syy * inverse_det), v_fnma(t, p->rxry, -sxy * inverse_det),
          v_fnma(t, p->ryry, sxx * inverse_det), t * rx, t * ry, k2);
    return out;
}

INLINE footprint footprint_parallel(const trip_cpu_view *view)
{
    const trip_splat *s = &view->parallel;
    trip_cpu_splat one;
    trip_cpu_set_conic(s, &one);
    return (footprint){
        .l11 = v_set(one.l11),
        .l21 = v_set(one.l21),
        .l22 = v_set(one.l22),
        .spread = v_set((float)pow(s->amplitude / view->splat.amplitude, 2)),
        .shift_x = v_set((float)(0.5 * (s->x0 + s->x1) - s->x)),
        .shift_y = v_set((float)(0.5 * (s->y0 + s->y1) - s->y)),
        .half_x = v_set((float)(0.5 * (s->x1 - s->x0))),
        .half_y = v_set((float)(0.5 * (s->y1 - s->y0))),
        .near = v_gt(v_set(0), v_set(1)),
    };
}

/* ---- colour and light ---- */

typedef struct colour {
    vf r, g, b;
} colour;

typedef struct v3 {
    vf x, y, z;
} v3;

INLINE vf dot(v3 a, v3 b)
{
    return v_fma(a.x, b.x, v_fma(a.y, b.y, a.z * b.z));
}

INLINE v3 unit(v3 a)
{
    vf inverse = v_inverse_sqrt(v_max(dot(a, a), v_set(1e-30f)), 2);
    return (v3){ a.x * inverse, a.y * inverse, a.z * inverse };
}

INLINE v3 v3_of(trip_vec3 a)
{
    return (v3){ v_set((float)a.x), v_set((float)a.y), v_set((float)a.z) };
}

/* From the splat to the eye, world space, not normalised. */
INLINE v3 towards_eye(const trip_cpu_view *view, const trip_cpu_lanes *lanes, uint32_t at)
{
    const trip_camera *camera = &view->splat.camera;
    v3 middle = v3_of(view->to_eye[0]);
    v3 across = v3_of(view->to_eye[1]), down = v3_of(view->to_eye[2]);
    vf x =
        (v_load(lanes->whole_x + at) - v_set((float)(0.5 * camera->width))) + v_load(lanes->x + at);
    vf y = (v_load(lanes->whole_y + at) - v_set((float)(0.5 * camera->height))) +
           v_load(lanes->y + at);
    return (v3){ v_fma(x, across.x, v_fma(y, down.x, middle.x)),
                 v_fma(x, across.y, v_fma(y, down.y, middle.y)),
                 v_fma(x, across.z, v_fma(y, down.z, middle.z)) };
}

/* As trip_normal_unpack(): the direction, and the magnitude over gradient_scale. */
INLINE v3 unpack_normal(vi normal, vf *magnitude)
{
    const vf step = v_set(2.0f / 4095);
    vf a = v_fma(v_from_int(normal & 4095), step, v_set(-1));
    vf b = v_fma(v_from_int(v_shift_right(normal, 12) & 4095), step, v_set(-1));
    vf m = v_from_int(v_shift_right(normal, 24)) * v_set(1.0f / 255);
    *magnitude = m * m;
    v3 n = { .z = v_set(1) - v_abs(a) - v_abs(b) };
    vm below = v_gt(v_set(0), n.z);
    n.x = v_select(below, v_copysign(v_set(1) - v_abs(b), a), a);
    n.y = v_select(below, v_copysign(v_set(1) - v_abs(a), b), b);
    return unit(n);
}

INLINE vf clamp01(vf a)
{
    return v_min(v_set(1), v_max(v_set(0), a));
}

/* As trip_shade(). */
INLINE colour shaded(const trip_cpu_view *view, colour c, v3 eye, vi packed)
{
    const trip_settings *s = view->of->settings;
    vf magnitude;
    v3 normal = unpack_normal(packed, &magnitude);
    eye = unit(eye);
    v3 light = eye, half = eye;
    if (!s->headlight) {
        light = v3_of(s->light_direction);
        half = unit((v3){ light.x + eye.x, light.y + eye.y, light.z + eye.z });
    }
    double full = view->of->data->header.gradient_scale / view->gradient_full;
    vf strength = v_min(v_set(1), magnitude * v_set((float)fmin(full, 1e30)));
    vf diffuse = v_abs(dot(normal, light));
    vf h2 = dot(normal, half) * dot(normal, half);
    vf h8 = (h2 * h2) * (h2 * h2);
    static_assert(TRIP_SHININESS == 24, "the power below");
    vf gloss = strength * v_set((float)TRIP_SPECULAR) * ((h8 * h8) * h8);
    vf matt = v_fma(diffuse, v_set((float)TRIP_DIFFUSE), v_set((float)(TRIP_AMBIENT - 1)));
    matt = v_fma(strength, matt, v_set(1));
    vm flat = v_ge(v_set(0), magnitude);
    return (colour){ v_select(flat, c.r, clamp01(v_fma(c.r, matt, gloss))),
                     v_select(flat, c.g, clamp01(v_fma(c.g, matt, gloss))),
                     v_select(flat, c.b, clamp01(v_fma(c.b, matt, gloss))) };
}

/* ---- putting it together ---- */

/* log2 of a positive number; error below 3e-7. The polynomial is Cephes' logf(). */
INLINE vf log2_of(vf a)
{
    vi t = v_bits(a) - 0x3f3504f3; /* sqrt(1/2) */
    vf e = v_from_int(t >> 23);
    vf f = v_from_bits((t & 0x7fffff) + 0x3f3504f3) - v_set(1);
    vf p = v_set(7.0376836292e-2f);
    p = v_fma(p, f, v_set(-1.1514610310e-1f));
    p = v_fma(p, f, v_set(1.1676998740e-1f));
    p = v_fma(p, f, v_set(-1.2420140846e-1f));
    p = v_fma(p, f, v_set(1.4249322787e-1f));
    p = v_fma(p, f, v_set(-1.6668057665e-1f));
    p = v_fma(p, f, v_set(2.0000714765e-1f));
    p = v_fma(p, f, v_set(-2.4999993993e-1f));
    p = v_fma(p, f, v_set(3.3333331174e-1f));
    vf f2 = f * f;
    vf ln = v_fma(f2, v_fma(f, p, v_set(-0.5f)), f);
    return v_fma(ln, v_set((float)LOG2_E), e);
}

/* First and last pixel whose centre lies in shift +- half about whole + part, a little more than
 * less; nothing when first > last. */
INLINE void pixels(vf whole, vf part, vf shift, vf half, int size, vi *first, vi *last)
{
    const vf zero = v_set(0), edge = v_set((float)size);
    vf middle = whole + (part + shift);
    vf slack = v_fma(half + v_abs(shift), v_set(1e-3f), v_set(1e-3f));
    slack = v_fma(v_abs(middle), v_set(1e-6f), slack);
    vf reach = half + slack - v_set(0.5f);
    /* v_max gives its second argument where the first is not a number. */
    *first = v_truncate(v_min(v_max(middle - reach, zero), edge));
    *last = v_truncate(v_min(v_max(middle + reach + v_set(1), zero), edge)) - 1;
}

INLINE vm less_or_equal(vi a, vi b)
{
    return v_ge(v_from_int(b), v_from_int(a));
}

INLINE vm above(vi a, int32_t b)
{
    return v_gt(v_from_int(a), v_set((float)b));
}

/* The centre from the corner of the first tile. */
INLINE vf from_corner(const float *whole, const float *part, vi first)
{
    vf corner = v_from_int(first & -TRIP_CPU_TILE);
    return v_load(part) + (v_load(whole) - corner);
}

/* Everything but the colour; the bits of the lanes that have pixels. */
INLINE unsigned complete(const trip_cpu_view *view, const footprint *f, vf extinction,
                         trip_cpu_lanes *lanes, uint32_t at)
{
    const trip_camera *camera = &view->splat.camera;
    const vf one = v_set((float)TRIP_CPU_EXP_UNIT), bias = v_set((float)(127 * TRIP_CPU_EXP_UNIT));
    vf depth = extinction * v_set((float)(view->splat.amplitude * view->stretch));
    vf log2_depth = log2_of(depth * depth * f->spread) * v_set(0.5f);
    vi x0, x1, y0, y1;
    pixels(v_load(lanes->whole_x + at), v_load(lanes->x + at), f->shift_x, f->half_x, camera->width,
           &x0, &x1);
    pixels(v_load(lanes->whole_y + at), v_load(lanes->y + at), f->shift_y, f->half_y,
           camera->height, &y0, &y1);
    v_store(lanes->l11 + at, f->l11);
    v_store(lanes->l21 + at, f->l21);
    v_store(lanes->l22 + at, f->l22);
    v_store(lanes->peak + at, v_fma(log2_depth, one, bias));
    vi_store(lanes->first + at, x0 | y0 << 16);
    vi_store(lanes->last + at, x1 | y1 << 16);
    v_store(lanes->x + at, from_corner(lanes->whole_x + at, lanes->x + at, x0));
    v_store(lanes->y + at, from_corner(lanes->whole_y + at, lanes->y + at, y0));
    static_assert(TRIP_CPU_TILE == 32, "the shifts below");
    vi right = (x1 >> 5) - (x0 >> 5), below = (y1 >> 5) - (y0 >> 5);
    lanes->right[at / V] = vm_bits(above(right, 0));
    lanes->below[at / V] = vm_bits(above(below, 0));
    lanes->wide[at / V] = vm_bits(above(right, 1)) | vm_bits(above(below, 1));
    vm seen = vm_and(v_gt(v_load(lanes->z + at), v_set(0)), v_gt(log2_depth, v_set(FAINTEST_LOG2)));
    return vm_bits(vm_and(seen, vm_and(less_or_equal(x0, x1), less_or_equal(y0, y1))));
}

/* The lanes near the plane of the eye, one by one; returns those that are drawn. */
static unsigned project_near(const trip_cpu_view *view, const trip_cpu_staged *staged, uint32_t at,
                             unsigned lanes, trip_cpu_splat near[V])
{
    unsigned drawn = 0;
    for (; lanes; lanes &= lanes - 1) {
        unsigned i = (unsigned)__builtin_ctz(lanes);
        uint32_t k = at + i;
        double extinction = (double)view->of->table[staged->code[k]].extinction;
        if (trip_cpu_project_near(view, staged->u[k], staged->v[k], staged->sheet[k], extinction,
                                  &near[i]))
            drawn |= 1u << i;
    }
    return drawn;
}

INLINE void set_colours(const trip_cpu_view *view, const trip_cpu_staged *staged, uint32_t at,
                        trip_cpu_lanes *lanes)
{
    const float *table = &view->of->table[0].r;
    vi code = vi_load(staged->code + at);
    colour c = { v_gather(table, code * 4), v_gather(table + 1, code * 4),
                 v_gather(table + 2, code * 4) };
    if (view->shading) {
        v3 eye = towards_eye(view, lanes, at);
        c = shaded(view, c, eye, vi_load(staged->normal + at));
    }
    v_store(lanes->r + at, c.r);
    v_store(lanes->g + at, c.g);
    v_store(lanes->b + at, c.b);
}

/* ---- splats, once for each tile ---- */

INLINE vf load_bits(const uint32_t *p)
{
    return v_from_bits(vi_load(p));
}

/* What the splats of a vector's lanes have in common wherever they are stored. */
typedef struct record {
    vf x, y, l11, l21, l22, peak, least, thick, r, g, b, first, last, sequence;
    vi x0, y0, x1, y1; /* pixels from the corner of the first tile */
    vi tile;
} record;

INLINE record load_record(const trip_cpu_view *view, const trip_cpu_lanes *lanes, uint32_t at,
                          uint32_t sequence)
{
    const vf bias = v_set((float)(127 * TRIP_CPU_EXP_UNIT));
    const vi mask = vi_set(TRIP_CPU_TILE - 1), low = vi_set(0xffff);
    vi first = vi_load(lanes->first + at), last = vi_load(lanes->last + at);
    vi x0 = first & low, y0 = v_shift_right(first, 16);
    vf peak = v_load(lanes->peak + at);
    vf limit = v_fma(v_set(view->thick_log2), v_set((float)TRIP_CPU_EXP_UNIT), bias);
    return (record){
        .x = v_load(lanes->x + at),
        .y = v_load(lanes->y + at),
        .l11 = v_load(lanes->l11 + at),
        .l21 = v_load(lanes->l21 + at),
        .l22 = v_load(lanes->l22 + at),
        .peak = peak,
        .least = peak - v_set(view->cutoff),
        .thick = v_select(v_gt(peak, limit), v_set(1), v_set(0)),
        .r = v_load(lanes->r + at),
        .g = v_load(lanes->g + at),
        .b = v_load(lanes->b + at),
        .first = v_from_bits(first),
        .last = v_from_bits(last),
        .sequence = v_from_bits(vi_count() + (int32_t)(sequence + at)),
        .x0 = x0 & mask,
        .y0 = y0 & mask,
        .x1 = (last & low) - (x0 & ~mask),
        .y1 = v_shift_right(last, 16) - (y0 & ~mask),
        .tile = (y0 >> 5) * view->tiles_across + (x0 >> 5),
    };
}

INLINE vi vi_clamp(vi a)
{
    return v_truncate(v_min(v_max(v_from_int(a), v_set(0)), v_set(TRIP_CPU_TILE - 1)));
}

/* trip_cpu_splat.blocks in the tile `across` and `down` from the first. */
INLINE vi blocks_in(const record *r, int across, int down)
{
    const vi rows = vi_set(V == 16 ? 2 : V == 8);
    const int32_t dx = across * TRIP_CPU_TILE, dy = down * TRIP_CPU_TILE;
    vi left = vi_clamp(r->x0 - dx) >> 2, right = vi_clamp(r->x1 - dx) >> 2;
    vi top = vi_clamp(r->y0 - dy) >> rows, bottom = vi_clamp(r->y1 - dy) >> rows;
    vi columns = (vi_set(0xff) << left) & (vi_set(0xff) >> (vi_set(7) - right));
    return columns | top << TRIP_CPU_BLOCKS_TOP_SHIFT |
           (bottom - top) << TRIP_CPU_BLOCKS_MORE_SHIFT;
}

/* The lanes as splats of a tile, each to the row of the output that it is given in floats. */
INLINE void store(const record *r, int across, int down, const uint32_t row[V], trip_cpu_splat *out)
{
    float *base = &out->u;
    vf x = r->x - v_set((float)(across * TRIP_CPU_TILE));
    vf y = r->y - v_set((float)(down * TRIP_CPU_TILE));
    vf u = -v_fma(x, r->l11, y * r->l21), w = -(y * r->l22);
    v_store_rows(base, row, u, w, r->l11, r->l21);
    v_store_rows(base + 4, row, r->l22, r->peak, r->least, r->thick);
    v_store_rows(base + 8, row, r->r, r->g, r->b, v_from_bits(blocks_in(r, across, down)));
    v_store_rows(base + 12, row, r->first, r->last, r->sequence, r->sequence);
}

INLINE void count_splat(trip_cpu_basket *b, uint32_t at, uint32_t tile)
{
    b->tiles[at] = tile;
    b->ranks[at] = (uint16_t)b->counts[tile]++;
}

/* A vector whose lanes all lie in one tile each. */
INLINE void store_plain(const record *r, const uint32_t rows[V], trip_cpu_basket *b)
{
    uint32_t tiles[V];
    vi_store(tiles, r->tile);
    store(r, 0, 0, rows, b->splats + b->count);
    for (uint32_t i = 0; i < V; i++)
        count_splat(b, b->count + i, tiles[i]);
    b->count += V;
}

/* Which lanes are drawn, and in which tiles beside the first. */
typedef struct lane_bits {
    unsigned kept, near, wide, right, below;
} lane_bits;

/* Rows for the lanes' splats in order: that of a lane's splat in the first tile; those in the tile
 * to the right, below and diagonally below follow it. Lanes that are not kept are overwritten by
 * the next. Counts the splats, and returns their number. */
INLINE uint32_t rank(const trip_cpu_view *view, const lane_bits *bits, const record *r,
                     uint32_t row[V], trip_cpu_basket *b)
{
    uint32_t tiles[V], n = 0, below = (uint32_t)view->tiles_across;
    vi_store(tiles, vi_select(vm_of(bits->wide), vi_set(view->tiles), r->tile));
    for (unsigned i = 0; i < V; i++) {
        row[i] = n;
        if (!(bits->kept >> i & 1))
            continue;
        bool is_right = bits->right >> i & 1, is_below = bits->below >> i & 1;
        count_splat(b, b->count + n++, tiles[i]);
        if (is_right)
            count_splat(b, b->count + n++, tiles[i] + 1);
        if (is_below)
            count_splat(b, b->count + n++, tiles[i] + below);
        if (is_right && is_below)
            count_splat(b, b->count + n++, tiles[i] + below + 1);
    }
    return n;
}

/* The splats of the lanes in `some` in a further tile, `skip` rows after the first. The other lanes
 * go to a row behind all. */
INLINE void store_further(const record *r, int across, int down, unsigned some, vi skip, vi row,
                          uint32_t behind, trip_cpu_splat *out)
{
    uint32_t floats[V];
    if (!some)
        return;
    vi_store(floats, vi_select(vm_of(some), row + skip, vi_set((int32_t)behind)) << 4);
    store(r, across, down, floats, out);
}

static void replace_near(trip_cpu_splat *out, const uint32_t row[V], unsigned lanes,
                         const trip_cpu_splat near[V])
{
    for (; lanes; lanes &= lanes - 1) {
        unsigned i = (unsigned)__builtin_ctz(lanes);
        trip_cpu_splat *s = out + row[i];
        trip_cpu_splat n = near[i];
        n.r = s->r;
        n.g = s->g;
        n.b = s->b;
        n.sequence = s->sequence;
        *s = n;
    }
}

/* A vector of which some lanes are left out, lie in several tiles or near the plane of the eye. */
static void store_mixed(const trip_cpu_view *view, const trip_cpu_staged *staged, uint32_t at,
                        const trip_cpu_lanes *lanes, const record *r, trip_cpu_basket *b)
{
    uint32_t row[V], floats[V];
    trip_cpu_splat near[V], *out = b->splats + b->count;
    lane_bits bits = { .kept = lanes->kept[at / V], .near = lanes->near[at / V] };
    if (bits.near)
        bits.near = project_near(view, staged, at, bits.near, near);
    bits.kept |= bits.near;
    bits.wide = lanes->wide[at / V] | bits.near;
    bits.right = bits.kept & lanes->right[at / V] & ~bits.wide;
    bits.below = bits.kept & lanes->below[at / V] & ~bits.wide;
    uint32_t n = rank(view, &bits, r, row, b);
    vi rows = vi_load(row), one = vi_set(1);
    vi_store(floats, rows << 4);
    store(r, 0, 0, floats, out);
    store_further(r, 1, 0, bits.right, one, rows, n, out);
    store_further(r, 0, 1, bits.below, vi_select(vm_of(bits.right), one + one, one), rows, n, out);
    store_further(r, 1, 1, bits.right & bits.below, vi_set(3), rows, n, out);
    if (bits.near)
        replace_near(out, row, bits.near, near);
    b->count += n;
}

static void project_footprints(const trip_cpu_view *view, const trip_cpu_staged *staged,
                               uint32_t count, trip_cpu_lanes *lanes)
{
    const float *extinction = &view->of->table[0].extinction;
    footprint parallel = footprint_parallel(view);
    perspective persp = perspective_of(&view->splat);
    for (uint32_t i = 0; i < count; i += V) {
        footprint f = parallel;
        if (!view->splat.camera.ortho)
            f = footprint_of(&persp, &view->splat, lanes, i);
        unsigned valid = vm_bits(vm_first(count - i));
        unsigned near = vm_bits(vm_and(f.near, v_gt(v_load(lanes->z + i), v_set(0)))) & valid;
        vf tau = v_gather(extinction, vi_load(staged->code + i) * 4);
        lanes->kept[i / V] = complete(view, &f, tau, lanes, i) & valid & ~near;
        lanes->near[i / V] = near;
    }
}

/* In four loops, each short enough that the processor works on several vectors at a time: in one,
 * the chain of divisions and roots would leave it waiting. */
static void project(const trip_cpu_view *view, const trip_cpu_staged *staged, uint32_t count,
                    uint32_t sequence, trip_cpu_lanes *lanes, trip_cpu_basket *basket)
{
    const unsigned every = (1u << V) - 1;
    uint32_t rows[V];
    for (uint32_t i = 0; i < V; i++)
        rows[i] = 16 * i;
    for (uint32_t i = 0; i < count; i += V)
        place(view, staged, i, lanes);
    for (uint32_t i = 0; i < count; i += V)
        set_colours(view, staged, i, lanes);
    project_footprints(view, staged, count, lanes);
    for (uint32_t i = 0; i < count; i += V) {
        uint32_t k = i / V;
        record r = load_record(view, lanes, i, sequence);
        if (lanes->kept[k] == every && !(lanes->right[k] | lanes->below[k]))
            store_plain(&r, rows, basket);
        else if (lanes->kept[k] | lanes->near[k])
            store_mixed(view, staged, i, lanes, &r, basket);
    }
}

#endif
