/* Small data sets with known contents, written through stream/writer.h into a folder that is
 * removed at the end, and pictures of them by any renderer. Failures end the test. */
#ifndef SCENES_H
#define SCENES_H

#include "field.h"
#include "frame.h"
#include "writer.h"

/* What voxel (i, j, k) holds: false when it is not there; `gradient` (world space) is zero when the
 * function does not set it. */
typedef bool (*scene_voxel)(void *user, int i, int j, int k, unsigned *code, double gradient[3]);

/* Random bits of a voxel, the same in every run. */
static inline uint32_t scene_hash(int i, int j, int k)
{
    uint32_t x = (uint32_t)i * 73856093u ^ (uint32_t)j * 19349663u ^ (uint32_t)k * 83492791u;
    x ^= x >> 13;
    x *= 0x5bd1e995u;
    return x ^ x >> 15;
}

/* Further lists along X, Y and Z: a halo, or another level. */
typedef struct scene_part {
    unsigned level;
    trip_kind kind;
    int by[3]; /* voxels of level 0 that one of this level is as long as; divisors of dims */
    scene_voxel voxel;
    void *user;
} scene_part;

typedef struct scene_params {
    int64_t dims[3];
    trip_affine index_to_world;          /* all zero: the identity */
    const trip_coordinates *coordinates; /* NULL: even spacing */
    unsigned tile_voxels, slab_sheets;
    bool normals;
    unsigned code_bytes, normal_bytes; /* 0: 2, and 4 where there are normals */
    double gradient_scale; /* of 4-byte normals, by which gradients are multiplied; 0: 1 */
    scene_voxel voxel;     /* NULL: every voxel is there with code 65535 */
    void *user;
    const scene_part *parts; /* after the voxels of level 0, three lists each */
    unsigned part_count;     /* at most 3 */
} scene_params;

typedef struct scene {
    char folder[64], path[96];
    trip_budget *budget;
    trip_dataset *data;
    unsigned level;       /* that the data set is of, as trip_dataset_level_open() makes it */
    trip_tf_entry *table; /* 65536 entries, all transparent black at first */
    struct trip_emission *emission; /* of who draws, who has begun it; NULL: none */
} scene;

/* A map with shear, unequal steps and an offset. */
extern const trip_affine scene_sheared;

/* Values are interpolated, in so many slices, not shaded, before no background. */
trip_settings scene_post(int samples_per_sheet);
/* The same with shadows of light from a direction. */
trip_settings scene_with_shadows(trip_vec3 to_light);

void scene_create(scene *s, const scene_params *params);
/* The map of a grid whose voxels are `by` voxels of `fine` long and begin where those do. */
trip_affine scene_coarse_map(const trip_affine *fine, const int by[3]);
void scene_destroy(scene *s);

/* Codes [first, last] get a colour and an opacity per voxel. */
void scene_colour(scene *s, unsigned first, unsigned last, double r, double g, double b,
                  double opacity);

/* What draws: created by name so that tests run over all there are. */
typedef int (*scene_renderer_create)(trip_renderer **out, trip_budget *budget);

typedef struct scene_renderer {
    const char *name;
    scene_renderer_create create;
    double tolerance; /* of a premultiplied component, against the reference */
} scene_renderer;

/* Every renderer this machine can run, ended by an entry without name. */
const scene_renderer *scene_renderers(void);

/* Of those the ones that classify after interpolation. */
const scene_renderer *scene_renderers_post(void);

typedef struct scene_picture {
    int width, height;
    float *rgba;
    float *depth; /* NULL unless the settings want it */
    trip_frame_stats stats;
    trip_list_stats *lists; /* by the data set's */
} scene_picture;

scene_picture scene_draw(const scene *s, const scene_renderer *renderer,
                         const trip_camera_params *view, const trip_settings *settings);
/* The same with the reader's parameters given (planes are filled in). */
scene_picture scene_draw_with(const scene *s, const scene_renderer *renderer,
                              const trip_camera_params *view, const trip_settings *settings,
                              const trip_reader_params *reader);

/* How the integral is made; zero: one thread, the data set's field. */
typedef struct scene_making {
    unsigned threads;
    const trip_field *field;
    void (*progress)(void *user, const char *stage, uint64_t done, uint64_t total);
    void *progress_user;
} scene_making;

scene_picture scene_integrate(const scene *s, const trip_camera_params *view,
                              const trip_settings *settings, const scene_making *how);
void scene_picture_free(scene_picture *p);

/* A scene drawn by one renderer after the other. */
typedef struct scene_turn {
    const scene_renderer *next; /* an array that an entry without name ends */
    const scene *scene;
    const trip_camera_params *view;
    const trip_settings *settings;
    /* Of this turn, until the next. */
    const scene_renderer *renderer;
    scene_picture picture;
} scene_turn;

scene_turn scene_turns(const scene_renderer *renderers, const scene *s,
                       const trip_camera_params *view, const trip_settings *settings);
/* Frees the picture before and draws the next; false when all had their turn. */
bool scene_take_turn(scene_turn *t);

static inline const float *scene_pixel(const scene_picture *p, int x, int y)
{
    return p->rgba + 4 * ((size_t)y * (size_t)p->width + (size_t)x);
}

/* The greatest opacity of a pixel. */
double scene_max_opaque(const scene_picture *p);

/* Largest difference of any component. */
double scene_difference(const scene_picture *a, const scene_picture *b);

/* Counts of a list by the reference and by a renderer, whose kernels may work in single precision:
 * of the splats drawn, those whose edge all but meets a pixel centre may count for one and not for
 * the other. */
void scene_compare_counts(const trip_list_stats *expected, const trip_list_stats *counts,
                          const char *name);

/* A view of the volume's middle from a direction (world space, from the middle to the eye). */
trip_camera_params scene_view(const scene *s, trip_vec3 direction, double distance,
                              double fov_degrees, int size);

/* Of the ray of a pixel's centre in index space: origin and unit direction. */
void scene_ray(const scene *s, const trip_camera_params *view, int x, int y, trip_vec3 *origin,
               trip_vec3 *direction);
/* Where it is in the box of all voxel centres: distances from its origin; false: nowhere. */
bool scene_ray_in_grid(const scene *s, trip_vec3 origin, trip_vec3 direction, double *from,
                       double *to);
/* World units per index length along it. */
double scene_ray_stretch(const scene *s, trip_vec3 direction);

#endif
