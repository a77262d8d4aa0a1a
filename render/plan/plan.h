/* The plan of one frame, made before any read: the lists, passes, bricks and planes that the
 * frame needs, and why. The frame that made the plan owns it and uses it on one thread. */
#ifndef TRIP_PLAN_H
#define TRIP_PLAN_H

#include <stdio.h>

#include "camera.h"
#include "classification.h"
#include "list_grid.h"
#include "lod.h"
#include "plan_around.h"
#include "selection.h"
#include "settings.h"
#include "transfer_function.h"
#include "weight.h"

/* A list of the data set, with the decisions of this frame. */
typedef struct trip_plan_list {
    /* The list belongs to a layer in which a ray of the view has weight. If false, all fields
     * below are unset. */
    bool drawn;
    trip_list_grid grid;        /* its position in the grid of level 0 */
    trip_camera camera;         /* views the list's own index space */
    trip_clip clip;             /* clips the list's voxels, in the list's own index space */
    bool by_level;              /* trip_plan.lod selects the voxels that are drawn */
    const trip_tf_entry *table; /* 65536 entries: colour and extinction of each code */
    trip_code_range shown;      /* codes with extinction, by trip_code_set_range() */
    uint64_t bricks, bricks_selected;
    uint64_t bricks_outside, bricks_without_weight, bricks_transparent, bricks_of_other_levels,
        bricks_clipped; /* left out, by reason */
    uint64_t splats_selected;
    uint64_t bytes_selected[TRIP_PLANES]; /* of the selected bricks, whether the plan reads the
                                             plane or not */
} trip_plan_list;

/* One pass over the lists of an axis. It starts at the eye and goes up or down the axis. In
 * `ascending` traversal one pass covers all sheets. */
typedef struct trip_plan_pass {
    trip_pass pass;
    trip_pass around;   /* pass.around, if normals are computed */
    bool front_to_back; /* false only in `ascending` traversal, if the view looks down the axis */
} trip_plan_pass;

/* The passes over the lists of one axis. */
typedef struct trip_plan_layer {
    bool used;      /* a ray of the view has weight in the layer */
    int pass_count; /* at most 2: sheets beyond the eye (ascending), then sheets below it
                       (descending) */
    trip_plan_pass passes[2];
    /* Splats only: a ray takes part in the pass of its own direction alone. The two passes
     * overlap by the distance that splats reach over the eye's coordinate. */
    bool parted;
} trip_plan_layer;

typedef struct trip_plan {
    int axis_of_view;
    bool gathers;   /* made by trip_plan_make_field() */
    trip_lod lod;   /* the level of detail of each part of the grid */
    unsigned level; /* post: the level of the whole frame; the plan's data set is of this level */
    trip_clip clip; /* the part of the grid that is drawn; index space */
    const trip_coordinates *coordinates; /* of the data set's grid */
    unsigned planes;                     /* the planes to read, a bit per trip_plane */
    /* The codes that the frame interpolates. Splats have the stored codes. */
    trip_draw_codes draw;
    /* Post only: coarse values have deviations, which blur the function (blurred_function.h). */
    bool blurs;
    /* Post only: see classification.h. Frames with effects or a blurred function have no closed
     * form. */
    unsigned code_min, code_max;
    trip_closed_form_fault not_closed;
    trip_closed_form closed; /* set if not_closed is TRIP_CLOSED_FORM_FOUND */
    unsigned list_count;
    trip_plan_list *lists; /* one per list of the data set, in its order */
    trip_plan_layer layers[3];
    trip_mean_tables own_tables; /* of coarse levels, if the caller keeps none */
    trip_selection *selections;  /* of all passes; room for two per list */
    unsigned selection_count;
    trip_plan_around around; /* of passes with computed normals */
} trip_plan;

/* Makes the plan of a frame. `camera` must be made with the index_to_world map of level 0.
 * `table` must be filled for the codes of `data`: bricks with transparent codes alone are left
 * out. Fails
 * (reported) for settings that exclude one another, for light too far away, and if memory is
 * exhausted. */
int trip_plan_make(trip_plan *plan, const trip_dataset *data, const trip_camera *camera,
                   const trip_settings *settings, const trip_tf_entry *table, trip_budget *budget);
/* Makes the plan of a later frame of the same data set. It uses and updates the results of
 * earlier frames in `classified` and `tables`. `tables` must outlive the plan; NULL selects
 * tables of the plan's own. In `post`, `table` belongs to the draw codes of `classified`. */
int trip_plan_make_next(trip_plan *plan, const trip_dataset *data, const trip_camera *camera,
                        const trip_settings *settings, const trip_tf_entry *table,
                        trip_classification *classified, trip_mean_tables *tables,
                        trip_budget *budget);
/* Makes the plan for the integral renderer: one pass over the whole Z list of level 0, for any
 * view and transfer function. `kinds` has a bit for each trip_kind to read; 0 reads nothing. `draw`
 * has the draw codes; NULL stands for the stored codes. */
int trip_plan_make_field(trip_plan *plan, const trip_dataset *data, const trip_camera *camera,
                         const trip_settings *settings, unsigned kinds, const trip_draw_codes *draw,
                         trip_budget *budget);
void trip_plan_release(trip_plan *plan, trip_budget *budget);

/* Fails (reported) for grids that are one voxel thick: they have no cells to interpolate in. The
 * message names `instead`, the option that draws such grids. */
int trip_plan_check_cells(const trip_dataset *data, const char *instead);

/* Fails (reported) for settings that cannot draw grids with uneven spacing. */
int trip_plan_check_coordinates(const trip_dataset *data, const trip_settings *settings);

/* Whether interpolation needs voxels that the data set may lack. The kernel reads two voxels
 * around each visible one, and the halo stores one. A missing voxel counts as the nearest corner
 * of the cell (sheet.h). */
bool trip_plan_halo_is_short(const trip_dataset *data, const trip_settings *settings);

/* Returns which voxels are splatted in the 8 x 8 square of a list's sheet with its corner at (u,
 * v). Voxels that are clipped, or drawn at another level, are left out. The result has a bit per
 * voxel by Morton number, as in a block. */
uint64_t trip_plan_square(const trip_plan *plan, const trip_list *list, int64_t sheet, int64_t u,
                          int64_t v);
/* Whether trip_plan_square() would return all voxels for every square of the list. */
bool trip_plan_draws_all(const trip_plan *plan, const trip_list *list);

/* Returns the direction of the rays that take part in an ascending or descending pass of an
 * axis. */
trip_way trip_plan_way(const trip_plan *plan, int axis, bool descending);

/* Whether the frame draws interpolated values instead of splats. */
bool trip_plan_is_of_values(const trip_plan *plan, const trip_settings *settings);

/* Returns the number of selected splats in all lists. */
uint64_t trip_plan_splats(const trip_plan *plan);

/* Writes "x" at level 0, "x1" at level 1, and then the kind unless it is voxels. `name` has room
 * for 24 bytes. Returns `name`. */
const char *trip_plan_list_name(const trip_list *list, char name[24]);

/* Returns the size of the selected bricks in the planes that the plan does not read. */
uint64_t trip_plan_bytes_left_out(const trip_plan *plan, const trip_dataset *data);

/* Prints the plan in words, one line per decision: whether a step runs, and why. */
void trip_plan_explain(const trip_plan *plan, const trip_dataset *data,
                       const trip_settings *settings, FILE *out);

#endif
