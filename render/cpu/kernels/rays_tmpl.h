/* Computes the lengths of V rays of a view at once. Included after simd_tmpl.h. */
#ifndef TRIP_CPU_RAYS_H
#define TRIP_CPU_RAYS_H

#include "cpu/kernels/kernels.h"
#include "cpu/kernels/simd_tmpl.h"

/* Evaluates ray2 or world2 of trip_cpu_view. (x, y) is in pixels from the image's middle. */
INLINE vf form_at(const float form[6], vf x, vf y)
{
    vf fx = v_fma(x, v_set(form[3]), v_fma(y, v_set(form[4]), v_set(form[1])));
    vf fy = v_fma(y, v_set(form[5]), v_set(form[2]));
    return v_fma(x, fx, v_fma(y, fy, v_set(form[0])));
}

/* G (trip_cpu_rays) and the stretch of splat.h, for perspective views. */
typedef struct ray_lengths {
    vf g, stretch;
} ray_lengths;

INLINE ray_lengths ray_lengths_at(const trip_cpu_view *view, vf x, vf y)
{
    ray_lengths r = { .g = v_set(1) / form_at(view->ray2, x, y), .stretch = v_set(1) };
    if (view->stretch_varies)
        r.stretch = v_sqrt(form_at(view->world2, x, y) * r.g);
    return r;
}

#endif
