/* The scene and the renderers shared by the tests of the CPU renderer. Each test creates and
 * destroys its own scene. */
#ifndef CPU_SCENES_H
#define CPU_SCENES_H

#include "scenes.h"

/* Creates smooth blobs inside a shell, with gaps between them. Voxels are faint, half opaque or
 * opaque and have normals. If `index_to_world` is NULL, voxels are cubes of size 1. */
void cpu_scenes_blobs(scene *s, unsigned tile_voxels, const trip_affine *index_to_world);
trip_affine cpu_scenes_sheared(void);

/* The number of threads of cpu_scenes_cpu; 3 by default. */
extern unsigned cpu_scenes_threads;

extern const scene_renderer cpu_scenes_cpu, cpu_scenes_reference;

/* Draws by the CPU renderer with a limited memory and 2 threads. Returns a negative status if the
 * memory does not suffice. */
int cpu_scenes_draw_within(const scene *s, uint64_t bytes, const trip_settings *settings,
                           const trip_camera_params *view, float *rgba);

#endif
