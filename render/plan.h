/* What one frame will do, worked out before anything is read: which lists, which side of the eye,
 * which bricks, which attribute planes, which passes, and why. Owned by the frame that made it. */
#ifndef TRIP_PLAN_H
#define TRIP_PLAN_H

#include <stdio.h>

#include "camera.h"
#include "selection.h"
#include "settings.h"
#include "transfer_function.h"

/* One pass over a list: a side of the eye, or the whole list in `ascending` traversal. */
typedef struct trip_plan_pass {
    trip_selection selection;
    bool front_to_back; /* false only in `ascending` traversal against the gaze */
} trip_plan_pass;

typedef struct trip_plan_list {
    bool used;      /* some ray of the view has weight in this list */
    int pass_count; /* at most 2: beyond the eye (ascending), then below (descending) */
    trip_plan_pass passes[2];
    uint64_t bricks, bricks_selected;
    uint64_t bricks_outside, bricks_without_weight, bricks_transparent; /* why left out */
    uint64_t splats_selected;
} trip_plan_list;

typedef struct trip_plan {
    int axis_of_view;
    unsigned planes; /* bit per trip_plane to read */
    trip_plan_list lists[3];
} trip_plan;

/* `table` as filled for `data`: bricks whose codes are all transparent are left out. */
int trip_plan_make(trip_plan *plan, const trip_dataset *data, const trip_camera *camera,
                   const trip_settings *settings, const trip_tf_entry *table, trip_budget *budget);
void trip_plan_release(trip_plan *plan, trip_budget *budget);

/* Of the selected splats, in the data set's planes that the plan does not call for. */
uint64_t trip_plan_bytes_left_out(const trip_plan *plan, const trip_dataset *data);

/* The plan in words, an effect a line: whether it runs and why. */
void trip_plan_explain(const trip_plan *plan, const trip_dataset *data,
                       const trip_settings *settings, FILE *out);

#endif
