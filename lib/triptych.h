/* The public interface of libtriptych, which draws volumes that do not fit in memory. A context
 * holds one opened data set (NAME.trip) and draws frames of it. The program `triptych brick` makes
 * data sets, and so does triptych_brick() (triptych_brick.h).
 *
 *     triptych *t;
 *     if (triptych_create(&t) == 0 && triptych_open(t, "head.trip", NULL) == 0) {
 *         triptych_set_view(t, &(triptych_view){ .width = 800, .height = 600 });
 *         triptych_draw(t, rgba);
 *     }
 *
 * Threads: one thread at a time may use a context. Only triptych_cancel() may be called from other
 * threads. Contexts share nothing, so different threads may use different contexts.
 *
 * Errors: unless a comment says otherwise, functions that return int return 0 or a negative
 * triptych_status. triptych_error() then gives the reason. Possible failures are TRIPTYCH_USAGE
 * (invalid arguments, or a call in the wrong order) and TRIPTYCH_ERROR (files, memory, devices).
 *
 * Parameters: structs, in which 0 or NULL selects the default of every field. TRIPTYCH_ZERO selects
 * the number 0 where 0 selects another default. The library does not use pointers in these structs
 * after a call returns. Structs grow at their end. triptych_create() tells the library which
 * version of the structs the caller has.
 *
 * Messages name a setting as the program's option does: settings.splat->kernel_radius is
 * --kernel-radius.
 *
 * Coordinates: world space has the length units of the volume's file (millimetres, metres, ...).
 * For a patient, x points to the right, y to anterior and z to superior (RAS), in every format.
 * Index space has voxel (i, j, k) at (i, j, k).
 *
 * Pictures: `height` rows of `width` pixels, the top row first. A pixel is four floats: red, green,
 * blue and alpha. Colours are sRGB display values from 0 to 1, multiplied by alpha. Equal data,
 * views, transfer functions and settings give equal pictures, bit for bit. A picture does not
 * depend on memory, threads or the way a frame is drawn. */
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

/* Version of the structs below. */
#define TRIPTYCH_HEADER_VERSION 1u

/* The number 0, for fields in which 0 selects another default. */
#define TRIPTYCH_ZERO (-1.0)

typedef enum triptych_status {
    TRIPTYCH_OK = 0,
    TRIPTYCH_ERROR = -1,
    TRIPTYCH_USAGE = -2,     /* invalid arguments or a call in the wrong order */
    TRIPTYCH_CANCELLED = -3, /* triptych_cancel() stopped the call */
    TRIPTYCH_LEFT_OUT = -4,  /* the data set lacks values; triptych_transfer_function.all_values */
} triptych_status;

typedef struct triptych triptych;

/* ---- contexts ---- */

/* Creates a context without a data set, for a caller with this version of the structs. Returns
 * TRIPTYCH_ERROR if memory is exhausted, and TRIPTYCH_USAGE for an unknown version; *out is then
 * NULL. Free the context with triptych_destroy(). */
TRIPTYCH_API int triptych_create_version(triptych **out, unsigned header_version);
/* Creates a context for the structs of this header. */
static inline int triptych_create(triptych **out)
{
    return triptych_create_version(out, TRIPTYCH_HEADER_VERSION);
}
/* Ends the frame, closes the data set and frees the context. Does nothing if `t` is NULL. */
TRIPTYCH_API void triptych_destroy(triptych *t);
/* Returns the reason why the last call failed, or "" if it succeeded. The reason is one line
 * without a line feed, such as "triptych: read: head.trip: ...". It is valid until the next call
 * with this context. */
TRIPTYCH_API const char *triptych_error(const triptych *t);
/* Receives a message for people, one line. */
typedef void (*triptych_message_callback)(void *user, const char *line);
/* Receives progress: `done` of `total` units of a stage. */
typedef void (*triptych_progress_callback)(void *user, const char *stage, uint64_t done,
                                           uint64_t total);

/* Sets the function that receives warnings, notes and failures. NULL, the default, discards
 * messages. The library may call `take` from other threads, but only during a call with this
 * context. */
TRIPTYCH_API void triptych_set_messages(triptych *t, triptych_message_callback take, void *user);
/* Sets the function that receives progress during long work. The library calls `show` on the
 * calling thread. NULL, the default, reports no progress. Drawing has
 * these stages; triptych_brick.h lists the stages of bricking.
 * - "draw": voxels, in post
 * - "splat": splats, in pre; Gaussians, in scenes
 * - "count": splats, with triptych_settings.count_exactly
 * - "integrate": pixels, with the integral renderer */
TRIPTYCH_API void triptych_set_progress(triptych *t, triptych_progress_callback show, void *user);
/* Returns the version, such as "0.1.0". */
TRIPTYCH_API const char *triptych_version(void);

/* ---- data ---- */

typedef enum triptych_renderer {
    TRIPTYCH_RENDERER_AUTO, /* GL if the machine has graphics hardware, otherwise CPU */
    TRIPTYCH_RENDERER_GL,   /* OpenGL 4.5 without a window */
    TRIPTYCH_RENDERER_CPU,
    TRIPTYCH_RENDERER_REFERENCE, /* double precision, slow */
    /* The integral along each ray in double precision, which all other renderers approximate.
     * Slowest. The whole volume must fit in memory, at 16 bytes per voxel. In a Gaussian scene, the
     * Gaussians in view must fit, at 352 bytes each. */
    TRIPTYCH_RENDERER_INTEGRAL,
} triptych_renderer;

typedef enum triptych_engine {
    TRIPTYCH_ENGINE_AUTO, /* io_uring if the kernel allows it, otherwise pread */
    TRIPTYCH_ENGINE_URING,
    TRIPTYCH_ENGINE_PREAD,
    TRIPTYCH_ENGINE_NULL, /* reads everything into memory first */
} triptych_engine;

typedef struct triptych_resources {
    uint64_t memory_bytes; /* limit for all data; default: a quarter of the memory available */
    unsigned threads;      /* for drawing and reading, up to 256; default: one per processor */
    triptych_renderer renderer;
    triptych_engine engine;
    /* If not 0, a cache keeps the bytes read for later frames. The cache takes up to half of the
     * memory left. */
    int keep_pages;
    /* If not 0, bricks behind opaque matter are read too. The picture does not change. */
    int read_occluded;
    const char *name; /* names the data in messages; default: the path of the data set */
    /* An existing folder that keeps the choices of triptych_quality for later contexts, in small
     * files NAME.quality. Default: they are kept in the context only. */
    const char *choices_folder;
    /* If not 0, triptych_begin() makes no trial. A frame without a known choice has the defaults of
     * its quality, and triptych_choose() makes the choice. */
    int choose_later;
} triptych_resources;

/* Closes the open data set, if any, and opens the data set at `path`. NULL for `resources` selects
 * the defaults. Fails with TRIPTYCH_USAGE if `resources` is invalid or while a frame is begun. If
 * opening fails, no data set is open.
 */
TRIPTYCH_API int triptych_open(triptych *t, const char *path, const triptych_resources *resources);
/* Opens another data set and draws it together with the open data set, sheet by sheet in one order.
 * The new data set must be another region of the same volume with the same codes
 * (triptych_brick_options.region_first). Effects of the call:
 * - All data sets are drawn at their finest level.
 * - The transfer function and the view are reset. The default transfer function is the one of the
 *   first data set.
 * - A voxel in several data sets counts once in post, and once for each of them in pre.
 * If it fails, the data sets that were open stay open. */
TRIPTYCH_API int triptych_add(triptych *t, const char *path);
/* Opens a data set of heat for TRIPTYCH_EFFECT_EMISSION, on any grid. It replaces an earlier one
 * and stays open until triptych_close() or triptych_open(). NULL for `path` closes the data set of
 * heat. */
TRIPTYCH_API int triptych_set_heat(triptych *t, const char *path);
/* Ends the frame and closes the data set, the data set of heat and all pictures of
 * triptych_new_picture(). The settings stay. Does nothing if no data set is open. */
TRIPTYCH_API void triptych_close(triptych *t);

typedef struct triptych_info {
    /* Voxels of the volume along i, j, k. */
    int64_t dims[3];
    /* Maps index space to world space: world = matrix * (i, j, k, 1). With uneven spacing it maps
     * positions (spacing_min) instead of indices. */
    double index_to_world[3][4];
    /* Minimum and maximum distance of neighbouring voxels along i, j, k, in world units. They
     * differ if the spacing is uneven. index_to_world then maps positions to world space. A
     * position is an index scaled unevenly, and equals the index on average. */
    double spacing_min[3], spacing_max[3];
    int64_t first[3], last[3]; /* first and last kept voxel along i, j, k */
    double lo[3], hi[3];       /* bounding box of the kept voxels in world space, edge to edge */
    /* Lower and upper edges along i, j, k of the kept voxels and of the grid, for index_to_world.
     */
    double edges[2][3], grid_edges[2][3];
    double value_min, value_max; /* minimum and maximum of the volume */
    /* Range of the values without the few that stand far outside. Functions that are made for the
     * data cover it. */
    double typical_min, typical_max;
    double code_lo, code_hi; /* values of codes 0 and 65535 (FORMAT.md) */
    /* "even": code_step_min apart. "knots": at least code_step_min and at most code_step_max apart.
     * "ids": a code for each of `ids` values. */
    const char *codes;
    double code_step_min, code_step_max;
    unsigned ids;
    uint64_t voxels; /* of the volume */
    uint64_t kept;   /* kept voxels, which are visible with a transfer function given to `brick` */
    uint64_t halo;   /* transparent neighbours of kept voxels, stored for interpolation */
    uint64_t bytes, index_bytes; /* size on disk of the whole data set and of its index */
    /* Checksum of the index, which contains the checksums of all other bytes. Equal data sets have
     * equal checksums. */
    uint64_t checksum;
    /* normal_bytes is 0 if the data set stores no normals; drawing then computes them. */
    unsigned format_version, lists, code_bytes, normal_bytes;
    /* gradient_step is the unit of 3-byte normals. Shading is full from gradients of gradient_full
     * on. */
    double gradient_step[3], gradient_full;
    unsigned tile_voxels, slab_sheets, page_bytes;
    /* Text from the maker of the data set; `brick` writes JSON. Valid until the data set is closed.
     */
    const char *notes;
} triptych_info;

/* Describes the open data set; of several, their union. Fails with TRIPTYCH_USAGE if none is open.
 */
TRIPTYCH_API int triptych_get_info(triptych *t, triptych_info *out);

/* An open data set of a Gaussian scene. Lengths are in units of the scene. */
typedef struct triptych_scene {
    uint64_t gaussians, bricks; /* bricks of the three lists, all levels */
    uint64_t coarse;            /* Gaussians of coarse levels, not in `gaussians` */
    uint64_t bytes;             /* of all files */
    int degree;                 /* of the spherical harmonics, 0 to 3 */
    int antialiased;            /* trained with opacities that make up for the blur of pixels */
    int flat;                   /* surfels: each has no thickness along one axis */
    int y_down;                 /* the scene's y axis points down */
    int z_up;                   /* the scene's z axis points up */
    double lo[3], hi[3];        /* bounds of all centres */
    /* Bounds of the centres without the outer 1 % on each side; if these are a point, bounds of the
     * Gaussians. Views fit these. */
    double typical_lo[3], typical_hi[3];
    const char *notes;         /* JSON; belongs to the data set; NULL if only volumes are placed */
    unsigned objects, volumes; /* in the picture; volumes are counted in `objects` too */
    int clouds;                /* all objects are clouds of points, which have light */
    int moved;                 /* several objects, or one with a place of its own */
    int lit;                   /* clouds that the default light shades */
} triptych_scene;

/* Returns 1 if the open data set is a Gaussian scene, or if objects with places are open. These
 * functions do not apply to scenes, and fail with TRIPTYCH_USAGE: triptych_get_info(),
 * triptych_get_list(), triptych_add(), and those about values, heat and probes. */
TRIPTYCH_API int triptych_is_scene(const triptych *t);
/* Describes the open scene. Fails with TRIPTYCH_USAGE if a volume or nothing is open. For several
 * objects in one picture, it sums the counts of the scenes, joins the bounds of all objects, and
 * gives the first scene's notes. */
TRIPTYCH_API int triptych_get_scene(triptych *t, triptych_scene *out);

/* ---- several data sets in one picture ---- */

enum { TRIPTYCH_OBJECTS_MAX = 16384 };

/* A data set and its place in the picture. */
typedef struct triptych_object {
    const char *path;     /* of the data set */
    const char *name;     /* in messages; NULL: the path */
    double matrix[3][4];  /* maps the data set's space into the common space */
    const char *function; /* file or preset of a volume; NULL: the function of the picture */
} triptych_object;

/* The matrix of an object that stays where it is. */
#define TRIPTYCH_UNPLACED                                                                          \
    {                                                                                              \
        { 1, 0, 0, 0 }, { 0, 1, 0, 0 },                                                            \
        {                                                                                          \
            0, 0, 1, 0                                                                             \
        }                                                                                          \
    }

/* Opens Gaussian scenes and at most 16 volumes for one picture, instead of triptych_open(). A
 * matrix may move, turn and scale evenly. One path may occur several times, and is opened once. */
TRIPTYCH_API int triptych_open_objects(triptych *t, const triptych_object *objects, unsigned count,
                                       const triptych_resources *resources);
/* Returns the number of scenes of the open picture: 0 if a volume or nothing is open. Sets *drawn
 * to the Gaussians of each that the last frame drew; they last until the next frame. */
TRIPTYCH_API unsigned triptych_get_objects(const triptych *t, const uint64_t **drawn);

/* Returns 1 if the path names a scene file: a JSON file that places data sets, and lists no range
 * images. */
TRIPTYCH_API int triptych_is_scene_file(const char *path);
/* Reads a scene file. The path of an object is a named file, which may still need bricking. The
 * `name` of an object is NULL. triptych_free_objects() frees the objects. */
TRIPTYCH_API int triptych_read_scene_file(triptych *t, const char *path, triptych_object **objects,
                                          unsigned *count);
TRIPTYCH_API void triptych_free_objects(triptych_object *objects, unsigned count);

/* A list: records of one kind along one axis at one level of detail. */
typedef struct triptych_list {
    const char *path; /* of the data set that has the list; valid until it is closed */
    int axis;         /* 0 to 2 for X, Y, Z */
    unsigned level;   /* 0 is the finest */
    const char *kind; /* "voxels", "halo", "means" or "values" */
    int drawn;        /* 1 if its records are drawn as splats, 0 if they only serve interpolation */
    int64_t dims[3];  /* of the grid of its level */
    double index_to_world[3][4];
    /* Sheet s lies at sheet_first + sheet_step * s, in voxels of level 0 along the axis. */
    double sheet_first, sheet_step;
    uint64_t records, slabs, bricks, bytes;
    uint64_t deviation_bytes; /* of `bytes`; 0 if the list has no deviations */
} triptych_list;

/* Describes a list. `number` is from 0 to triptych_info.lists - 1, otherwise TRIPTYCH_USAGE. */
TRIPTYCH_API int triptych_get_list(triptych *t, unsigned number, triptych_list *out);
/* Reads the whole data set and checks it against its checksums and its index. Returns
 * TRIPTYCH_ERROR if anything is damaged. */
TRIPTYCH_API int triptych_verify(triptych *t);

enum { TRIPTYCH_HISTOGRAM_BINS = 1024 };

typedef struct triptych_histogram {
    /* Bins divide the typical range from lo to hi equally. */
    double lo, hi;
    uint64_t counts[TRIPTYCH_HISTOGRAM_BINS]; /* finite values in the range, kept or not */
    uint64_t total;
} triptych_histogram;

/* Returns the histogram that the data set stores. Reads no voxels. `total` is 0 if the data set
 * stores none. */
TRIPTYCH_API int triptych_get_histogram(triptych *t, triptych_histogram *out);

/* ---- appearance ---- */

typedef struct triptych_transfer_function {
    /* Name of a preset or path of a file, as for --tf. The default is the transfer function stored
     * in the data set. */
    const char *name;
    double opacity_scale; /* factor on extinction, up to 1e6; default 1 */
    /* If window > 0, the function is stretched over level - window / 2 to level + window / 2, in
     * data units. */
    double window, level;
    const char *text; /* the function as the text of a `.tf` file; excludes `name` */
    /* If not 0, the call fails with TRIPTYCH_LEFT_OUT for a function that shows values that
     * bricking dropped, and the transfer function stays. If 0, a warning names the values. */
    int all_values;
} triptych_transfer_function;

/* Sets the transfer function for later frames. NULL selects the default. Fails with TRIPTYCH_USAGE
 * if a number is out of range or while a frame is begun, with TRIPTYCH_ERROR if the function cannot
 * be read. */
TRIPTYCH_API int triptych_set_transfer_function(triptych *t,
                                                const triptych_transfer_function *function);

typedef struct triptych_preset {
    /* `values` says which units the values of the function have: data units, relative to the range,
     * ... */
    const char *name, *values, *summary;
} triptych_preset;

/* Describes the built-in transfer function `number`, counted from 0. Returns 1, or 0 if there is no
 * such function. */
TRIPTYCH_API int triptych_get_preset(unsigned number, triptych_preset *out);

typedef enum triptych_form {
    TRIPTYCH_FORM_TF,       /* Triptych's own text format */
    TRIPTYCH_FORM_PARAVIEW, /* ParaView, JSON */
    TRIPTYCH_FORM_VP,       /* 3D Slicer, text */
    TRIPTYCH_FORM_VP_JSON,
    TRIPTYCH_FORM_SLICER, /* 3D Slicer, presets in XML */
    TRIPTYCH_FORM_VTK,    /* VTK, XML */
} triptych_form;

typedef struct triptych_conversion {
    const char *function; /* preset or file; default: the transfer function of the data */
    const char *volume;   /* file of the volume; default: the open data set, or no data */
    /* If no data is given and lo < hi, functions relative to the range of the data span lo to hi.
     */
    double lo, hi;
    triptych_form form;
    /* Name of the result, in its text and in messages. The default is the function's name, then the
     * volume's, then the data set's. */
    const char *name;
} triptych_conversion;

/* Converts a transfer function to data units, as text that other programs read. Free *text with
 * free(). *text is NULL after a failure. */
TRIPTYCH_API int triptych_convert(triptych *t, const triptych_conversion *wanted, char **text);

/* A promise of the mean error of post, over the pixels that the object covers. The truth is the
 * integral's mean over the area of each pixel. The library chooses the samples per sheet, the rays
 * per pixel and the levels of detail that are not given. A trial on small pictures finds the
 * cheapest numbers that keep the promise. The numbers depend on the data, the transfer function,
 * the settings and the width of a voxel in pixels, in steps of half an octave. They do not depend
 * on time, threads or memory. If voxels are at least a pixel wide, and one ray per pixel at the
 * finest level keeps the promise of normal, no other numbers are chosen. */
typedef enum triptych_quality {
    TRIPTYCH_QUALITY_DEFAULT, /* normal */
    TRIPTYCH_QUALITY_DRAFT,   /* post, 4 of 255 */
    TRIPTYCH_QUALITY_NORMAL,  /* 1 of 255 */
    TRIPTYCH_QUALITY_HIGH,    /* post, 0.3 of 255 */
    /* Post at the finest level, without a trial. It has 16 samples per sheet, and 4 to 16 rays
     * along each side of a pixel: 8 for each voxel. Early termination is at 1/8192. */
    TRIPTYCH_QUALITY_EXACT,
} triptych_quality;

/* The order of classification and interpolation. */
typedef enum triptych_classify {
    /* Post, unless a setting of triptych_splat_settings is given, the traversal is ascending, the
     * method is image, splats are counted, or the data cannot be interpolated:
     * - a grid one voxel thick
     * - a data set without a halo from which bricking dropped voxels
     * triptych_explain() gives the reason. Memory has no influence: if post does not fit, the frame
     * fails, and the error names a remedy. */
    TRIPTYCH_CLASSIFY_AUTO,
    TRIPTYCH_CLASSIFY_PRE,  /* voxels are classified, then drawn as splats */
    TRIPTYCH_CLASSIFY_POST, /* values are interpolated in sheets, then classified at each pixel */
} triptych_classify;

/* Sets *levels to the number of coarse levels for a classification: levels of values for post and
 * auto, levels of means for pre. */
TRIPTYCH_API int triptych_count_levels(triptych *t, triptych_classify classify, unsigned *levels);

typedef enum triptych_method {
    TRIPTYCH_METHOD_DEFAULT, /* merge */
    TRIPTYCH_METHOD_MERGE,   /* blends the layers of up to three lists */
    TRIPTYCH_METHOD_CLIP,    /* draws each pixel from one list */
    TRIPTYCH_METHOD_AXIS,    /* draws the whole picture from one list */
    /* Cuts splats into sheets parallel to the image plane (Mueller & Crawfis 1998). Needs pre and
     * the reference renderer. */
    TRIPTYCH_METHOD_IMAGE,
} triptych_method;

typedef enum triptych_traversal {
    TRIPTYCH_TRAVERSAL_DEFAULT,   /* outward */
    TRIPTYCH_TRAVERSAL_OUTWARD,   /* from the eye outward, front to back */
    TRIPTYCH_TRAVERSAL_ASCENDING, /* in file order; pre only */
} triptych_traversal;

/* Interpolation of values, in post and the integral. */
typedef enum triptych_interpolation {
    /* Nearest if the data set holds labels of more than two values, otherwise linear. Between two
     * values lies only the surface of a solid. */
    TRIPTYCH_INTERPOLATION_DEFAULT,
    TRIPTYCH_INTERPOLATION_LINEAR, /* between the 8 nearest voxels */
    TRIPTYCH_INTERPOLATION_CUBIC,  /* Catmull-Rom, between 64 voxels */
    /* The profile of a splat over 64 voxels, which smooths. Not for the integral. */
    TRIPTYCH_INTERPOLATION_GAUSSIAN,
    /* The value of the nearest voxel, for labels: no point has a value that no voxel has. Rays are
     * followed from voxel to voxel, whatever the quality and the samples per sheet. */
    TRIPTYCH_INTERPOLATION_NEAREST,
} triptych_interpolation;

/* The colours of a picture. */
typedef enum triptych_show {
    TRIPTYCH_SHOW_DEFAULT, /* picture */
    TRIPTYCH_SHOW_PICTURE, /* by the transfer function */
    TRIPTYCH_SHOW_LISTS,   /* by list: x red, y green, z blue */
    TRIPTYCH_SHOW_MERGE,   /* weights of the lists at each pixel; reads no data */
    /* By level of detail. From the finest level on: white, blue, green, yellow, orange, red, then
     * violet for all others. */
    TRIPTYCH_SHOW_LEVELS,
} triptych_show;

/* The unit of compositing for splats. */
typedef enum triptych_compositing {
    TRIPTYCH_COMPOSITING_DEFAULT, /* splat */
    TRIPTYCH_COMPOSITING_SPLAT,   /* each splat, in list order */
    /* The sum of the splats of a sheet. Their order within the sheet then does not matter. */
    TRIPTYCH_COMPOSITING_SHEET,
} triptych_compositing;

/* How the footprint of a splat is computed. */
typedef enum triptych_footprint {
    TRIPTYCH_FOOTPRINT_DEFAULT, /* exact */
    TRIPTYCH_FOOTPRINT_EXACT,   /* from the distance of each pixel's ray */
    /* By the affine approximation at the centre (EWA, Zwicker et al. 2001). */
    TRIPTYCH_FOOTPRINT_EWA,
    /* A circle of one size in pixels, computed for a splat in the middle of the volume. Reference
     * and GL renderers only. */
    TRIPTYCH_FOOTPRINT_FIXED,
} triptych_footprint;

/* The low-pass filter that keeps splats from falling between pixels. */
typedef enum triptych_low_pass {
    TRIPTYCH_LOW_PASS_DEFAULT, /* EWA */
    TRIPTYCH_LOW_PASS_EWA,     /* convolution with a Gaussian */
    /* Swan's scaling. Needs EWA footprints and the reference renderer. */
    TRIPTYCH_LOW_PASS_UNIFORM,
    TRIPTYCH_LOW_PASS_NONE,
} triptych_low_pass;

/* The weights of the lists, in merge. */
typedef enum triptych_weights {
    TRIPTYCH_WEIGHTS_DEFAULT, /* of pixels */
    TRIPTYCH_WEIGHTS_PIXEL,   /* of the ray of each pixel */
    /* Interpolated between the corners of each splat; near splats use the weights of pixels. Needs
     * compositing by splat and the reference renderer. */
    TRIPTYCH_WEIGHTS_VERTEX,
} triptych_weights;

/* The pixel format of layers. The reference renderer ignores it. */
typedef enum triptych_target {
    TRIPTYCH_TARGET_DEFAULT, /* rgba32f */
    TRIPTYCH_TARGET_RGBA32F,
    TRIPTYCH_TARGET_RGBA16F,
    TRIPTYCH_TARGET_RGBA8,
} triptych_target;

/* The vertices that the GL renderer draws. */
typedef enum triptych_submit_lists {
    TRIPTYCH_SUBMIT_DEFAULT,    /* replicated */
    TRIPTYCH_SUBMIT_REPLICATED, /* the lists are sent in every frame */
    /* Both stay in GPU memory, and have neither coarse levels nor clipping. */
    TRIPTYCH_SUBMIT_INDEXED,  /* one vertex array with an index for each list */
    TRIPTYCH_SUBMIT_RESIDENT, /* a vertex array for each list */
} triptych_submit_lists;

/* The primitives that the GL renderer draws. */
typedef enum triptych_submit_primitives {
    TRIPTYCH_SUBMIT_PRIMITIVES_DEFAULT, /* sprites */
    TRIPTYCH_SUBMIT_SPRITES,
    TRIPTYCH_SUBMIT_TRIANGLES,
} triptych_submit_primitives;

/* Settings of splats (pre). */
typedef struct triptych_splat_settings {
    triptych_compositing compositing;
    triptych_footprint footprint;
    triptych_low_pass low_pass;
    /* Standard deviation of the low-pass filter in pixels, 0 (TRIPTYCH_ZERO, no filter) to 16; the
     * default is 0.4. Zwicker et al. use 1. Not with TRIPTYCH_LOW_PASS_NONE. */
    double low_pass_px;
    triptych_weights weights;
    /* EWA footprints: factor by which kernels are flattened along gradients of full shading, 1
     * (round, the default) to 100. Not with count_exactly. */
    double flatten;
    /* Radius of a splat in voxels, 0.1 to 100; default 2. Below 1.5 a warning says that a pattern
     * of voxels is visible. */
    double kernel_radius;
    triptych_target target;
    triptych_submit_lists lists;
    triptych_submit_primitives primitives;
} triptych_splat_settings;

/* Settings of sheets of interpolated values (post). */
typedef struct triptych_sheet_settings {
    /* Samples per sheet, 1 to 16. More samples come closer to the integral. By default (0 or -1)
     * they are chosen by the quality. Without a trial, the view selects 2 to 6. */
    int samples;
} triptych_sheet_settings;

/* The field that the integral renderer integrates. */
typedef enum triptych_field {
    TRIPTYCH_FIELD_DEFAULT, /* values */
    TRIPTYCH_FIELD_VALUES,  /* values interpolated between voxels, then classified */
    TRIPTYCH_FIELD_SPLATS,  /* the sum of the splats */
} triptych_field;

/* Settings of the integral renderer. */
typedef struct triptych_integral_settings {
    triptych_field field;
    /* Bound of the error of each component of a pixel, 1e-12 to 0.1. The default is 1e-3 for the
     * mean over the area of each pixel, 1e-4 for a number of rays per pixel, and 5e-5 for a
     * Gaussian scene. */
    double tolerance;
} triptych_integral_settings;

/* Levels of detail. The data set needs coarse levels for the classification
 * (triptych_levels_for); without them a warning says so. 0 sets no bound. */
typedef struct triptych_lod_settings {
    /* Each part of the picture is drawn at the coarsest level with voxels at most this many pixels
     * wide, up to 1000. TRIPTYCH_ZERO draws the finest level only. By default (0 or -2), post
     * chooses by the quality, and pre draws the finest level. For Gaussian scenes the default is
     * 1. */
    double voxel_px;
    /* Bounds the bytes of codes and normals in view. The parts that are widest in the picture get
     * the finest levels first. Positions are not counted; they add 10 to 30 %. Never finer than
     * voxel_px asks for. */
    double max_bytes;
    /* Bounds the time of a frame in ms in the same way as max_bytes, by the speed of earlier frames
     * of this context. The picture then depends on the machine. */
    double max_ms;
} triptych_lod_settings;

typedef enum triptych_light_kind {
    /* Head. With shadows the light comes from the upper left front of the view instead, and a note
     * says so. */
    TRIPTYCH_LIGHT_DEFAULT,
    TRIPTYCH_LIGHT_HEAD,      /* at the eye */
    TRIPTYCH_LIGHT_DIRECTION, /* from the direction `toward` of world space */
    TRIPTYCH_LIGHT_POINT,     /* at the position `toward`; equally bright at any distance */
    /* From the direction `toward` of the view: left, up, front. { 1, 1, 1 } shines from the upper
     * left front. The light turns with the camera, so shadows are swept anew in each new view. */
    TRIPTYCH_LIGHT_VIEW,
} triptych_light_kind;

typedef struct triptych_light {
    int no_shading; /* if not 0, gradients do not shade the colours; effects still use the light */
    triptych_light_kind kind;
    /* Direction to the light, not zero, or its position. In world space, except for
     * TRIPTYCH_LIGHT_VIEW. */
    double toward[3];
} triptych_light;

/* Effects beyond shading. An effect that is off costs nothing. */
enum {
    /* Matter between a point and the light attenuates the light, and fog scatters it. Not with
     * TRIPTYCH_LIGHT_HEAD. */
    TRIPTYCH_EFFECT_SHADOWS = 1,
    /* Matter around a point attenuates the light from everywhere. Also for clouds of points. */
    TRIPTYCH_EFFECT_OCCLUSION = 2,
    TRIPTYCH_EFFECT_CUEING = 4,    /* distant matter fades into the background */
    /* Adds the effects that suit the kind of data and the transfer function. */
    TRIPTYCH_EFFECT_AUTO = 8,
    /* Hot matter radiates as a black body; needs triptych_set_heat(). */
    TRIPTYCH_EFFECT_EMISSION = 16,
    /* Eye-dome lighting: pixels that lie behind their neighbours become darker. For Gaussian scenes
     * and clouds of points. Scenes have no other effect. Not with the integral renderer. */
    TRIPTYCH_EFFECT_EDL = 32,
};

typedef struct triptych_effects {
    int which; /* sum of TRIPTYCH_EFFECT_SHADOWS, ... */
    /* Scattering in fog: -0.95 (backwards) to 0.95 (forwards); 0 is the same in all directions. */
    double anisotropy;
    /* Share of the background in the farthest colours, above 0 and up to 1; default 0.6. */
    double cueing;
    /* Emission: temperatures in kelvin where the heat is 0 and where it is greatest, ascending, up
     * to 100000. The default of both is 0 and 2500. */
    double kelvin[2];
    /* Shadows, occlusion and emission: cells of the lattice along its longest side, 8 to 1024;
     * default 128. A cell is at least one voxel long. Clouds of points have half as many. */
    int light_cells;
    /* Eye-dome lighting: its strength, above 0 to 100, default 0.4, and the distance of the
     * neighbours in pixels, 1 to 64, default 1.4. */
    double edl_strength, edl_radius_px;
} triptych_effects;

/* Clipping. Post and the integral cut rays exactly. Pre drops whole splats by the position of their
 * voxel, so remaining splats reach over the cut by their radius. */
typedef struct triptych_clip {
    int box;                     /* if not 0, keeps only box_lo to box_hi */
    int box_of_voxels;           /* if not 0, the box is in index space, otherwise in world space */
    double box_lo[3], box_hi[3]; /* lo < hi; infinities set no bound */
    int planes;                  /* number of half-spaces in plane[], 0 to 6 */
    /* Plane (a, b, c, d) keeps the points of world space with a x + b y + c z + d >= 0. */
    double plane[6][4];
} triptych_clip;

/* The order in which the Gaussians of a scene are drawn. */
typedef enum triptych_order {
    /* Deferred for clouds of points by the CPU or the reference renderer, unless settings for
     * blending are given: an opacity factor, a footprint, or early termination. Otherwise depth. */
    TRIPTYCH_ORDER_DEFAULT,
    TRIPTYCH_ORDER_DEPTH, /* by the depth of their centres, as scenes are trained */
    /* By their coordinates along X, Y and Z. The layers of the three lists are blended. Fewer
     * Gaussians change places when the view turns. */
    TRIPTYCH_ORDER_LISTS,
    /* In slabs of space, perpendicular to X, Y and Z. A Gaussian shares out its optical depth over
     * the sheets that it reaches. The order inside a sheet does not matter. The picture comes close
     * to the integral of overlapping Gaussians. Not with GL. */
    TRIPTYCH_ORDER_SHEETS,
    /* Draws only the nearest surfels of a cloud, and blends them at each pixel. For clouds of
     * points alone. Not with GL. An opacity factor below 1 makes the whole cloud translucent. */
    TRIPTYCH_ORDER_DEFERRED,
} triptych_order;

/* The sides of surfels that are drawn. */
typedef enum triptych_sides {
    TRIPTYCH_SIDES_DEFAULT, /* both */
    TRIPTYCH_SIDES_BOTH,
    /* The front sides alone, from which normals point away. A coarse surfel that stands for several
     * sides has no front side, and is drawn. For the deferred order. */
    TRIPTYCH_SIDES_FRONT,
} triptych_sides;

/* The highest degree of the spherical harmonics of a scene that are read and drawn. */
typedef enum triptych_harmonics {
    TRIPTYCH_HARMONICS_DEFAULT, /* all that the scene has */
    TRIPTYCH_HARMONICS_0,
    TRIPTYCH_HARMONICS_1,
    TRIPTYCH_HARMONICS_2,
    TRIPTYCH_HARMONICS_3,
} triptych_harmonics;

/* Settings of Gaussian scenes. */
typedef struct triptych_scene_settings {
    triptych_order order;
    triptych_harmonics harmonics;
    /* Thickness of a sheet in units of the scene; for the order by sheets. The default is a 1024th
     * of the scene's radius, half the diagonal of its typical bounds. */
    double sheet;
    triptych_sides sides; /* of clouds of points */
} triptych_scene_settings;

/* The settings of a picture. NULL selects the defaults of a group. */
typedef struct triptych_settings {
    triptych_quality quality;
    triptych_classify classify;
    triptych_method method;
    triptych_traversal traversal;
    triptych_interpolation interpolation;
    triptych_show show; /* not with the integral, which has no lists and no levels */
    /* Merge: weight at which layers begin to blend, 0 (TRIPTYCH_ZERO) to below 1. The default is
     * 0.85 for pre and 0.99 for post. A scene drawn by depth has one layer, and refuses h and
     * `method`. */
    double h;
    /* Transmittance below which a pixel takes no more samples or splats: 0 (TRIPTYCH_ZERO, never)
     * to 0.1. No component of a pixel changes by more than this number. The default is 1/8192 for
     * pre and 1/512 for post. GL uses at most the default in pre. */
    double early_termination;
    /* Rays along each side of a pixel, 1 to 64. By default (0 or -1), the integral takes the mean
     * over the area of each pixel, and post chooses by the quality. Pre takes 1. Renderers draw a
     * picture this many times wider and higher, and average it. Above 1 not with depth. */
    int samples;
    /* If not 0, colours are divided by the accumulated opacity, and every covered pixel becomes
     * opaque. */
    int normalise;
    /* If not 0, frames have distances too. Needs the target rgba32f; not with the integral. */
    int depth;
    /* If not 0, triptych_list_stats has exact counts. Takes time, and draws occluded bricks too. */
    int count_exactly;
    /* Red, green, blue, alpha, 0 to 1, not multiplied by alpha. NULL selects opaque black. With
     * alpha below 1, triptych_write() refuses JPEG. */
    const double *background;
    const triptych_splat_settings *splat;
    const triptych_sheet_settings *sheet;
    const triptych_scene_settings *scene;
    const triptych_integral_settings *integral;
    const triptych_lod_settings *lod;
    const triptych_light *light;
    const triptych_effects *effects;
    const triptych_clip *clip;
} triptych_settings;

/* Sets the settings for later frames. NULL selects the defaults. Fails with TRIPTYCH_USAGE if a
 * value is out of range or while a frame is begun. triptych_begin() checks settings that exclude
 * one another. */
TRIPTYCH_API int triptych_set_settings(triptych *t, const triptych_settings *settings);
/* Checks settings for a renderer, without data. Fails with TRIPTYCH_USAGE for values out of range,
 * for settings that exclude one another, and for settings without effect, which drawing ignores.
 * The message names the setting and the reason. If the renderer is auto and a setting requires a
 * certain renderer, sets *renderer to it. */
TRIPTYCH_API int triptych_check_settings(triptych *t, const triptych_settings *settings,
                                         triptych_renderer *renderer);

/* Sides by the orientation of the data. Left and right are the object's own. */
typedef enum triptych_side {
    TRIPTYCH_SIDE_DEFAULT, /* the front, seen a little from the left and from above */
    TRIPTYCH_SIDE_FRONT,
    TRIPTYCH_SIDE_BACK,
    TRIPTYCH_SIDE_LEFT,
    TRIPTYCH_SIDE_RIGHT,
    TRIPTYCH_SIDE_TOP,
    TRIPTYCH_SIDE_BOTTOM,
    TRIPTYCH_SIDE_ISO,
} triptych_side;

/* The view. All zero shows all visible voxels in a picture of 1024 x 1024 pixels. */
typedef struct triptych_view {
    int width, height;             /* in pixels, up to 65536; default 1024 */
    const double *eye, *look, *up; /* x, y, z in world space; NULL lets the library choose */
    triptych_side side;            /* side to look at, if eye is NULL */
    double azimuth_degrees;        /* turns the eye from there around the object, to the right */
    double elevation_degrees, roll_degrees; /* raises the eye; turns the picture clockwise */
    double zoom;        /* factor on the picture size, as with another lens; default 1 */
    double fov_degrees; /* vertical angle of view; default 30; within these limits: */
#define TRIPTYCH_FOV_MIN_DEGREES 1e-6
#define TRIPTYCH_FOV_MAX_DEGREES 179.999
    double ortho_height; /* if > 0, a parallel view of this height in world units */
    int ortho_fit;       /* if not 0, a parallel view as high as needed */
    /* If not 0, the view shows all visible voxels from every azimuth. */
    int turntable;
} triptych_view;

/* Computes the view and uses it for later frames. If the view has to fit the visible voxels, this
 * reads data, so set the transfer function and the settings first. Fails with TRIPTYCH_USAGE if a
 * number is out of range or while a frame is begun. */
TRIPTYCH_API int triptych_set_view(triptych *t, const triptych_view *view);
/* Turns the view of triptych_set_view() about its up axis, counterclockwise seen from above. Each
 * call starts from that view, not from an earlier turn. */
TRIPTYCH_API int triptych_turn(triptych *t, double degrees);

typedef struct triptych_camera {
    double eye[3], look[3], up[3];
    double fov_degrees, ortho_height; /* the view is parallel if ortho_height > 0 */
    int width, height;
    uint64_t splats; /* splats examined to fit the view */
} triptych_camera;

/* Returns the view of the next frame. Computes the default view if none is set. */
TRIPTYCH_API int triptych_get_camera(triptych *t, triptych_camera *out);

/* The visible point on a ray. Half of the opacity of the ray lies in front of it. */
typedef struct triptych_hit {
    /* Opacity of the whole ray. If 0, nothing is visible and all other fields are 0. */
    double opacity;
    double position[3]; /* world space */
    double index[3];    /* the same position in index space */
    /* The interpolated value where the ray meets the sheet nearest to the position. Without
     * interpolation (TRIPTYCH_INTERPOLATION_NEAREST), the value of the voxel around the position.
     */
    double value;
    /* World units from the eye along the ray; in parallel views, from the plane of the eye. */
    double depth;
    double depth_first; /* depth of the first visible matter */
} triptych_hit;

/* Finds the visible point at (x, y) for the current view, transfer function and data set. The
 * position is in pixels from the top left corner; pixel centres are at + 0.5. Points outside the
 * picture are allowed. Reads the bricks along the ray. Fails with TRIPTYCH_USAGE while a frame is
 * begun. */
TRIPTYCH_API int triptych_probe(triptych *t, double x, double y, triptych_hit *out);

/* ---- frames ---- */

/* Draws a whole frame. `rgba` takes 4 floats per pixel of the view. */
TRIPTYCH_API int triptych_draw(triptych *t, float *rgba);

/* Results of triptych_step(). */
enum {
    TRIPTYCH_STEP_DONE = 0,
    TRIPTYCH_STEP_MORE = 1, /* the deadline passed before the frame was complete */
    TRIPTYCH_STEP_WAITS =
        2, /* nothing can be drawn until the disk or the graphics device delivers */
};

/* Begins a frame that triptych_step() draws in steps, for programs with other things to do. Call
 * triptych_begin(), triptych_step() until it returns TRIPTYCH_STEP_DONE, triptych_picture(), and
 * triptych_end(). Functions that change the data set, settings or view fail until then. */
TRIPTYCH_API int triptych_begin(triptych *t);
/* Draws data that has been read, until the deadline, and at least one piece. The deadline is in ns
 * of CLOCK_MONOTONIC; UINT64_MAX sets none. Returns TRIPTYCH_STEP_DONE, TRIPTYCH_STEP_MORE,
 * TRIPTYCH_STEP_WAITS or a failure. Never waits for the disk. Waits for a graphics device at most
 * for one picture or piece. */
TRIPTYCH_API int triptych_step(triptych *t, uint64_t deadline_ns);
/* Waits until triptych_step() has something to draw, at most `timeout_ns`. */
TRIPTYCH_API int triptych_await(triptych *t, uint64_t timeout_ns);
/* Copies the picture drawn so far; after TRIPTYCH_STEP_DONE it is complete. `rgba` takes 4 floats
 * per pixel. */
TRIPTYCH_API int triptych_picture(triptych *t, float *rgba);
/* Copies the picture and its distances, for frames with triptych_settings.depth. `depth` takes
 * width * height floats. A distance is the mean in world units from the eye to the visible matter;
 * in parallel views it starts at the plane of the eye. Pixels without matter have +infinity. */
TRIPTYCH_API int triptych_picture_and_depth(triptych *t, float *rgba, float *depth);
/* Ends the frame, complete or not. */
TRIPTYCH_API void triptych_end(triptych *t);

/* Cancels the running call. Any thread may call this. The running call returns TRIPTYCH_CANCELLED
 * within milliseconds, and so do further calls for a frame that is begun. */
TRIPTYCH_API void triptych_cancel(triptych *t);

/* Chooses the samples, rays and levels of the next frame, as triptych_begin() does without
 * triptych_resources.choose_later. Makes a trial if the choice is not known. Fails with
 * TRIPTYCH_USAGE while a frame is begun. */
TRIPTYCH_API int triptych_choose(triptych *t);

/* ---- costs of a frame ---- */

/* Explains the frame that is begun: which bricks, lists and planes it reads, and why, one effect or
 * list per line. A post frame at several levels has a plan for each; the text shows the plan that
 * is being drawn. Free *text with free(). *text is NULL after a failure. */
TRIPTYCH_API int triptych_explain(triptych *t, char **text);

/* Statistics of the last complete frame. Strings are valid until the data set is closed. */
typedef struct triptych_frame_stats {
    double ms;      /* from the begin of drawing to the picture */
    double plan_ms; /* planning, not in `ms` */
    /* Parts of `ms`: waiting for the disk, drawing, merging the layers. Merging includes the rays
     * of the integral. */
    double wait_ms, draw_ms, merge_ms;
    double normals_ms; /* computing normals that the data set does not store (pre) */
    uint64_t splats, bytes_read, reads;     /* over all lists; read from disk */
    uint64_t bytes_cached;                  /* taken from the cache instead of the disk */
    uint64_t runs_occluded, bytes_occluded; /* not read, because they lie behind opaque matter */
    uint64_t bytes_unused; /* not read, because the planes have no effect on the picture */
    uint64_t memory_bytes, peak_memory_bytes; /* limit, and maximum since the data set was opened */
    /* Examples: "cpu", "8 threads, AVX2" and "io_uring+O_DIRECT". */
    const char *renderer, *device, *engine;
    const char *ring;           /* memory into which blocks are read, in words */
    triptych_classify classify; /* pre or post, as drawn */
    int samples_per_sheet;      /* post; 0 in pre */
    /* Post, and the integral of values, as drawn; otherwise TRIPTYCH_INTERPOLATION_DEFAULT. */
    triptych_interpolation interpolation;
    triptych_footprint footprint; /* pre, as drawn */
    /* Transmittance below which pixels took no more samples; -1 with the integral and deferred. */
    double early_termination;
    double tolerance; /* bound of the error of each component of a pixel; 0 without the integral */
    int effects;      /* effects that were drawn */
    /* For shadows and occlusion. Not in bytes_read. 0 if the lattice was kept from an earlier
     * frame. */
    uint64_t light_bytes_read;
    uint64_t light_memory_bytes;
    double light_gather_ms, light_sweep_ms; /* reading the extinction; computing the light */
    /* For emission. Not in bytes_read. 0 if the lattice was kept from an earlier frame. */
    uint64_t heat_bytes_read;
    uint64_t heat_memory_bytes;
    double heat_ms;
    /* 1 if the integrals of the transfer function have a closed form, so that no table was looked
     * up (post). */
    int closed_form;
    int rays;      /* along each side of a pixel; 0 with the mean over its area */
    double lod_px; /* voxels of coarse levels were at most this wide; 0: the finest level */
    /* Mean error by the trial, of 255, and the promise of the quality. The error is -1 if no trial
     * was made, and the promise 0 if the quality makes none. */
    double expected_error, promised_error;
    double trial_ms;      /* of the trial for this frame, not in `ms`; 0 if the choice was known */
    unsigned trials;      /* made by this context */
    int choice_waits;     /* 1 if the frame has the defaults until triptych_choose() */
    triptych_order order; /* of Gaussians, as drawn; TRIPTYCH_ORDER_DEFAULT for volumes */
    /* Deferred pictures count the surfels of the bricks in view. With front sides alone, some
     * bricks face away and are not read. Unread surfels are in hidden bricks. The others were read.
     * They lie outside the picture or face away, or are hidden, or are visible. */
    uint64_t surfels_planned, surfels_away, surfels_unread, surfels_outside, surfels_hidden,
        surfels_visible;
    unsigned objects_in_view;
} triptych_frame_stats;

/* Returns the statistics of the last complete frame. Fails with TRIPTYCH_USAGE if there is none. */
TRIPTYCH_API int triptych_get_frame_stats(triptych *t, triptych_frame_stats *out);

typedef struct triptych_list_stats {
    uint64_t bricks, bricks_selected;
    /* Bricks left out because they are transparent, outside the view, or without weight at any
     * pixel. */
    uint64_t bricks_transparent, bricks_outside, bricks_without_weight;
    uint64_t splats_read, bytes_read;
    int counted; /* 1 with triptych_settings.count_exactly; otherwise the next two are 0 */
    uint64_t splats_projected, splats_drawn; /* splats in view; splats that cover a pixel centre */
    uint64_t bricks_clipped, bricks_of_other_levels; /* also left out */
} triptych_list_stats;

/* Returns statistics of the last complete frame for one list, numbered as in
 * triptych_get_list(). Fails with TRIPTYCH_USAGE if there is no such list or no such frame. */
TRIPTYCH_API int triptych_get_list_stats(triptych *t, unsigned number, triptych_list_stats *out);

/* ---- pictures ---- */

/* Allocates a zeroed picture within triptych_resources.memory_bytes. `channels` is 4, or 1 for
 * distances. Fails with TRIPTYCH_ERROR if it does not fit. triptych_close() releases all pictures.
 */
TRIPTYCH_API int triptych_new_picture(triptych *t, int width, int height, int channels,
                                      float **pixels);
/* Releases a picture of triptych_new_picture(). Does nothing for other pointers. */
TRIPTYCH_API void triptych_release_picture(triptych *t, float *pixels);

/* Writes a picture. The ending of `path` selects the format: .png, .jpg, .tif, or .exr (linear
 * light). Colours are multiplied by alpha in .tif and .exr, but not in .png. */
TRIPTYCH_API int triptych_write(triptych *t, const char *path, int width, int height,
                                const float *rgba);
/* Writes width * height distances as .exr (channel Z) or .tif. */
TRIPTYCH_API int triptych_write_depth(triptych *t, const char *path, int width, int height,
                                      const float *depth);
/* Checks the paths and starts the helper that writes them, so that it is ready when the first
 * picture is complete. Optional. Fails with TRIPTYCH_USAGE for names that the two functions above
 * refuse. NULL is allowed for `depth_path`. */
TRIPTYCH_API int triptych_prepare_write(triptych *t, const char *path, const char *depth_path);

#ifdef __cplusplus
}
#endif

#endif
