#include "cpu/count.h"

#include "weight.h"

bool trip_cpu_is_projected(const trip_cpu_view *view, int u, int v, int sheet)
{
    const trip_camera *camera = &view->splat.camera;
    const trip_list_grid *grid = &view->of->plan->lists[view->list->index].grid;
    double p[3];
    p[view->axis] = sheet;
    p[view->u_axis] = u;
    p[view->v_axis] = v;
    trip_vec3 position = trip_v3(p[0], p[1], p[2]);
    trip_splat s;
    return trip_splat_project(&view->splat, position, &s) &&
           trip_weight_may_reach(view->of->settings, view->of->camera, view->of->plan->axis_of_view,
                                 view->axis,
                                 trip_list_grid_vector(grid, trip_sub(position, camera->eye)),
                                 s.radius * trip_list_grid_growth(grid));
}
