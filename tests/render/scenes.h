/* Small data sets with known contents, and pictures of them by any renderer. scene_create() writes
 * a data set through stream/writer.h into a folder, and scene_destroy() removes it. Any failure
 * ends the test. */
#ifndef SCENES_H
#define SCENES_H

#include "field.h"
#include "frame.h"
#include "writer.h"

/* Sets the code of voxel (i, j, k), or returns false if the voxel is absent. `gradient` (world
 * space) is zero unless the function sets it. */
typedef bool (*scene_voxel)(void *user, int i, int j, int k, unsigned *code, double gradient[3]);

/* Returns pseudo-random bits of a voxel, identical in every run. */
static inline uint32_t scene_hash(int i, int j, int k)
{
    uint32_t x = (uint32_t)i * 73856093u ^ (uint32_t)j * 19349663u ^ (uint32_t)k * 83492791u;
    x ^= x >> 13;
    x *= 0x5bd1e995u;
    return x ^ x >> 15;
}

/* More lists along X, Y and Z: a halo, or another level of detail. */
typedef struct scene_part {
    unsigned level;
    trip_kind kind;
    int by[3]; /* length of this level's voxels in voxels of level 0; divides dims */
    scene_voxel voxel;
    void *user;
    /* Returns the deviation code of a voxel of values (deviation.h). NULL stores no deviations; all
     * parts of values then have none. */
    unsigned (*deviation)(void *user, int i, int j, int k);
} scene_part;

typedef struct scene_params {
    int64_t dims[3];
    trip_affine index_to_world;          /* all zero selects the identity */
    const trip_coordinates *coordinates; /* NULL selects even spacing */
    unsigned tile_voxels, slab_sheets;
    bool normals;
    /* 0 selects 2 for codes, and 4 for normals if there are any. */
    unsigned code_bytes, normal_bytes;
    const trip_codes *codes; /* NULL: even codes of values from 0 to 1 */
    double typical[2];       /* typical range; both 0 select the whole range */
    double gradient_scale;   /* factor of the gradients in 4-byte normals; 0 selects 1 */
    scene_voxel voxel;       /* NULL stores every voxel with code 65535 */
    void *user;
    const scene_part *parts; /* follow the voxels of level 0; three lists each */
    unsigned part_count;     /* 3 at most */
} scene_params;

typedef struct scene {
    char folder[64], path[96];
    trip_budget *budget;
    trip_dataset *data;
    unsigned level;       /* the level of `data`, see trip_dataset_level_open() */
    trip_tf_entry *table; /* 65536 entries, initially transparent black */
    /* Set by scene_use_function(), with the draw table in `table`. */
    const trip_draw_codes *draw;
    trip_tf_entry *stored_table; /* NULL: the same as `table` */
    /* Heat to draw, after trip_emission_begin() by the test that owns it. NULL for none. */
    struct trip_emission *emission;
} scene;

/* A map with shear, unequal steps and an offset. */
extern const trip_affine scene_sheared;

/* Returns settings of `post` with this number of samples per sheet, no shading and no background.
 */
trip_settings scene_post(int samples_per_sheet);
/* Returns the settings of scene_post() with shadows of a directional light. */
trip_settings scene_with_shadows(trip_vec3 to_light);

void scene_create(scene *s, const scene_params *params);
/* Returns the map of a coarse grid. Its voxels are `by` voxels of `fine` long, and the two grids
 * share one corner. */
trip_affine scene_coarse_map(const trip_affine *fine, const int by[3]);
void scene_destroy(scene *s);

/* Gives codes [first, last] a colour and an opacity per voxel. */
void scene_colour(scene *s, unsigned first, unsigned last, double r, double g, double b,
                  double opacity);

/* The codes and tables of a transfer function, as a session has them. */
typedef struct scene_function {
    uint16_t map[TRIP_CODES];
    trip_draw_codes draw;
    trip_tf_entry table[TRIP_CODES], stored_table[TRIP_CODES];
} scene_function;

/* Makes frames draw by a function with these points in data units. `f` must outlive the scene. */
void scene_use_function(scene *s, scene_function *f, const trip_tf_point *points, size_t count);

/* Creates a renderer. Tests run over all renderers of a table of names. */
typedef int (*scene_renderer_create)(trip_renderer **out, trip_budget *budget);

typedef struct scene_renderer {
    const char *name;
    scene_renderer_create create;
    double tolerance; /* of a premultiplied component, against the reference */
} scene_renderer;

/* Tells whether this machine can run gl. Notes in the test if it cannot. Fails if gl cannot be
 * created although a driver is there, or draws with another driver than TRIP_TEST_DRIVER. */
bool scene_has_gl(void);

/* Returns every renderer that this machine can run. An entry without a name ends the array. */
const scene_renderer *scene_renderers(void);

/* Returns the renderers of scene_renderers() that support post-classification. */
const scene_renderer *scene_renderers_post(void);

typedef struct scene_picture {
    int width, height;
    float *rgba;
    float *depth; /* NULL unless the settings request it */
    trip_frame_stats stats;
    trip_list_stats *lists; /* in the order of the data set's lists */
} scene_picture;

scene_picture scene_draw(const scene *s, const scene_renderer *renderer,
                         const trip_camera_params *view, const trip_settings *settings);
/* Draws like scene_draw() with the given parameters of the reader. It fills in the planes itself.
 */
scene_picture scene_draw_with(const scene *s, const scene_renderer *renderer,
                              const trip_camera_params *view, const trip_settings *settings,
                              const trip_reader_params *reader);

/* Parameters of the integral. Zero selects one thread and the data set's field. */
typedef struct scene_making {
    unsigned threads;
    const trip_field *field;
    void (*progress)(void *user, const char *stage, uint64_t done, uint64_t total);
    void *progress_user;
} scene_making;

scene_picture scene_integrate(const scene *s, const trip_camera_params *view,
                              const trip_settings *settings, const scene_making *how);
void scene_picture_free(scene_picture *p);

/* Draws a scene with one renderer after another. */
typedef struct scene_turn {
    const scene_renderer *next; /* an entry without a name ends the array */
    const scene *scene;
    const trip_camera_params *view;
    const trip_settings *settings;
    /* Valid for this turn, until the next scene_take_turn(). */
    const scene_renderer *renderer;
    scene_picture picture;
} scene_turn;

scene_turn scene_turns(const scene_renderer *renderers, const scene *s,
                       const trip_camera_params *view, const trip_settings *settings);
/* Frees the previous picture and draws the next one. Returns false after the last renderer. */
bool scene_take_turn(scene_turn *t);

static inline const float *scene_pixel(const scene_picture *p, int x, int y)
{
    return p->rgba + 4 * ((size_t)y * (size_t)p->width + (size_t)x);
}

/* Returns the maximum opacity of all pixels. */
double scene_max_opaque(const scene_picture *p);

/* Returns the maximum difference of a picture of gl or cpu from the reference. A rounding may end a
 * pixel one sample or splat earlier or later, which changes less than the transmittance of early
 * termination. Single precision adds the rest. In `post` it also moves the samples: far from the
 * origin their places have fewer bits. */
static inline double scene_bound(const trip_settings *s)
{
    const double rounding = s->classify == TRIP_CLASSIFY_POST ? 0.15 / 255 : 0.05 / 255;
    return trip_settings_early_termination(s) + rounding;
}

/* Returns the largest difference of any component. */
double scene_difference(const scene_picture *a, const scene_picture *b);

/* Compares the counts of a list drawn by the reference and by another renderer. A renderer in
 * single precision may count a splat differently if the splat's edge nearly touches a pixel
 * centre. */
void scene_compare_counts(const trip_list_stats *expected, const trip_list_stats *counts,
                          const char *name);

/* Returns a view of the volume's centre. `direction` (world space) points from the centre to the
 * eye. */
trip_camera_params scene_view(const scene *s, trip_vec3 direction, double distance,
                              double fov_degrees, int size);

/* Returns the ray through a pixel's centre in index space: its origin and unit direction. */
void scene_ray(const scene *s, const trip_camera_params *view, int x, int y, trip_vec3 *origin,
               trip_vec3 *direction);
/* Finds the part of a ray inside the box of all voxel centres, as distances from the ray's origin.
 * Returns false if the ray misses the box. */
bool scene_ray_in_grid(const scene *s, trip_vec3 origin, trip_vec3 direction, double *from,
                       double *to);
/* Returns the number of world units per unit of index space along a direction. */
double scene_ray_stretch(const scene *s, trip_vec3 direction);

#endif
