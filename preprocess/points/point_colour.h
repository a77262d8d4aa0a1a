/* The display colours of a cloud's points: their own, or a palette over one of their values. */
#ifndef TRIP_POINT_COLOUR_H
#define TRIP_POINT_COLOUR_H

#include "point_file.h"
#include "transfer_function.h"

typedef enum trip_point_colouring {
    TRIP_POINT_BY_AUTO, /* by colours, else by intensity, else by height */
    TRIP_POINT_BY_RGB,
    TRIP_POINT_BY_INTENSITY,      /* grey */
    TRIP_POINT_BY_HEIGHT,         /* viridis, along the axis that points up */
    TRIP_POINT_BY_CLASSIFICATION, /* a fixed colour for each class of LAS */
    TRIP_POINT_BY_RETURN,         /* viridis, by the number of the return */
    TRIP_POINT_BY_TIME,           /* viridis */
    TRIP_POINT_BY_DENSITY,        /* viridis, by the logarithm of surfel_shape.h's density */
} trip_point_colouring;

/* Chooses the colouring of a surveyed cloud. Fails if the cloud lacks the wanted
 * attribute. */
int trip_point_choose_colouring(const trip_point_info *info, const char *path,
                                trip_point_colouring wanted, trip_point_colouring *out);

/* Notes how a cloud without colours is coloured. */
void trip_point_note_colouring(const char *path, trip_point_colouring chosen);

/* Returns the value of a point that is coloured. */
double trip_point_value(trip_point_colouring by, const trip_point *p, const double up[3]);

/* Colours of values. */
typedef struct trip_point_palette {
    trip_point_colouring by;
    trip_tf *tf; /* over 0 to 1, or NULL */
    double lo, hi;
} trip_point_palette;

/* Values from `lo` to `hi` get all colours. Values outside get the first or the last. */
int trip_point_palette_make(trip_point_palette *p, trip_point_colouring by, double lo, double hi);
void trip_point_palette_colour(const trip_point_palette *p, double value, float rgb[3]);
void trip_point_palette_free(trip_point_palette *p);

#endif
