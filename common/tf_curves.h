/* Transfer functions as other programs describe them: separate curves of colours and opacities,
 * each with its own interpolation (vtkColorTransferFunction, vtkPiecewiseFunction). Readers of
 * foreign files fill the curves. trip_tf_curves_build() samples the parts that are not linear, and
 * merges both. Only the tf_*.c files include this header. */
#ifndef TRIP_TF_CURVES_H
#define TRIP_TF_CURVES_H

#include "tf_colour.h"
#include "tf_internal.h"

/* Nodes of colours have value, r, g, b; nodes of opacities have value, opacity, midpoint,
 * sharpness. */
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
    double unit_world; /* 0 means one voxel */
} trip_tf_curves;

/* Appends a node. An invalid node is a reported failure; `where` and `key` name its position. */
int trip_tf_nodes_add(trip_tf_nodes *n, trip_tf_node node, const char *where, const char *key);
/* Appends the nodes of the text "COUNT number number ...". COUNT numbers follow, four per node for
 * colours, two for opacities (linear between nodes). */
int trip_tf_nodes_add_text(trip_tf_nodes *n, const char *text, int numbers_per_node,
                           const char *where, const char *key);
/* Normalises the curves if the colours span 0 to 1 or -1 to 1. ParaView stretches such curves over
 * the data when it loads them. */
void trip_tf_curves_stretch(trip_tf_curves *c);
/* Drops opacities that are all 1. Colour maps for surfaces have them; a volume would be a solid
 * box.
 */
void trip_tf_curves_drop_opaque(trip_tf_curves *c);
/* Builds the transfer function. Without opacities, opacity rises from 0 to 1 over the range of the
 * colours, as in ParaView. trip_tf_adapt() lets it begin above the background. */
int trip_tf_curves_build(trip_tf **out, const trip_tf_curves *c, const char *where);
void trip_tf_curves_free(trip_tf_curves *c);

/* Warns that opacities by gradient are ignored, unless they are all 1. */
void trip_tf_warn_of_gradient(const trip_tf_nodes *gradient, const char *where);

#endif
