#include "settings.h"

trip_settings trip_settings_default(void)
{
    return (trip_settings){
        .method = TRIP_METHOD_MERGE,
        .traversal = TRIP_TRAVERSAL_OUTWARD,
        .target = TRIP_TARGET_RGBA32F,
        .shading = true,
        .headlight = true,
        .light_direction = { 0, 0, 1 },
        .h = 0.85,
        .kernel_radius = TRIP_KERNEL_RADIUS_VOXELS,
        .background = { 0, 0, 0, 1 },
    };
}
