/* The views of a report around the object, in turns perspective, parallel, from inside and wide.
 * One thread. */
#ifndef TRIP_ACCURACY_VIEWS_H
#define TRIP_ACCURACY_VIEWS_H

#include "triptych.h"

typedef struct accuracy_view {
    const char *name;
    triptych_camera camera;
} accuracy_view;

/* Computes view `index` of `count` around the open data set. Changes the view of the context. */
int accuracy_view_find(triptych *t, int width, int height, int index, int count,
                       accuracy_view *out);
/* Sets the view of a context. */
int accuracy_view_use(triptych *t, const accuracy_view *view);

#endif
