#include "cpu/cpu_batch.h"

#include "report.h"
#include "weight.h"

static const trip_list_grid *grid_of(const trip_cpu_view *view)
{
    return &view->of->plan->lists[view->list->index].grid;
}

/* Returns the bound by which the kernel `reaching` culls splats of the list. */
static trip_cpu_reach reach_of(const trip_cpu_view *view)
{
    const trip_settings *s = view->of->settings;
    const trip_list_grid *grid = grid_of(view);
    const int axes[3] = { view->u_axis, view->v_axis, view->axis };
    const double h = trip_weight_h(s);
    trip_cpu_reach reach = { .bounded = !view->of->camera->ortho && s->method != TRIP_METHOD_AXIS,
                             .inclusive = s->method == TRIP_METHOD_CLIP,
                             .h = (float)h,
                             .across = (float)(sqrt(1 + h * h) * trip_list_grid_growth(grid)) };
    for (int i = 0; i < 3; i++)
        reach.scale[i] = (float)grid->scale[axes[i]];
    return reach;
}

/* Tests one splat that the kernels leave to trip_splat_project(). */
static bool is_reaching(const trip_cpu_view *view, const trip_cpu_staged *staged, uint32_t i)
{
    double p[3];
    p[view->axis] = staged->sheet[i];
    p[view->u_axis] = staged->u[i];
    p[view->v_axis] = staged->v[i];
    trip_vec3 voxel = trip_v3(p[0], p[1], p[2]);
    trip_vec3 from_eye = trip_sub(trip_coordinates_point(&view->of->data->coordinates, voxel),
                                  view->splat.camera.eye);
    trip_splat_frame local;
    double growth;
    trip_vec3 position =
        trip_splat_position(&view->splat, &view->of->data->coordinates, voxel, &local, &growth);
    trip_splat s;
    return trip_splat_project(&local, position, &s) &&
           trip_weight_may_reach(view->of->settings, view->of->camera, view->of->plan->axis_of_view,
                                 view->axis, trip_list_grid_vector(grid_of(view), from_eye),
                                 growth * s.radius * trip_list_grid_growth(grid_of(view)));
}

/* Counts the staged splats that may reach a ray on which the list has weight. The renderer does not
 * draw other splats. */
static uint32_t count_reaching(const trip_cpu *r, const trip_cpu_view *view, trip_cpu_worker *w,
                               uint32_t n)
{
    const trip_cpu_reach reach = reach_of(view);
    const trip_cpu_staged *staged = &w->scratch.staged;
    const trip_cpu_lanes *lanes = &w->scratch.lanes;
    const uint32_t across = r->isa->lanes;
    uint32_t count = 0;
    r->isa->reaching(view, &reach, staged, n, &w->scratch.lanes);
    for (uint32_t i = 0; i < n; i += across) {
        count += (uint32_t)__builtin_popcount(lanes->kept[i / across]);
        for (uint32_t bits = lanes->scalar[i / across]; bits; bits &= bits - 1)
            count += is_reaching(view, staged, i + (uint32_t)__builtin_ctz(bits));
    }
    return count;
}

void trip_cpu_count_part(const trip_cpu *r, trip_cpu_worker *w, trip_cpu_chunk *chunk,
                         const trip_cpu_part *part)
{
    const trip_cpu_view *view = &r->counted_views[chunk->list];
    trip_square squares[TRIP_BLOCK_SQUARES_MAX];
    const uint32_t count = trip_block_squares(&part->block, squares);
    const trip_cpu_part_squares of = trip_cpu_part_squares_of(r, part);
    for (uint32_t i = 0; i < count; i++) {
        if (!trip_cpu_part_has(part, squares[i].number))
            continue;
        trip_cpu_square square = trip_cpu_make_square(&of, w, &squares[i]);
        if (square.mask == 0)
            continue;
        uint32_t n = r->isa->stage(view, &square, false, &w->scratch.staged, 0);
        chunk->counts.splats_projected += count_reaching(r, view, w, n);
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
                         "exact counts do not fit the memory given; raise --memory");
    /* Any extinction works that the kernels do not treat as 0. */
    for (int i = 0; i < 65536; i++)
        r->visible[i] = (trip_tf_entry){ .extinction = (float)(0x1p20 / camera->voxel_world) };
    r->counted_frame = *r->frame;
    r->counted_frame.table = r->visible;
    return 0;
}
