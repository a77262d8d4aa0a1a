#include "brick_box.h"

const trip_file_slab *trip_brick_slab(const trip_list *list, uint64_t brick)
{
    uint64_t lo = 0, hi = list->slab_count;
    while (hi - lo > 1) {
        uint64_t middle = (lo + hi) / 2;
        if (list->slabs[middle].first_brick <= brick)
            lo = middle;
        else
            hi = middle;
    }
    return &list->slabs[lo];
}

trip_brick_box trip_brick_box_of(const trip_file_header *header, const trip_file_slab *slab,
                                 const trip_file_brick *brick)
{
    double u = (double)((uint64_t)brick->tile_u << header->tile_log2);
    double v = (double)((uint64_t)brick->tile_v << header->tile_log2);
    double sheet = (double)((uint64_t)slab->slab * header->slab_sheets);
    return (trip_brick_box){
        { u + brick->u_min, v + brick->v_min, sheet + brick->sheet_min },
        { u + brick->u_max, v + brick->v_max, sheet + brick->sheet_max },
    };
}
