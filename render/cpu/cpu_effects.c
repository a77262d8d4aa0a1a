#include "cpu/cpu_effects.h"

#include "emission.h"
#include "light_map.h"

static trip_cpu_light light_of(const trip_light_grid *grid, int axis)
{
    if (!grid)
        return (trip_cpu_light){ .at = NULL };
    const int32_t steps[3] = { 1, grid->nodes[0], grid->nodes[0] * grid->nodes[1] };
    trip_cpu_light light = { .at = grid->at, .per_voxel = (float)(1 / grid->spacing) };
    for (int i = 0; i < 3; i++) {
        light.step[i] = steps[(axis + 1 + i) % 3];
        light.last[i] = (float)(grid->nodes[(axis + 1 + i) % 3] - 1);
    }
    return light;
}

static void set_light(trip_cpu_effects *e, const trip_effects_view *view, int axis)
{
    e->point_light = view->point_light;
    for (int i = 0; i < 3; i++) {
        const int a = (axis + 1 + i) % 3;
        e->light[i] = (float)trip_component(view->light, a);
        for (int k = 0; k < 3; k++)
            e->aside[i][k] = (float)(view->bias * view->to_index.m[a][k]);
    }
}

static void set_emission(trip_cpu_emission *e, const trip_emission *emission, int axis)
{
    const trip_emission_view view = trip_emission_view_of(emission);
    e->heat = light_of(view.heat, axis);
    e->rgb = view.rgb;
    e->steps = TRIP_EMISSION_STEPS;
    for (int i = 0; i < 3; i++) {
        const int a = (axis + 1 + i) % 3;
        e->last[i] = (float)view.last[a];
        e->to_heat[i][3] = (float)view.to_heat.m[a][3];
        for (int k = 0; k < 3; k++)
            e->to_heat[i][k] = (float)view.to_heat.m[a][(axis + 1 + k) % 3];
    }
}

void trip_cpu_effects_make(trip_cpu_effects *e, const trip_frame *frame, int axis,
                           const trip_list_grid *grid)
{
    const trip_effects *effects = &frame->settings->effects;
    *e = (trip_cpu_effects){ .some = trip_effects_some(effects) };
    if (!e->some)
        return;
    const trip_effects_view view =
        trip_effects_view_make(frame->settings, frame->camera, frame->data->header.dims);
    e->lit = trip_effects_light(effects);
    e->cued = effects->cueing > 0;
    e->cueing = (float)effects->cueing;
    for (int i = 0; i < 3; i++) {
        const int a = (axis + 1 + i) % 3;
        e->scale[i] = grid ? (float)grid->scale[a] : 1;
        e->offset[i] = grid ? (float)grid->offset[a] : 0;
        e->cue[i] = (float)view.cue[a];
        e->cue_rgb[i] = (float)view.cue_rgb[i];
    }
    e->cue[3] = (float)view.cue[3];
    if (effects->emission)
        set_emission(&e->emission, frame->emission, axis);
    if (!e->lit)
        return;
    const double g = effects->anisotropy;
    e->reached = light_of(trip_light_map_reached(frame->light), axis);
    e->open = light_of(trip_light_map_open(frame->light), axis);
    e->phase[0] = (float)(1 - g * g);
    e->phase[1] = (float)(1 + g * g);
    e->phase[2] = (float)(2 * g);
    set_light(e, &view, axis);
}
