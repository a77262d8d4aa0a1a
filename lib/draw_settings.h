/* The settings of a picture by value, their table of options, and the rules between settings.
 * triptych_settings points to the groups; this struct holds the groups. All zero
 * bytes are the defaults. Any thread. */
#ifndef TRIP_DRAW_SETTINGS_H
#define TRIP_DRAW_SETTINGS_H

#include "option.h"
#include "triptych.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct draw_settings {
    triptych_settings all; /* its pointers are NULL */
    triptych_splat_settings splat;
    triptych_sheet_settings sheet;
    triptych_scene_settings scene;
    triptych_integral_settings integral;
    triptych_lod_settings lod;
    triptych_light light;
    triptych_effects effects;
    triptych_clip clip;
    int has_background; /* otherwise opaque black */
    double background[4];
} draw_settings;

/* Headings of options, for all commands. */
enum {
    DRAW_GROUP_PICTURE = 1,
    DRAW_GROUP_WINDOW,
    DRAW_GROUP_SERVER,
    DRAW_GROUP_VIEW,
    DRAW_GROUP_PATHS,
    DRAW_GROUP_LOOK,
    DRAW_GROUP_LIGHT,
    DRAW_GROUP_CLIP,
    DRAW_GROUP_ACCURACY,
    DRAW_GROUP_MEASUREMENT,
    DRAW_GROUP_RENDERER,
    DRAW_GROUP_RESULTS,
    DRAW_GROUP_VOLUME,
    DRAW_GROUP_POINTS,
    DRAW_GROUP_RAW,
    DRAW_GROUP_KEPT,
    DRAW_GROUP_OUTPUT,
    DRAW_GROUP_STORED,
    DRAW_GROUP_INTEGRAL,
    DRAW_GROUP_TABLES,
    DRAW_GROUP_LEVELS,
    DRAW_GROUP_FLIGHT,
    DRAW_GROUP_PAPERS,
};

/* Rows of draw_settings_table. */
enum {
    DRAW_BACKGROUND,
    DRAW_LIGHT,
    DRAW_EFFECTS,
    DRAW_ANISOTROPY,
    DRAW_CUEING,
    DRAW_LIGHT_CELLS,
    DRAW_TEMPERATURE,
    DRAW_EDL_STRENGTH,
    DRAW_EDL_RADIUS,
    DRAW_NO_SHADING,
    DRAW_CLIP_BOX,
    DRAW_CLIP_PLANE,
    DRAW_QUALITY,
    DRAW_CLASSIFY,
    DRAW_EARLY_TERMINATION,
    DRAW_FOOTPRINT, /* named "kernel" */
    DRAW_INTERPOLATION,
    DRAW_LOD,
    DRAW_MAX_BYTES,
    DRAW_MAX_MS,
    DRAW_SAMPLES,
    DRAW_SAMPLES_PER_SHEET,
    DRAW_DEPTH,
    DRAW_COUNT,
    DRAW_SHOW,
    DRAW_FIELD,
    DRAW_TOLERANCE,
    DRAW_COMPOSITING,
    DRAW_FLATTEN,
    DRAW_H,
    DRAW_KERNEL_RADIUS,
    DRAW_LOW_PASS,
    DRAW_LOW_PASS_WIDTH,
    DRAW_METHOD,
    DRAW_NORMALISE,
    DRAW_LISTS,
    DRAW_PRIMITIVES, /* both named "submit" */
    DRAW_TARGET,
    DRAW_TRAVERSAL,
    DRAW_WEIGHTS,
    DRAW_ORDER,
    DRAW_SHEET,
    DRAW_HARMONICS, /* named "sh" */
    DRAW_SIDES,
    DRAW_OPTIONS
};

extern const trip_option_table draw_settings_table;

/* Returns the settings for the library. They point into *s. */
triptych_settings draw_settings_public(const draw_settings *s);
/* Returns a copy of settings. NULL gives the defaults. */
draw_settings draw_settings_of(const triptych_settings *s);
/* Calls triptych_set_settings(). */
int draw_settings_use(triptych *t, const draw_settings *s);
bool draw_settings_same(const draw_settings *a, const draw_settings *b);
/* Writes the settings as options of `triptych render`, each after a space, for free(). Returns NULL
 * if memory is exhausted. */
char *draw_settings_text(const draw_settings *s);
/* Reads such a text over *s. Reports a fault and returns TRIP_USAGE. */
int draw_settings_read_text(draw_settings *s, const char *text);
/* Unsets a row. */
void draw_settings_unset(draw_settings *s, int row);
/* Returns the background: red, green, blue, alpha. */
const double *draw_settings_background(const draw_settings *s);
/* Returns the name of a row's value, such as "merge"; of an unset row, the default's name. */
const char *draw_settings_choice(const draw_settings *s, int row);
/* Returns the mean error that a quality promises, of 255; 0 if it promises none. */
double draw_settings_promise(triptych_quality quality);

/* ---- exclusions ---- */

/* Checks every range. */
int draw_settings_check_ranges(const draw_settings *s);
/* Checks every range and rule, as triptych_check_settings() does. With `idle_too`, also refuses
 * settings that only have no effect. */
int draw_settings_check(const draw_settings *s, triptych_renderer *renderer, bool idle_too);
/* The kinds of data. C++ takes a kind as an int. DRAW_KIND_VOLUME is 0. */
typedef enum draw_kind {
    DRAW_KIND_VOLUME,
    DRAW_KIND_SCENE,
    DRAW_KIND_CLOUD,
    DRAW_KIND_OBJECTS /* volumes with places, alone or beside Gaussian scenes */
} draw_kind;

/* Whether all data are Gaussians. */
static inline bool draw_kind_is_gaussian(int kind)
{
    return kind == DRAW_KIND_SCENE || kind == DRAW_KIND_CLOUD;
}
/* Checks that all settings and resources apply to a kind of data. */
int draw_settings_check_kind(const draw_settings *s, const triptych_resources *r, draw_kind kind);
/* Returns whether a row applies, with the other settings as they are. */
bool draw_settings_applies(const draw_settings *s, int row, int kind);
/* Returns whether a choice of a row that applies does too. */
bool draw_settings_choice_applies(int row, int choice, int kind);
/* Returns the effects that a kind of data can have: a sum of TRIPTYCH_EFFECT_SHADOWS, ... */
int draw_settings_effects_of_kind(int kind);
/* Unsets all settings that draw_settings_check_kind() would refuse. */
void draw_settings_drop_kind(draw_settings *s, int kind);
/* Unsets all settings that the other settings or the renderer exclude. */
void draw_settings_drop_excluded(draw_settings *s, triptych_renderer renderer);
/* Returns the name of a given setting that only splats have, or NULL. */
const char *draw_settings_of_splats(const draw_settings *s);
/* Returns the classification that the settings ask for; auto if the data decide. */
triptych_classify draw_settings_classify(const draw_settings *s);
/* Returns whether the settings allow post. */
static inline bool draw_settings_may_use_sheets(const draw_settings *s)
{
    const triptych_classify classify = draw_settings_classify(s);
    return classify == TRIPTYCH_CLASSIFY_POST ||
           (classify == TRIPTYCH_CLASSIFY_AUTO && !draw_settings_of_splats(s));
}
/* Returns whether coarse levels may be drawn. */
static inline bool draw_settings_has_levels(const draw_settings *s)
{
    return s->lod.voxel_px > 0 || s->lod.max_bytes > 0 || s->lod.max_ms > 0;
}

#ifdef __cplusplus
}
#endif

#endif
