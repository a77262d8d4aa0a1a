/* Writes a view as options of `triptych render` that reproduce it bit for bit. Any thread may call
 * these functions. */
#ifndef TRIP_VIEW_CAMERA_TEXT_H
#define TRIP_VIEW_CAMERA_TEXT_H

#include "navigation.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Returns "--eye X,Y,Z --look ... --up ... --fov DEGREES --size WxH", with --ortho HEIGHT in place
 * of --fov for a parallel view. The text is for free(); NULL if memory is exhausted. */
char *trip_camera_text(const trip_navigation *n, int width, int height);
char *trip_camera_text_of(const triptych_camera *camera);

#ifdef __cplusplus
}
#endif

#endif
