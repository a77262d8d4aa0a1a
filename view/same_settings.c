#include "same_settings.h"

static bool same_numbers(const double *a, const double *b, int count)
{
    for (int i = 0; i < count; i++)
        if (!(a[i] == b[i]))
            return false;
    return true;
}

static bool same_clip(const triptych_clip *a, const triptych_clip *b)
{
    return a->box == b->box && a->box_of_voxels == b->box_of_voxels && a->planes == b->planes &&
           same_numbers(a->box_lo, b->box_lo, 3) && same_numbers(a->box_hi, b->box_hi, 3) &&
           same_numbers(a->plane[0], b->plane[0], 4 * a->planes);
}

static bool same_form(const triptych_settings *a, const triptych_settings *b)
{
    return a->classify == b->classify && a->compositing == b->compositing &&
           a->samples_per_sheet == b->samples_per_sheet && a->method == b->method &&
           a->traversal == b->traversal && a->target == b->target && a->indexed == b->indexed &&
           a->triangles == b->triangles && a->h == b->h &&
           a->early_termination == b->early_termination && a->kernel_radius == b->kernel_radius &&
           a->lod_px == b->lod_px && a->max_bytes == b->max_bytes && a->max_ms == b->max_ms &&
           a->field == b->field && a->kernel == b->kernel && a->tolerance == b->tolerance &&
           a->samples == b->samples;
}

static bool same_footprints(const triptych_settings *a, const triptych_settings *b)
{
    return a->footprint == b->footprint && a->low_pass == b->low_pass && a->flatten == b->flatten &&
           a->vertex_weights == b->vertex_weights;
}

static bool same_effects(const triptych_settings *a, const triptych_settings *b)
{
    return a->effects == b->effects && a->anisotropy == b->anisotropy && a->cueing == b->cueing &&
           same_numbers(a->kelvin, b->kelvin, 2) && a->light_cells == b->light_cells;
}

bool trip_same_settings(const triptych_settings *a, const triptych_settings *b)
{
    return same_form(a, b) && same_footprints(a, b) && same_effects(a, b) &&
           a->normalise == b->normalise && a->shading == b->shading &&
           a->headlight == b->headlight && a->point_light == b->point_light &&
           same_numbers(a->light, b->light, 3) && same_numbers(a->background, b->background, 4) &&
           a->depth == b->depth && a->count == b->count && a->show == b->show &&
           same_clip(&a->clip, &b->clip);
}
