/* Scenes with a coarse level of values that have deviations. Each test creates and destroys its own
 * scene. */
#ifndef LEVEL_SCENES_H
#define LEVEL_SCENES_H

#include "scenes.h"

/* A scene with a coarse level, which `at` presents. */
typedef struct level_scene {
    scene of, at;
} level_scene;

/* The voxels of level 1. Level 0 is empty, since no frame draws it. */
typedef struct level_contents {
    scene_voxel voxel;
    unsigned (*deviation)(void *user, int i, int j, int k); /* NULL: no deviations are stored */
    void *user;
    unsigned tile; /* 0 selects 64 */
    int64_t dims[3];
    const trip_affine *index_to_world; /* of level 0; NULL selects the identity */
    const trip_codes *codes;           /* NULL: even codes */
} level_contents;

void level_scene_create(level_scene *l, const level_contents *c);
void level_scene_destroy(level_scene *l);
/* Gives the level the colours of `of`. */
void level_scene_use_colours(level_scene *l);

/* Returns settings of `post` that draw levels. */
trip_settings level_scene_settings(void);

/* Waves with deviations in some places. Voxels are missing where the wave is low. */
extern const level_contents level_waves;
/* Creates a scene of waves, with colours. */
void level_scene_waves(level_scene *l, const level_contents *waves);
/* Creates a scene of blocks with codes 0 and 65535. Cubic kernels overshoot both ends of the table,
 * beyond which the function is constant. */
void level_scene_blocks(level_scene *l);
/* Returns one of three views of waves. View 1 is from inside, view 2 is parallel. */
trip_camera_params level_scene_view(const level_scene *l, int number, int pixels);

#endif
