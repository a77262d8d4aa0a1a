/* What is drawn over the picture for orientation, in its pixels: the edges of a box, its axes with
 * round numbers, a scale bar of round length. Pure functions. */
#ifndef TRIP_VIEW_ANNOTATION_H
#define TRIP_VIEW_ANNOTATION_H

#include "navigation.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Corner n of a box lies at the upper end of axis a where bit a of n is set. */
typedef struct trip_annotation_box {
    double corners[8][3]; /* world space */
} trip_annotation_box;

/* About the voxels that are kept, to their outer faces. */
trip_annotation_box trip_annotation_box_of(const triptych_info *info);

typedef struct trip_annotation_edge {
    double from[2], to[2]; /* pixels; the part in front of the eye */
    int axis;              /* of the box */
    bool drawn;            /* false: none of it is in front of the eye */
    bool hidden;           /* behind the box: no face next to it is turned to the eye */
    bool outline;          /* of one of its two faces alone that is so */
} trip_annotation_edge;

enum { TRIP_ANNOTATION_EDGES = 12 }; /* four along each axis, by axis */

void trip_annotation_edges(const trip_annotation_box *box, const trip_navigation *n, int width,
                           int height, trip_annotation_edge edges[TRIP_ANNOTATION_EDGES]);

/* A mark on an edge: from there outward, and the middle of its number. */
typedef struct trip_annotation_tick {
    double from[2], to[2], label[2];
    char text[32];
} trip_annotation_tick;

enum { TRIP_ANNOTATION_TICKS = 24 };

/* The scale along one axis of the box, on that edge of its outline that is lowest in the picture.
 */
typedef struct trip_annotation_axis {
    int count; /* of ticks; 0: there is no room */
    trip_annotation_tick ticks[TRIP_ANNOTATION_TICKS];
    double title[2]; /* the middle of its name */
    char name[24];   /* "x (mm)"; of axes that lie oblique in the world "i" to "k", and the ticks
                        are then distances from the box's corner */
} trip_annotation_axis;

/* `unit` may be NULL. Ticks are at least some 50 pixels apart. */
void trip_annotation_axes(const trip_annotation_box *box, const trip_navigation *n, int width,
                          int height, const char *unit, trip_annotation_axis axes[3]);

/* The length 1, 2 or 5 times a power of ten that takes at most `max_px` at this distance along the
 * gaze, and what it takes. */
typedef struct trip_annotation_bar {
    double length, px;
    char text[40]; /* "20 mm" */
} trip_annotation_bar;
trip_annotation_bar trip_annotation_scale_bar(const trip_navigation *n, int height, double depth,
                                              double max_px, const char *unit);

/* The least 1, 2 or 5 times a power of ten that is not below `least`, which is above 0. */
double trip_annotation_round(double min);

#ifdef __cplusplus
}
#endif

#endif
