/* The views of a report: in turns perspective, parallel, from inside and wide, round the object. */
#ifndef TRIP_ACCURACY_VIEWS_H
#define TRIP_ACCURACY_VIEWS_H

#include "triptych.h"

typedef struct accuracy_view {
    const char *name;
    triptych_camera camera;
} accuracy_view;

/* View `index` of `count` of what a context has open; sets the context's own view. */
int accuracy_view_find(triptych *t, int width, int height, int index, int count,
                       accuracy_view *out);
/* What a context is to draw from. */
int accuracy_view_use(triptych *t, const accuracy_view *view);

#endif
