#include "cpu/count.h"

#include "cpu/batch.h"
#include "report.h"
#include "weight.h"

/* The kernels leave out no single splat for its weight, so that they have no bound of their own to
 * count by: this is the definition's. What lies behind the eye is the same by both: wherever a
 * support is near it, trip_splat_project() decides for the kernels too. */
static bool is_projected(const trip_cpu_view *view, int u, int v, int sheet)
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

void trip_cpu_count_part(const trip_cpu *r, trip_cpu_worker *w, trip_cpu_chunk *chunk,
                         const trip_block *block, const trip_cpu_part *part)
{
    const trip_cpu_view *view = &r->counted_views[chunk->list];
    trip_cpu_walk at = trip_cpu_walk_begin(block, false);
    while (trip_cpu_walk_next(&at)) {
        if (!trip_cpu_part_has(part, at.number))
            continue;
        trip_cpu_square square = trip_cpu_make_square(r, w, block, part->run, &at);
        if (square.mask == 0)
            continue;
        const trip_cpu_staged *staged = &w->scratch.staged;
        uint32_t n = r->isa->stage(view, &square, false, &w->scratch.staged, 0);
        for (uint32_t i = 0; i < n; i++)
            chunk->counts.splats_projected +=
                is_projected(view, staged->u[i], staged->v[i], staged->sheet[i]);
        n = r->isa->project(view, NULL, &w->scratch.staged, n, &w->scratch.lanes, w->counted, NULL);
        chunk->counts.splats_drawn += r->isa->drawn(view, &w->scratch, w->counted, n);
    }
}

int trip_cpu_begin_counting(trip_cpu *r)
{
    const trip_camera *camera = r->frame->camera;
    if (!r->visible)
        r->visible = trip_budget_take(r->budget, TRIP_CPU_COUNT_TABLE_BYTES);
    if (!r->visible)
        return trip_fail(TRIP_ERROR, "render", "CPU renderer",
                         "the memory given does not suffice for counting; raise --memory");
    /* Any extinction will do that the kernels do not take for nothing. */
    for (int i = 0; i < 65536; i++)
        r->visible[i] = (trip_tf_entry){ .extinction = (float)(0x1p20 / camera->voxel_world) };
    r->counted_frame = *r->frame;
    r->counted_frame.table = r->visible;
    return 0;
}
