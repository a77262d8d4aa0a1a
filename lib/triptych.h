/* Triptych as a library: draws volumes that do not fit in memory. A context holds one opened data
 * set (NAME.trip, as `triptych brick` or triptych_brick() of triptych_brick.h makes it) and draws
 * frames of it:
 *
 *     triptych *t;
 *     if (triptych_create(&t) == 0 && triptych_open(t, "head.trip", NULL) == 0) {
 *         triptych_set_view(t, &(triptych_view){ .width = 800, .height = 600 });
 *         triptych_draw(t, rgba);
 *     }
 *
 * One thread at a time uses a context, but for triptych_cancel(); any number of contexts may be
 * used by as many threads, and share nothing. Functions return 0 or a negative triptych_status, and
 * triptych_error() then says why. Parameters are plain structs in which zero means the default,
 * but for triptych_settings, which begins as triptych_default_settings() has it; what they point to
 * is needed during the call only.
 *
 * World space is the data's own (millimetres, metres, ...), as the volume's file says. Pictures are
 * floats: height rows of width pixels, row 0 at the top, each red, green, blue, alpha, multiplied
 * by alpha; colours are display values (sRGB), 0 to 1. The same data, view, function and settings
 * give the same picture, bit for bit, however it is drawn and whatever memory and threads it gets.
 */
#ifndef TRIPTYCH_H
#define TRIPTYCH_H

#include <stdint.h>

#if defined(__GNUC__)
#define TRIPTYCH_API __attribute__((visibility("default")))
#else
#define TRIPTYCH_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef enum triptych_status {
    TRIPTYCH_OK = 0,
    TRIPTYCH_ERROR = -1,
    TRIPTYCH_USAGE = -2,     /* the caller's parameters are at fault */
    TRIPTYCH_CANCELLED = -3, /* by triptych_cancel() */
} triptych_status;

typedef struct triptych triptych;

/* ---- contexts ---- */

/* Fails only without memory. */
TRIPTYCH_API int triptych_create(triptych **out);
/* NULL is fine. */
TRIPTYCH_API void triptych_destroy(triptych *t);
/* Why the last call failed: one line without its end, "triptych: read: head.trip: ..."; "" where it
 * did not. Valid until the next call. */
TRIPTYCH_API const char *triptych_error(const triptych *t);
/* Calls `take` with each line for people as it comes: warnings, notes and failures. NULL: they are
 * dropped. It may be called by other threads, but only during a call with this context. */
TRIPTYCH_API void triptych_set_messages(triptych *t, void (*take)(void *user, const char *line),
                                        void *user);
/* Calls `show` now and then during long work, on the calling thread: how much of a stage is done.
 * Stages are "draw" (of voxels, post), "splat" and "count" (of splats, pre), "integrate" (of
 * pixels), and those of triptych_brick.h. NULL: no calls. */
TRIPTYCH_API void triptych_set_progress(triptych *t,
                                        void (*show)(void *user, const char *stage, uint64_t done,
                                                     uint64_t total),
                                        void *user);
/* "0.1.0". */
TRIPTYCH_API const char *triptych_version(void);

/* ---- data ---- */

typedef enum triptych_renderer {
    TRIPTYCH_RENDERER_AUTO, /* GL on graphics hardware, else CPU */
    TRIPTYCH_RENDERER_GL,   /* OpenGL 4.5, without a window */
    TRIPTYCH_RENDERER_CPU,
    TRIPTYCH_RENDERER_REFERENCE, /* double precision, slow */
    TRIPTYCH_RENDERER_INTEGRAL,  /* what the others approximate: ray by ray, slower; all of the
                                    volume has to fit the memory, 16 bytes a voxel */
} triptych_renderer;

typedef enum triptych_engine {
    TRIPTYCH_ENGINE_AUTO, /* io_uring where the kernel allows it, else pread */
    TRIPTYCH_ENGINE_URING,
    TRIPTYCH_ENGINE_PREAD,
    TRIPTYCH_ENGINE_NULL, /* everything is read into memory first */
} triptych_engine;

typedef struct triptych_resources {
    uint64_t memory_bytes; /* that all data may take; default: a quarter of what may be used */
    unsigned threads;      /* that draw and read, up to 256; default: one a processor */
    triptych_renderer renderer;
    triptych_engine engine;
    int keep_pages; /* not 0: half of the memory left keeps what was read for the frames to come */
    int read_occluded; /* not 0: bricks behind what is opaque are read too; the same picture */
    const char *name;  /* of the data in messages; default: its path */
} triptych_resources;

/* Closes what is open, and opens a data set; resources NULL: the defaults. */
TRIPTYCH_API int triptych_open(triptych *t, const char *path, const triptych_resources *resources);
/* Opens one more, to be drawn in one picture with what is open, sheet by sheet in one order:
 * another region of the same volume, with the same codes, as triptych_brick_options.region_first
 * makes them. All of them are drawn at their finest level. A function and a view that were set are
 * forgotten; the default function is the first data set's. A voxel that several hold counts once in
 * post, and for each of them in pre. After a failure what was open still is. */
TRIPTYCH_API int triptych_add(triptych *t, const char *path);
/* Opens a data set of the heat of what is open, on any grid, in the place of one that was: for
 * TRIPTYCH_EMISSION, until what is open is closed. NULL: none. */
TRIPTYCH_API int triptych_set_heat(triptych *t, const char *path);
TRIPTYCH_API void triptych_close(triptych *t);

typedef struct triptych_info {
    int64_t dims[3];             /* voxels of the volume along i, j, k */
    double index_to_world[3][4]; /* world = matrix . (i, j, k, 1), where spacing is even */
    /* Least and most distance of neighbours along i, j, k in the world. They differ where spacing
     * is uneven; the matrix then takes places to the world, which are indices on the average. */
    double spacing_min[3], spacing_max[3];
    int64_t first[3], last[3]; /* voxels kept along i, j, k */
    double lo[3], hi[3];       /* box of those in world space, from edge to edge */
    /* Where those begin and end along i, j, k, and where the grid does: for the matrix. */
    double edges[2][3], grid_edges[2][3];
    double value_min, value_max; /* of the volume */
    double code_lo, code_hi;     /* values of codes 0 and 65535 (FORMAT.md) */
    uint64_t voxels;             /* of the volume */
    uint64_t kept;               /* of those: not what no function given to `brick` shows */
    uint64_t halo;               /* neighbours of those, for interpolation */
    uint64_t bytes, index_bytes; /* on disk: of everything, of the index */
    uint64_t
        checksum; /* of the index, which has those of all else: the same data, the same number */
    unsigned format_version, lists, code_bytes, normal_bytes; /* 0: splats are not shaded */
    double gradient_step[3], gradient_full;                   /* of normals of 3 bytes, of all */
    unsigned tile_voxels, slab_sheets, page_bytes;
    const char *notes; /* as its maker left them, JSON by `brick`; last until it is closed */
} triptych_info;

TRIPTYCH_API int triptych_get_info(triptych *t, triptych_info *out);

/* Records of one kind along one axis at one level of detail. */
typedef struct triptych_list {
    const char *path; /* of its data set; lasts until that is closed */
    int axis;         /* 0 to 2 */
    unsigned level;   /* 0: all details */
    const char *kind; /* "voxels", "halo" */
    int drawn;        /* 0: there for interpolation alone */
    int64_t dims[3];  /* of the list's own grid */
    double index_to_world[3][4];
    double sheet_first, sheet_step; /* sheets along the axis, in voxels of level 0 */
    uint64_t records, slabs, bricks, bytes;
} triptych_list;

/* Lists are numbered from 0 to below triptych_info.lists. */
TRIPTYCH_API int triptych_get_list(triptych *t, unsigned number, triptych_list *out);
/* Reads everything and checks it against its checksums and the index. */
TRIPTYCH_API int triptych_verify(triptych *t);

enum { TRIPTYCH_HISTOGRAM_BINS = 1024 };

typedef struct triptych_histogram {
    double lo, hi;                            /* what the bins divide equally */
    uint64_t counts[TRIPTYCH_HISTOGRAM_BINS]; /* of finite values of the volume, kept or not */
    uint64_t total;
} triptych_histogram;

/* As it is kept in the data set, nothing is read for it; total 0: none is. */
TRIPTYCH_API int triptych_get_histogram(triptych *t, triptych_histogram *out);

/* ---- what is drawn ---- */

typedef struct triptych_transfer_function {
    const char *name;     /* preset or file, as of --tf; default: the one kept in the data set */
    double opacity_scale; /* multiplies extinction, up to 1e6; default 1 */
    double window, level; /* window > 0: stretched over level - window / 2 to level + window / 2 */
    int *left_out;        /* not NULL: set to 1 (else 0), in place of a warning, where values that
                             would show were not kept; the function is then not taken */
    const char *text;     /* the function itself, as the text of a `.tf`; not with a name */
} triptych_transfer_function;

/* From the next frame on; NULL: the default. */
TRIPTYCH_API int triptych_set_transfer_function(triptych *t,
                                                const triptych_transfer_function *function);

typedef struct triptych_preset {
    const char *name, *values, *summary; /* values: what the function's values are relative to */
} triptych_preset;

/* Built-in functions, numbered from 0; returns 0 beyond the last, else 1. */
TRIPTYCH_API int triptych_get_preset(unsigned number, triptych_preset *out);

typedef enum triptych_form {
    TRIPTYCH_FORM_TF,       /* Triptych's own text */
    TRIPTYCH_FORM_PARAVIEW, /* JSON */
    TRIPTYCH_FORM_VP,       /* 3D Slicer, as text and as JSON */
    TRIPTYCH_FORM_VP_JSON,
    TRIPTYCH_FORM_SLICER, /* presets in XML */
    TRIPTYCH_FORM_VTK,    /* XML */
} triptych_form;

typedef struct triptych_conversion {
    const char *function; /* preset or file; default: the data's own */
    const char *volume;   /* the data, a file; default: the data set that is open, or none */
    double lo, hi;        /* lo < hi: without data, what a function over the data's range spans */
    triptych_form form;
    const char *name; /* of what is converted, for the text and messages; default: of the above */
} triptych_conversion;

/* A function in data units, as text that other programs read; *text is for free(). */
TRIPTYCH_API int triptych_convert(triptych *t, const triptych_conversion *wanted, char **text);

typedef enum triptych_method {
    TRIPTYCH_MERGE, /* three layers, blended */
    TRIPTYCH_CLIP,  /* each pixel from one layer */
    TRIPTYCH_AXIS,  /* one layer for the picture */
    TRIPTYCH_IMAGE, /* sheets parallel to the image plane (Mueller & Crawfis 1998), which have no
                       order of lists; pre, by the reference alone */
} triptych_method;

typedef enum triptych_traversal {
    TRIPTYCH_OUTWARD,   /* front to back from the eye */
    TRIPTYCH_ASCENDING, /* in the order of the file */
} triptych_traversal;

typedef enum triptych_target {
    TRIPTYCH_RGBA32F,
    TRIPTYCH_RGBA16F,
    TRIPTYCH_RGBA8,
} triptych_target;

typedef enum triptych_field {
    TRIPTYCH_VALUES, /* interpolated between voxels, then classified */
    TRIPTYCH_SPLATS, /* the sum of the splats */
} triptych_field;

typedef enum triptych_kernel {
    TRIPTYCH_LINEAR,   /* between the 8 voxels around */
    TRIPTYCH_CUBIC,    /* Catmull and Rom's, between 64 */
    TRIPTYCH_GAUSSIAN, /* a splat's, of 64, which smooths; not of the integral */
} triptych_kernel;

/* What comes first. */
typedef enum triptych_classify {
    TRIPTYCH_PRE,  /* voxels are classified, and their splats drawn */
    TRIPTYCH_POST, /* values are interpolated in sheets, and classified at pixels */
    /* Post, but pre where something is set that only splats have (ascending traversal, the
     * method image, weights of vertices, a rounded target, indexed, triangles, by
     * sheet, EWA footprints, another low-pass or kernel radius than 2, count), or the data has no
     * cells to interpolate in: one voxel thick, or culled without a halo. triptych_explain() says
     * which. Memory has no part in it: where post does not fit, the frame fails, and names what
     * would do. */
    TRIPTYCH_CLASSIFY_AUTO,
} triptych_classify;

/* How many coarse levels there are to draw the data set's pictures by, of values (post, auto) or of
 * means (pre). */
TRIPTYCH_API int triptych_count_levels(triptych *t, triptych_classify classify, unsigned *levels);

/* What of splats (pre) is composited. */
typedef enum triptych_compositing {
    TRIPTYCH_BY_SPLAT, /* each, in list order */
    TRIPTYCH_BY_SHEET, /* the sum of those of each sheet, whose order does not matter then */
} triptych_compositing;

/* How the footprint of a splat is worked out (pre). */
typedef enum triptych_footprint {
    TRIPTYCH_FOOTPRINT_EXACT, /* from the distance of every pixel's ray */
    TRIPTYCH_FOOTPRINT_EWA,   /* by the affine map at its centre, as EWA volume splatting does */
    TRIPTYCH_FOOTPRINT_FIXED, /* a circle of one size in pixels, that of one in the middle of the
                                 volume; by the reference and gl */
} triptych_footprint;

/* What keeps splats from falling between pixels (pre). */
typedef enum triptych_low_pass {
    TRIPTYCH_LOW_PASS_EWA,     /* convolution with a Gaussian */
    TRIPTYCH_LOW_PASS_UNIFORM, /* Swan's scaling; of EWA footprints, by the reference alone */
    TRIPTYCH_LOW_PASS_NONE,
} triptych_low_pass;

/* What is cut away. Of splats (pre) those are drawn whose voxels are inside: they reach over the
 * cut by their radius. Where values are interpolated (post, the integral) rays are cut. */
typedef struct triptych_clip {
    int box;                     /* not 0: what lies outside of box_lo to box_hi is cut away */
    int box_of_voxels;           /* not 0: those are indices; else world space */
    double box_lo[3], box_hi[3]; /* lo < hi; infinities are no bounds */
    int planes;                  /* 0 to 6 half-spaces besides: */
    double plane[6][4]; /* a, b, c, d: what is kept has a x + b y + c z + d >= 0, world space */
} triptych_clip;

/* What a picture is coloured by. */
typedef enum triptych_show {
    TRIPTYCH_SHOW_PICTURE, /* the function */
    TRIPTYCH_SHOW_LISTS,   /* which list: x red, y green, z blue */
    TRIPTYCH_SHOW_MERGE,   /* the weights of the lists at each pixel, alike; nothing is read */
    TRIPTYCH_SHOW_LEVELS,  /* which level: white the finest, then blue, green, yellow, orange, red
                              and, of all beyond, violet */
} triptych_show;

/* Effects besides shading. What is not among them costs nothing. */
enum {
    TRIPTYCH_SHADOWS = 1,      /* what lies towards the light attenuates it, and fog scatters it;
                                  not with the headlight */
    TRIPTYCH_OCCLUSION = 2,    /* what lies around attenuates the light from everywhere */
    TRIPTYCH_CUEING = 4,       /* what is farther fades into the background */
    TRIPTYCH_EFFECTS_AUTO = 8, /* and those that the kind of data and the function call for */
    TRIPTYCH_EMISSION = 16,    /* what is hot radiates as a black body: by triptych_set_heat() */
};

/* The h that suits the classification: 0.85 of splats, 0.99 of values. */
#define TRIPTYCH_H_AUTO (-1.0)

/* The saturation that suits the classification: 1/8192 of splats, 1/512 of values. */
#define TRIPTYCH_EARLY_TERMINATION_AUTO (-1.0)

typedef struct triptych_settings {
    triptych_classify classify;
    triptych_compositing compositing; /* pre */
    triptych_footprint footprint;     /* pre */
    triptych_low_pass low_pass;       /* pre */
    int vertex_weights; /* not 0: merge takes weights from the corners of splats, about the eye of
                           pixels (pre, by splat; by the reference alone) */
    int normalise;      /* not 0: colours are divided by the opacity that has accumulated, and what
                           is covered at all is opaque */
    double flatten; /* of EWA footprints: how many times flatter kernels are along full gradients, 1
                       (round) to 100; without count */
    int samples_per_sheet; /* of a sheet, post: 1 to 16, more come closer to the integral; 0: by the
                              view */
    triptych_method method;
    triptych_traversal traversal;
    triptych_target target;   /* of the layers; not of the reference */
    int indexed, triangles;   /* how GL is given splats: one array for all lists, quads */
    int shading;              /* from gradients */
    int headlight;            /* light from the eye; else from light[] */
    int point_light;          /* not 0: light[] is the light's place, as bright at any distance */
    double light[3];          /* world direction to the light, not zero; or its place */
    double h;                 /* where layers begin to blend, 0 to below 1, or TRIPTYCH_H_AUTO */
    double early_termination; /* transmittance below which a pixel takes nothing of what lies
                          behind, 0 (none is) to 0.1, or TRIPTYCH_EARLY_TERMINATION_AUTO: no
                          component is off by more than that. By gl with pre at most the default */
    double kernel_radius; /* of a splat, voxels, 0.1 to 100; below 1.5 warned of: a pattern shows */
    double background[4]; /* red, green, blue, alpha, 0 to 1, not multiplied by alpha */
    double lod_px; /* where voxels are at most so many pixels wide the coarsest such level is drawn,
                      0 to 1000; 0, the default: the finest alone. Of those of the classification
                      (triptych_levels_for); a warning where there are none. Not with indexed */
    double max_bytes; /* > 0: what is widest in the picture first is drawn by the finest levels with
                         which codes and normals of so many bytes at most are in view; not counted
                         are positions, some 10 to 30 % more. Not beyond what lod_px calls for */
    double max_ms; /* > 0: the same by about how long the frame takes, from how long others of the
                      context took: depends on the machine, and so does the picture then */
    int depth;     /* not 0: frames have distances too; not with rounded targets or the integral */
    /* Of the integral renderer alone, but for samples. */
    triptych_field field;   /* what it integrates */
    triptych_kernel kernel; /* of values; of post, too */
    double tolerance;       /* of a component of a pixel, 1e-12 to 0.1 */
    int samples;            /* rays along each side of a pixel, 1 to 64; without depth. Renderers
                               but the integral draw a picture so many times as wide and high */
    int count; /* not 0: triptych_list_stats has exact counts, which takes time, of occluded bricks
                  too */
    triptych_clip clip;
    triptych_show show; /* not of the integral, which has no lists or levels */
    int effects;        /* the sum of TRIPTYCH_SHADOWS, ... */
    double anisotropy;  /* of fog that scatters: -0.95 backwards to 0.95 forwards, 0 alike */
    double cueing;      /* share of the background in what is farthest, above 0 to 1 */
    double kelvin[2];   /* of emission: temperature where heat is 0 and where it is greatest, 0 or
                           more, the second above the first, up to 100000 */
    int light_cells; /* of shadows, occlusion and emission: a lattice of at most so many cells along
                        the longest side, 8 to 1024, at least a voxel each */
} triptych_settings;

/* Classification auto, by splat, exact footprints with EWA's low-pass, slices by the view, merge,
 * outward, rgba32f, h and saturation by the classification, kernel radius 2, shading by headlight,
 * black; values, linear, 1e-4, one ray a pixel; no effects, and where they are set scattering
 * alike, cueing 0.6, up to 2500 K, 128 cells. */
TRIPTYCH_API triptych_settings triptych_default_settings(void);
/* How close to the integral pictures are to be, for the time that takes; measured by `triptych
 * accuracy`, triptych-accuracy(1) has the figures. */
typedef enum triptych_quality {
    TRIPTYCH_DRAFT,
    TRIPTYCH_NORMAL, /* the default settings */
    TRIPTYCH_HIGH,
    TRIPTYCH_EXACT, /* with a saturation of 1/8192 also of values */
} triptych_quality;

/* Changes what accuracy is traded for time by: classify, compositing, footprint, low_pass, flatten,
 * vertex_weights, slices, method, h, saturation, target, kernel_radius, lod_px, max_bytes, max_ms
 * and samples; the rest stays. TRIPTYCH_USAGE: there is no such quality. */
TRIPTYCH_API int triptych_set_quality(triptych_settings *s, triptych_quality quality);
TRIPTYCH_API int triptych_set_settings(triptych *t, const triptych_settings *settings);

/* Left and right are the object's own. */
typedef enum triptych_side {
    TRIPTYCH_SIDE_DEFAULT, /* the front, a little from the left and above */
    TRIPTYCH_FRONT,
    TRIPTYCH_BACK,
    TRIPTYCH_LEFT,
    TRIPTYCH_RIGHT,
    TRIPTYCH_TOP,
    TRIPTYCH_BOTTOM,
    TRIPTYCH_ISO,
} triptych_side;

/* All zero: all that the function shows, in a picture of 1024 x 1024. */
typedef struct triptych_view {
    int width, height;                      /* px, up to 65536; default 1024 */
    const double *eye, *look, *up;          /* world space, x, y, z; NULL: found */
    triptych_side side;                     /* that is seen, without an eye */
    double azimuth_degrees;                 /* from there round the object, to the right */
    double elevation_degrees, roll_degrees; /* up; the picture clockwise */
    double zoom;                            /* as another lens would; default 1 */
    double fov_degrees;                     /* vertical; default 30; not beyond these: */
#define TRIPTYCH_FOV_MIN_DEGREES 1e-6
#define TRIPTYCH_FOV_MAX_DEGREES 179.999
    double ortho_height; /* > 0: parallel, so many world units high */
    int ortho_fit;       /* not 0: parallel, as high as needed */
    int turntable;       /* not 0: all stays in view when it is turned */
} triptych_view;

/* Works out the view; reads some of the data where it is to be fitted to what the function shows,
 * so after the function and the settings. */
TRIPTYCH_API int triptych_set_view(triptych *t, const triptych_view *view);
/* The view that triptych_set_view() made, turned about its up axis: counterclockwise seen from
 * above. */
TRIPTYCH_API int triptych_turn(triptych *t, double degrees);

typedef struct triptych_camera {
    double eye[3], look[3], up[3];
    double fov_degrees, ortho_height; /* ortho_height > 0: parallel */
    int width, height;
    uint64_t splats; /* that were looked at to find the view */
} triptych_camera;

/* The view that frames are drawn from. */
TRIPTYCH_API int triptych_get_camera(triptych *t, triptych_camera *out);

/* What is seen at a place of the picture: where half of what the ray loses is lost. */
typedef struct triptych_hit {
    double opacity; /* of the whole ray, unshaded; 0: nothing is seen, what follows is not set */
    double position[3]; /* world space */
    double index[3];    /* the same in voxels */
    double value; /* of the data where the ray meets the sheet nearest to that, interpolated */
    double depth; /* from the eye along the ray, in parallel views from the eye's plane */
    double depth_first; /* where what shows begins */
} triptych_hit;

/* Of the view, function and data set, whatever was drawn; x and y in pixels from the picture's top
 * left corner, pixel centres at + 0.5, also beyond its edges. Reads the bricks along the ray. Not
 * while a frame is begun. */
TRIPTYCH_API int triptych_probe(triptych *t, double x, double y, triptych_hit *out);

/* ---- frames ---- */

/* rgba: width * height * 4 floats. */
TRIPTYCH_API int triptych_draw(triptych *t, float *rgba);

/* What triptych_step() has come to. */
enum {
    TRIPTYCH_DONE = 0,
    TRIPTYCH_MORE = 1,  /* there is more to draw: the deadline has passed */
    TRIPTYCH_WAITS = 2, /* nothing to draw: the disk or a graphics device is at work */
};

/* The same in steps, for programs with other things to do: begin, steps until TRIPTYCH_DONE,
 * picture, end. Until the end nothing can be set. */
TRIPTYCH_API int triptych_begin(triptych *t);
/* Draws what has been read, until the deadline by CLOCK_MONOTONIC in nanoseconds; something of it
 * in any case. Never waits for the disk, and for a graphics device no longer than for a picture or
 * a piece. UINT64_MAX: no deadline. */
TRIPTYCH_API int triptych_step(triptych *t, uint64_t deadline_ns);
/* Waits until there is something to draw, or room for it, at most so long. */
TRIPTYCH_API int triptych_await(triptych *t, uint64_t timeout_ns);
/* The picture so far; after TRIPTYCH_DONE the picture. rgba as above. */
TRIPTYCH_API int triptych_picture(triptych *t, float *rgba);
/* The same of a frame with triptych_settings.depth, and as many distances, in world units: from the
 * eye (in parallel views its plane) to what is seen of the data, on average; +infinity: nothing. */
TRIPTYCH_API int triptych_picture_and_depth(triptych *t, float *rgba, float *depth);
/* Also gives up a frame that is not done. */
TRIPTYCH_API void triptych_end(triptych *t);

/* From any thread: the call under way ends within milliseconds, with TRIPTYCH_CANCELLED, and so do
 * those that follow for a frame that is begun. */
TRIPTYCH_API void triptych_cancel(triptych *t);

/* ---- what a frame takes ---- */

/* Of a frame that is begun: what it reads and why, an effect or list a line; of post at several
 * levels, the picture that is being drawn. *text is for free(). */
TRIPTYCH_API int triptych_explain(triptych *t, char **text);

/* Of the last frame whose picture was complete. Texts last until the data set is closed. */
typedef struct triptych_frame_stats {
    double ms;                              /* from its begin to its picture */
    double plan_ms;                         /* before that */
    double wait_ms, draw_ms, merge_ms;      /* waiting for the disk, drawing, merging layers (of the
                                               integral: its rays) */
    uint64_t splats, bytes_read, reads;     /* of all lists, from the disk */
    uint64_t bytes_cached;                  /* instead from memory */
    uint64_t runs_occluded, bytes_occluded; /* not read: behind what is opaque */
    uint64_t bytes_unused;                  /* not read: of attributes that have no effect */
    uint64_t memory_bytes, peak_memory_bytes; /* that may be taken, and were since it was opened */
    const char *renderer, *device, *engine;   /* "cpu", "8 threads, AVX2", "io_uring+O_DIRECT" */
    const char *ring;                         /* where reads land, in words */
    triptych_classify classify;               /* pre or post, what was drawn */
    int samples_per_sheet;                    /* of a sheet, post; else 0 */
    triptych_footprint footprint;             /* pre: what was drawn */
    double
        early_termination; /* transmittance below which pixels took no more; -1 of the integral */
    int effects;           /* that ran; of shadows and occlusion: */
    uint64_t light_bytes_read; /* not in bytes_read; 0 where it was kept */
    uint64_t light_memory_bytes;
    double light_gather_ms, light_sweep_ms; /* in ms: reading and gathering; working out */
    uint64_t heat_bytes_read;               /* of emission, likewise */
    uint64_t heat_memory_bytes;
    double heat_ms;
    int closed_form; /* post: the function is linear in the value, or nearly, and was not looked up
                      */
} triptych_frame_stats;

TRIPTYCH_API int triptych_get_frame_stats(triptych *t, triptych_frame_stats *out);

typedef struct triptych_list_stats {
    uint64_t bricks, bricks_selected;
    uint64_t bricks_transparent, bricks_outside, bricks_without_weight; /* why left out */
    uint64_t splats_read, bytes_read;
    int counted; /* by triptych_settings.count; else what follows is 0 */
    uint64_t splats_projected, splats_drawn; /* not culled; of those, with a pixel centre in them */
    uint64_t bricks_clipped, bricks_of_other_levels; /* left out, too */
} triptych_list_stats;

/* The same frame's, by list. */
TRIPTYCH_API int triptych_get_list_stats(triptych *t, unsigned number, triptych_list_stats *out);

/* ---- pictures ---- */

/* Memory for a picture, zeroed, out of triptych_resources.memory_bytes: 4 channels, or 1 for
 * distances. triptych_close() releases what is left of it. */
TRIPTYCH_API int triptych_new_picture(triptych *t, int width, int height, int channels,
                                      float **pixels);
TRIPTYCH_API void triptych_release_picture(triptych *t, float *pixels);

/* Writes a picture: .png, .jpg, .tif or, in linear light, .exr. */
TRIPTYCH_API int triptych_write(triptych *t, const char *path, int width, int height,
                                const float *rgba);
/* Writes distances, width * height of them: .exr, as channel Z, or .tif. */
TRIPTYCH_API int triptych_write_depth(triptych *t, const char *path, int width, int height,
                                      const float *depth);
/* May come before: refuses names that these refuse, and starts what they write by, which is then
 * ready when the first picture is. depth_path may be NULL. */
TRIPTYCH_API int triptych_prepare_write(triptych *t, const char *path, const char *depth_path);

#ifdef __cplusplus
}
#endif

#endif
