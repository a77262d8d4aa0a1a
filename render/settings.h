/* What a picture is to be. Plain values that every renderer reads alike; start from
 * trip_settings_default(). Sections of papers: 2005 is Hofsetz & Max, 2008 with Bastos. */
#ifndef TRIP_SETTINGS_H
#define TRIP_SETTINGS_H

#include <stdbool.h>

#include "clip.h"
#include "geometry.h"

/* Standard deviation of the reconstruction Gaussian is kernel_radius / TRIP_CUTOFF, and every
 * footprint, low-pass included, ends at TRIP_CUTOFF standard deviations, where the Gaussian has
 * fallen to exp(-TRIP_CUTOFF^2 / 2) = 0.39 % of its peak; it is lowered by as much, to end at 0. */
#define TRIP_CUTOFF (10.0 / 3.0)
#define TRIP_KERNEL_RADIUS_VOXELS 2.0
/* Standard deviation of the low-pass Gaussian in pixels (the filter of Zwicker et al. 2001, EWA
 * volume resampling filter, which is 1 pixel there), so that a splat never falls between pixel
 * centres. */
#define TRIP_LOW_PASS_PX 0.4
typedef enum trip_method {
    TRIP_METHOD_MERGE, /* three layers blended by w^2 (2005, 5.2; 2008, 4.2) */
    TRIP_METHOD_CLIP,  /* every pixel from the list its ray is most aligned with (2005, 5.1) */
    TRIP_METHOD_AXIS,  /* one list per frame, by the ray at the image centre (Westover 1989) */
    TRIP_METHOD_IMAGE, /* sheets parallel to the image plane, which splats are cut into (Mueller &
                          Crawfis 1998, image_sheets.h); any one list will do */
} trip_method;

typedef enum trip_traversal {
    TRIP_TRAVERSAL_OUTWARD,   /* from the eye outward, front to back, as each ray goes */
    TRIP_TRAVERSAL_ASCENDING, /* file order, blend equation by the central ray (2008, 5.3) */
} trip_traversal;

typedef enum trip_target {
    TRIP_TARGET_RGBA32F,
    TRIP_TARGET_RGBA16F,
    TRIP_TARGET_RGBA8,
} trip_target;

/* What the integral renderer integrates. */
typedef enum trip_field_kind {
    TRIP_FIELD_VALUES, /* values interpolated between voxels, then classified */
    TRIP_FIELD_SPLATS, /* the sum of the splats */
} trip_field_kind;

/* What of a splat's footprint is worked out how (pre; splat.h). */
typedef enum trip_footprint {
    TRIP_FOOTPRINT_EXACT, /* from the distance of every pixel's ray */
    TRIP_FOOTPRINT_EWA,   /* by the affine map at the centre (Zwicker et al. 2001) */
    TRIP_FOOTPRINT_FIXED, /* of one size in pixels, sprite_px (2008, 5.2) */
} trip_footprint;

/* What keeps footprints from falling between pixel centres (ewa.h). */
typedef enum trip_low_pass {
    TRIP_LOW_PASS_EWA,     /* the footprint's convolution with a Gaussian */
    TRIP_LOW_PASS_UNIFORM, /* Swan's scaling; of EWA footprints, by the reference alone */
    TRIP_LOW_PASS_NONE,
} trip_low_pass;

typedef enum trip_kernel {
    TRIP_KERNEL_LINEAR,   /* between the 8 voxels around */
    TRIP_KERNEL_CUBIC,    /* Catmull and Rom's, between 64 */
    TRIP_KERNEL_GAUSSIAN, /* a splat's, of 64, which smooths (kernel.h); not of the integral */
} trip_kernel;

/* What comes first: the transfer function, or the reconstruction from voxels. */
typedef enum trip_classify {
    TRIP_CLASSIFY_PRE,  /* voxels are classified, and their splats drawn (splat.h) */
    TRIP_CLASSIFY_POST, /* values are interpolated in sheets, and classified at pixels (sheet.h) */
} trip_classify;

/* What of the splats of a list is composited (pre; splat.h). */
typedef enum trip_compositing {
    TRIP_COMPOSITING_SPLAT, /* each, in list order, as the papers do */
    TRIP_COMPOSITING_SHEET, /* the sum of each sheet's */
} trip_compositing;

/* What a picture is coloured by (tint.h). */
typedef enum trip_show {
    TRIP_SHOW_PICTURE, /* the transfer function */
    TRIP_SHOW_LISTS,   /* which list: x red, y green, z blue */
    TRIP_SHOW_MERGE,   /* the weights of the lists at each pixel, and nothing of the volume */
    TRIP_SHOW_LEVELS,  /* which level of detail */
} trip_show;

/* A build without effects refuses them: what they would cost where none runs is counted beside it
 * (tests/compare/uncalled). */
#ifdef TRIP_WITHOUT_EFFECTS
#define TRIP_HAS_EFFECTS 0
#else
#define TRIP_HAS_EFFECTS 1
#endif

/* What is simulated besides colour and shading (effects.h). What is off costs nothing. */
typedef struct trip_effects {
    bool shadows;      /* what lies towards the light attenuates it */
    bool occlusion;    /* what lies around attenuates the light that comes from everywhere */
    bool emission;     /* hot matter gives off light of its own (emission.h) */
    double cueing;     /* share of the background in the colour of what is farthest: 0 (off) to 1 */
    double anisotropy; /* of scattering, where shadows are: -1 < g < 1 */
    int cells; /* of the light's grid along its longest axis, TRIP_LIGHT_CELLS_MAX or less */
} trip_effects;

#define TRIP_LIGHT_CELLS 128
#define TRIP_LIGHT_CELLS_MAX 1024

/* Slices of a sheet: the most that settings may have. */
#define TRIP_SHEET_SAMPLES_MAX 16

typedef struct trip_settings {
    trip_classify classify;
    trip_compositing compositing; /* of splats */
    trip_footprint footprint;     /* likewise */
    trip_low_pass low_pass;       /* likewise */
    double
        flatten; /* of EWA footprints: how much flatter kernels are along the gradient, 1: round */
    double sprite_px;      /* of fixed footprints: their width, trip_splat_sprite_px() */
    bool vertex_weights;   /* merge: weights of a splat's corners, interpolated over it (2008, 4.2);
                              of pixels where it is near */
    int samples_per_sheet; /* of a sheet, post: 1 to TRIP_SHEET_SAMPLES_MAX */
    trip_method method;
    trip_traversal traversal;
    trip_target target;
    bool indexed;              /* one vertex array with three index lists instead of three lists */
    bool triangles;            /* bounding quads of two triangles instead of point sprites */
    bool depth;                /* a picture of distances too, see layer.h; rgba32f only */
    bool shading;              /* diffuse and specular from the stored gradients */
    bool headlight;            /* light from the eye; otherwise from light_direction, */
    bool point_light;          /* or from light_position, as bright at any distance */
    trip_vec3 light_direction; /* world space, towards the light, unit length */
    trip_vec3 light_position;  /* world space */
    double h;                  /* 0 <= h < 1, or TRIP_H_AUTO: trip_settings_h() */
    double early_termination;  /* compositing front to back, the transmittance below which a pixel
                           takes no  more: 0 (none is) to TRIP_EARLY_TERMINATION_MAX, or
                           TRIP_EARLY_TERMINATION_AUTO */
    double kernel_radius;      /* voxels (index space) */
    double background[4];      /* r, g, b, a; not premultiplied */
    double lod_px;      /* what is far is drawn at the coarsest level whose voxels are at most so
                           many pixels of the picture wide there (lod.h, lod_parts.h); 0: all at
                           the finest */
    double max_bytes;   /* and at coarser ones still, so that no more is read (lod_limit.h);
                           0: no bound */
    trip_kernel kernel; /* of values, post and the integral */
    /* Of the integral renderer alone. */
    trip_field_kind field;
    double tolerance; /* of a component of a pixel, 0 to 1 */
    int samples;      /* rays of a pixel, along x and along y; their mean is its colour. Frames
                         of other renderers are that much larger instead */
    trip_clip clip;   /* what is drawn lies inside; world space */
    trip_show show;
    trip_effects effects;
} trip_settings;

/* Where layers begin to blend, by how they are classified: of splats 0.85, as the papers have it.
 * By post layers agree so well that a narrow border hides where they meet (`triptych bench popping
 * --classify post`), and fewer pixels are drawn twice. */
#define TRIP_H_AUTO (-1.0)
#define TRIP_H_PRE 0.85
#define TRIP_H_POST 0.99

/* Where pixels are saturated, by how they are classified: what lies behind adds less than that to
 * any component. Of values it is half of 1/255, since a saturated pixel is opaque there (sheet.h).
 * At the most it is 26/255. */
#define TRIP_EARLY_TERMINATION_AUTO (-1.0)
#define TRIP_EARLY_TERMINATION_PRE (1.0 / 8192.0)
#define TRIP_EARLY_TERMINATION_POST (1.0 / 512.0)
#define TRIP_EARLY_TERMINATION_MAX 0.1

/* The defaults: pre, splat by splat, exact footprints, EWA's low-pass, 2 slices, merge, outward, h
 * and saturation by the classification, kernel radius 2, shading by headlight, rgba32f, no depth,
 * black; values, linear, to 1e-4, one ray a pixel. */
trip_settings trip_settings_default(void);

/* The h of merge. */
static inline double trip_settings_h(const trip_settings *s)
{
    const double of_class = s->classify == TRIP_CLASSIFY_POST ? TRIP_H_POST : TRIP_H_PRE;
    return s->h >= 0 ? s->h : of_class;
}

/* The transmittance below which a pixel takes no more. */
static inline double trip_settings_early_termination(const trip_settings *s)
{
    const bool post = s->classify == TRIP_CLASSIFY_POST;
    return s->early_termination >= 0 ? s->early_termination
           : post                    ? TRIP_EARLY_TERMINATION_POST
                                     : TRIP_EARLY_TERMINATION_PRE;
}

/* Whether splats are summed sheet by sheet. */
static inline bool trip_settings_sum_sheets(const trip_settings *s)
{
    return s->classify == TRIP_CLASSIFY_PRE && s->compositing == TRIP_COMPOSITING_SHEET;
}

/* Whether a frame has one list, that of the axis of view. */
static inline bool trip_settings_has_one_list(const trip_settings *s)
{
    return s->method == TRIP_METHOD_AXIS || s->method == TRIP_METHOD_IMAGE;
}

/* Whether coarse levels may be drawn. */
static inline bool trip_settings_has_levels(const trip_settings *s)
{
    return s->lod_px > 0 || s->max_bytes > 0;
}

/* Fails (usage) for settings that exclude one another. */
int trip_settings_check(const trip_settings *s);

#endif
