/* The settings of a picture: plain values that have the same meaning for every renderer. Start from
 * trip_settings_default(). Comments cite two papers: 2005 is Hofsetz & Max, 2008 is Hofsetz, Max &
 * Bastos. */
#ifndef TRIP_SETTINGS_H
#define TRIP_SETTINGS_H

#include <stdbool.h>

#include "clip.h"
#include "geometry.h"

/* Every footprint ends at TRIP_CUTOFF standard deviations, including the low-pass filter. The
 * standard deviation of the kernel is kernel_radius / TRIP_CUTOFF. At the cut-off the Gaussian has
 * fallen to exp(-TRIP_CUTOFF^2 / 2) = 0.39 % of its peak. That value is subtracted, so that the
 * footprint ends at 0. */
#define TRIP_CUTOFF (10.0 / 3.0)
#define TRIP_KERNEL_RADIUS_VOXELS 2.0
/* Default standard deviation of the low-pass Gaussian in pixels. The filter keeps splats from
 * falling between pixel centres. Zwicker et al. 2001 (EWA volume resampling filter) use 1 pixel. */
#define TRIP_LOW_PASS_PX 0.4
#define TRIP_LOW_PASS_PX_MAX 16.0
typedef enum trip_method {
    TRIP_METHOD_MERGE, /* three layers blended by w^2 (2005, 5.2; 2008, 4.2) */
    TRIP_METHOD_CLIP,  /* each pixel from the list its ray is most aligned with (2005, 5.1) */
    TRIP_METHOD_AXIS,  /* one list per frame, by the ray at the image centre (Westover 1989) */
    /* Splats of any one list, cut into sheets parallel to the image plane (Mueller & Crawfis 1998,
     * reference_sheets.h). */
    TRIP_METHOD_IMAGE,
} trip_method;

typedef enum trip_traversal {
    TRIP_TRAVERSAL_OUTWARD,   /* from the eye outward, front to back along each ray */
    TRIP_TRAVERSAL_ASCENDING, /* file order; the central ray selects the blending (2008, 5.3) */
} trip_traversal;

typedef enum trip_target {
    TRIP_TARGET_RGBA32F,
    TRIP_TARGET_RGBA16F,
    TRIP_TARGET_RGBA8,
} trip_target;

/* The field that the integral renderer integrates. */
typedef enum trip_field_kind {
    TRIP_FIELD_VALUES, /* values interpolated between voxels, then classified */
    TRIP_FIELD_SPLATS, /* the sum of the splats */
} trip_field_kind;

/* How the footprint of a splat is computed (pre; splat.h). */
typedef enum trip_footprint {
    TRIP_FOOTPRINT_EXACT, /* from the distance of each pixel's ray */
    TRIP_FOOTPRINT_EWA,   /* by the affine approximation at the centre (Zwicker et al. 2001) */
    TRIP_FOOTPRINT_FIXED, /* one size in pixels, sprite_px (2008, 5.2) */
} trip_footprint;

/* The filter that keeps footprints from falling between pixel centres (ewa.h). */
typedef enum trip_low_pass {
    TRIP_LOW_PASS_EWA,     /* convolution of the footprint with a Gaussian */
    TRIP_LOW_PASS_UNIFORM, /* Swan's scaling; with EWA footprints, reference renderer only */
    TRIP_LOW_PASS_NONE,
} trip_low_pass;

typedef enum trip_kernel {
    TRIP_KERNEL_LINEAR,   /* between the 8 nearest voxels */
    TRIP_KERNEL_CUBIC,    /* Catmull-Rom, between 64 voxels */
    TRIP_KERNEL_GAUSSIAN, /* profile of a splat over 64 voxels, which smooths (kernel.h); not for
                             the integral */
    TRIP_KERNEL_NEAREST,  /* the nearest voxel's value, for labels (sheet.h) */
} trip_kernel;

/* The order of classification by the transfer function and reconstruction from voxels. */
typedef enum trip_classify {
    TRIP_CLASSIFY_PRE,  /* voxels are classified, then drawn as splats (splat.h) */
    TRIP_CLASSIFY_POST, /* values are interpolated in sheets, then classified at pixels (sheet.h) */
} trip_classify;

/* The unit of compositing for the splats of a list (pre; splat.h). */
typedef enum trip_compositing {
    TRIP_COMPOSITING_SPLAT, /* each splat, in list order, as in the papers */
    TRIP_COMPOSITING_SHEET, /* the sum of the splats of a sheet */
} trip_compositing;

/* The colours of a picture (debug_view.h). */
typedef enum trip_show {
    TRIP_SHOW_PICTURE, /* by the transfer function */
    TRIP_SHOW_LISTS,   /* by list: x red, y green, z blue */
    TRIP_SHOW_MERGE,   /* the weights of the lists at each pixel, without the volume */
    TRIP_SHOW_LEVELS,  /* by level of detail */
} trip_show;

/* A build with TRIP_WITHOUT_EFFECTS refuses effects. tests/compare/uncalled compares its cost with
 * the cost of a full build. */
#ifdef TRIP_WITHOUT_EFFECTS
#define TRIP_HAS_EFFECTS 0
#else
#define TRIP_HAS_EFFECTS 1
#endif

/* Effects beyond colour and shading (effects.h). An effect that is off costs nothing. */
typedef struct trip_effects {
    bool shadows;   /* matter towards the light attenuates it */
    bool occlusion; /* matter around a point attenuates ambient light */
    bool emission;  /* hot matter emits light (emission.h) */
    double cueing;  /* share of the background in the colour of the farthest matter: 0 (off) to 1 */
    double anisotropy; /* of scattering, with shadows: -1 < g < 1 */
    int cells;         /* of the light grid along its longest axis, at most TRIP_LIGHT_CELLS_MAX */
} trip_effects;

#define TRIP_LIGHT_CELLS 128
#define TRIP_LIGHT_CELLS_MAX 1024

/* Maximum of samples_per_sheet. */
#define TRIP_SHEET_SAMPLES_MAX 16

typedef struct trip_settings {
    trip_classify classify;
    trip_compositing compositing; /* of splats */
    trip_footprint footprint;     /* of splats */
    trip_low_pass low_pass;       /* of splats */
    double low_pass_px;           /* its standard deviation, 0 to TRIP_LOW_PASS_PX_MAX */
    /* EWA footprints: how many times flatter kernels are along the gradient. 1 keeps them round. */
    double flatten;
    double sprite_px; /* width of fixed footprints, see trip_splat_sprite_px() */
    /* Merge: interpolates the weights of a splat's corners over the splat (2008, 4.2). Near splats
     * use the weights of pixels. */
    bool vertex_weights;
    int samples_per_sheet; /* post: 1 to TRIP_SHEET_SAMPLES_MAX; 2 with the nearest value */
    trip_method method;
    trip_traversal traversal;
    trip_target target;
    bool indexed;  /* one vertex array with three index lists instead of three lists */
    bool resident; /* three vertex arrays that stay in GL memory */
    /* Selects every brick of the lists that are drawn, as if nothing could be left out. For
     * measurements of splats. */
    bool unculled;
    /* Culls splats by the weights of two points (2008, 5.4; weight.h). May lose splats. Not for
     * cpu. */
    bool two_point_culling;
    bool triangles;            /* bounding quads of two triangles instead of point sprites */
    bool depth;                /* also computes distances (layer.h); rgba32f only */
    bool shading;              /* diffuse and specular light */
    double shading_range;      /* full shading counts at most this range of values; 0: no limit */
    bool headlight;            /* light from the eye */
    bool point_light;          /* light from light_position, equally bright at any distance */
    trip_vec3 light_direction; /* if neither: world space, towards the light, unit length */
    trip_vec3 light_position;  /* world space */
    double h;                  /* 0 <= h < 1, or TRIP_H_AUTO: trip_settings_h() */
    /* Transmittance below which a pixel takes no more samples or splats, in front to back
     * compositing: 0 (never) to TRIP_EARLY_TERMINATION_MAX, or TRIP_EARLY_TERMINATION_AUTO. */
    double early_termination;
    double kernel_radius; /* voxels (index space) */
    double background[4]; /* r, g, b, a; not premultiplied */
    /* Each part is drawn at the coarsest level with voxels at most this many pixels wide (lod.h,
     * lod_parts.h). 0 draws the finest level everywhere. */
    double lod_px;
    /* Upper bound of the bytes read. Coarser levels than lod_px asks for are drawn to keep it
     * (lod.h). 0 sets no bound. */
    double max_bytes;
    /* Post: reads the deviations of coarse values, which blur the transfer function (sheet.h). */
    bool deviations;
    trip_kernel kernel; /* of values, in post and the integral */
    /* For the integral renderer alone. */
    trip_field_kind field;
    double tolerance; /* of each component of a pixel, 0 to 1 */
    /* Rays per pixel along x and along y; their mean is the pixel's colour. Frames of other
     * renderers are this many times larger instead. 0 (integral renderer only) takes the mean over
     * the area of the pixel, to the tolerance (integral/pixel_area.h). */
    int samples;
    trip_clip clip; /* the part of the volume to draw; world space */
    trip_show show;
    trip_effects effects;
} trip_settings;

/* The default tolerance of means over the areas of pixels: a quarter of 1/255. */
#define TRIP_TOLERANCE_OF_AREAS 1e-3

/* The weight parameter h by classification: layers blend at rays with a second component above h.
 * Splats use 0.85, as the papers do. In `post` the layers agree so well that a narrow border hides
 * their transition (`triptych bench popping --classify post`), and fewer pixels are drawn twice. */
#define TRIP_H_AUTO (-1.0)
#define TRIP_H_PRE 0.85
#define TRIP_H_POST 0.99

/* Transmittance of early termination, by classification. Matter behind that point adds less than
 * this to any component. For values it is half of 1/255, since the pixel is then opaque (sheet.h).
 * The maximum is 26/255. */
#define TRIP_EARLY_TERMINATION_AUTO (-1.0)
#define TRIP_EARLY_TERMINATION_PRE (1.0 / 8192.0)
#define TRIP_EARLY_TERMINATION_POST (1.0 / 512.0)
#define TRIP_EARLY_TERMINATION_MAX 0.1

/* Returns the defaults:
 * - pre, compositing splat, exact footprints of radius 2, low-pass filter EWA;
 * - 2 samples per sheet in post;
 * - merge, outward, h and early termination by the classification;
 * - shading by headlight, a black background, rgba32f, no depth;
 * - the integral of linearly interpolated values to 1e-4, one ray per pixel. */
trip_settings trip_settings_default(void);

/* Returns h for merge. */
static inline double trip_settings_h(const trip_settings *s)
{
    const double of_class = s->classify == TRIP_CLASSIFY_POST ? TRIP_H_POST : TRIP_H_PRE;
    return s->h >= 0 ? s->h : of_class;
}

/* Returns the transmittance below which a pixel takes no more samples or splats. */
static inline double trip_settings_early_termination(const trip_settings *s)
{
    const bool post = s->classify == TRIP_CLASSIFY_POST;
    return s->early_termination >= 0 ? s->early_termination
           : post                    ? TRIP_EARLY_TERMINATION_POST
                                     : TRIP_EARLY_TERMINATION_PRE;
}

/* Returns the standard deviation of the low-pass filter in pixels; 0 without a filter. */
static inline double trip_settings_low_pass_px(const trip_settings *s)
{
    return s->low_pass == TRIP_LOW_PASS_NONE ? 0 : s->low_pass_px;
}

/* Whether all splats stay in GL memory between frames. */
static inline bool trip_settings_stays(const trip_settings *s)
{
    return s->indexed || s->resident;
}

/* Whether splats are added sheet by sheet. */
static inline bool trip_settings_sum_sheets(const trip_settings *s)
{
    return s->classify == TRIP_CLASSIFY_PRE && s->compositing == TRIP_COMPOSITING_SHEET;
}

/* Whether a frame draws only the list along the axis of view. */
static inline bool trip_settings_has_one_list(const trip_settings *s)
{
    return s->method == TRIP_METHOD_AXIS || s->method == TRIP_METHOD_IMAGE;
}

/* Whether a frame interpolates values between voxels, so that it needs draw codes. */
static inline bool trip_settings_interpolates(const trip_settings *s, bool integral)
{
    const bool values =
        integral ? s->field == TRIP_FIELD_VALUES : s->classify == TRIP_CLASSIFY_POST;
    return values && s->kernel != TRIP_KERNEL_NEAREST;
}

/* Whether coarse levels may be drawn. */
static inline bool trip_settings_has_levels(const trip_settings *s)
{
    return s->lod_px > 0 || s->max_bytes > 0;
}

/* Fails with TRIP_USAGE (reported) for settings that exclude one another. */
int trip_settings_check(const trip_settings *s);

#endif
