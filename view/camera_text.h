/* A view as options of `triptych render`, which give the same view again, to the last bit. Any
 * thread. */
#ifndef TRIP_VIEW_CAMERA_TEXT_H
#define TRIP_VIEW_CAMERA_TEXT_H

#include "navigation.h"

#ifdef __cplusplus
extern "C" {
#endif

/* "--eye X,Y,Z --look ... --up ... --fov DEGREES --size WxH", --ortho HEIGHT for a parallel view;
 * for free(), NULL without memory. */
char *trip_camera_text(const trip_navigation *n, int width, int height);
char *trip_camera_text_of(const triptych_camera *camera);

#ifdef __cplusplus
}
#endif

#endif
