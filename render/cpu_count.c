#include "cpu_count.h"

#include "weight.h"

static bool has_weight(const trip_cpu_view *view, int x, int y)
{
    trip_vec3 ray = trip_camera_ray(&view->splat.camera, x + 0.5, y + 0.5);
    return trip_weight(view->of->settings, view->of->plan->axis_of_view, ray, view->axis) > 0;
}

static bool touches(const trip_cpu_view *view, const trip_splat *s, int x, int y)
{
    return trip_splat_radius2(&view->splat, s, x + 0.5, y + 0.5) <= view->splat.cutoff2 &&
           has_weight(view, x, y);
}

/* The pixels whose centres lie in [lo, hi], cut to the image. */
static void pixel_range(double lo, double hi, int size, int *first, int *last)
{
    *first = (int)fmin(size, fmax(0, ceil(lo - 0.5)));
    *last = (int)fmax(-1, fmin(size - 1, floor(hi - 0.5)));
}

/* True when some pixel centre is in the support where the list has weight; the middle one is the
 * likeliest. */
static bool is_drawn(const trip_cpu_view *view, const trip_splat *s)
{
    const trip_camera *camera = &view->splat.camera;
    int x0, x1, y0, y1;
    pixel_range(s->x0, s->x1, camera->width, &x0, &x1);
    pixel_range(s->y0, s->y1, camera->height, &y0, &y1);
    if (x0 <= x1 && y0 <= y1 && touches(view, s, (x0 + x1) / 2, (y0 + y1) / 2))
        return true;
    for (int y = y0; y <= y1; y++)
        for (int x = x0; x <= x1; x++)
            if (touches(view, s, x, y))
                return true;
    return false;
}

void trip_cpu_count(const trip_cpu_view *view, const trip_run *run, uint32_t voxel,
                    trip_list_stats *stats)
{
    const trip_camera *camera = &view->splat.camera;
    double p[3];
    p[view->axis] = run->sheet;
    p[view->u_axis] = run->u + (int)trip_voxel_u(voxel);
    p[view->v_axis] = run->v + (int)trip_voxel_v(voxel);
    trip_vec3 position = trip_v3(p[0], p[1], p[2]);
    trip_splat s;
    if (!trip_splat_project(&view->splat, position, &s) ||
        !trip_weight_may_reach(view->of->settings, camera, view->of->plan->axis_of_view, view->axis,
                               trip_sub(position, camera->eye), s.radius))
        return;
    stats->splats_projected++;
    stats->splats_drawn += is_drawn(view, &s);
}
