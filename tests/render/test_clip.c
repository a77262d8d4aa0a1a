/* Clipping by every renderer. The tests compare pictures with closed forms of the remaining path,
 * and with pictures of a volume that contains the remaining voxels alone. */
#include "scenes.h"
#include "test.h"

#include "clip.h"
#include "plan.h"

enum { EDGE = 20 };

static trip_settings clear(trip_classify classify)
{
    trip_settings s = trip_settings_default();
    s.classify = classify;
    s.shading = false;
    s.background[3] = 0;
    s.tolerance = 1e-6;
    return s;
}

static void a_box_is_the_inside_of_its_six_faces(void **state)
{
    (void)state;
    const double lo[3] = { 1, -INFINITY, 2.5 }, hi[3] = { 7, 4, INFINITY };
    const trip_affine same = trip_affine_identity();
    trip_clip clip = { 0 };
    trip_clip_add_box(&clip, lo, hi, &same);
    assert_int_equal(clip.count, 4);
    for (int n = 0; n < 1000; n++) {
        int i = n % 10, j = n / 10 % 10, k = n / 100;
        bool inside = i >= 1 && i <= 7 && j <= 4 && k >= 3;
        assert_int_equal(trip_clip_has(&clip, trip_v3(i, j, k)), inside);
    }
}

/* Returns the bit of a voxel in a square. */
static int morton_of(int u, int v)
{
    int bit = 0;
    for (int b = 0; b < 3; b++)
        bit |= (u >> b & 1) << 2 * b | (v >> b & 1) << (2 * b + 1);
    return bit;
}

static void squares_hold_the_voxels_that_are_inside(void **state)
{
    (void)state;
    for (int n = 0; n < 300; n++) {
        trip_clip clip = { 0 };
        const int axis = n % 3;
        for (int i = 0; i <= n % 3; i++) {
            uint32_t r = scene_hash(n, i, 7);
            trip_clip_add(&clip,
                          trip_normalize(trip_v3((double)(r % 7) - 3.2, (double)(r / 7 % 7) - 2.9,
                                                 (double)(r / 49 % 7) - 3.1)),
                          (double)(r / 343 % 40) - 15);
        }
        uint64_t mask = trip_clip_square(&clip, axis, 5, 8, 16);
        for (int v = 0; v < 8; v++)
            for (int u = 0; u < 8; u++) {
                double p[3];
                p[axis] = 5;
                p[(axis + 1) % 3] = 8 + u;
                p[(axis + 2) % 3] = 16 + v;
                assert_int_equal(mask >> morton_of(u, v) & 1,
                                 trip_clip_has(&clip, trip_v3(p[0], p[1], p[2])));
            }
    }
}

/* The mask depends on the voxels' positions. Bits beyond the grid's last voxel stay clear,
 * whatever their position would be. */
static void squares_of_uneven_grids_hold_the_voxels_that_are_inside(void **state)
{
    (void)state;
    enum { MAX = 32 };
    double tables[3][MAX];
    for (int a = 0; a < 3; a++)
        for (int i = 0; i < MAX; i++)
            tables[a][i] = i + 0.3 * sin(1.1 * i + a);
    const int64_t voxels[3] = { 13, 21, 19 }, corner[3] = { 8, 16, 5 };
    const trip_coordinates c =
        trip_coordinates_make((const double *const[]){ tables[0], tables[1], tables[2] }, voxels);
    int inside = 0, outside = 0;
    for (int n = 0; n < 60; n++) {
        const int axis = n % 3, u_axis = (axis + 1) % 3, v_axis = (axis + 2) % 3;
        trip_clip clip = { 0 };
        trip_clip_add(&clip, trip_normalize(trip_v3(sin(n), cos(1.7 * n), sin(2.3 * n))),
                      n % 20 - 8);
        const uint64_t mask = trip_clip_uneven_square(&clip, &c, axis, corner);
        for (int i = 0; i < 64; i++) {
            const int u = i % 8, v = i / 8;
            double p[3];
            p[axis] = tables[axis][corner[2]];
            p[u_axis] = tables[u_axis][corner[0] + u];
            p[v_axis] = tables[v_axis][corner[1] + v];
            const bool there = corner[0] + u < voxels[u_axis] && corner[1] + v < voxels[v_axis];
            const bool has = there && trip_clip_has(&clip, trip_v3(p[0], p[1], p[2]));
            assert_int_equal(mask >> morton_of(u, v) & 1, has);
            inside += has;
            outside += there && !has;
        }
    }
    assert_true(inside > 100 && outside > 100);
}

/* A box is missed if all its corners lie outside one plane. */
static void boxes_entirely_outside_are_missed(void **state)
{
    (void)state;
    int missed = 0;
    for (int n = 0; n < 1000; n++) {
        const trip_vec3 normal =
            trip_normalize(trip_v3(test_random() - 0.5, test_random() - 0.5, test_random() - 0.5));
        const trip_vec3 at = trip_v3(50 * test_random(), -30 * test_random(), 7);
        const double margin = n % 2 * 4 * test_random(), offset = 100 * test_random() - 50;
        double lo[3], hi[3], max = -INFINITY;
        for (int a = 0; a < 3; a++) {
            lo[a] = 40 * test_random() - 20;
            hi[a] = lo[a] + 10 * test_random();
        }
        for (int i = 0; i < 8; i++) {
            const trip_vec3 corner = trip_v3(i & 1 ? hi[0] + margin : lo[0] - margin,
                                             i & 2 ? hi[1] + margin : lo[1] - margin,
                                             i & 4 ? hi[2] + margin : lo[2] - margin);
            max = fmax(max, trip_dot(normal, trip_add(at, corner)) + offset);
        }
        trip_clip clip = { 0 };
        trip_clip_add(&clip, normal, offset);
        if (max > -TRIP_CLIP_SLACK)
            assert_false(trip_clip_misses(&clip, at, lo, hi, margin));
        if (max < -3 * TRIP_CLIP_SLACK)
            assert_true(trip_clip_misses(&clip, at, lo, hi, margin));
        missed += max < 0;
    }
    assert_in_range(missed, 200, 800);
}

/* A box of one voxel is not missed if the voxel lies outside only by rounding. */
static void boxes_of_voxels_inside_by_rounding_are_not_missed(void **state)
{
    (void)state;
    for (double beyond = 0.25; beyond <= 1; beyond += 0.25) {
        const double at[3] = { 5, 6, 7 };
        trip_clip clip = { 0 };
        trip_clip_add(&clip, trip_v3(0, 1, 0), -6 - beyond * TRIP_CLIP_SLACK);
        assert_true(trip_clip_has(&clip, trip_v3(5, 6, 7)));
        assert_false(trip_clip_misses(&clip, trip_v3(0, 0, 0), at, at, 0));
    }
}

static trip_half_space random_half_space(void)
{
    return (trip_half_space){ trip_normalize(trip_v3(test_random() - 0.5, test_random() - 0.5,
                                                     test_random() - 0.5)),
                              20 * test_random() - 8 };
}

/* Returns the distance of a point from the nearest half-space border: positive inside all
 * half-spaces, negative outside. */
static double room_at(const trip_clip *clip, trip_vec3 p)
{
    double min = INFINITY;
    for (int i = 0; i < clip->count; i++)
        min = fmin(min, trip_dot(clip->planes[i].normal, p) + clip->planes[i].offset);
    return min;
}

/* Cuts rays from 1 to 20. The remaining part must lie inside, and the parts beside it outside. If
 * nothing remains, every point of the ray must lie outside. */
static void a_ray_is_cut_to_its_part_inside(void **state)
{
    (void)state;
    int left = 0;
    for (int n = 0; n < 2000; n++) {
        const trip_vec3 o = trip_v3(9 * test_random(), 9 * test_random(), 9 * test_random());
        const trip_vec3 d = random_half_space().normal;
        double from = 1, to = 20;
        trip_clip clip = { .count = 1 + n % 3 };
        for (int i = 0; i < clip.count; i++)
            clip.planes[i] = random_half_space();
        const bool some = trip_clip_ray(&clip, o, d, &from, &to);
        for (int i = 0; i <= 190; i++) {
            const double t = 1 + 0.1 * i, room = room_at(&clip, trip_add(o, trip_scale(d, t)));
            if (fabs(room) > 1e-9)
                assert_int_equal(some && t >= from && t <= to, room > 0);
        }
        left += some;
    }
    assert_in_range(left, 200, 1800);
}

/* A ray inside the plane counts as inside. A ray that only touches the half-space keeps nothing. */
static void points_on_a_plane_are_inside(void **state)
{
    (void)state;
    trip_clip clip = { 0 };
    trip_clip_add(&clip, trip_v3(1, 0, 0), -3);
    double from = 0, to = 5;
    assert_true(trip_clip_ray(&clip, trip_v3(3, 0, 0), trip_v3(0, 1, 0), &from, &to));
    assert_true(from == 0 && to == 5);
    assert_false(
        trip_clip_ray(&clip, trip_v3(8, 0, 0), trip_v3(1, 0, 0), &(double){ -9 }, &(double){ -5 }));
}

/* A half-space mapped to the source space of a map keeps its side, and its offset is in that
 * space's units of length. A half-space with a zero normal contains all points or none, depending
 * on its offset. */
static void half_spaces_keep_their_side_under_an_inverse_map(void **state)
{
    (void)state;
    trip_clip clip = { 0 };
    for (int i = 0; i < 6; i++) {
        const trip_half_space p = random_half_space();
        trip_clip_add(&clip, trip_scale(p.normal, 3), p.offset);
    }
    trip_clip_add(&clip, trip_v3(0, 0, 0), 2);
    trip_clip_add(&clip, trip_v3(0, 0, 0), -2);
    const trip_clip before = trip_clip_before(&clip, &scene_sheared);
    assert_int_equal(before.count, clip.count);
    for (int n = 0; n < 50 * clip.count; n++) {
        const trip_half_space *p = &clip.planes[n % clip.count],
                              *q = &before.planes[n % clip.count];
        const trip_vec3 at = trip_v3(9 * test_random(), 9 * test_random(), 9 * test_random());
        const trip_vec3 to = trip_affine_point(&scene_sheared, at);
        const double own = trip_dot(q->normal, at) + q->offset;
        const double world = trip_dot(p->normal, to) + p->offset;
        assert_true(own * world > 0);
        if (n % clip.count < 6)
            assert_close(trip_length(q->normal), 1, 1e-12);
    }
}

/* A half-space that cuts no voxel of 10 x 20 x 30 is removed. The remaining ones keep their order.
 */
static void half_spaces_that_hold_all_voxels_are_left_out(void **state)
{
    (void)state;
    const uint64_t dims[3] = { 10, 20, 30 };
    const struct {
        trip_vec3 normal;
        double offset;
        bool cuts;
    } of[] = {
        { { 1, 0, 0 }, 0, false },     { { 1, 0, 0 }, -0.1, true },    { { -1, 0, 0 }, 9, false },
        { { -1, 0, 0 }, 8.9, true },   { { 0, 1, 0 }, 0, false },      { { 0, 1, 0 }, -0.2, true },
        { { 0, -1, 0 }, 19, false },   { { 0, -1, 0 }, 18.9, true },   { { 0, 0, 1 }, 0, false },
        { { 0, 0, 1 }, -0.3, true },   { { 0, 0, -1 }, 29, false },    { { 0, 0, -1 }, 28.9, true },
        { { -1, -1, -1 }, 57, false }, { { -1, -1, -1 }, 56.9, true },
    };
    enum { COUNT = sizeof of / sizeof *of };
    trip_clip clip = { 0 };
    for (int i = 0; i < COUNT; i++)
        trip_clip_add(&clip, of[i].normal, of[i].offset);
    trip_clip_simplify(&clip, dims);
    int kept = 0;
    for (int i = 0; i < COUNT; i++)
        if (of[i].cuts) {
            assert_memory_equal(&clip.planes[kept].normal, &of[i].normal, sizeof of[i].normal);
            assert_true(clip.planes[kept++].offset == of[i].offset);
        }
    assert_int_equal(clip.count, kept);
}

/* Narrows an interval of a ray to one side of a plane in index space. */
static void cut(const double plane[4], trip_vec3 o, trip_vec3 d, double *from, double *to)
{
    double at = plane[0] * o.x + plane[1] * o.y + plane[2] * o.z + plane[3];
    double by = plane[0] * d.x + plane[1] * d.y + plane[2] * d.z;
    double t = -at / by;
    if (by > 0 && t > *from)
        *from = t;
    if (by < 0 && t < *to)
        *to = t;
}

/* Adds a plane given in index space to the clipping, which is in world space. */
static void add_plane(trip_settings *s, const trip_affine *index_to_world, const double plane[4])
{
    trip_affine to_index;
    assert_true(trip_affine_invert(index_to_world, &to_index));
    double world[4] = { 0, 0, 0, plane[3] };
    for (int a = 0; a < 3; a++)
        for (int i = 0; i < 4; i++)
            world[i] += plane[a] * to_index.m[a][i];
    trip_clip_add(&s->clip, trip_v3(world[0], world[1], world[2]), world[3]);
}

static const double planes[][4] = {
    { 0, 0, 1, -9.5 },        { 0, -1, 0, 9.25 },         { 0.3, 0.2, 1, -12 },
    { -0.4, 1, 0.3, -8.125 }, { 0.61, -0.2, -0.77, 1.5 },
};
enum { PLANES = sizeof planes / sizeof *planes };

/* Sets the extinction of all codes to a constant, or makes it rise with the code. */
static void fill(scene *s, bool rises)
{
    for (int code = 0; code < 65536; code++)
        s->table[code] =
            (trip_tf_entry){ 1, 0.5F, 0.25F, rises ? 0.2F * (float)code / 65535 : 0.05F };
}

/* Codes rise by 3000 per voxel along i. */
static bool ramp(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)j;
    (void)k;
    (void)gradient;
    *code = 3000u * (unsigned)i;
    return true;
}

static double depth_between(const scene *s, bool rises, trip_vec3 o, trip_vec3 d, double from,
                            double to)
{
    double code = 3000 * (o.x + 0.5 * (from + to) * d.x);
    double extinction = rises ? 0.2F * code / 65535 : (double)0.05F;
    return from < to ? extinction * (to - from) * scene_ray_stretch(s, d) : 0;
}

/* Compares each pixel with the closed form. Every ray enters and leaves through the faces of one
 * axis, so that no segment touches the grid's border. */
static void compare_with_path(const scene *s, const trip_camera_params *view,
                              const scene_picture *p, const double plane[4], bool rises,
                              double tolerance)
{
    for (int n = 0; n < p->width * p->height; n++) {
        trip_vec3 o, d;
        double from, to;
        scene_ray(s, view, n % p->width, n / p->width, &o, &d);
        assert_true(scene_ray_in_grid(s, o, d, &from, &to));
        cut(plane, o, d, &from, &to);
        double alpha = 1 - exp(-depth_between(s, rises, o, d, from, to));
        const float *c = scene_pixel(p, n % p->width, n / p->width);
        assert_close(c[3], alpha, tolerance);
        assert_close(c[1], alpha / 2, tolerance);
    }
}

static void the_unclipped_path_has_its_opacity(void **state)
{
    (void)state;
    for (int i = 0; i < 10; i++) {
        const int axis = i % 3, which = i % PLANES;
        const bool rises = i / 2 % 2, skewed = i / 5;
        scene s;
        scene_create(
            &s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                 .index_to_world = skewed ? scene_sheared : trip_affine_identity(),
                                 .tile_voxels = 16,
                                 .slab_sheets = 4,
                                 .voxel = ramp });
        fill(&s, rises);
        double d[3] = { 0.04, -0.05, 0.03 };
        d[axis] = i % 2 ? 1 : -1;
        trip_vec3 direction =
            trip_affine_vector(&s.data->index_to_world, trip_v3(d[0], d[1], d[2]));
        trip_camera_params view = scene_view(&s, direction, 80, 4, 5);
        view.ortho_height = i / 3 % 2 ? 4 : 0;
        trip_settings settings = clear(TRIP_CLASSIFY_POST);
        settings.samples_per_sheet = 1 + i % 4;
        add_plane(&settings, &s.data->index_to_world, planes[which]);
        for (const scene_renderer *r = scene_renderers_post(); r->name; r++) {
            scene_picture p = scene_draw(&s, r, &view, &settings);
            compare_with_path(&s, &view, &p, planes[which], rises, 3e-5 + r->tolerance);
            scene_picture_free(&p);
        }
        scene_picture p = scene_integrate(&s, &view, &settings, &(scene_making){ 0 });
        compare_with_path(&s, &view, &p, planes[which], rises, 1e-5);
        scene_picture_free(&p);
        scene_destroy(&s);
    }
}

/* Tests whether a voxel is inside two planes and a box, computed independently of clip.c. */
static bool is_left(int i, int j, int k)
{
    return 3 * i + j - 2 * k >= -7 && 2 * k - i <= 23 && i >= 2 && j >= 3 && k >= 1 && i <= 17 &&
           j <= 15 && k <= 18;
}

static bool blobs(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    gradient[0] = sin(0.7 * i);
    gradient[1] = cos(0.5 * j);
    gradient[2] = sin(0.3 * k + i);
    *code = (unsigned)(32768 + 32000 * sin(0.5 * i) * cos(0.4 * j + 0.2 * k));
    return !user || is_left(i, j, k);
}

static void set_cut(trip_settings *settings)
{
    const double lo[3] = { 2, 3, 1 }, hi[3] = { 17, 15, 18 };
    const trip_affine same = trip_affine_identity();
    settings->clip = (trip_clip){ 0 };
    trip_clip_add(&settings->clip, trip_v3(3, 1, -2), 7);
    trip_clip_add(&settings->clip, trip_v3(1, 0, -2), 23);
    trip_clip_add_box(&settings->clip, lo, hi, &same);
}

static void make_blobs(scene *s, bool cropped)
{
    static char yes;
    scene_create(s, &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                     .tile_voxels = 16,
                                     .slab_sheets = 4,
                                     .normals = true,
                                     .voxel = blobs,
                                     .user = cropped ? &yes : NULL });
    scene_colour(s, 20000, 40000, 0.2, 0.5, 1, 0.05);
    scene_colour(s, 40001, 65535, 0.9, 0.4, 0.1, 0.4);
}

static void clipped_splats_equal_those_of_a_cropped_volume(void **state)
{
    (void)state;
    scene all, cropped;
    make_blobs(&all, false);
    make_blobs(&cropped, true);
    for (int i = 0; i < 3; i++) {
        trip_camera_params view =
            scene_view(&all, trip_v3(i % 2 ? 1 : -0.4, 0.8 - 0.4 * i, 0.5), 40, 35, 40);
        view.ortho_height = i == 1 ? 25 : 0;
        trip_settings plain = clear(TRIP_CLASSIFY_PRE), cutting;
        plain.shading = true;
        plain.compositing = (trip_compositing)(i % 2);
        cutting = plain;
        set_cut(&cutting);
        for (const scene_renderer *r = scene_renderers(); r->name; r++) {
            scene_picture a = scene_draw(&all, r, &view, &cutting);
            scene_picture b = scene_draw(&cropped, r, &view, &plain);
            scene_picture whole = scene_draw(&all, r, &view, &plain);
            assert_memory_equal(a.rgba, b.rgba, 40 * 40 * 4 * sizeof *a.rgba);
            assert_true(scene_difference(&a, &whole) > 0.1);
            scene_picture_free(&a);
            scene_picture_free(&b);
            scene_picture_free(&whole);
        }
    }
    scene_destroy(&all);
    scene_destroy(&cropped);
}

static bool is_in_box(int i, int j, int k)
{
    return i >= 2 && j >= 3 && k >= 1 && i <= 17 && j <= 15 && k <= 18;
}

static bool boxed_blobs(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    blobs(NULL, i, j, k, code, gradient);
    return !user || is_in_box(i, j, k);
}

/* Creates a volume clipped to a box of whole voxels, and a volume that contains the box's voxels
 * alone. */
static void make_boxes(scene *all, scene *cropped, trip_settings *cutting)
{
    static char yes;
    const double lo[3] = { 2, 3, 1 }, hi[3] = { 17, 15, 18 };
    const trip_affine same = trip_affine_identity();
    scene *const both[2] = { all, cropped };
    for (int i = 0; i < 2; i++) {
        scene_create(both[i], &(scene_params){ .dims = { EDGE, EDGE, EDGE },
                                               .voxel = boxed_blobs,
                                               .user = i ? &yes : NULL });
        scene_colour(both[i], 20000, 40000, 0.2, 0.5, 1, 0.05);
        scene_colour(both[i], 40001, 65535, 0.9, 0.4, 0.1, 0.4);
    }
    trip_clip_add_box(&cutting->clip, lo, hi, &same);
}

/* Only rays along an axis are compared. Other rays have segments that cross the box's sides, and
 * clipping keeps a part of such a segment. */
static void sheets_cut_at_voxels_equal_those_of_a_cropped_volume(void **state)
{
    (void)state;
    scene all, cropped;
    trip_settings plain = clear(TRIP_CLASSIFY_POST), cutting = plain;
    make_boxes(&all, &cropped, &cutting);
    for (int i = 0; i < 3; i++) {
        const int axis = i, way = i % 2 ? -1 : 1;
        trip_camera_params view = scene_view(
            &all, trip_v3(way * (axis == 0), way * (axis == 1), way * (axis == 2)), 40, 35, 25);
        view.ortho_height = 22.3;
        for (const scene_renderer *r = scene_renderers_post(); r->name; r++) {
            scene_picture a = scene_draw(&all, r, &view, &cutting);
            scene_picture b = scene_draw(&cropped, r, &view, &plain);
            assert_true(scene_difference(&a, &b) < 1e-5);
            assert_true(scene_pixel(&a, 12, 12)[3] > 0.1F);
            scene_picture_free(&a);
            scene_picture_free(&b);
        }
    }
    scene_destroy(&all);
    scene_destroy(&cropped);
}

static void the_integral_cut_at_voxels_equals_that_of_a_cropped_volume(void **state)
{
    (void)state;
    scene all, cropped;
    trip_settings plain = clear(TRIP_CLASSIFY_PRE), cutting = plain;
    make_boxes(&all, &cropped, &cutting);
    for (int i = 0; i < 4; i++) {
        trip_camera_params view = scene_view(&all, trip_v3(1 - i, 0.4 * i, 0.7), 40, 35, 25);
        plain.field = cutting.field = (trip_field_kind)(i % 2);
        scene_picture a = scene_integrate(&all, &view, &cutting, &(scene_making){ 0 });
        scene_picture b = scene_integrate(&cropped, &view, &plain, &(scene_making){ 0 });
        assert_true(scene_difference(&a, &b) < 3e-6);
        assert_true(scene_pixel(&a, 12, 12)[3] > 0.1F);
        scene_picture_free(&a);
        scene_picture_free(&b);
    }
    scene_destroy(&all);
    scene_destroy(&cropped);
}

static void renderers_clip_like_the_reference(void **state)
{
    (void)state;
    scene s;
    make_blobs(&s, false);
    for (int i = 0; i < 4; i++) {
        trip_camera_params view =
            scene_view(&s, trip_v3(i % 2 ? 1 : -0.4, 0.8 - 0.4 * i, 0.5), i < 3 ? 40 : 6, 35, 40);
        view.ortho_height = i == 2 ? 25 : 0;
        trip_settings settings = clear((trip_classify)(i > 0));
        settings.shading = true;
        settings.depth = true;
        settings.show = (trip_show)(i % 2 ? TRIP_SHOW_LISTS : TRIP_SHOW_PICTURE);
        set_cut(&settings);
        const scene_renderer *r = scene_renderers();
        scene_picture expected = scene_draw(&s, r, &view, &settings);
        for (r++; r->name; r++) {
            scene_picture p = scene_draw(&s, r, &view, &settings);
            assert_true(scene_difference(&expected, &p) <= 2.0 / 255);
            for (int n = 0; n < 40 * 40; n++)
                if (scene_pixel(&p, n, 0)[3] > 0.05F)
                    assert_close(p.depth[n], expected.depth[n], 0.05);
            scene_picture_free(&p);
        }
        scene_picture_free(&expected);
    }
    scene_destroy(&s);
}

static void clipped_bricks_are_not_read(void **state)
{
    (void)state;
    scene s;
    make_blobs(&s, false);
    trip_camera camera;
    trip_camera_params view = scene_view(&s, trip_v3(1, 0.1, 0.2), 60, 30, 40);
    assert_int_equal(trip_camera_make(&camera, &view, &s.data->index_to_world), 0);
    for (int classify = 0; classify < 2; classify++) {
        uint64_t clipped[2] = { 0 }, selected[2] = { 0 };
        for (int cuts = 0; cuts < 2; cuts++) {
            trip_settings settings = clear((trip_classify)classify);
            trip_plan plan;
            if (cuts)
                trip_clip_add(&settings.clip, trip_v3(1, 0, 0), -16);
            assert_int_equal(trip_plan_make(&plan, s.data, &camera, &settings, s.table, s.budget),
                             0);
            for (unsigned i = 0; i < plan.list_count; i++) {
                clipped[cuts] += plan.lists[i].bricks_clipped;
                selected[cuts] += plan.lists[i].bricks_selected;
            }
            trip_plan_release(&plan, s.budget);
        }
        assert_int_equal(clipped[0], 0);
        assert_true(clipped[1] > 0);
        assert_int_equal(selected[0], selected[1] + clipped[1]);
    }
    scene_destroy(&s);
}

/* Lumps without a gap. */
static bool lumps(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user;
    (void)gradient;
    *code = (unsigned)(32768 + 32000 * sin(0.9 * i) * cos(0.7 * j + 0.5 * k));
    return true;
}

/* The picture is the same with small bricks and with one brick for the whole volume. Rays inside
 * the cut read values and gradients from beyond it. The distance grows with the ray's steepness to
 * the sheets. */
enum { WIDE = 48 };

static void compare_what_is_left_out(const trip_coordinates *coordinates, double middle_position)
{
    enum { SIZE = 16 };
    scene parts, whole;
    uint64_t left_out = 0;
    for (int i = 0; i < 2; i++) {
        scene_create(i ? &whole : &parts, &(scene_params){ .dims = { WIDE, WIDE, WIDE },
                                                           .coordinates = coordinates,
                                                           .tile_voxels = i ? 64 : 16,
                                                           .slab_sheets = i ? 64 : 1,
                                                           .voxel = lumps });
        scene_colour(i ? &whole : &parts, 20000, 65535, 0.9, 0.4, 0.1, 0.1);
    }
    for (int i = 0; i < 36; i++) {
        const bool steep = i % 3 == 2; /* draws from a list that is far from the view direction */
        const bool straight = i % 3 == 1;
        const trip_vec3 along = { i / 3 % 3 == 0, i / 3 % 3 == 1, i / 3 % 3 == 2 };
        const trip_vec3 middle = { middle_position, middle_position, middle_position };
        trip_half_space cut = random_half_space();
        trip_vec3 view_direction = random_half_space().normal;
        if (straight) /* the cut lies between two sheets of the list along the view */
            cut.normal = view_direction = trip_scale(along, i / 9 % 2 ? 1 : -1);
        trip_camera_params view =
            scene_view(&whole, view_direction, i % 4 ? 70 : 10, steep ? 120 : 40, SIZE);
        view.ortho_height = i % 4 == 1 ? 50 : 0;
        trip_settings settings = clear(TRIP_CLASSIFY_POST);
        settings.samples_per_sheet = 1 + i % 2;
        settings.shading = i % 5 > 0;
        settings.kernel = coordinates ? TRIP_KERNEL_LINEAR : (trip_kernel)(i / 2 % 3);
        settings.h = straight ? TRIP_H_AUTO : 0.3;
        settings.method = steep ? TRIP_METHOD_AXIS : TRIP_METHOD_MERGE;
        trip_clip_add(&settings.clip, cut.normal, 0.3 - trip_dot(cut.normal, middle));
        scene_picture a = scene_draw(&parts, scene_renderers(), &view, &settings);
        scene_picture b = scene_draw(&whole, scene_renderers(), &view, &settings);
        double apart = scene_difference(&a, &b);
        if (!(apart <= 1e-6))
            fail_msg("view %d: %g apart", i, apart);
        left_out += b.stats.all.splats_read - a.stats.all.splats_read;
        scene_picture_free(&a);
        scene_picture_free(&b);
    }
    assert_true(left_out > 10 * WIDE * WIDE * WIDE);
    scene_destroy(&parts);
    scene_destroy(&whole);
}

/* With uneven spacing, the voxels near the cut are nearly two units wide. */
static void culling_clipped_bricks_changes_nothing(void **state)
{
    (void)state;
    double table[WIDE] = { 0 };
    for (int i = 1; i < WIDE; i++)
        table[i] = table[i - 1] + (i > 16 && i <= 32 ? 1.96875 : 0.5);
    const double *const along[3] = { table, table, table };
    const trip_coordinates coordinates =
        trip_coordinates_make(along, (const int64_t[]){ WIDE, WIDE, WIDE });
    compare_what_is_left_out(NULL, WIDE / 2);
    compare_what_is_left_out(&coordinates, table[WIDE / 2]);
}

/* A pixel at which one list has all the weight shows the colour of the list's axis. */
static void lists_are_shown_in_their_colours(void **state)
{
    (void)state;
    scene s;
    make_blobs(&s, false);
    for (int i = 0; i < 6; i++) {
        const int axis = i % 3;
        trip_camera_params view =
            scene_view(&s, trip_v3(axis == 0, axis == 1, axis == 2), 60, 10, 9);
        view.ortho_height = 10;
        trip_settings settings = clear((trip_classify)(i / 3));
        settings.show = TRIP_SHOW_LISTS;
        for (const scene_renderer *r = scene_renderers(); r->name; r++) {
            scene_picture p = scene_draw(&s, r, &view, &settings);
            for (int n = 0; n < 81; n++)
                for (int c = 0; c < 3; c++) {
                    const float *rgba = scene_pixel(&p, n, 0);
                    assert_close(rgba[c], c == axis ? rgba[3] : 0, 1e-5 + r->tolerance);
                }
            assert_true(scene_pixel(&p, 4, 4)[3] > 0.1F);
            scene_picture_free(&p);
        }
    }
    scene_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_box_is_the_inside_of_its_six_faces),
        cmocka_unit_test(squares_hold_the_voxels_that_are_inside),
        cmocka_unit_test(squares_of_uneven_grids_hold_the_voxels_that_are_inside),
        cmocka_unit_test(boxes_entirely_outside_are_missed),
        cmocka_unit_test(boxes_of_voxels_inside_by_rounding_are_not_missed),
        cmocka_unit_test(a_ray_is_cut_to_its_part_inside),
        cmocka_unit_test(points_on_a_plane_are_inside),
        cmocka_unit_test(half_spaces_keep_their_side_under_an_inverse_map),
        cmocka_unit_test(half_spaces_that_hold_all_voxels_are_left_out),
        cmocka_unit_test(the_unclipped_path_has_its_opacity),
        cmocka_unit_test(clipped_splats_equal_those_of_a_cropped_volume),
        cmocka_unit_test(sheets_cut_at_voxels_equal_those_of_a_cropped_volume),
        cmocka_unit_test(the_integral_cut_at_voxels_equals_that_of_a_cropped_volume),
        cmocka_unit_test(renderers_clip_like_the_reference),
        cmocka_unit_test(clipped_bricks_are_not_read),
        cmocka_unit_test(culling_clipped_bricks_changes_nothing),
        cmocka_unit_test(lists_are_shown_in_their_colours),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
