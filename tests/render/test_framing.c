#include "scenes.h"
#include "test.h"

#include "framing.h"

#define DEGREE (3.14159265358979323846 / 180)

/* Returns an anisotropic, rotated and sheared map. */
static trip_affine sheared(void)
{
    return (trip_affine){ { { 0.5, 0.2, -0.1, 3 }, { -0.3, 1.5, 0.4, -2 }, { 0.1, 0.2, 2.5, 7 } } };
}

static trip_camera_params frame(const trip_view_settings *s, trip_view_object o)
{
    trip_found_view v;
    assert_int_equal(trip_view_find(&v, s, &o), 0);
    return v.params;
}

/* Computes the picture's axes in world space from the parameters alone. */
static void axes_of(const trip_camera_params *p, trip_vec3 *right, trip_vec3 *up,
                    trip_vec3 *view_direction)
{
    *view_direction = trip_normalize(trip_sub(p->look, p->eye));
    *right = trip_normalize(trip_cross(*view_direction, p->up));
    *up = trip_cross(*right, *view_direction);
}

/* Computes the picture position of a world point: half widths to the right, half heights up. */
static void position_of(const trip_camera_params *p, trip_vec3 point, double at[2])
{
    trip_vec3 right, up, view_direction, d = trip_sub(point, p->eye);
    axes_of(p, &right, &up, &view_direction);
    double depth = trip_dot(d, view_direction);
    double half = 0.5 * p->ortho_height;
    assert_true(depth > 0);
    if (!(half > 0))
        half = depth * tan(p->fov_degrees / 2 * DEGREE);
    at[0] = trip_dot(d, right) / (half * p->width / p->height);
    at[1] = trip_dot(d, up) / half;
}

static trip_vec3 corner_of(const trip_view_object *o, int corner)
{
    return trip_affine_point(&o->index_to_world, trip_v3(corner & 1 ? o->hi[0] : o->lo[0],
                                                         corner & 2 ? o->hi[1] : o->lo[1],
                                                         corner & 4 ? o->hi[2] : o->lo[2]));
}

static void box_bounds(const trip_view_object *o, const trip_camera_params *p, double lo[2],
                       double hi[2])
{
    lo[0] = lo[1] = INFINITY;
    hi[0] = hi[1] = -INFINITY;
    for (int corner = 0; corner < 8; corner++) {
        double at[2];
        position_of(p, corner_of(o, corner), at);
        for (int a = 0; a < 2; a++) {
            lo[a] = fmin(lo[a], at[a]);
            hi[a] = fmax(hi[a], at[a]);
        }
    }
}

/* Both ends of the tighter direction must be at the margin. The other direction must be centred. */
static void assert_fits(const double lo[2], const double hi[2])
{
    int tight = hi[1] - lo[1] > hi[0] - lo[0];
    assert_close(hi[tight], 0.9, 1e-9);
    assert_close(lo[tight], -0.9, 1e-9);
    assert_close(hi[!tight], -lo[!tight], 1e-4);
    assert_true(hi[!tight] <= 0.9 + 1e-9);
}

static void a_box_is_centred_and_fills_the_picture_up_to_the_margins(void **state)
{
    (void)state;
    const double sizes[][3] = { { 100, 100, 100 }, { 10, 200, 30 }, { 1, 1, 1 } };
    const trip_vec3 ups[] = { { 0, 0, 0 }, { 0, 1, 0 }, { 0, 0, -1 }, { 1, 2, 0.5 } };
    for (int i = 0; i < 2 * 3 * 4 * 8; i++) {
        const double *d = sizes[i % 3];
        trip_view_object o = { .index_to_world = sheared(),
                               .lo = { -3, 0, 5 },
                               .hi = { d[0] - 3, d[1], 5 + d[2] },
                               .up = ups[i / 3 % 4] };
        trip_view_settings s = { .width = i % 2 ? 300 : 100,
                                 .height = 200,
                                 .azimuth_degrees = 45.0 * (i / 12 % 8) + 3,
                                 .elevation_degrees = i % 7 * 10,
                                 .roll_degrees = i % 4 ? 0 : 25,
                                 .fov_degrees = i % 5 ? 0 : 70,
                                 .ortho_fit = i >= 96 };
        double lo[2], hi[2];
        trip_camera_params p = frame(&s, o);
        box_bounds(&o, &p, lo, hi);
        assert_fits(lo, hi);
    }
}

static bool one(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)gradient;
    *code = 65535;
    return i == 1 && j == 2 && k == 3;
}

/* A splat of radius 4 about voxel (1, 2, 3). The cone about a sphere of radius r at distance d has
 * the half angle asin(r / d). */
static void a_sphere_has_the_distance_of_its_tangent_cone(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 5, 6, 7 }, .voxel = one });
    scene_colour(&s, 65535, 65535, 1, 1, 1, 0.5);
    trip_visible v = { .data = s.data, .budget = s.budget, .table = s.table };
    const trip_view_object o = { .index_to_world = trip_affine_identity(),
                                 .visible = &v,
                                 .kernel_radius = 4 };
    trip_view_settings settings = { .width = 200, .height = 100, .fov_degrees = 50 };
    assert_int_equal(trip_reader_create(&v.reader, s.data, &(trip_reader_params){ 0 }, s.budget),
                     0);
    trip_camera_params p = frame(&settings, o);
    trip_vec3 to = trip_sub(trip_v3(1, 2, 3), p.eye), view_direction = trip_sub(p.look, p.eye);
    assert_close(trip_length(to), 4 / sin(atan(0.9 * tan(25 * DEGREE))), 1e-9);
    assert_close(trip_dot(trip_normalize(to), trip_normalize(view_direction)), 1, 1e-9);
    settings.ortho_fit = true;
    p = frame(&settings, o);
    assert_close(p.ortho_height, 8 / 0.9, 1e-9);
    to = trip_sub(trip_v3(1, 2, 3), p.eye);
    view_direction = trip_normalize(trip_sub(p.look, p.eye));
    assert_close(trip_length(trip_cross(to, view_direction)), 0, 1e-9);
    assert_true(trip_dot(to, view_direction) > 4); /* the eye is in front of the sphere */
    trip_reader_destroy(v.reader);
    scene_destroy(&s);
}

/* An ellipsoid of faint noise with some dense voxels around it. */
static bool cloud(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    (void)user, (void)gradient;
    const double x = (i - 31.5) / 28, y = (j - 23.5) / 20, z = (k - 15.5) / 13;
    const uint32_t noise = scene_hash(i, j, k);
    const bool dense = noise % 4096 == 7;
    *code = dense ? 65535 : 1000 + noise / 4096 % 3000;
    return dense || x * x + y * y + z * z < 1;
}

/* Checks the changes between neighbouring views. A body within R of its centre reaches at most
 * R dt farther or less far after a turn by dt. So half the height or width changes by at most
 * R sqrt(1 + t^2) dt for a half angle with tangent t. The point looked at moves by at most three
 * times as much.
 * There are `steps` views, `azimuth` and `elevation` degrees apart. */
static void assert_changes_gradually(trip_view_settings s, trip_view_object o, double radius,
                                     int steps, double azimuth, double elevation)
{
    const double half = s.ortho_fit ? 0 : 0.9 * tan(15 * DEGREE);
    const double wide = s.ortho_fit ? 0.9 : half;
    const double most = radius * sqrt(1 + half * half) * hypot(azimuth, elevation) * DEGREE;
    double last_size = 0;
    trip_vec3 last_look = { 0 };
    for (int n = 0; n < steps; n++) {
        const trip_camera_params p = frame(&s, o);
        const double size = s.ortho_fit ? p.ortho_height / 2 : trip_length(trip_sub(p.look, p.eye));
        if (n > 0) {
            assert_true(fabs(size - last_size) <= most / wide * 1.001);
            assert_true(trip_length(trip_sub(p.look, last_look)) <= 3 * most);
        }
        last_size = size;
        last_look = p.look;
        s.azimuth_degrees += azimuth;
        s.elevation_degrees += elevation;
    }
}

static void the_framing_changes_no_faster_than_the_direction(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        scene s;
        scene_create(&s, &(scene_params){ .dims = { 64, 48, 32 }, .voxel = cloud });
        scene_colour(&s, 65535, 65535, 1, 1, 1, 0.5);
        scene_colour(&s, 1000, 3999, 1, 1, 1, i ? 0.002 : 0.02);
        trip_visible v = { .data = s.data, .budget = s.budget, .table = s.table };
        const trip_view_object o = { .index_to_world = trip_affine_identity(), .visible = &v };
        trip_view_settings settings = { .width = 200, .height = 200, .elevation_degrees = 10 };
        const double radius = sqrt(32 * 32 + 24 * 24 + 16 * 16);
        assert_int_equal(
            trip_reader_create(&v.reader, s.data, &(trip_reader_params){ 0 }, s.budget), 0);
        for (int parallel = 0; parallel < 2; parallel++) {
            settings.ortho_fit = parallel;
            assert_changes_gradually(settings, o, radius, 72, 2.5, 0);
            assert_changes_gradually(settings, o, radius, 60, 0.02, 0);
            assert_changes_gradually(settings, o, radius, 60, -0.02, 0.05);
        }
        trip_reader_destroy(v.reader);
        scene_destroy(&s);
    }
}

static void without_memory_to_search_there_is_no_view(void **state)
{
    (void)state;
    scene s;
    scene_create(&s, &(scene_params){ .dims = { 5, 6, 7 }, .voxel = one });
    scene_colour(&s, 65535, 65535, 1, 1, 1, 0.5);
    trip_budget *none;
    assert_int_equal(trip_budget_create(&none, 1), 0);
    trip_visible v = { .data = s.data, .budget = none, .table = s.table };
    const trip_view_object o = { .index_to_world = trip_affine_identity(), .visible = &v };
    trip_found_view found;
    test_catch_reports();
    assert_int_equal(trip_view_find(&found, &(trip_view_settings){ .width = 9, .height = 9 }, &o),
                     TRIP_ERROR);
    assert_one_report("memory");
    trip_budget_destroy(none);
    scene_destroy(&s);
}

static void a_parallel_view_keeps_a_given_height_and_centres_its_object(void **state)
{
    (void)state;
    const trip_view_object o = { .index_to_world = sheared(), .hi = { 40, 40, 40 } };
    double lo[2], hi[2];
    trip_camera_params p =
        frame(&(trip_view_settings){ .width = 100, .height = 100, .ortho_height = 41 }, o);
    assert_close(p.ortho_height, 41, 0);
    box_bounds(&o, &p, lo, hi);
    for (int a = 0; a < 2; a++)
        assert_close(lo[a], -hi[a], 1e-9);
}

/* Returns the bounds of the box's corners over one turn in small steps. */
static void turned_bounds(const trip_view_object *o, const trip_camera_params *first,
                          double lowest[2], double highest[2])
{
    lowest[0] = lowest[1] = highest[0] = highest[1] = 0;
    for (int step = 0; step < 1440; step++) {
        double lo[2], hi[2];
        trip_camera_params p = trip_camera_turn(first, trip_v3(0, 0, 1), step * 0.25);
        box_bounds(o, &p, lo, hi);
        for (int a = 0; a < 2; a++) {
            lowest[a] = fmin(lowest[a], lo[a]);
            highest[a] = fmax(highest[a], hi[a]);
        }
    }
}

/* The corners touch a margin and never cross one. */
static void a_turning_object_stays_in_the_picture_and_touches_its_margins(void **state)
{
    (void)state;
    const double sizes[][3] = { { 100, 100, 100 }, { 10, 200, 30 }, { 5, 5, 300 } };
    for (int i = 0; i < 3 * 2 * 3 * 2; i++) {
        const double *d = sizes[i % 3];
        trip_view_object o = { .index_to_world = trip_affine_identity(),
                               .hi = { d[0], d[1], d[2] } };
        const trip_view_settings s = { .width = i / 3 % 2 ? 300 : 150,
                                       .height = 200,
                                       .elevation_degrees = i / 6 % 3 * 25,
                                       .roll_degrees = i % 5 ? 0 : 30,
                                       .ortho_fit = i >= 18,
                                       .turntable = true };
        o.index_to_world.m[2][2] = 0.7;
        trip_camera_params first = frame(&s, o);
        double lowest[2], highest[2];
        turned_bounds(&o, &first, lowest, highest);
        double max = fmax(fmax(highest[0], -lowest[0]), fmax(highest[1], -lowest[1]));
        assert_true(max <= 0.9 + 1e-9);
        assert_close(max, 0.9, 1e-4);
        /* The turntable's axis passes through the centre of the box. */
        assert_close(first.look.x, d[0] / 2, 1e-9);
        assert_close(first.look.y, d[1] / 2, 1e-9);
    }
}

/* A tower; its top is nearer than its foot. */
static void a_rolled_turntable_is_centred_vertically(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++) {
        const trip_view_object o = { .index_to_world = trip_affine_identity(),
                                     .hi = { 5, 5, 300 } };
        const trip_view_settings s = { .width = 200,
                                       .height = 200,
                                       .elevation_degrees = 25,
                                       .roll_degrees = 90 * i,
                                       .turntable = true };
        trip_camera_params first = frame(&s, o);
        double lowest[2], highest[2];
        turned_bounds(&o, &first, lowest, highest);
        const int along = i % 2 ? 0 : 1;
        assert_close(highest[along], 0.9, 1e-4);
        assert_close(lowest[along], -0.9, 1e-4);
    }
}

/* Returns the direction from the centre to the eye in the view that frames a cube. */
static trip_vec3 oriented_from(trip_view_settings s, trip_vec3 up, trip_vec3 front,
                               trip_camera_params *p)
{
    s.width = s.height = 10;
    *p = frame(&s, (trip_view_object){ .index_to_world = trip_affine_identity(),
                                       .hi = { 9, 9, 9 },
                                       .up = up,
                                       .front = front });
    return trip_normalize(trip_sub(p->eye, p->look));
}

static trip_vec3 seen_from(trip_view_settings s, trip_camera_params *p)
{
    return oriented_from(s, trip_v3(0, 0, 0), trip_v3(0, 0, 0), p);
}

static void assert_direction(trip_vec3 d, trip_vec3 expected)
{
    assert_close(trip_length(trip_sub(d, trip_normalize(expected))), 0, 1e-9);
}

static void the_default_view_is_from_the_front_right_and_above(void **state)
{
    (void)state;
    trip_camera_params p;
    const trip_view_settings s = { 0 };
    const trip_vec3 none = { 0 };
    trip_vec3 d = seen_from(s, &p);
    assert_true(-d.y > d.x && d.x > 0 && d.z > 0 && -d.y > d.z);
    d = oriented_from(s, trip_v3(0, 1, 0), none, &p);
    assert_true(d.z > d.x && d.x > 0 && d.y > 0 && d.z > d.y);
    d = oriented_from(s, none, trip_v3(0, 1, 0), &p);
    /* If the viewer faces +y with +z up, -x is on the right. */
    assert_true(d.y > -d.x && -d.x > 0 && d.z > 0);
}

static void sides_have_names(void **state)
{
    (void)state;
    /* The object faces -y, like a patient with y pointing to the back: +x is the patient's left. */
    const struct {
        trip_side side;
        trip_vec3 from, up;
    } expected[] = {
        { TRIP_SIDE_FRONT, { 0, -1, 0 }, { 0, 0, 1 } },
        { TRIP_SIDE_BACK, { 0, 1, 0 }, { 0, 0, 1 } },
        { TRIP_SIDE_LEFT, { 1, 0, 0 }, { 0, 0, 1 } },
        { TRIP_SIDE_RIGHT, { -1, 0, 0 }, { 0, 0, 1 } },
        { TRIP_SIDE_TOP, { 0, 0, 1 }, { 0, 1, 0 } },
        { TRIP_SIDE_BOTTOM, { 0, 0, -1 }, { 0, -1, 0 } },
    };
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
        trip_camera_params p;
        const trip_view_settings s = { .side = expected[i].side };
        assert_direction(seen_from(s, &p), expected[i].from);
        assert_direction(p.up, expected[i].up);
        /* The object faces +y, like a patient with y pointing to the front: -x is the patient's
         * left. */
        trip_vec3 from = expected[i].from, up = expected[i].up;
        assert_direction(oriented_from(s, trip_v3(0, 0, 0), trip_v3(0, 1, 0), &p),
                         trip_v3(-from.x, -from.y, from.z));
        assert_direction(p.up, trip_v3(-up.x, -up.y, up.z));
    }
    trip_camera_params p;
    assert_direction(seen_from((trip_view_settings){ .side = TRIP_SIDE_ISO }, &p),
                     trip_v3(1, -1, 1));
}

static void azimuth_goes_to_the_right_elevation_up_and_roll_turns_clockwise(void **state)
{
    (void)state;
    trip_camera_params p;
    double at[2];
    trip_view_settings f = { .side = TRIP_SIDE_FRONT, .azimuth_degrees = 60 };
    assert_direction(seen_from(f, &p), trip_v3(sin(60 * DEGREE), -cos(60 * DEGREE), 0));
    f = (trip_view_settings){ .side = TRIP_SIDE_FRONT, .elevation_degrees = 30 };
    assert_direction(seen_from(f, &p), trip_v3(0, -cos(30 * DEGREE), sin(30 * DEGREE)));
    f = (trip_view_settings){ .side = TRIP_SIDE_FRONT, .elevation_degrees = 135 };
    seen_from(f, &p); /* over the top: upside down, from behind */
    assert_true(p.eye.y > 4.5 && p.eye.z > 4.5);
    position_of(&p, trip_v3(4.5, 4.5, 9), at);
    assert_true(at[1] < 0);
    f = (trip_view_settings){ .side = TRIP_SIDE_FRONT, .roll_degrees = 90 };
    seen_from(f, &p);
    position_of(&p, trip_v3(4.5, 4.5, 9), at); /* the top has turned to the right */
    assert_true(at[0] > 0.5 && fabs(at[1]) < 1e-9);
    f.roll_degrees = 180;
    seen_from(f, &p);
    position_of(&p, trip_v3(4.5, 4.5, 9), at);
    assert_true(at[1] < -0.5 && fabs(at[0]) < 1e-9);
}

static trip_vec3 tipped(trip_vec3 up, trip_camera_params *p)
{
    const double given[3] = { up.x, up.y, up.z };
    return seen_from((trip_view_settings){ .side = TRIP_SIDE_FRONT, .up = given }, p);
}

static void any_direction_can_be_the_up_vector(void **state)
{
    (void)state;
    const trip_vec3 ups[] = { { 1, 0, 0 }, { -1, 0, 0 }, { 0, 1, 0 },   { 0, -1, 0 },
                              { 0, 0, 1 }, { 0, 0, -1 }, { 0.3, 2, -1 } };
    for (size_t i = 0; i < sizeof ups / sizeof *ups; i++) {
        trip_camera_params p;
        trip_vec3 d = tipped(ups[i], &p), up = trip_normalize(ups[i]);
        assert_close(trip_dot(d, up), 0, 1e-9); /* the eye stayed level and moved */
        assert_direction(p.up, up);
        if (fabs(up.y) < 0.5) /* still from the front */
            assert_direction(d, trip_v3(0, -1, 0));
    }
    /* The front turned up shows the bottom, turned down the top. */
    trip_camera_params p;
    assert_direction(tipped(trip_v3(0, -1, 0), &p), trip_v3(0, 0, -1));
    assert_direction(tipped(trip_v3(0, 3, 0), &p), trip_v3(0, 0, 1));
}

static void an_empty_box_far_from_the_origin_is_framed(void **state)
{
    (void)state;
    trip_affine m = trip_affine_identity();
    m.m[0][3] = 1e6;
    const trip_view_object o = { .index_to_world = m, .lo = { -1, -1, 0 }, .hi = { 1, 1, 0 } };
    double lo[2], hi[2];
    trip_camera_params p = frame(&(trip_view_settings){ .width = 50, .height = 50 }, o);
    box_bounds(&o, &p, lo, hi);
    assert_close(fmax(hi[0], hi[1]), 0.9, 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_box_is_centred_and_fills_the_picture_up_to_the_margins),
        cmocka_unit_test(a_sphere_has_the_distance_of_its_tangent_cone),
        cmocka_unit_test(the_framing_changes_no_faster_than_the_direction),
        cmocka_unit_test(without_memory_to_search_there_is_no_view),
        cmocka_unit_test(a_parallel_view_keeps_a_given_height_and_centres_its_object),
        cmocka_unit_test(a_turning_object_stays_in_the_picture_and_touches_its_margins),
        cmocka_unit_test(the_default_view_is_from_the_front_right_and_above),
        cmocka_unit_test(sides_have_names),
        cmocka_unit_test(a_rolled_turntable_is_centred_vertically),
        cmocka_unit_test(azimuth_goes_to_the_right_elevation_up_and_roll_turns_clockwise),
        cmocka_unit_test(any_direction_can_be_the_up_vector),
        cmocka_unit_test(an_empty_box_far_from_the_origin_is_framed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
