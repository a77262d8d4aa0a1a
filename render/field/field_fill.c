#include "field_fill.h"

void trip_field_fill_begin(trip_field_fill *f, const trip_dataset *data,
                           const trip_draw_codes *draw, trip_field *field, unsigned planes)
{
    f->field = field;
    f->deviations = NULL;
    f->draw = *draw;
    f->has_normals = planes >> TRIP_PLANE_NORMALS & 1;
    f->header = &data->header;
    f->compact = trip_compact_normals_make(&data->index_to_world, f->header->gradient_full,
                                           f->header->gradient_step);
}

static void unpack_gradient(const trip_field_fill *f, uint32_t normal, double gradient[3])
{
    if (f->header->normal_bytes == 3)
        trip_compact_normal_unpack(&f->compact, normal, gradient);
    else
        trip_normal_unpack(normal, f->header->gradient_full, gradient);
}

static int put_deviation(trip_field_fill *f, const int64_t at[3], const trip_block *block,
                         uint32_t n)
{
    const unsigned d = block->deviations ? block->deviations[n] : 0;
    return trip_field_put(f->deviations, at,
                          trip_draw_deviation(&f->draw, trip_voxel_code(f->voxels[n]), d), NULL);
}

int trip_field_fill_run(trip_field_fill *f, const trip_batch *batch, const trip_run *run)
{
    const trip_block block = trip_block_of(batch, run);
    int axis = trip_batch_list(batch, run)->axis, status = 0;
    const bool normals = f->has_normals && block.normals;
    trip_block_voxels(&block, 0, run->count, f->voxels);
    if (normals)
        trip_block_normals(&block, 0, run->count, f->normals);
    for (uint32_t n = 0; n < run->count && !status; n++) {
        int64_t at[3];
        double gradient[3];
        at[axis] = run->sheet;
        at[(axis + 1) % 3] = run->u + (int64_t)trip_voxel_u(f->voxels[n]);
        at[(axis + 2) % 3] = run->v + (int64_t)trip_voxel_v(f->voxels[n]);
        if (normals)
            unpack_gradient(f, f->normals[n], gradient);
        const double code = trip_draw_code_exact(&f->draw, trip_voxel_code(f->voxels[n]));
        status = trip_field_put(f->field, at, code, normals ? gradient : NULL);
        if (f->deviations && !status)
            status = put_deviation(f, at, &block, n);
    }
    return status;
}
