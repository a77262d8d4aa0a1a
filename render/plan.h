/* What one frame will do, worked out before anything is read: which lists, which side of the eye,
 * which bricks, which attribute planes, which passes, and why. Owned by the frame that made it. */
#ifndef TRIP_PLAN_H
#define TRIP_PLAN_H

#include <stdio.h>

#include "camera.h"
#include "classification.h"
#include "list_grid.h"
#include "lod.h"
#include "mean_tables.h"
#include "selection.h"
#include "settings.h"
#include "transfer_function.h"
#include "weight.h"

/* A list of the data set as the frame sees it. */
typedef struct trip_plan_list {
    bool drawn;          /* of a layer in which some ray of the view has weight: splatted, or where
                            values are interpolated; where it is not, what follows is not set */
    trip_list_grid grid; /* in that of level 0 */
    trip_camera camera;  /* the view in the list's own index space */
    trip_clip clip;      /* of its voxels, in its own index space */
    bool by_level;       /* of its voxels those are drawn that trip_plan.lod says */
    const trip_tf_entry *table; /* of 65536: what its codes look like */
    trip_code_range shown;      /* those with extinction, as trip_code_set_range() has them */
    uint64_t bricks, bricks_selected;
    uint64_t bricks_outside, bricks_without_weight, bricks_transparent, bricks_of_other_levels,
        bricks_clipped; /* why left out */
    uint64_t splats_selected;
    uint64_t bytes_selected[TRIP_PLANES]; /* of those, in the data set's planes */
} trip_plan_list;

/* One pass over the lists of an axis: from the eye outwards up the axis or down it, or all in
 * `ascending` traversal. */
typedef struct trip_plan_pass {
    trip_pass pass;
    bool front_to_back; /* false only in `ascending` traversal against the gaze */
} trip_plan_pass;

/* What is drawn from the lists of one axis. */
typedef struct trip_plan_layer {
    bool used;      /* some ray of the view has weight in it */
    int pass_count; /* at most 2: beyond the eye (ascending), then below (descending) */
    trip_plan_pass passes[2];
    /* Splats: a ray takes part in the pass that goes its way alone. The passes overlap, by as far
     * as splats reach over the eye's coordinate. */
    bool parted;
} trip_plan_layer;

typedef struct trip_plan {
    int axis_of_view;
    bool gathers;   /* trip_plan_make_field()'s */
    trip_lod lod;   /* which level is drawn where */
    unsigned level; /* post: of all of the frame; the data set it was made for is of that level */
    trip_clip clip; /* in index space: what of the grid is inside */
    const trip_coordinates *coordinates; /* of the data set */
    unsigned planes;                     /* bit per trip_plane to read */
    /* post: as classification.h has them, but that frames with effects have no closed form. */
    unsigned code_min, code_max;
    trip_closed_form_fault not_closed;
    trip_closed_form closed; /* where not_closed is TRIP_CLOSED_FORM_FOUND */
    unsigned list_count;
    trip_plan_list *lists; /* by the data set's lists */
    trip_plan_layer layers[3];
    trip_mean_tables own_tables; /* of coarse levels, where the caller keeps none */
    trip_selection *selections;  /* of all passes: room for two a list */
    unsigned selection_count;
} trip_plan;

/* `camera` is made with level 0's map. `table` as filled for `data`: bricks whose codes are all
 * transparent are left out. */
int trip_plan_make(trip_plan *plan, const trip_dataset *data, const trip_camera *camera,
                   const trip_settings *settings, const trip_tf_entry *table, trip_budget *budget);
/* The same after other frames of the data set, with what is known from them in `classified` and
 * `tables`; what is known after this one is put there. `tables` stay there until the plan is
 * released; NULL: the plan has its own. */
int trip_plan_make_next(trip_plan *plan, const trip_dataset *data, const trip_camera *camera,
                        const trip_settings *settings, const trip_tf_entry *table,
                        trip_classification *classified, trip_mean_tables *tables,
                        trip_budget *budget);
/* For the integral renderer: one pass over all of the list of level 0 along z, whatever the view
 * and the function. `kinds` has a bit for each trip_kind that is read; 0: nothing is. */
int trip_plan_make_field(trip_plan *plan, const trip_dataset *data, const trip_camera *camera,
                         const trip_settings *settings, unsigned kinds, trip_budget *budget);
void trip_plan_release(trip_plan *plan, trip_budget *budget);

/* Fails (reported) for grids one voxel thick, in which no value lies between voxels; `instead` is
 * the option that draws them. */
int trip_plan_check_cells(const trip_dataset *data, const char *instead);

/* Fails (reported) for what grids with uneven spacing are not drawn with. */
int trip_plan_check_coordinates(const trip_dataset *data, const trip_settings *settings);

/* Whether interpolation needs voxels that a data set with a halo of one may lack: two about what is
 * visible. They count as the corners of cells next to them (sheet.h). */
bool trip_plan_halo_is_short(const trip_dataset *data, const trip_settings *settings);

/* Of the 8 x 8 square of a list's sheet with its corner at u and v, which voxels are splatted: not
 * those of cubes that another level is drawn in, nor those that are cut away. A bit each by Morton
 * number, as in a block. */
uint64_t trip_plan_square(const trip_plan *plan, const trip_list *list, int64_t sheet, int64_t u,
                          int64_t v);
/* Whether that is all of them, of any square of the list. */
bool trip_plan_draws_all(const trip_plan *plan, const trip_list *list);

/* The rays that take part in the pass of an axis that goes ascending or descending. */
trip_way trip_plan_way(const trip_plan *plan, int axis, bool descending);

/* Whether a frame is of interpolated values: not of splats. */
bool trip_plan_is_of_values(const trip_plan *plan, const trip_settings *settings);

/* Selected in all lists. */
uint64_t trip_plan_splats(const trip_plan *plan);

/* "x" at level 0, "x1" at level 1, and the kind where it is not voxels; `name` has room for 24. */
const char *trip_plan_list_name(const trip_list *list, char name[24]);

/* Of the selected splats, in the data set's planes that the plan does not call for. */
uint64_t trip_plan_bytes_left_out(const trip_plan *plan, const trip_dataset *data);

/* The plan in words, an effect a line: whether it runs and why. */
void trip_plan_explain(const trip_plan *plan, const trip_dataset *data,
                       const trip_settings *settings, FILE *out);

#endif
