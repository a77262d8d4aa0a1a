/* The scene and the renderers that the tests of the CPU renderer share. */
#ifndef CPU_SCENES_H
#define CPU_SCENES_H

#include "scenes.h"

/* Smooth blobs inside a shell, with gaps: faint, half opaque and opaque voxels, with normals. NULL:
 * cubic voxels of size 1. */
void cpu_scenes_blobs(scene *s, unsigned tile_voxels, const trip_affine *index_to_world);
trip_affine cpu_scenes_sheared(void);

/* Threads that cpu_scenes_cpu is made with; 3 at first. */
extern unsigned cpu_scenes_threads;

extern const scene_renderer cpu_scenes_cpu, cpu_scenes_reference;

#endif
