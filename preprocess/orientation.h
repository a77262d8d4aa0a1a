/* How a volume lies whose file does not say so, guessed from what was kept of it. */
#ifndef TRIP_ORIENTATION_H
#define TRIP_ORIENTATION_H

#include "occupancy.h"

typedef struct trip_orientation {
    int mirror;  /* axis across which alone it is mirror-symmetric, mirror.h; -1: none */
    int footing; /* side on which it stands, footing.h; -1: none */
} trip_orientation;

/* Of lists that are complete. */
int trip_orientation_find(trip_orientation *u, trip_writer *w, const trip_occupancy_params *params,
                          trip_budget *budget);

#endif
