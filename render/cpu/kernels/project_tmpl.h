/* Decodes squares of voxels and projects them to splats, V at a time. Included by table_tmpl.h
 * after simd_tmpl.h.
 *
 * Positions are computed in double precision from the voxel's indices, so that a splat's numbers do
 * not depend on its tile, run or lane. Footprints are computed in single precision. For a few
 * splats this precision is too low, mostly near the plane of the eye. trip_cpu_project_scalar()
 * projects them one by one. */
#ifndef TRIP_CPU_PROJECT_H
#define TRIP_CPU_PROJECT_H

#include "cpu/kernels/terminated_tmpl.h"
#include "cpu/kernels/exp_tmpl.h"
#include "cpu/kernels/kernels.h"
#include "cpu/kernels/rays_tmpl.h"
#include "cpu/cpu_scalar.h"
#include "cpu/kernels/simd_tmpl.h"
#include "cpu/kernels/effects_tmpl.h"
#include "shade.h"

/* Splats with a smaller maximum optical depth are left out: even 10^18 of them are invisible. */
#define FAINTEST 0x1p-60f

#define LOG2_E 1.44269504088896340736

/* ---- staging: squares of voxels to lanes ---- */

/* Includes room for loads and stores that end past the last byte. */
enum { POSITIONS_ROOM = 64 + V };

/* Computes the positions of a mask's voxels in the square, u + 8 v. */
INLINE void positions_of(uint64_t mask, uint8_t bit_positions[POSITIONS_ROOM])
{
#ifdef V_PACKS_BITS
    v_bytes all;
    for (unsigned i = 0; i < 64; i++)
        all[i] = (uint8_t)((i & 1) | (i >> 1 & 2) | (i >> 2 & 4) | (i & 2) << 2 | (i & 8) << 1 |
                           (i & 32));
    v_pack_bytes(bit_positions, mask, all);
#else
    uint32_t n = 0;
    for (unsigned i = 0; i < 8; i++) {
        unsigned byte = mask >> 8 * i & 255;
        uint64_t row = (i & 1) << 4 | (i & 2) << 1 | (i & 4) << 3;
        uint64_t eight = trip_cpu_positions[byte] + row * UINT64_C(0x0101010101010101);
        memcpy(bit_positions + n, &eight, sizeof eight);
        n += (uint32_t)__builtin_popcount(byte);
    }
#endif
}

/* Loads the codes of V voxels from number `at` on, a multiple of V. Lanes past the square's voxels
 * also get valid codes. */
INLINE vi load_codes(const trip_cpu_square *square, unsigned code_bytes, int32_t at)
{
    if (code_bytes == 1)
        return vi_load_bytes(square->codes + at);
    const uint32_t width = square->width;
    return (vi_load_bits(square->codes + (size_t)at * width / 8, width) + (int32_t)square->min) &
           UINT16_MAX;
}

INLINE vi load_normals(const unsigned char *normals, unsigned normal_bytes, int32_t at)
{
    return normal_bytes == 4 ? vi_load(normals + 4 * at) : vi_load_3_bytes(normals + 3 * at);
}

INLINE uint64_t reversed_bits(uint64_t a)
{
    a = (a >> 1 & UINT64_C(0x5555555555555555)) | (a & UINT64_C(0x5555555555555555)) << 1;
    a = (a >> 2 & UINT64_C(0x3333333333333333)) | (a & UINT64_C(0x3333333333333333)) << 2;
    a = (a >> 4 & UINT64_C(0x0f0f0f0f0f0f0f0f)) | (a & UINT64_C(0x0f0f0f0f0f0f0f0f)) << 4;
    return __builtin_bswap64(a);
}

/* Returns the lanes with extinction. `in_range` means that view->shown is the range of all codes
 * with extinction. Then no row of the table is read here; rows lie far apart in memory. */
INLINE unsigned lanes_seen(const trip_cpu_view *view, vi code, bool in_range)
{
    if (in_range) {
        const vf at = v_from_int(code);
        return vm_bits(vm_and(v_ge(at, v_set((float)view->shown.min)),
                              v_ge(v_set((float)view->shown.max), at)));
    }
    return vm_bits(v_gt(v_gather(&trip_cpu_rows(view)->extinction, code * 4), v_set(0)));
}

/* Stages a square. `in_range` is as in lanes_seen(). With codes of one byte it allows testing the
 * whole square at once. Lanes past the square's voxels hold arbitrary data and are left out. */
INLINE uint32_t stage_square(const trip_cpu_view *view, const trip_cpu_square *square,
                             unsigned code_bytes, bool in_range, bool reversed,
                             trip_cpu_staged *staged, uint32_t filled)
{
    const bool bytes_in_range = in_range && code_bytes == 1;
    const vi u = vi_set(square->u), v = vi_set(square->v), sheet = vi_set(square->sheet);
    int32_t count = __builtin_popcountll(square->mask), all = (count + V - 1) / V * V;
    uint64_t seen = UINT64_MAX >> (64 - count);
    if (bytes_in_range)
        seen &= v_bytes_within(square->codes, (uint8_t)view->shown.min, (uint8_t)view->shown.max);
    if (seen == 0)
        return filled;
    uint8_t bit_positions[POSITIONS_ROOM];
    positions_of(square->mask, bit_positions);
    const uint64_t in_order = reversed ? reversed_bits(seen) >> (64 - all) : seen;
    for (int32_t i = 0; i < all; i += V) {
        int32_t at = reversed ? all - V - i : i;
        unsigned lanes = (unsigned)(in_order >> i) & ((1u << V) - 1);
        vi position = vi_load_bytes(bit_positions + at), code = load_codes(square, code_bytes, at);
        vi normal = vi_set(0);
        if (view->shading || view->flattens)
            normal = load_normals(square->normals, view->normal_bytes, at);
        if (reversed) {
            position = vi_reverse(position);
            code = vi_reverse(code);
            normal = vi_reverse(normal);
        }
        if (!bytes_in_range)
            lanes &= lanes_seen(view, code, in_range);
        vi_store_packed(staged->u + filled, lanes, u + (position & 7));
        vi_store_packed(staged->v + filled, lanes, v + v_shift_right(position, 3));
        vi_store(staged->sheet + filled, sheet);
        vi_store_packed(staged->code + filled, lanes, code);
        if (view->shading || view->flattens)
            vi_store_packed(staged->normal + filled, lanes, normal);
        filled += (uint32_t)__builtin_popcount(lanes);
    }
    return filled;
}

static uint32_t stage(const trip_cpu_view *view, const trip_cpu_square *square, bool reversed,
                      trip_cpu_staged *staged, uint32_t filled)
{
    const bool in_range = view->shown.min <= view->shown.max;
    if (view->code_bytes == 1 && in_range)
        return reversed ? stage_square(view, square, 1, true, true, staged, filled)
                        : stage_square(view, square, 1, true, false, staged, filled);
    if (view->code_bytes == 1)
        return reversed ? stage_square(view, square, 1, false, true, staged, filled)
                        : stage_square(view, square, 1, false, false, staged, filled);
    if (in_range)
        return reversed ? stage_square(view, square, 2, true, true, staged, filled)
                        : stage_square(view, square, 2, true, false, staged, filled);
    return reversed ? stage_square(view, square, 2, false, true, staged, filled)
                    : stage_square(view, square, 2, false, false, staged, filled);
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

/* Returns 1 / z in double precision: one Newton step from the single-precision quotient. */
INLINE vd refine(vd z, vd inverse)
{
    return vd_fma(inverse, vd_fma(-z, inverse, vd_set(1)), inverse);
}

INLINE void split(vd_pair p, vf *whole, vf *part)
{
    *whole = v_from_int(v_truncate(v_narrow(p.lo, p.hi)));
    *part = v_narrow(p.lo - vd_low(*whole), p.hi - vd_high(*whole));
}

/* Returns the positions of voxels along an axis of the grid. Lanes past the last voxel may hold any
 * number. */
INLINE vd_pair positions(const trip_cpu_view *view, int axis, const int32_t *voxels)
{
    if (!view->coordinates)
        return widen_int(vi_load(voxels));
    const double *along = view->coordinates->along[axis];
    const int64_t last = view->coordinates->voxels[axis] - 1;
    double low[V / 2], high[V / 2];
    for (int i = 0; i < V; i++) {
        int64_t n = voxels[i] < 0 ? 0 : voxels[i] > last ? last : voxels[i];
        (i < V / 2 ? low : high)[i % (V / 2)] = along[n];
    }
    vd_pair out;
    memcpy(&out.lo, low, sizeof low);
    memcpy(&out.hi, high, sizeof high);
    return out;
}

INLINE void position(const trip_cpu_view *view, const trip_cpu_staged *staged, uint32_t at,
                     trip_cpu_lanes *lanes)
{
    vd_pair u = positions(view, view->u_axis, staged->u + at);
    vd_pair v = positions(view, view->v_axis, staged->v + at);
    vd_pair s = positions(view, view->axis, staged->sheet + at);
    vd_pair x = along(view->along_x, u, v, s), y = along(view->along_y, u, v, s);
    vd_pair zs = along(view->along_z, u, v, s);
    vf z = v_narrow(zs.lo, zs.hi), whole, part;
    v_store(lanes->z + at, z);
    if (!view->splat.camera.ortho) {
        vf inverse = v_set(1) / z;
        vd lo = refine(zs.lo, vd_low(inverse)), hi = refine(zs.hi, vd_high(inverse));
        x = (vd_pair){ x.lo * lo, x.hi * hi };
        y = (vd_pair){ y.lo * lo, y.hi * hi };
    }
    split(x, &whole, &part);
    v_store(lanes->whole_x + at, whole);
    v_store(lanes->x + at, part);
    split(y, &whole, &part);
    v_store(lanes->whole_y + at, whole);
    v_store(lanes->y + at, part);
}

/* ---- normals ---- */

typedef struct v3 {
    vf x, y, z;
} v3;

INLINE vf dot(v3 a, v3 b)
{
    return v_fma(a.x, b.x, v_fma(a.y, b.y, a.z * b.z));
}

/* Returns the unit vector and the length. Lengths below 1e-15 count as 0. */
INLINE v3 unit_of(v3 a, vf *length)
{
    const vf min = v_set(1e-30f);
    vf squared = dot(a, a), root = v_sqrt(v_max(squared, min)), inverse = v_set(1) / root;
    *length = v_select(v_ge(squared, min), root, v_set(0));
    return (v3){ a.x * inverse, a.y * inverse, a.z * inverse };
}

INLINE v3 unit(v3 a)
{
    vf length;
    return unit_of(a, &length);
}

INLINE v3 v3_of(trip_vec3 a)
{
    return (v3){ v_set((float)a.x), v_set((float)a.y), v_set((float)a.z) };
}

/* Selects one of two forms of a normal, and returns its direction and length. The strong form
 * stores its length separately. */
INLINE v3 strong_or_weak(vm is_strong, v3 strong, vf strong_length, v3 weak, vf *length)
{
    vf weak_length;
    v3 direction =
        unit_of((v3){ v_select(is_strong, strong.x, weak.x), v_select(is_strong, strong.y, weak.y),
                      v_select(is_strong, strong.z, weak.z) },
                &weak_length);
    *length = v_select(is_strong, strong_length, weak_length);
    return direction;
}

/* Mirrors trip_normal_unpack(). Returns the direction; `length` is in units of gradient_full. */
INLINE v3 unpack_normal(const trip_cpu_view *view, vi normal, vf *length)
{
    const vf step = v_set(2.0f / 4095), part = v_set(view->normal_full / 511);
    vf centre = v_from_int(v_shift_right(normal, 30) & 1) * v_set(0.5f);
    v3 weak = { (v_from_int(normal << 22 >> 22) + centre) * part,
                (v_from_int(normal << 12 >> 22) + centre) * part,
                (v_from_int(normal << 2 >> 22) + centre) * part };
    vf a = v_fma(v_from_int(normal & 4095), step, v_set(-1));
    vf b = v_fma(v_from_int(v_shift_right(normal, 12) & 4095), step, v_set(-1));
    v3 strong = { .z = v_set(1) - v_abs(a) - v_abs(b) };
    vm below = v_gt(v_set(0), strong.z);
    strong.x = v_select(below, v_copysign(v_set(1) - v_abs(b), a), a);
    strong.y = v_select(below, v_copysign(v_set(1) - v_abs(a), b), b);
    vf root = v_fma(v_from_int(v_shift_right(normal, 24) & 127), v_set(1.0f / 32), v_set(1));
    vm is_strong = v_gt(v_set(0), v_from_int(normal));
    return strong_or_weak(is_strong, strong, root * root * v_set(view->normal_full), weak, length);
}

/* Mirrors trip_compact_normal_unpack(). Returns the direction; `length` is in units of
 * gradient_full. */
INLINE v3 unpack_compact_normal(const trip_cpu_view *view, vi normal, vf *length)
{
    const float(*m)[3] = view->compact;
    vf x = v_from_int(normal << 24 >> 24), y = v_from_int(normal << 16 >> 24);
    vf z = v_from_int(v_shift_right(normal, 16) & 127);
    v3 weak = { v_fma(v_set(m[0][0]), x, v_fma(v_set(m[0][1]), y, v_set(m[0][2]) * z)),
                v_fma(v_set(m[1][0]), x, v_fma(v_set(m[1][1]), y, v_set(m[1][2]) * z)),
                v_fma(v_set(m[2][0]), x, v_fma(v_set(m[2][1]), y, v_set(m[2][2]) * z)) };
    vf p = v_fma(v_from_int(normal & 4095), v_set(1.0f / 4095), v_set(-0.5f));
    vf q = v_fma(v_from_int(v_shift_right(normal, 12) & 2047), v_set(1.0f / 2047), v_set(-0.5f));
    v3 strong = { p + q, p - q, v_set(1) - v_abs(p + q) - v_abs(p - q) };
    vm is_strong = v_gt(v_from_int(normal & 0x800000), v_set(0));
    return strong_or_weak(is_strong, strong, v_set(view->normal_full), weak, length);
}

/* trip_flattening for V kernels, along the list's axes. */
typedef struct flattening {
    v3 normal;
    vf share;
} flattening;

/* Mirrors trip_splat_flattening(). */
INLINE flattening flattening_of(const trip_cpu_view *view, const trip_cpu_staged *staged,
                                uint32_t at)
{
    vi packed = vi_load(staged->normal + at);
    vf strength;
    v3 g = view->normal_bytes == 3 ? unpack_compact_normal(view, packed, &strength)
                                   : unpack_normal(view, packed, &strength);
    v3 columns[3];
    for (int i = 0; i < 3; i++)
        columns[i] = (v3){ v_set((float)view->world[0][i]), v_set((float)view->world[1][i]),
                           v_set((float)view->world[2][i]) };
    return (flattening){
        .normal = unit((v3){ dot(columns[0], g), dot(columns[1], g), dot(columns[2], g) }),
        .share = v_min(v_set(1), strength) * v_set((float)view->splat.flatten),
    };
}

/* ---- the footprint ---- */

typedef struct footprint {
    vf l11, l21, l22; /* as in trip_cpu_splat */
    vf det_ratio;     /* |S| / |S'|; for affine splats, times the squared stretch */
    vf shift_x, shift_y, half_x, half_y; /* bounds of the support about the centre */
    vm precise; /* lanes with sufficient precision; all others are projected one by one */
} footprint;

/* Constants of a perspective view as floats. Rays are relative to the image's middle. The pixel
 * steps X = rx / step and Y = ry / step have a length near 1, so their squares fit a float however
 * narrow the view is. */
typedef struct perspective {
    vf middle_x, middle_y, step;
    vf rr, rX, rY, XX, XY, YY; /* dot products of r at the middle, X and Y */
    vf det;                    /* (r . X x Y)^2 */
    vf inverse_sigma;          /* for a splat at depth 1, in 1 / pixels: step (r . X x Y) / sigma */
    vf reach, inverse_step;    /* cutoff^2 step; 1 / step */
    vf near;                   /* 2 cutoff^2 step^2; in affine views the bound of splat.h */
    v3 middle, X, Y, XxY;      /* r at the middle, X, Y and X x Y, along the list's axes */
    v3 YxR, RxX;
    bool uneven; /* voxels are not cubes; a footprint may then be much longer than wide */
    bool affine;
} perspective;

/* Bound of u in footprint_of(). Beyond it the products there would leave a float's range. */
#define FARTHEST 1e12f

/* Returns the components along u, v and the list's axis. This is an even permutation, so cross
 * products keep their sign. */
INLINE v3 in_list_axes(const trip_cpu_view *view, trip_vec3 a)
{
    return v3_of(trip_v3(trip_component(a, view->u_axis), trip_component(a, view->v_axis),
                         trip_component(a, view->axis)));
}

/* Safety factor on the bound of affine splats. Splats close to the bound are projected one by one
 * in double precision. */
#define AFFINE_ROOM 1.001

INLINE perspective perspective_of(const trip_cpu_view *view)
{
    const trip_splat_frame *f = &view->splat;
    const trip_camera *c = &f->camera;
    trip_vec3 r = trip_camera_ray(c, 0.5 * c->width, 0.5 * c->height);
    double step = sqrt(fmax(f->rxrx, f->ryry));
    trip_vec3 x = trip_scale(c->rx, 1 / step), y = trip_scale(c->ry, 1 / step);
    double volume = trip_dot(r, trip_cross(x, y));
    double nearest = f->affine ? AFFINE_ROOM / (TRIP_SPLAT_AFFINE * TRIP_SPLAT_AFFINE) : 2;
    return (perspective){
        .middle_x = v_set((float)(0.5 * c->width)),
        .middle_y = v_set((float)(0.5 * c->height)),
        .step = v_set((float)step),
        .rr = v_set((float)trip_dot(r, r)),
        .rX = v_set((float)trip_dot(r, x)),
        .rY = v_set((float)trip_dot(r, y)),
        .XX = v_set((float)trip_dot(x, x)),
        .XY = v_set((float)trip_dot(x, y)),
        .YY = v_set((float)trip_dot(y, y)),
        .det = v_set((float)(volume * volume)),
        .inverse_sigma = v_set((float)(step * volume / f->sigma)),
        .reach = v_set((float)(f->cutoff2 * step)),
        .inverse_step = v_set((float)(1 / step)),
        .near = v_set((float)(nearest * f->cutoff2 * step * step)),
        .middle = in_list_axes(view, r),
        .X = in_list_axes(view, x),
        .Y = in_list_axes(view, y),
        .XxY = in_list_axes(view, trip_cross(x, y)),
        .YxR = in_list_axes(view, trip_cross(y, r)),
        .RxX = in_list_axes(view, trip_cross(r, x)),
        .uneven = view->stretch_varies,
        .affine = f->affine,
    };
}

/* Computes the bounds of the support: the ellipse of E and l in splat.h, both divided by u of
 * footprint_of(). k2 is cutoff^2 / u. The caller must widen the bounds for rounding. */
INLINE void bound(footprint *f, vf exx, vf exy, vf eyy, vf lx, vf ly, vf k2)
{
    vf inverse = v_set(1) / v_fnma(exy, exy, exx * eyy);
    f->shift_x = v_fnma(exy, ly, eyy * lx) * inverse;
    f->shift_y = v_fnma(exy, lx, exx * ly) * inverse;
    vf size = v_fma(lx, f->shift_x, v_fma(ly, f->shift_y, k2)) * inverse;
    f->half_x = v_sqrt(size * eyy);
    f->half_y = v_sqrt(size * exx);
}

/* Computes the bounds of an affine splat's support, an ellipse about the centre. */
INLINE void bound_affine(footprint *f, vf sxx, vf syy, vf k2)
{
    f->shift_x = f->shift_y = v_set(0);
    f->half_x = v_sqrt(k2 * sxx);
    f->half_y = v_sqrt(k2 * syy);
}

/* Returns (stretch / view->stretch)^2. (x, y) is in pixels from the image's middle. */
INLINE vf stretch2_at(const trip_cpu_view *view, vf x, vf y)
{
    vf stretch = ray_lengths_at(view, x, y).stretch;
    return stretch * stretch;
}

/* Returns whether little precision was lost in a difference from `whole`. */
INLINE vm is_exact(vf difference, vf whole)
{
    return v_ge(difference, whole * v_set(1e-2f));
}

/* S of a kernel (splat.h) and its determinant. */
typedef struct spread {
    vf xx, xy, yy, det;
} spread;

INLINE v3 cross(v3 a, v3 b)
{
    return (v3){ v_fnma(a.z, b.y, a.y * b.z), v_fnma(a.x, b.z, a.z * b.x),
                 v_fnma(a.y, b.x, a.x * b.y) };
}

INLINE vf mixed(vf a, vf b, vf share)
{
    return v_fma(share, b - a, a);
}

/* Returns S of a flattened kernel from S of the round kernel:
 *     (1 - share) S + share [(gx x n).(gx x n) ...]
 * gx and gy are the gradients of x and y, and n is the normal. The second term is the part
 * perpendicular to n. `along2` is (n . r)^2 and `all2` is r . r for the ray r. */
INLINE spread flattened(spread s, const flattening *f, v3 gx, v3 gy, vf along2, vf all2)
{
    v3 x = cross(gx, f->normal), y = cross(gy, f->normal);
    return (spread){ mixed(s.xx, dot(x, x), f->share), mixed(s.xy, dot(x, y), f->share),
                     mixed(s.yy, dot(y, y), f->share),
                     s.det * mixed(v_set(1), along2 / all2, f->share) };
}

/* Flattens the S of a splat with its centre (x, y) steps from the image's middle. */
INLINE spread flattened_at(const perspective *p, spread s, const flattening *f, vf x, vf y, vf rr)
{
    vf along =
        v_fma(x, dot(p->X, f->normal), v_fma(y, dot(p->Y, f->normal), dot(p->middle, f->normal)));
    v3 gx = { v_fnma(x, p->XxY.x, p->YxR.x), v_fnma(x, p->XxY.y, p->YxR.y),
              v_fnma(x, p->XxY.z, p->YxR.z) };
    v3 gy = { v_fnma(y, p->XxY.x, p->RxX.x), v_fnma(y, p->XxY.y, p->RxX.y),
              v_fnma(y, p->XxY.z, p->RxX.z) };
    return flattened(s, f, gx, gy, along * along, rr);
}

/* Computes the footprints of V splats in perspective. With D = r_c . X x Y, constant over the
 * image, and u = (step D z / sigma)^2,
 *     u S = adj [X x r_c, Y x r_c],  |u S| = D^2 |r_c|^2.
 * Only u depends on the size of a splat in pixels; all other numbers are near 1. */
INLINE footprint footprint_of(const perspective *p, const trip_cpu_view *view,
                              const trip_cpu_lanes *lanes, const flattening *flat, uint32_t at)
{
    const trip_splat_frame *f = &view->splat;
    footprint out;
    vf x = ((v_load(lanes->whole_x + at) - p->middle_x) + v_load(lanes->x + at)) * p->step;
    vf y = ((v_load(lanes->whole_y + at) - p->middle_y) + v_load(lanes->y + at)) * p->step;
    vf rx = v_fma(x, p->XX, v_fma(y, p->XY, p->rX)); /* r_c . X */
    vf ry = v_fma(x, p->XY, v_fma(y, p->YY, p->rY));
    vf rr = v_fma(x, p->rX + rx, v_fma(y, p->rY + ry, p->rr)); /* |r_c|^2 */
    vf u = p->inverse_sigma * v_load(lanes->z + at);
    u = u * u;
    /* From here on S, S' and the low-pass filter are multiplied by u. */
    vf low_pass = v_set((float)f->low_pass2) * u;
    vf sxx = v_fnma(ry, ry, rr * p->YY), syy = v_fnma(rx, rx, rr * p->XX);
    vf sxy = v_fnma(rr, p->XY, rx * ry);
    vm exact = vm_first(V);
    if (p->uneven)
        exact = vm_and(is_exact(sxx, rr * p->YY), is_exact(syy, rr * p->XX));
    vf det_s = p->det * rr;
    vf trace = v_fma(p->XX, sxx + low_pass, v_fma(p->YY, syy + low_pass, (p->XY + p->XY) * sxy));
    spread shape = { sxx, sxy, syy, det_s };
    if (flat) {
        shape = flattened_at(p, shape, flat, x, y, rr);
        sxx = shape.xx, sxy = shape.xy, syy = shape.yy;
    }
    vf det = v_fma(low_pass, sxx + syy + low_pass, shape.det);
    sxx = sxx + low_pass;
    syy = syy + low_pass;

    /* q^T S'^-1 q = (syy / det) (x - sxy / syy y)^2 + y^2 / syy */
    vf inverse = v_set(1) / (det * syy);
    vf inverse_det = syy * inverse, inverse_syy = det * inverse;
    vf rr_u = rr * u, unit = (p->affine ? u : rr_u) * v_set((float)(1 / f->cutoff2));
    out.l11 = v_sqrt(unit * (syy * inverse_det));
    out.l21 = -(sxy * inverse_syy) * out.l11;
    out.l22 = v_sqrt(unit * inverse_syy);
    out.det_ratio = det_s * inverse_det;

    /* The trace is computed for round kernels. E is S'^-1 minus a matrix M, and S' M has the trace
     * k^2 / |r_c|^2 times `trace`. The test requires twice the value that makes E positive
     * definite. Then |v - eye|^2 exceeds 4 R^2 and R^2 + radius^2 of splat.h, so no near splat
     * passes. NaN fails the test. */
    out.precise = vm_and(v_ge(rr_u, trace * p->near), v_ge(v_set(FARTHEST), u));
    if (p->affine) {
        out.precise = vm_and(out.precise, exact);
        bound_affine(&out, sxx, syy, v_set((float)f->cutoff2) / u);
        if (p->uneven)
            out.det_ratio =
                out.det_ratio * stretch2_at(view, x * p->inverse_step, y * p->inverse_step);
        return out;
    }
    vf t = p->reach / rr_u, t_step = t * p->step;
    vf exx = v_fnma(t_step, p->XX, syy * inverse_det),
       eyy = v_fnma(t_step, p->YY, sxx * inverse_det);
    vf exy = v_fnma(t_step, p->XY, -sxy * inverse_det);
    if (p->uneven)
        out.precise =
            vm_and(vm_and(out.precise, exact), is_exact(v_fnma(exy, exy, exx * eyy), exx * eyy));
    bound(&out, exx, exy, eyy, t * rx, t * ry, t * rr * p->inverse_step);
    return out;
}

/* Computes the footprints of flattened kernels in a parallel view. */
INLINE footprint footprint_flat_parallel(const trip_cpu_view *view, const flattening *flat)
{
    const trip_splat_frame *f = &view->splat;
    const trip_camera *c = &f->camera;
    double xx = trip_dot(c->to_x, c->to_x), yy = trip_dot(c->to_y, c->to_y), max = fmax(xx, yy);
    double area = trip_length(trip_cross(c->to_x, c->to_y)) / max, root = 1 / sqrt(max);
    v3 gx = in_list_axes(view, trip_scale(c->to_x, root));
    v3 gy = in_list_axes(view, trip_scale(c->to_y, root));
    vf along = dot(in_list_axes(view, trip_normalize(c->r0)), flat->normal);
    /* S, S' and the low-pass filter are divided by sigma^2 max. */
    spread s = { v_set((float)(xx / max)), v_set((float)(trip_dot(c->to_x, c->to_y) / max)),
                 v_set((float)(yy / max)), v_set((float)(area * area)) };
    vf det_s = s.det, low_pass = v_set((float)(f->low_pass2 / (f->sigma * f->sigma * max)));
    s = flattened(s, flat, gx, gy, along * along, v_set(1));
    vf det = v_fma(low_pass, s.xx + s.yy + low_pass, s.det);
    vf sxx = s.xx + low_pass, syy = s.yy + low_pass;
    vf unit = v_set((float)(1 / (f->cutoff2 * f->sigma * f->sigma * max)));
    footprint out = { .det_ratio = det_s / det };
    out.l11 = v_sqrt(unit * (syy / det));
    out.l21 = -(s.xy / syy) * out.l11;
    out.l22 = v_sqrt(unit / syy);
    bound_affine(&out, sxx, syy, v_set((float)(f->cutoff2 * f->sigma * f->sigma * max)));
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
        .det_ratio = v_set((float)pow(s->amplitude / view->splat.amplitude, 2)),
        .shift_x = v_set((float)(0.5 * (s->x0 + s->x1) - s->x)),
        .shift_y = v_set((float)(0.5 * (s->y0 + s->y1) - s->y)),
        .half_x = v_set((float)(0.5 * (s->x1 - s->x0))),
        .half_y = v_set((float)(0.5 * (s->y1 - s->y0))),
    };
}

/* ---- colour and light ---- */

typedef struct colour {
    vf r, g, b;
} colour;

INLINE vf offset(vd_pair a, double eye)
{
    return v_narrow(a.lo - vd_set(eye), a.hi - vd_set(eye));
}

/* Returns the vector from the voxel to a position, in world space, not normalised. */
INLINE v3 towards(const trip_cpu_view *view, const double position[3],
                  const trip_cpu_staged *staged, uint32_t at)
{
    vf c[3] = { offset(positions(view, view->u_axis, staged->u + at), position[0]),
                offset(positions(view, view->v_axis, staged->v + at), position[1]),
                offset(positions(view, view->axis, staged->sheet + at), position[2]) };
    vf w[3];
    for (int i = 0; i < 3; i++)
        w[i] = -v_fma(
            v_set((float)view->world[i][0]), c[0],
            v_fma(v_set((float)view->world[i][1]), c[1], v_set((float)view->world[i][2]) * c[2]));
    return (v3){ w[0], w[1], w[2] };
}

/* Returns the vector from the voxel to the eye, in world space, not normalised. */
INLINE v3 towards_eye(const trip_cpu_view *view, const trip_cpu_staged *staged, uint32_t at)
{
    const trip_camera *camera = &view->splat.camera;
    if (camera->ortho)
        return v3_of(trip_scale(camera->world_forward, -1));
    return towards(view, view->eye, staged, at);
}

/* Returns the unit vector to the light. `eye` is the unit vector to the eye. */
INLINE v3 light_of(const trip_cpu_view *view, v3 eye, const trip_cpu_staged *staged, uint32_t at)
{
    const trip_settings *s = view->of->settings;
    if (s->headlight)
        return eye;
    return s->point_light ? unit(towards(view, view->light, staged, at))
                          : v3_of(s->light_direction);
}

/* Mirrors trip_light_on(). `eye` and `light` have unit length. With a headlight, `facing` is left
 * out, since it changes no float. */
INLINE surface surface_of(const trip_cpu_view *view, v3 eye, v3 light, vi packed)
{
    const trip_settings *s = view->of->settings;
    vf magnitude;
    v3 normal = view->normal_bytes == 3 ? unpack_compact_normal(view, packed, &magnitude)
                                        : unpack_normal(view, packed, &magnitude);
    vf strength = v_min(v_set(1), magnitude), shining = strength;
    vf to_light = dot(normal, eye), to_half = to_light;
    if (!s->headlight) {
        vf to_eye = to_light * v_set((float)TRIP_FACING);
        to_light = dot(normal, light);
        to_half = dot(normal, unit((v3){ light.x + eye.x, light.y + eye.y, light.z + eye.z }));
        shining = strength * v_min(v_set(1), v_max(v_set(0), to_light * to_eye));
    }
    vf diffuse = v_abs(to_light);
    /* The bound keeps the 24th power above 2^-126. Processors are slow with smaller numbers. */
    vf h2 = v_max(to_half * to_half, v_set(0x1p-8f));
    vf h8 = (h2 * h2) * (h2 * h2);
    static_assert((int)TRIP_SHININESS == 24, "the power below");
    return (surface){ .strength = strength,
                      .diffuse = diffuse,
                      .gloss = shining * v_set((float)TRIP_SPECULAR) * ((h8 * h8) * h8),
                      .normal = { normal.x, normal.y, normal.z } };
}

/* Mirrors trip_shade() for colours in [0, 1]. Voxels without a surface have strength 0 and keep
 * their colour. */
INLINE colour shaded(const surface *s, colour c)
{
    vf matt = v_fma(s->diffuse, v_set((float)TRIP_DIFFUSE), v_set((float)(TRIP_AMBIENT - 1)));
    matt = v_fma(s->strength, matt, v_set(1));
    return (colour){ v_min(v_set(1), v_fma(c.r, matt, s->gloss)),
                     v_min(v_set(1), v_fma(c.g, matt, s->gloss)),
                     v_min(v_set(1), v_fma(c.b, matt, s->gloss)) };
}

INLINE vf position_along(const trip_cpu_view *view, int axis, const int32_t *voxels)
{
    if (!view->coordinates)
        return v_from_int(vi_load(voxels));
    const vd_pair bit_positions = positions(view, axis, voxels);
    return v_narrow(bit_positions.lo, bit_positions.hi);
}

/* Applies the frame's effects to a colour. `s` has strength 0 without shading. */
INLINE colour with_effects(const trip_cpu_view *view, colour c, v3 eye, v3 light, const surface *s,
                           const trip_cpu_staged *staged, uint32_t at)
{
    const vf position[3] = { position_along(view, view->u_axis, staged->u + at),
                             position_along(view, view->v_axis, staged->v + at),
                             position_along(view, view->axis, staged->sheet + at) };
    const vf to_light[3] = { light.x, light.y, light.z }, to_eye[3] = { eye.x, eye.y, eye.z };
    vf rgb[3] = { c.r, c.g, c.b };
    effects_on(&view->effects, position, s, to_light, to_eye, rgb);
    return (colour){ rgb[0], rgb[1], rgb[2] };
}

/* ---- putting it together ---- */

/* Returns log2 of a positive number with an error below 3e-7. The polynomial is from Cephes'
 * logf(). */
INLINE vf log2_of(vf a)
{
    vi t = (vi)((vu)v_bits(a) - 0x3f3504f3u); /* sqrt(1/2); wraps in lanes without a splat */
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

/* Computes the first and last pixel with a centre within `half` of whole + part + shift. The bounds
 * are slightly enlarged. There is none if first > last. */
INLINE void pixels(vf whole, vf part, vf shift, vf half, int size, vi *first, vi *last)
{
    const vf zero = v_set(0), edge = v_set((float)size);
    vf middle = whole + (part + shift);
    vf slack = v_fma(half + v_abs(shift), v_set(1e-3f), v_set(1e-3f));
    slack = v_fma(v_abs(middle), v_set(1e-6f), slack);
    vf reach = half + slack - v_set(0.5f);
    /* v_max() returns its second argument if the first is NaN. */
    *first = v_truncate(v_min(v_max(middle - reach, zero), edge));
    *last = v_truncate(v_min(v_max(middle + reach + v_set(1), zero), edge)) - 1;
}

INLINE vm less_or_equal(vi a, vi b)
{
    return v_ge(v_from_int(b), v_from_int(a));
}

/* Mirrors trip_cpu_panes(). */
INLINE vi panes_of(vi x0, vi y0, vi x1, vi y1, int across)
{
    const vi one = vi_set(1);
    static_assert(TRIP_CPU_PANE == 32, "the shifts below");
    vi x = x0 >> 5, y = y0 >> 5, right = (x1 >> 5) - x, below = (y1 >> 5) - y;
    vi more = v_shift_right((one - right) | (one - below), 31); /* 1 if either exceeds 1 */
    vi any_right = v_shift_right(-right, 31), any_below = v_shift_right(-below, 31);
    return y * across + x + (any_right << TRIP_CPU_PANES_RIGHT_SHIFT) +
           (any_below << TRIP_CPU_PANES_BELOW_SHIFT) + more * (int32_t)TRIP_CPU_PANES_MORE;
}

/* Returns the first pixel of a pixel's pane along an axis. */
INLINE vf first_of_pane(vi pixel)
{
    return v_from_int(pixel & ~(TRIP_CPU_PANE - 1));
}

/* Computes all fields of the splats except colour and opacity. Returns the lanes that have pixels.
 */
INLINE unsigned complete(const trip_cpu_view *view, const footprint *f, vf extinction,
                         trip_cpu_lanes *lanes, uint32_t at)
{
    const trip_camera *camera = &view->splat.camera;
    vf depth = extinction * v_set((float)(view->splat.amplitude * view->stretch));
    depth = depth * v_sqrt(f->det_ratio);
    vi x0, x1, y0, y1;
    pixels(v_load(lanes->whole_x + at), v_load(lanes->x + at), f->shift_x, f->half_x, camera->width,
           &x0, &x1);
    pixels(v_load(lanes->whole_y + at), v_load(lanes->y + at), f->shift_y, f->half_y,
           camera->height, &y0, &y1);
    vf x = v_load(lanes->x + at) + (v_load(lanes->whole_x + at) - first_of_pane(x0));
    vf y = v_load(lanes->y + at) + (v_load(lanes->whole_y + at) - first_of_pane(y0));
    v_store(lanes->l11 + at, f->l11);
    v_store(lanes->l21 + at, f->l21);
    v_store(lanes->l22 + at, f->l22);
    v_store(lanes->l1 + at, -v_fma(f->l11, x, f->l21 * y));
    v_store(lanes->l2 + at, -(f->l22 * y));
    v_store(lanes->depth + at, depth);
    vi_store(lanes->first + at, x0 | y0 << 16);
    vi_store(lanes->last + at, x1 | y1 << 16);
    vi_store(lanes->panes + at, panes_of(x0, y0, x1, y1, view->panes_across));
    vm seen = vm_and(v_gt(v_load(lanes->z + at), v_set(0)), v_gt(depth, v_set(FAINTEST)));
    return vm_bits(vm_and(seen, vm_and(less_or_equal(x0, x1), less_or_equal(y0, y1))));
}

/* Computes the offsets of the lanes' records in the output, in floats, and returns the number of
 * kept lanes. The next lane overwrites a lane that is not kept. */
INLINE uint32_t rank(unsigned bits, uint32_t row[V])
{
    uint32_t n = 0;
    for (unsigned i = 0; i < V; i++) {
        row[i] = n * 16;
        n += bits >> i & 1;
    }
    return n;
}

/* Projects the given lanes one by one and returns the lanes that are drawn. If sheets are summed,
 * it sets `depths` to the peaks. */
static unsigned project_scalar(const trip_cpu_view *view, const trip_cpu_staged *staged,
                               uint32_t at, unsigned lanes, trip_cpu_splat splats[V], float *depths,
                               bool *broken)
{
    unsigned drawn = 0;
    flattening along = { .share = v_set(0) };
    if (view->flattens)
        along = flattening_of(view, staged, at);
    for (; lanes; lanes &= lanes - 1) {
        unsigned i = (unsigned)__builtin_ctz(lanes);
        uint32_t k = at + i;
        double extinction = (double)trip_cpu_rows(view)[staged->code[k]].extinction;
        const float flat[4] = { along.normal.x[i], along.normal.y[i], along.normal.z[i],
                                along.share[i] };
        if (trip_cpu_project_scalar(view, staged->u[k], staged->v[k], staged->sheet[k], extinction,
                                    view->flattens ? flat : NULL, &splats[i], broken))
            drawn |= 1u << i;
        if (view->sums)
            depths[i] = splats[i].peak;
    }
    return drawn;
}

/* Returns whether the splat's c[] holds an edge that long_depth() subtracts. */
static bool has_edge(const trip_cpu_view *view, const trip_cpu_splat *s)
{
    const bool thick = s->panes >> TRIP_CPU_PANES_THICK_SHIFT;
    if (view->sums || (s->panes & TRIP_CPU_PANES_NEAR && trip_cpu_own_rays(view)))
        return false;
    return thick || view->rays == TRIP_CPU_STRETCHED;
}

/* Replaces the geometry of splats that were projected one by one, and keeps their colours. The edge
 * is computed with the kernels' exponential, so that the optical depth is exactly 0 at the edge of
 * the support. */
static void replace_scalar(const trip_cpu_view *view, trip_cpu_splat *out, const uint32_t row[V],
                           unsigned lanes, const trip_cpu_splat splats[V])
{
    for (; lanes; lanes &= lanes - 1) {
        unsigned i = (unsigned)__builtin_ctz(lanes);
        trip_cpu_splat *s = out + row[i] / 16;
        trip_cpu_splat n = splats[i];
        if (has_edge(view, &n))
            n.c[TRIP_CPU_EDGE] = exp2_biased(v_set(n.c[TRIP_CPU_MIN]))[0];
        n.r = s->r;
        n.g = s->g;
        n.b = s->b;
        *s = n;
    }
}

INLINE colour colour_of(const trip_cpu_view *view, const trip_cpu_staged *staged, uint32_t at)
{
    vf entry[4];
    v_load_rows(&trip_cpu_rows(view)->r, staged->code + at, entry);
    colour c = { entry[0], entry[1], entry[2] };
    if (view->has_debug_colour)
        c = (colour){ v_set(view->debug_colour[0]), v_set(view->debug_colour[1]),
                      v_set(view->debug_colour[2]) };
    if (!view->shading && !TRIP_CPU_EFFECTS)
        return c;
    const v3 eye = unit(towards_eye(view, staged, at)), light = light_of(view, eye, staged, at);
    surface s;
    if (view->shading)
        s = surface_of(view, eye, light, vi_load(staged->normal + at));
    else
        s = (surface){ .strength = v_set(0), .gloss = v_set(0) };
    return TRIP_CPU_EFFECTS ? with_effects(view, c, eye, light, &s, staged, at) : shaded(&s, c);
}

/* Computes trip_cpu_splat.c[] for thin splats. */
INLINE void thin_terms(vf depth, vf c[TRIP_CPU_TERMS])
{
    vf root = v_sqrt(depth);
    for (int i = 0; i < TRIP_CPU_TERMS; i++) {
        const float *by = trip_cpu_thin[i];
        vf sum = v_fma(v_set(by[3]), depth, v_set(by[2]));
        c[i] = v_fma(v_fma(sum, depth, v_set(by[1])), depth, v_set(by[0])) * root;
    }
}

/* Computes c[MIN] and c[EDGE] for the lanes `which`. */
INLINE void long_terms(const trip_cpu_view *view, vf depth, vm which, vf c[TRIP_CPU_TERMS])
{
    vf one = v_set((float)TRIP_CPU_EXP_UNIT), bias = v_set((float)(127 * TRIP_CPU_EXP_UNIT));
    vf min = v_fma(log2_of(depth), one, bias) - v_set(view->cutoff);
    c[TRIP_CPU_MIN] = v_select(which, min, c[TRIP_CPU_MIN]);
    c[TRIP_CPU_EDGE] = v_select(which, exp2_biased(min), c[TRIP_CPU_EDGE]);
}

/* Stores the kept lanes as splats for summed sheets. */
INLINE void store_summed(const trip_cpu_lanes *lanes, const trip_cpu_staged *staged, uint32_t at,
                         const uint32_t row[V], colour light, trip_cpu_splat *out)
{
    float *base = &out->l11;
    /* The limit avoids overflow, and splats above it are opaque in any case. */
    vf peak = v_min(v_load(lanes->depth + at), v_set(0x1p90f));
    v_store_rows(base, row, v_load(lanes->l11 + at), v_load(lanes->l21 + at),
                 v_load(lanes->l22 + at), v_load(lanes->l1 + at));
    v_store_rows(base + 4, row, v_load(lanes->l2 + at), light.r * peak, light.g * peak,
                 light.b * peak);
    v_store_rows(base + 8, row, peak, v_from_bits(vi_load(staged->sheet + at)), v_set(0), v_set(0));
    v_store_rows(base + 12, row, v_set(0), v_load(lanes->first + at), v_load(lanes->last + at),
                 v_load(lanes->panes + at));
}

INLINE void store(const trip_cpu_view *view, const trip_cpu_lanes *lanes, uint32_t at,
                  const uint32_t row[V], colour light, trip_cpu_splat *out)
{
    float *base = &out->l11;
    vf depth = v_load(lanes->depth + at), c[TRIP_CPU_TERMS];
    vf panes = v_load(lanes->panes + at), limit = v_set(view->thin);
    if (view->rays == TRIP_CPU_STRETCHED) {
        c[0] = c[1] = c[2] = c[3] = c[4] = v_set(0);
        long_terms(view, depth, vm_first(V), c);
    } else {
        thin_terms(depth, c);
        if (vm_any(v_gt(depth, limit)))
            long_terms(view, depth, v_gt(depth, limit), c);
    }
    const vi thick = vi_set(INT32_MIN);
    static_assert(TRIP_CPU_PANES_THICK_SHIFT == 31, "the bit above");
    panes = v_select(v_gt(depth, limit), v_from_bits(v_bits(panes) | thick), panes);
    v_store_rows(base, row, v_load(lanes->l11 + at), v_load(lanes->l21 + at),
                 v_load(lanes->l22 + at), v_load(lanes->l1 + at));
    v_store_rows(base + 4, row, v_load(lanes->l2 + at), light.r, light.g, light.b);
    v_store_rows(base + 8, row, c[0], c[1], c[2], c[3]);
    v_store_rows(base + 12, row, c[4], v_load(lanes->first + at), v_load(lanes->last + at), panes);
}

INLINE void store_depths_of(const trip_cpu_view *view, const trip_cpu_lanes *lanes, uint32_t at,
                            const uint32_t row[V], float *depths)
{
    float z[V];
    v_store(z, v_max(v_load(lanes->z + at), v_set(0)) * v_set((float)view->depth_unit));
    for (int i = 0; i < V; i++)
        depths[row[i] / 16] = z[i];
}

static uint32_t store_splats(const trip_cpu_view *view, const trip_cpu_staged *staged, uint32_t at,
                             trip_cpu_lanes *lanes, trip_cpu_splat *out, float *depths)
{
    uint32_t row[V];
    unsigned kept = lanes->kept[at / V], scalar = lanes->scalar[at / V];
    trip_cpu_splat replaced[V];
    if (scalar)
        scalar =
            project_scalar(view, staged, at, scalar, replaced, lanes->depth + at, &lanes->broken);
    kept |= scalar;
    if (kept == 0)
        return 0;
    uint32_t n = rank(kept, row);
    if (view->sums)
        store_summed(lanes, staged, at, row, colour_of(view, staged, at), out);
    else
        store(view, lanes, at, row, colour_of(view, staged, at), out);
    if (TRIP_CPU_DEPTH)
        store_depths_of(view, lanes, at, row, depths);
    if (scalar)
        replace_scalar(view, out, row, scalar, replaced);
    return n;
}

/* Projects in three loops. Each is short enough that the processor works on several vectors at
 * once. In a single loop it would wait for the chain of divisions and roots. Splats over terminated
 * texels are left out before they are coloured, stored, sorted and gathered.
 *
 * `common` means round kernels in perspective with exact footprints; `uneven` is then
 * view->stretch_varies. */
INLINE uint32_t project_as(bool common, bool uneven, const trip_cpu_view *view,
                           const _Atomic uint64_t *open, const trip_cpu_staged *staged,
                           uint32_t count, trip_cpu_lanes *lanes, trip_cpu_splat *out,
                           float *depths)
{
    uint32_t n = 0;
    const bool ortho = !common && view->splat.camera.ortho, flattens = !common && view->flattens;
    footprint parallel = footprint_parallel(view);
    perspective persp = perspective_of(view);
    if (common) {
        persp.uneven = uneven;
        persp.affine = false;
    }
    for (uint32_t i = 0; i < count; i += V)
        position(view, staged, i, lanes);
    for (uint32_t i = 0; i < count; i += V) {
        footprint f = parallel;
        flattening flat;
        if (flattens)
            flat = flattening_of(view, staged, i);
        if (flattens && ortho)
            f = footprint_flat_parallel(view, &flat);
        if (!ortho)
            f = footprint_of(&persp, view, lanes, flattens ? &flat : NULL, i);
        else
            f.precise = v_ge(v_load(lanes->z + i), v_set(view->near));
        unsigned valid = vm_bits(vm_first(count - i));
        unsigned behind = vm_bits(v_ge(v_set(view->behind), v_load(lanes->z + i)));
        unsigned precise = view->coordinates ? 0 : vm_bits(f.precise);
        unsigned scalar = valid & ~behind & ~precise;
        vf entry[4];
        v_load_rows(&trip_cpu_rows(view)->r, staged->code + i, entry);
        unsigned kept = complete(view, &f, entry[3], lanes, i) & valid & ~scalar;
        if (open && kept)
            kept &= over_open_texels(lanes, i, open, view->panes_across);
        lanes->kept[i / V] = kept;
        lanes->scalar[i / V] = scalar;
    }
    for (uint32_t i = 0; i < count; i += V)
        n += store_splats(view, staged, i, lanes, out + n, TRIP_CPU_DEPTH ? depths + n : NULL);
    return n;
}

/* Round kernels in perspective have two specialised variants: for cubic voxels and for all others.
 */
static uint32_t project(const trip_cpu_view *view, const _Atomic uint64_t *open,
                        const trip_cpu_staged *staged, uint32_t count, trip_cpu_lanes *lanes,
                        trip_cpu_splat *out, float *depths)
{
    if (view->splat.camera.ortho || view->splat.affine || view->flattens)
        return project_as(false, false, view, open, staged, count, lanes, out, depths);
    if (view->stretch_varies)
        return project_as(true, true, view, open, staged, count, lanes, out, depths);
    return project_as(true, false, view, open, staged, count, lanes, out, depths);
}

#endif
