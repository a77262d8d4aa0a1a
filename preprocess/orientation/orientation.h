/* Guesses the orientation of a volume from its kept part, if the file gives none. One thread. */
#ifndef TRIP_ORIENTATION_H
#define TRIP_ORIENTATION_H

#include "occupancy.h"

typedef struct trip_orientation {
    int mirror;  /* the only axis across which the volume is mirror-symmetric; -1 if none */
    int footing; /* side on which it stands, as in orientation_base.h; -1 if none */
} trip_orientation;

/* Guesses the orientation from the lists of the data set, which must be complete. Takes its working
 * memory from the budget. */
int trip_orientation_find(trip_orientation *u, trip_writer *w, const trip_occupancy_params *params,
                          trip_budget *budget);

#endif
