/* Views that are difficult for numbers: the eye anywhere, rays along axes and diagonals, weights
 * at the border between lists, and the widest and narrowest views. */
#include "hard.h"
#include "test.h"

/* SIZE is in pixels. It is odd, so that the central ray is the view direction. */
enum { EDGE = 12, SIZE = 17 };

static scene lumps;

static int set_up(void **state)
{
    (void)state;
    hard_lumps(&lumps, (const int64_t[3]){ EDGE, EDGE, EDGE }, NULL);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    scene_destroy(&lumps);
    return 0;
}

static hard_view view_from(const char *name, trip_vec3 eye, trip_vec3 towards, double fov)
{
    hard_view v = { .name = name, .settings = hard_settings(), .forms = HARD_ALL };
    trip_vec3 d = trip_normalize(towards);
    v.camera = (trip_camera_params){ .eye = eye,
                                     .look = trip_add(eye, trip_scale(d, 10)),
                                     .up = fabs(d.z) < 0.9 ? trip_v3(0, 0, 1) : trip_v3(0, 1, 0),
                                     .fov_degrees = fov,
                                     .width = SIZE,
                                     .height = SIZE };
    return v;
}

/* Returns a view towards the centre of the grid from a given distance. */
static hard_view view_of(const char *name, trip_vec3 from, double distance, double fov)
{
    const double c = 0.5 * (EDGE - 1);
    trip_vec3 d = trip_normalize(from);
    return view_from(name, trip_add(trip_v3(c, c, c), trip_scale(d, distance)), trip_scale(d, -1),
                     fov);
}

static void the_eye_may_be_anywhere(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        trip_vec3 eye;
    } positions[] = {
        { "inside a cell", { 4.3, 5.7, 6.2 } },
        { "on a voxel", { 4, 5, 6 } },
        { "on a sheet", { 4, 5.3, 6.7 } },
        { "on two sheets", { 4, 5, 6.7 } },
        { "between sheets", { 4.5, 5.5, 6.5 } },
        { "a millionth off a sheet", { 4.000001, 5.5, 6.5 } },
        { "on the first sheet", { 0, 5.3, 6.7 } },
        { "on the last voxel", { EDGE - 1, EDGE - 1, EDGE - 1 } },
        { "inside a splat beside the grid", { -0.7, 5.2, 6.1 } },
        { "where a splat's support ends", { -2, 5, 6 } },
    };
    for (size_t i = 0; i < sizeof positions / sizeof *positions; i++)
        for (int wide = 0; wide < 2; wide++) {
            hard_view v = view_from(positions[i].name, positions[i].eye, trip_v3(0.6, 0.35, -0.2),
                                    wide ? 100 : 40);
            v.gl = wide ? 1u << i % 3 : 0;
            v.settings.h = 0.3 + 0.5 * wide;
            hard_check(&lumps, &v);
        }
}

static void rays_may_lie_along_axes_and_diagonals(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        trip_vec3 towards;
    } rays[] = {
        { "along X", { 1, 0, 0 } },
        { "against X", { -1, 0, 0 } },
        { "along Y", { 0, 1, 0 } },
        { "against Z", { 0, 0, -1 } },
        { "45 degrees of X and Y", { 1, 1, 0 } },
        { "45 degrees of Y and Z", { 0, -1, 1 } },
        { "45 degrees of Z and X", { -1, 0, -1 } },
        { "along (1, 1, 1)", { 1, 1, 1 } },
        { "along (-1, 1, -1)", { -1, 1, -1 } },
    };
    static const double hs[] = { 0, 0.85, 1 - 0x1p-40, 1 - 0x1p-53 };
    for (size_t i = 0; i < sizeof rays / sizeof *rays; i++)
        for (int n = 0; n < 12; n++) {
            hard_view v =
                view_of(rays[i].name, trip_scale(rays[i].towards, -1), n % 2 ? 20 : 40, 40);
            v.camera.ortho_height = n % 2 ? EDGE : 0;
            v.settings.method = n / 2 < 4    ? TRIP_METHOD_MERGE
                                : n / 2 == 4 ? TRIP_METHOD_CLIP
                                             : TRIP_METHOD_AXIS;
            v.settings.h = n / 2 < 4 ? hs[n / 2] : 0.85;
            v.forms = 1u << (i + (size_t)n) % 3;
            v.gl = n % 4 == 1 ? HARD_ALL : 0;
            v.shows = true;
            /* Rays through edges of the grid take one segment more or fewer. */
            v.tie = i > 3 ? 3.0 / 255 : 0;
            hard_check(&lumps, &v);
        }
}

static void views_may_graze_sheets_and_be_as_wide_as_they_go(void **state)
{
    (void)state;
    hard_view views[] = {
        view_from("just above a face", trip_v3(-8, 5.4, EDGE - 1 + 1e-3), trip_v3(1, 0, 0), 60),
        view_from("in the plane of a face", trip_v3(-8, 5.4, EDGE - 1), trip_v3(1, 0, 0), 60),
        view_from("in the plane of a sheet", trip_v3(-8, 5.4, 5), trip_v3(1, 0.01, 0), 60),
        view_from("a thousandth of a degree off a face", trip_v3(-9, 5.4, EDGE - 1),
                  trip_v3(1, 0, -1.7e-5), 50),
        view_from("170 degrees inside", trip_v3(5.2, 5.7, 6.1), trip_v3(1, 0.5, 0.2), 170),
        view_from("170 degrees beside", trip_v3(-0.5, 5.7, 6.1), trip_v3(1, 0.5, 0.2), 170),
        view_from("179 degrees", trip_v3(5.2, 5.7, 6.1), trip_v3(1, 1, 1), 179),
        view_from("170 degrees from outside", trip_v3(-2.5, 5.7, 6.1), trip_v3(1, 0, 0), 170),
    };
    for (size_t i = 0; i < sizeof views / sizeof *views; i++) {
        views[i].gl = HARD_POST | (i % 2 ? HARD_SPLATS : HARD_SHEETS);
        if (i == 1) /* rounding decides whether rays in a face are visible */
            views[i].forms = HARD_SPLATS | HARD_SHEETS;
        hard_check(&lumps, &views[i]);
    }
}

static void a_voxel_may_be_a_thousand_pixels_or_a_fraction_of_one(void **state)
{
    (void)state;
    static const double voxel_px[] = { 1000, 100, 1.0 / 8, 1.0 / 64, 1.0 / 256 };
    for (int i = 0; i < 5; i++)
        for (int ortho = 0; ortho < 2; ortho++) {
            char name[64];
            double height = SIZE / voxel_px[i];
            snprintf(name, sizeof name, "%g pixels a voxel, %s", voxel_px[i],
                     ortho ? "parallel" : "perspective");
            double distance = ortho ? 40 : 0.5 * height / tan(15 * 3.14159265358979 / 180);
            hard_view v = view_of(name, trip_v3(0.4, -1, 0.3), fmax(distance, 14), 30);
            if (!ortho && distance < 14)
                v.camera.fov_degrees = 360 / 3.14159265358979 * atan(0.5 * height / 14);
            v.camera.ortho_height = ortho ? height : 0;
            v.gl = 1u << (i + ortho) % 3 | HARD_POST;
            hard_check(&lumps, &v);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_eye_may_be_anywhere),
        cmocka_unit_test(rays_may_lie_along_axes_and_diagonals),
        cmocka_unit_test(views_may_graze_sheets_and_be_as_wide_as_they_go),
        cmocka_unit_test(a_voxel_may_be_a_thousand_pixels_or_a_fraction_of_one),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
