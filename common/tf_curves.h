/* Transfer functions as other programs describe them: colours and opacities as separate curves,
 * each with its own interpolation (vtkColorTransferFunction, vtkPiecewiseFunction). Readers of
 * their files fill curves, which are then sampled where they are not linear, and merged. Only the
 * tf_*.c files include this. */
#ifndef TRIP_TF_CURVES_H
#define TRIP_TF_CURVES_H

#include "tf_colour.h"
#include "tf_internal.h"

/* Of colours: value, r, g, b. Of opacities: value, opacity, midpoint, sharpness. */
typedef struct trip_tf_node {
    double value, part[3];
} trip_tf_node;

typedef struct trip_tf_nodes {
    trip_tf_node *data;
    size_t count, room;
} trip_tf_nodes;

typedef struct trip_tf_curves {
    trip_colour_space space;
    trip_tf_nodes colours, opacities;
    bool normalised;
    double unit_world; /* 0: one voxel */
} trip_tf_curves;

/* Appends a node; an impossible one is a reported failure, in which `where` and `key` name the
 * place. */
int trip_tf_nodes_add(trip_tf_nodes *n, trip_tf_node node, const char *where, const char *key);
/* Appends the nodes of "COUNT number number ...": COUNT numbers, four to a node for colours, two
 * for opacities (straight lines between). */
int trip_tf_nodes_add_text(trip_tf_nodes *n, const char *text, int numbers_per_node,
                           const char *where, const char *key);
/* Where the colours span 0 to 1 or -1 to 1 the curves are meant to be stretched over the data, as
 * ParaView does on loading them; normalises them then. */
void trip_tf_curves_stretch(trip_tf_curves *c);
/* Without opacities, they rise from 0 to 1 over the colours' range, ParaView's default. */
int trip_tf_curves_build(trip_tf **out, const trip_tf_curves *c, const char *where);
void trip_tf_curves_free(trip_tf_curves *c);

/* Warns that opacities by gradient are ignored, unless they are all 1. */
void trip_tf_warn_of_gradient(const trip_tf_nodes *gradient, const char *where);

#endif
