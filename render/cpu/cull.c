#include "cpu/cull.h"

/* Minimum number of voxels for a test of regions. The test costs about as much as this many splats.
 */
enum { FEWEST = 16 };

/* One word of a block's squares covers one region. */
static_assert(TRIP_CPU_REGION_SQUARES == 64 && TRIP_CPU_SQUARE == 8, "as in a block");

/* Returns the squares that may be visible in a region of the run's tile, as a mask. */
static uint64_t visible_squares(const trip_cpu_culling *c, const trip_run *run, unsigned word)
{
    trip_cpu_region where;
    int u = run->u + (int)(word & 1) * TRIP_CPU_REGION;
    int v = run->v + (int)(word >> 1) * TRIP_CPU_REGION;
    trip_cpu_occlusion occlusion = trip_cpu_region_make(c->view, u, v, run->sheet, &where);
    if (occlusion != TRIP_CPU_VISIBLE)
        return occlusion == TRIP_CPU_OCCLUDED ? 0 : UINT64_MAX;
    return c->kernels->squares(c->view, &where, c->mask->panes, c->lanes);
}

static uint32_t count_voxels(const trip_cpu_part *part)
{
    uint32_t voxels = 0;
    trip_cpu_walk w = trip_cpu_walk_begin(&part->block, false);
    while (trip_cpu_walk_next(&w))
        if (part->squares[w.number / 64] >> w.number % 64 & 1)
            voxels += w.count;
    return voxels;
}

void trip_cpu_cull(const trip_cpu_culling *c, trip_cpu_part *part)
{
    const trip_run *run = part->run;
    if (!c->view->front_to_back || c->view->coordinates)
        return;
    trip_cpu_box box =
        trip_cpu_brick_box(c->view->of->data, c->view->list, run->brick, run->sheet, run->sheet);
    trip_cpu_occlusion occlusion = trip_cpu_box_occlusion(c->view, c->mask, &box);
    if (occlusion == TRIP_CPU_OCCLUDED) {
        part->voxels = 0;
    } else if (occlusion == TRIP_CPU_PARTLY && part->voxels >= FEWEST) {
        for (unsigned word = 0; word < part->block.present_words; word++)
            if (part->squares[word])
                part->squares[word] &= visible_squares(c, run, word);
        part->voxels = count_voxels(part);
    }
}
