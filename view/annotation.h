/* The overlays of the picture, in its pixels: the edges of a box, axes with round numbers, and a
 * scale bar of round length. Pure functions. */
#ifndef TRIP_VIEW_ANNOTATION_H
#define TRIP_VIEW_ANNOTATION_H

#include "navigation.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Bit a of the corner's number n is set if the corner lies at the upper end of axis a. */
typedef struct trip_annotation_box {
    double corners[8][3]; /* world space */
} trip_annotation_box;

/* Returns the box around the kept voxels, up to their outer faces. */
trip_annotation_box trip_annotation_box_of(const triptych_info *info);

typedef struct trip_annotation_edge {
    double from[2], to[2]; /* px; the part of the edge in front of the eye */
    int axis;              /* of the box */
    bool drawn;            /* false if the whole edge is behind the eye */
    bool hidden;           /* neither adjacent face is turned to the eye */
    bool outline;          /* exactly one adjacent face is turned to the eye */
} trip_annotation_edge;

enum { TRIP_ANNOTATION_EDGES = 12 }; /* four along each axis, by axis */

void trip_annotation_edges(const trip_annotation_box *box, const trip_navigation *n, int width,
                           int height, trip_annotation_edge edges[TRIP_ANNOTATION_EDGES]);

/* A tick mark on an edge, from the edge outward, with the centre of its number. Pixels. */
typedef struct trip_annotation_tick {
    double from[2], to[2], label[2];
    char text[32];
} trip_annotation_tick;

enum { TRIP_ANNOTATION_TICKS = 24 };

/* The scale along one axis of the box. It stands on the lowest outline edge in the picture. */
typedef struct trip_annotation_axis {
    int count; /* of ticks; 0 if there is no room for any */
    trip_annotation_tick ticks[TRIP_ANNOTATION_TICKS];
    double title[2]; /* centre of the name, px */
    char name[24];   /* such as "x (mm)"; "i" to "k" for axes oblique in world space, with ticks at
                        distances from the corner of the box */
} trip_annotation_axis;

/* Computes the scales of the three axes. `unit` may be NULL. Ticks are at least 50 px apart. */
void trip_annotation_axes(const trip_annotation_box *box, const trip_navigation *n, int width,
                          int height, const char *unit, trip_annotation_axis axes[3]);

/* A scale bar: a world length of 1, 2 or 5 times a power of ten, and its length in pixels. */
typedef struct trip_annotation_bar {
    double length, px;
    char text[40]; /* "20 mm" */
} trip_annotation_bar;
/* Returns the longest scale bar of at most `max_px` pixels at distance `depth` along the view
 * direction. */
trip_annotation_bar trip_annotation_scale_bar(const trip_navigation *n, int height, double depth,
                                              double max_px, const char *unit);

/* Returns the smallest number of the form 1, 2 or 5 times a power of ten that is at least `min`.
 * Requires min > 0. */
double trip_annotation_round(double min);

#ifdef __cplusplus
}
#endif

#endif
