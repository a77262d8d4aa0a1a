/* What the tests of hard cases share: one view drawn in every form (pre by splats, pre by sheets,
 * post) by every renderer and instruction set, against the reference. */
#ifndef HARD_H
#define HARD_H

#include "cpu_scenes.h"

/* The forms, a bit each. */
enum { HARD_SPLATS = 1, HARD_SHEETS = 2, HARD_POST = 4, HARD_ALL = 7 };

/* What of it is looked at. */
typedef struct hard_view {
    const char *name;
    trip_camera_params camera;
    trip_settings settings; /* classify and compositing are set by the form */
    unsigned forms;
    unsigned gl; /* of those by gl too, which is slow where a processor stands for it */
    double tie;  /* of post, where rays lie exactly at the grid's border; 0: the renderer's */
    bool shows;  /* something opaque is to be seen */
} hard_view;

/* No scene's background; unlit. */
trip_settings hard_settings(void);

/* Draws and compares, each renderer within its tolerance; fails the test by the view's name. */
void hard_check(const scene *s, const hard_view *view);

/* The picture of one form. */
scene_picture hard_draw(const scene *s, const scene_renderer *r, const hard_view *view,
                        unsigned form);

/* Smooth lumps on an edge x edge x edge grid of codes 0 to 65535, and a function of them: thin fog
 * with an opaque core. */
void hard_lumps(scene *s, const int64_t dims[3], const trip_affine *index_to_world);

#endif
