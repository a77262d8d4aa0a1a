/* Triptych as a library: draws volumes that do not fit in memory. A context holds one opened data
 * set (NAME.trip, as `triptych brick` or triptych_brick() makes it) and draws frames of it:
 *
 *     triptych *t;
 *     if (triptych_create(&t) == 0 && triptych_open(t, "head.trip", NULL) == 0) {
 *         triptych_set_view(t, &(triptych_view){ .width = 800, .height = 600 });
 *         triptych_draw(t, rgba);
 *     }
 *
 * One thread at a time uses a context, but for triptych_cancel(); any number of contexts may be
 * used by as many threads, and share nothing. Functions return 0 or a negative triptych_status, and
 * triptych_error() then says why. Parameters are plain structs in which zero means the default;
 * what they point to is needed during the call only.
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
/* Takes lines for people as they come: warnings, notes and failures; NULL: nobody does. May be
 * called by other threads, but only during a call with this context. */
TRIPTYCH_API void triptych_set_messages(triptych *t, void (*take)(void *user, const char *line),
                                        void *user);
/* "0.1.0". */
TRIPTYCH_API const char *triptych_version(void);

/* ---- data ---- */

typedef enum triptych_renderer {
    TRIPTYCH_RENDERER_AUTO, /* GL on graphics hardware, else CPU */
    TRIPTYCH_RENDERER_GL,   /* OpenGL 4.5, without a window */
    TRIPTYCH_RENDERER_CPU,
    TRIPTYCH_RENDERER_REFERENCE, /* double precision, slow */
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
    int keep_pages;  /* not 0: half of the memory left keeps what was read for the frames to come */
    int read_hidden; /* not 0: bricks behind what is opaque are read too; the same picture */
    const char *name; /* of the data in messages; default: its path */
} triptych_resources;

/* Closes what is open, and opens a data set; resources NULL: the defaults. */
TRIPTYCH_API int triptych_open(triptych *t, const char *path, const triptych_resources *resources);
TRIPTYCH_API void triptych_close(triptych *t);

typedef struct triptych_info {
    int64_t dims[3];             /* voxels of the volume along i, j, k */
    double index_to_world[3][4]; /* world = matrix . (i, j, k, 1) */
    double lo[3], hi[3];         /* box of the voxels kept, in world space */
    double value_min, value_max; /* of the volume */
    uint64_t kept;               /* voxels: not those that no function given to `brick` shows */
    uint64_t bytes;              /* on disk */
    unsigned lists;              /* of voxels, by axis and level of detail */
    int normals;                 /* 1: it can be shaded */
} triptych_info;

TRIPTYCH_API int triptych_get_info(triptych *t, triptych_info *out);

/* Makes a data set of a volume (.nhdr, .nrrd, .nii, .vdb, DICOM, slices, ...): all that the
 * automatic transfer function shows, and what the given ones do (presets or files; a list ended by
 * NULL, or NULL). Replaces what is there under that name. Needs no data set open. */
TRIPTYCH_API int triptych_brick(triptych *t, const char *volume, const char *data_set,
                                const char *const *functions, const triptych_resources *resources);

/* ---- what is drawn ---- */

typedef struct triptych_function {
    const char *name;     /* preset or file, as of --tf; default: the one kept in the data set */
    double opacity_scale; /* multiplies extinction; default 1 */
    double window, level; /* window > 0: stretched over level - window / 2 to level + window / 2 */
    int *left_out;        /* not NULL: set to 1 (else 0), in place of a warning, where values that
                             would show were not kept; the function is then not taken */
} triptych_function;

/* From the next frame on; NULL: the default. */
TRIPTYCH_API int triptych_set_function(triptych *t, const triptych_function *function);

typedef enum triptych_method {
    TRIPTYCH_MERGE, /* three layers, blended */
    TRIPTYCH_CLIP,  /* each pixel from one layer */
    TRIPTYCH_AXIS,  /* one layer for the picture */
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

typedef struct triptych_settings {
    triptych_method method;
    triptych_traversal traversal;
    triptych_target target; /* of the layers; not of the reference */
    int indexed, triangles; /* how GL is given splats: one array for all lists, quads */
    int shading;            /* from gradients */
    int headlight;          /* light from the eye; else from light[] */
    double light[3];        /* world direction to the light, not zero */
    double h;               /* where layers begin to blend, 0 to below 1 */
    double kernel_radius;   /* of a splat, voxels, 0.1 to 100 */
    double background[4];   /* red, green, blue, alpha, 0 to 1, not multiplied by alpha */
} triptych_settings;

/* Merge, outward, rgba32f, h 0.85, kernel radius 2, shading by headlight, black. */
TRIPTYCH_API triptych_settings triptych_default_settings(void);
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
    int width, height;                      /* px, up to 99999; default 1024 */
    const double *eye, *look, *up;          /* world space, x, y, z; NULL: found */
    triptych_side side;                     /* that is seen, without an eye */
    double azimuth_degrees;                 /* from there round the object, to the right */
    double elevation_degrees, roll_degrees; /* up; the picture clockwise */
    double zoom;                            /* as another lens would; default 1 */
    double fov_degrees;                     /* vertical, 1e-6 to 179.999; default 30 */
    double ortho_height;                    /* > 0: parallel, so many world units high */
    int ortho_fit;                          /* not 0: parallel, as high as needed */
    int turntable;                          /* not 0: all stays in view when it is turned */
} triptych_view;

/* Works out the view; reads some of the data where it is to be fitted to what the function shows,
 * so after the function and the settings. */
TRIPTYCH_API int triptych_set_view(triptych *t, const triptych_view *view);
/* The view that triptych_set_view() made, turned about its up axis: counterclockwise seen from
 * above. */
TRIPTYCH_API int triptych_turn(triptych *t, double degrees);

/* ---- frames ---- */

/* rgba: width * height * 4 floats. */
TRIPTYCH_API int triptych_draw(triptych *t, float *rgba);

/* What triptych_step() has come to. */
enum {
    TRIPTYCH_DONE = 0,
    TRIPTYCH_MORE = 1,  /* there is more to draw: the deadline has passed */
    TRIPTYCH_WAITS = 2, /* nothing to draw: the disk is at work */
};

/* The same in steps, for whoever has other things to do: begin, steps until TRIPTYCH_DONE, picture,
 * end. Until the end nothing can be set. */
TRIPTYCH_API int triptych_begin(triptych *t);
/* Draws what has been read, until the deadline by CLOCK_MONOTONIC in nanoseconds; something of it
 * in any case. Never waits for the disk. UINT64_MAX: no deadline. */
TRIPTYCH_API int triptych_step(triptych *t, uint64_t deadline_ns);
/* Waits until there is something to draw, at most so long. */
TRIPTYCH_API int triptych_await(triptych *t, uint64_t timeout_ns);
/* The picture so far; after TRIPTYCH_DONE the picture. rgba as above. */
TRIPTYCH_API int triptych_picture(triptych *t, float *rgba);
/* Also gives up a frame that is not done. */
TRIPTYCH_API void triptych_end(triptych *t);

/* From any thread: the call under way ends within milliseconds, with TRIPTYCH_CANCELLED, and so do
 * those that follow for a frame that is begun. */
TRIPTYCH_API void triptych_cancel(triptych *t);

/* Calls `tell` between pieces of a frame: splats drawn, of how many. */
TRIPTYCH_API void triptych_set_progress(triptych *t,
                                        void (*tell)(void *user, uint64_t splats, uint64_t total),
                                        void *user);

/* Writes a picture: .png, .jpg, .tif or, in linear light, .exr. */
TRIPTYCH_API int triptych_write(triptych *t, const char *path, int width, int height,
                                const float *rgba);

#ifdef __cplusplus
}
#endif

#endif
