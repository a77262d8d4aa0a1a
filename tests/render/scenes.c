#include "scenes.h"

#include "light_map.h"

#include "test.h"

#include <stdlib.h>
#include <string.h>

#ifndef TRIP_WITHOUT_GL
#include "gl/gl_context.h"
#endif
#include "normal.h"
#include "opengl.h"

const trip_affine scene_sheared = { { { 1, 0.2, 0, 3 }, { 0, 2, 0.3, -1 }, { 0.1, 0, 0.5, 2 } } };

trip_settings scene_post(int samples_per_sheet)
{
    trip_settings s = trip_settings_default();
    s.classify = TRIP_CLASSIFY_POST;
    s.samples_per_sheet = samples_per_sheet;
    s.shading = false;
    s.background[3] = 0;
    return s;
}

trip_settings scene_with_shadows(trip_vec3 to_light)
{
    trip_settings s = scene_post(4);
    s.headlight = false;
    s.light_direction = trip_normalize(to_light);
    s.tolerance = 1e-5;
    s.effects.shadows = true;
    return s;
}

enum { PARTS_MAX = 4 };

/* The contents of a data set while it is written. */
typedef struct writing {
    trip_writer *writer;
    trip_writer_params params;
    trip_compact_normals compact; /* used for 3-byte normals */
    scene_part parts[PARTS_MAX];  /* the first part holds the voxels of level 0 */
    trip_writer_list lists[3 * PARTS_MAX];
} writing;

trip_affine scene_coarse_map(const trip_affine *fine, const int by[3])
{
    trip_affine step = trip_affine_identity();
    for (int a = 0; a < 3; a++) {
        step.m[a][a] = by[a];
        step.m[a][3] = 0.5 * (by[a] - 1);
    }
    return trip_affine_multiply(fine, &step);
}

static void set_lists(writing *w, const scene_params *p)
{
    assert_true(p->part_count < PARTS_MAX);
    w->parts[0] = (scene_part){ .by = { 1, 1, 1 }, .voxel = p->voxel, .user = p->user };
    for (unsigned i = 0; i <= p->part_count; i++) {
        const scene_part *part = i ? &p->parts[i - 1] : &w->parts[0];
        w->parts[i] = *part;
        trip_writer_list list = { .level = part->level, .kind = part->kind };
        list.index_to_world = part->level ? scene_coarse_map(&w->params.index_to_world, part->by)
                                          : w->params.index_to_world;
        for (int a = 0; a < 3; a++) {
            assert_int_equal(p->dims[a] % part->by[a], 0);
            list.dims[a] = p->dims[a] / part->by[a];
        }
        for (int a = 0; a < 3; a++) {
            list.axis = a;
            list.sheet_first = 0.5 * (part->by[a] - 1);
            list.sheet_step = part->by[a];
            w->lists[3 * i + (unsigned)a] = list;
        }
    }
    w->params.lists = w->lists;
    w->params.list_count = 3 * (p->part_count + 1);
}

static void set_params(writing *w, const scene_params *p)
{
    w->params = (trip_writer_params){
        .code_bytes = p->code_bytes ? p->code_bytes : 2,
        .normal_bytes = p->normals ? p->normal_bytes ? p->normal_bytes : 4 : 0,
        .tile_voxels = p->tile_voxels ? p->tile_voxels : 64,
        .slab_sheets = p->slab_sheets,
        .page_bytes = 4096,
        .dims = { p->dims[0], p->dims[1], p->dims[2] },
        .index_to_world = p->index_to_world,
        .coordinates = p->coordinates,
        .codes = { .code_hi = 1 },
    };
    trip_writer_params *params = &w->params;
    if (p->codes) {
        params->codes = (trip_writer_codes){ .code_lo = p->codes->lo,
                                             .code_hi = p->codes->hi,
                                             .table = p->codes->table,
                                             .table_entries = p->codes->entries,
                                             .table_step_log2 = p->codes->step_log2 };
    }
    bool given = false;
    for (int i = 0; i < 12; i++)
        given |= p->index_to_world.m[i / 4][i % 4] != 0;
    if (!given)
        params->index_to_world = trip_affine_identity();
    if (params->normal_bytes != 3) {
        params->codes.gradient_full =
            TRIP_GRADIENT_FULL * (p->gradient_scale > 0 ? p->gradient_scale : 1);
        return;
    }
    double voxel = cbrt(fabs(trip_affine_determinant(&params->index_to_world)));
    params->codes.gradient_full = TRIP_GRADIENT_FULL / voxel; /* values range from 0 to 1 */
    trip_compact_normals_choose(&params->index_to_world, params->codes.gradient_full, 0,
                                params->codes.gradient_step);
    w->compact = trip_compact_normals_make(&params->index_to_world, params->codes.gradient_full,
                                           params->codes.gradient_step);
}

static uint32_t pack_normal(const writing *w, const double gradient[3])
{
    if (w->params.normal_bytes != 3)
        return trip_normal_pack(gradient, TRIP_GRADIENT_FULL);
    trip_vec3 g = trip_affine_transpose_vector(&w->params.index_to_world,
                                               trip_v3(gradient[0], gradient[1], gradient[2]));
    return trip_compact_normal_pack(&w->compact, (double[3]){ g.x, g.y, g.z });
}

/* Returns the even bits of a Morton code. */
static uint32_t even_bits(uint32_t morton)
{
    uint32_t u = morton & 0x55555555;
    u = (u | u >> 1) & 0x33333333;
    u = (u | u >> 2) & 0x0f0f0f0f;
    u = (u | u >> 4) & 0x00ff00ff;
    return (u | u >> 8) & 0x0000ffff;
}

/* Returns the number of Morton codes that cover a rectangle of cells at the origin. */
static uint32_t morton_codes(int64_t width, int64_t height)
{
    uint32_t side = 1;
    while (side < width || side < height)
        side *= 2;
    return side * side;
}

/* Gathers the voxels of one tile of a sheet in Morton order, and their normals or deviations. */
static uint32_t gather_run(const writing *w, unsigned number, int sheet, uint32_t tile_u,
                           uint32_t tile_v, uint32_t *voxels, uint32_t *beside)
{
    const trip_writer_list *list = &w->lists[number];
    const scene_part *part = &w->parts[number / 3];
    uint32_t tile = w->params.tile_voxels, count = 0;
    int axis = list->axis, u_axis = (axis + 1) % 3, v_axis = (axis + 2) % 3;
    const int64_t width = list->dims[u_axis] - (int64_t)tile_u * tile;
    const int64_t height = list->dims[v_axis] - (int64_t)tile_v * tile;
    const uint32_t codes = morton_codes(width < tile ? width : tile, height < tile ? height : tile);
    for (uint32_t m = 0; m < codes; m++) {
        uint32_t u = even_bits(m), v = even_bits(m >> 1);
        int at[3];
        at[axis] = sheet;
        at[u_axis] = (int)(tile_u * tile + u);
        at[v_axis] = (int)(tile_v * tile + v);
        if (at[u_axis] >= list->dims[u_axis] || at[v_axis] >= list->dims[v_axis])
            continue;
        unsigned code = 65535;
        double gradient[3] = { 0 };
        if (part->voxel && !part->voxel(part->user, at[0], at[1], at[2], &code, gradient))
            continue;
        voxels[count] = trip_voxel_pack(u, v, code);
        beside[count++] = part->deviation ? part->deviation(part->user, at[0], at[1], at[2])
                                          : pack_normal(w, gradient);
    }
    return count;
}

static void append_sheet(const writing *w, unsigned number, int sheet)
{
    static uint32_t voxels[128 * 128], beside[128 * 128];
    const trip_writer_list *list = &w->lists[number];
    int64_t tile = w->params.tile_voxels;
    uint32_t tiles_u = (uint32_t)((list->dims[(list->axis + 1) % 3] + tile - 1) / tile);
    uint32_t tiles_v = (uint32_t)((list->dims[(list->axis + 2) % 3] + tile - 1) / tile);
    const bool has_beside = (w->params.normal_bytes && list->kind == TRIP_KIND_VOXELS) ||
                            w->parts[number / 3].deviation;
    for (uint32_t m = 0; m < morton_codes(tiles_u, tiles_v); m++) {
        uint32_t tile_u = even_bits(m), tile_v = even_bits(m >> 1);
        if (tile_u >= tiles_u || tile_v >= tiles_v)
            continue;
        uint32_t count = gather_run(w, number, sheet, tile_u, tile_v, voxels, beside);
        if (count)
            assert_int_equal(trip_writer_append(w->writer, number, (uint32_t)sheet, tile_u, tile_v,
                                                voxels, has_beside ? beside : NULL, count),
                             0);
    }
}

static void write_dataset(const scene *s, const scene_params *p)
{
    writing w = { 0 };
    set_params(&w, p);
    set_lists(&w, p);
    assert_int_equal(trip_writer_open(&w.writer, s->path, &w.params, s->budget), 0);
    for (unsigned i = 0; i < p->part_count; i++)
        if (p->parts[i].deviation)
            assert_int_equal(trip_writer_add_deviations(w.writer), 0);
    for (unsigned i = 0; i < w.params.list_count; i++)
        for (int sheet = 0; sheet < w.lists[i].dims[w.lists[i].axis]; sheet++)
            append_sheet(&w, i, sheet);
    trip_writer_summary summary = {
        .value_min = p->codes ? p->codes->lo : 0,
        .value_max = p->codes ? p->codes->hi : 1,
        .typical_min = p->typical[0],
        .typical_max = p->typical[1],
        .voxels = (uint64_t)(p->dims[0] * p->dims[1] * p->dims[2]),
        .text = "{}",
    };
    assert_int_equal(trip_writer_finish(w.writer, &summary), 0);
}

void scene_create(scene *s, const scene_params *params)
{
    memset(s, 0, sizeof *s);
    snprintf(s->folder, sizeof s->folder, "/tmp/trip-scene-XXXXXX");
    assert_non_null(mkdtemp(s->folder));
    snprintf(s->path, sizeof s->path, "%s/scene.trip", s->folder);
    assert_int_equal(trip_budget_create(&s->budget, UINT64_C(1) << 30), 0);
    write_dataset(s, params);
    assert_int_equal(trip_dataset_open(&s->data, s->path, s->budget), 0);
    s->table = calloc(65536, sizeof *s->table);
    assert_non_null(s->table);
}

void scene_destroy(scene *s)
{
    char command[128];
    trip_dataset_close(s->data);
    trip_budget_destroy(s->budget);
    free(s->table);
    snprintf(command, sizeof command, "rm -r '%s'", s->folder);
    assert_int_equal(system(command), 0);
}

void scene_colour(scene *s, unsigned first, unsigned last, double r, double g, double b,
                  double opacity)
{
    double voxel = cbrt(fabs(trip_affine_determinant(&s->data->index_to_world)));
    trip_tf_entry entry = { (float)r, (float)g, (float)b,
                            (float)(trip_extinction(opacity) / voxel) };
    for (unsigned i = first; i <= last; i++)
        s->table[i] = entry;
}

void scene_use_function(scene *s, scene_function *f, const trip_tf_point *points, size_t count)
{
    const double voxel = cbrt(fabs(trip_affine_determinant(&s->data->index_to_world)));
    trip_tf *tf;
    assert_int_equal(trip_tf_from_points(&tf, points, count, false, 0), 0);
    const double typical[2] = { s->data->header.typical_min, s->data->header.typical_max };
    f->draw = trip_draw_codes_for(tf, &s->data->codes, typical, f->map);
    trip_draw_codes_table(&f->draw, tf, voxel, f->table);
    trip_draw_codes_stored_table(&f->draw, tf, voxel, f->stored_table);
    trip_tf_destroy(tf);
    memcpy(s->table, f->table, sizeof f->table);
    s->draw = &f->draw;
    s->stored_table = f->stored_table;
}

/* Returns the table of a frame. */
static const trip_tf_entry *table_of(const scene *s, bool interpolates)
{
    return interpolates || !s->stored_table ? s->table : s->stored_table;
}

static int create_cpu(trip_renderer **out, trip_budget *budget)
{
    return trip_cpu_create(out, budget, 3);
}

#ifdef TRIP_WITHOUT_GL
bool scene_has_gl(void)
{
    test_lacks("gl, which is switched off");
    return false;
}
#else
/* Checks that gl draws with the driver that the test was started for. */
static void check_driver(const char *device)
{
    const char *wanted = getenv("TRIP_TEST_DRIVER");
    print_message("gl draws with %s\n", device);
    if (wanted && !strstr(device, wanted))
        fail_msg("gl draws with %s; install the driver %s (mesa-vulkan-drivers)", device, wanted);
}

bool scene_has_gl(void)
{
    trip_gl_context *context;
    if (trip_gl_context_create(&context) == 0) {
        check_driver(trip_gl_context_device(context));
        trip_gl_context_destroy(context);
        return true;
    }
    const char *driver = test_opengl();
    if (driver)
        fail_msg("gl cannot be created, although %s offers OpenGL 4.5", driver);
    test_lacks("OpenGL 4.5 by EGL");
    return false;
}
#endif

const scene_renderer *scene_renderers(void)
{
    static scene_renderer all[4] = {
        { "reference", trip_reference_create, 0 },
        { "cpu", create_cpu, 1.0 / 255 },
    };
    static bool looked;
    if (!looked && scene_has_gl())
        all[2] = (scene_renderer){ "gl", trip_gl_create, 1.0 / 255 };
    looked = true;
    return all;
}

static bool classifies_post(const scene_renderer *renderer)
{
    trip_budget *budget;
    trip_renderer *r;
    assert_int_equal(trip_budget_create(&budget, UINT64_C(1) << 30), 0);
    assert_int_equal(renderer->create(&r, budget), 0);
    bool does = r->ops->classifies_post;
    r->ops->destroy(r);
    trip_budget_destroy(budget);
    return does;
}

const scene_renderer *scene_renderers_post(void)
{
    static scene_renderer some[4];
    if (some[0].name)
        return some;
    scene_renderer *next = some;
    for (const scene_renderer *r = scene_renderers(); r->name; r++)
        if (classifies_post(r))
            *next++ = *r;
    return some;
}

/* Checks every picture: components must lie between 0 and 1, apart from rounding, and distances
 * must be positive. */
static void check_numbers(const scene_picture *p, const char *name)
{
    for (int i = 0; i < 4 * p->width * p->height; i++)
        if (!(p->rgba[i] >= -0.001F && p->rgba[i] <= 1.001F))
            fail_msg("%s: component %d of pixel %d, %d is %g", name, i % 4, i / 4 % p->width,
                     i / 4 / p->width, (double)p->rgba[i]);
    for (int i = 0; i < p->width * p->height && p->depth; i++)
        if (!(p->depth[i] >= 0))
            fail_msg("%s: the distance of pixel %d, %d is %g", name, i % p->width, i / p->width,
                     (double)p->depth[i]);
}

scene_picture scene_draw_with(const scene *s, const scene_renderer *renderer,
                              const trip_camera_params *view, const trip_settings *settings,
                              const trip_reader_params *reader_params)
{
    trip_camera camera;
    trip_plan plan;
    trip_renderer *r;
    trip_reader *reader;
    trip_reader_params params = *reader_params;
    scene_picture p = { .width = view->width, .height = view->height };
    assert_int_equal(trip_camera_make(&camera, view, &s->data->index_to_world), 0);
    const trip_tf_entry *table = table_of(s, trip_settings_interpolates(settings, false));
    trip_classification classified = { .draw = s->draw };
    assert_int_equal(
        trip_plan_make_next(&plan, s->data, &camera, settings, table, &classified, NULL, s->budget),
        0);
    plan.level = s->level;
    params.planes = plan.planes;
    assert_int_equal(trip_reader_create(&reader, s->data, &params, s->budget), 0);
    assert_int_equal(renderer->create(&r, s->budget), 0);
    trip_light_map *light = NULL;
    const trip_light_source source = { .data = s->data,
                                       .settings = settings,
                                       .clip = &plan.clip,
                                       .table = table_of(s, false),
                                       .engine = params.engine,
                                       .threads = 1 };
    if (trip_effects_light(&settings->effects)) {
        assert_int_equal(trip_light_map_create(&light, s->budget), 0);
        assert_int_equal(trip_light_map_begin(light, &source), 0);
    }

    trip_frame frame = { .data = s->data,
                         .camera = &camera,
                         .settings = settings,
                         .plan = &plan,
                         .table = table,
                         .light = light,
                         .emission = s->emission,
                         .count = true };
    p.rgba = calloc((size_t)p.width * (size_t)p.height, 4 * sizeof *p.rgba);
    assert_non_null(p.rgba);
    if (settings->depth) {
        p.depth = calloc((size_t)p.width * (size_t)p.height, sizeof *p.depth);
        assert_non_null(p.depth);
    }
    assert_int_equal(trip_frame_draw(r, reader, &frame, p.rgba, p.depth, &p.stats), 0);
    check_numbers(&p, renderer->name);

    p.lists = calloc(s->data->list_count, sizeof *p.lists);
    assert_non_null(p.lists);
    for (unsigned i = 0; i < s->data->list_count; i++)
        p.lists[i] = trip_frame_list_stats(r, reader, i);
    r->ops->destroy(r);
    trip_light_map_destroy(light);
    trip_reader_destroy(reader);
    trip_plan_release(&plan, s->budget);
    return p;
}

scene_picture scene_draw(const scene *s, const scene_renderer *renderer,
                         const trip_camera_params *view, const trip_settings *settings)
{
    return scene_draw_with(s, renderer, view, settings, &(trip_reader_params){ 0 });
}

scene_picture scene_integrate(const scene *s, const trip_camera_params *view,
                              const trip_settings *settings, const scene_making *how)
{
    trip_camera camera;
    trip_plan plan;
    trip_renderer *r;
    trip_reader *reader;
    scene_picture p = { .width = view->width, .height = view->height };
    unsigned kinds = settings->field == TRIP_FIELD_SPLATS ? 1 : 3;
    const bool interpolates = trip_settings_interpolates(settings, true);
    assert_int_equal(trip_camera_make(&camera, view, &s->data->index_to_world), 0);
    assert_int_equal(trip_plan_make_field(&plan, s->data, &camera, settings, how->field ? 0 : kinds,
                                          interpolates ? s->draw : NULL, s->budget),
                     0);
    assert_int_equal(trip_reader_create(&reader, s->data,
                                        &(trip_reader_params){ .planes = plan.planes }, s->budget),
                     0);
    assert_int_equal(trip_integral_create(&r, s->budget, how->threads ? how->threads : 1), 0);
    trip_frame frame = { .data = s->data,
                         .camera = &camera,
                         .settings = settings,
                         .plan = &plan,
                         .field = how->field,
                         .table = table_of(s, interpolates),
                         .emission = s->emission,
                         .progress = how->progress,
                         .progress_user = how->progress_user };
    p.rgba = calloc((size_t)p.width * (size_t)p.height, 4 * sizeof *p.rgba);
    assert_non_null(p.rgba);
    assert_int_equal(trip_frame_draw(r, reader, &frame, p.rgba, NULL, &p.stats), 0);
    check_numbers(&p, "integral");
    r->ops->destroy(r);
    trip_reader_destroy(reader);
    trip_plan_release(&plan, s->budget);
    return p;
}

void scene_picture_free(scene_picture *p)
{
    free(p->rgba);
    free(p->depth);
    free(p->lists);
    p->lists = NULL;
    p->rgba = p->depth = NULL;
}

scene_turn scene_turns(const scene_renderer *renderers, const scene *s,
                       const trip_camera_params *view, const trip_settings *settings)
{
    return (scene_turn){ .next = renderers, .scene = s, .view = view, .settings = settings };
}

bool scene_take_turn(scene_turn *t)
{
    if (t->renderer)
        scene_picture_free(&t->picture);
    t->renderer = t->next;
    if (!t->next->name)
        return false;
    t->picture = scene_draw(t->scene, t->next++, t->view, t->settings);
    return true;
}

double scene_max_opaque(const scene_picture *p)
{
    double max = 0;
    for (int y = 0; y < p->height; y++)
        for (int x = 0; x < p->width; x++) {
            const double opacity = scene_pixel(p, x, y)[3];
            max = opacity > max ? opacity : max;
        }
    return max;
}

double scene_difference(const scene_picture *a, const scene_picture *b)
{
    assert_int_equal(a->width, b->width);
    assert_int_equal(a->height, b->height);
    return test_max_apart(a->rgba, b->rgba, 4 * (size_t)a->width * (size_t)a->height);
}

void scene_compare_counts(const trip_list_stats *expected, const trip_list_stats *counts,
                          const char *name)
{
    double drawn = (double)expected->splats_drawn;
    double apart = fabs(drawn - (double)counts->splats_drawn);
    assert_int_equal(expected->splats_read, counts->splats_read);
    assert_int_equal(expected->bytes_read, counts->bytes_read);
    double projected = (double)expected->splats_projected;
    double off = fabs(projected - (double)counts->splats_projected);
    if (!(off <= 1 + 2e-5 * projected))
        fail_msg("%s: %.0f splats projected, %.0f apart", name, projected, off);
    if (!(apart <= 1 + 2e-4 * drawn))
        fail_msg("%s: %.0f splats drawn, %.0f apart", name, drawn, apart);
}

trip_camera_params scene_view(const scene *s, trip_vec3 direction, double distance,
                              double fov_degrees, int size)
{
    const uint64_t *dims = s->data->header.dims;
    trip_vec3 middle = { 0.5 * ((double)dims[0] - 1), 0.5 * ((double)dims[1] - 1),
                         0.5 * ((double)dims[2] - 1) };
    trip_camera_params p = { .fov_degrees = fov_degrees, .width = size, .height = size };
    p.look = trip_affine_point(&s->data->index_to_world, middle);
    p.eye = trip_add(p.look, trip_scale(trip_normalize(direction), distance));
    /* Any up vector works that is not parallel to the view direction. */
    p.up = fabs(direction.z) < 0.9 * trip_length(direction) ? trip_v3(0, 0, 1) : trip_v3(0, 1, 0);
    return p;
}

void scene_ray(const scene *s, const trip_camera_params *view, int x, int y, trip_vec3 *origin,
               trip_vec3 *direction)
{
    trip_camera c;
    assert_int_equal(trip_camera_make(&c, view, &s->data->index_to_world), 0);
    *origin = c.eye;
    if (c.ortho)
        *origin = trip_add(c.eye, trip_add(trip_scale(c.rx, x + 0.5), trip_scale(c.ry, y + 0.5)));
    *direction = trip_normalize(trip_camera_ray(&c, x + 0.5, y + 0.5));
}

bool scene_ray_in_grid(const scene *s, trip_vec3 origin, trip_vec3 direction, double *from,
                       double *to)
{
    *from = 0;
    *to = INFINITY;
    for (int a = 0; a < 3; a++) {
        double o = trip_component(origin, a), d = trip_component(direction, a);
        double last = (double)s->data->header.dims[a] - 1, t0 = -o / d, t1 = (last - o) / d;
        if (d == 0 && (o < 0 || o > last))
            return false;
        if (d == 0)
            continue;
        *from = fmax(*from, fmin(t0, t1));
        *to = fmin(*to, fmax(t0, t1));
    }
    return *from < *to;
}

double scene_ray_stretch(const scene *s, trip_vec3 direction)
{
    return trip_length(trip_affine_vector(&s->data->index_to_world, direction)) /
           trip_length(direction);
}
