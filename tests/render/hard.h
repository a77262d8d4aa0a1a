/* Shared code of the hard-case tests. It draws one view in every form (`pre` by splats, `pre` by
 * sheets, `post`) with every renderer and instruction set, and compares each picture with the
 * reference. */
#ifndef HARD_H
#define HARD_H

#include "cpu_scenes.h"

/* The forms, one bit each. */
enum { HARD_SPLATS = 1, HARD_SHEETS = 2, HARD_POST = 4, HARD_ALL = 7 };

/* One view of a scene, and the expectations for its pictures. */
typedef struct hard_view {
    const char *name;
    trip_camera_params camera;
    trip_settings settings; /* the form sets classify and compositing */
    unsigned forms;
    unsigned gl; /* forms that gl draws too; slow on a machine without a GPU */
    double tie;  /* tolerance of `post` at the grid's border; 0 selects the renderer's */
    bool shows;  /* the picture must contain something opaque */
} hard_view;

/* Returns default settings without shading and background. */
trip_settings hard_settings(void);

/* Draws the view in each form and compares the pictures, each within its renderer's tolerance. A
 * failure names the view. */
void hard_check(const scene *s, const hard_view *view);

/* Draws one form of the view. */
scene_picture hard_draw(const scene *s, const scene_renderer *r, const hard_view *view,
                        unsigned form);

/* Creates smooth lumps on a grid of `dims` voxels with codes 0 to 65535. The transfer function
 * shows thin fog with an opaque core. */
void hard_lumps(scene *s, const int64_t dims[3], const trip_affine *index_to_world);

#endif
