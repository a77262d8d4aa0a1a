/* Draws random scenes twice: unchanged, and transformed. A transformation permutes or mirrors the
 * axes of the grid, scales the world, or moves volume and camera together. The picture must be the
 * same in every form and with every instruction set. Seeds are fixed. */
#include "cpu/kernels/isa.h"
#include "hard.h"
#include "test.h"

#include <stdlib.h>

enum { SIZE = 20, SCENES = 5 };

/* The parameters of a scene. */
typedef struct field {
    int dims[3];
    double waves[4][4]; /* x, y, z in radians a voxel; phase */
    bool gaps;          /* some voxels are missing */
} field;

/* Maps a voxel of the transformed grid to a voxel of the field, and the field's world to the new
 * world. */
typedef struct transform {
    const char *name;
    int axis[3]; /* the field's axis for each axis of the grid */
    bool mirrored[3];
    double scale;
    bool moved;
    double splats; /* in 1/255; bound by splats where the order within a sheet changes */
} transform;

static const transform transforms[] = {
    { .name = "permuted", .axis = { 2, 0, 1 }, .scale = 1 },
    { .name = "two axes exchanged", .axis = { 1, 0, 2 }, .scale = 1, .splats = 8 },
    { .name = "mirrored",
      .axis = { 0, 1, 2 },
      .mirrored = { true, false, true },
      .scale = 1,
      .splats = 22 },
    { .name = "scaled up", .axis = { 0, 1, 2 }, .scale = 1e4 },
    { .name = "scaled down", .axis = { 0, 1, 2 }, .scale = 3e-7 },
    { .name = "moved", .axis = { 0, 1, 2 }, .scale = 1, .moved = true },
    { .name = "all of it",
      .axis = { 1, 2, 0 },
      .mirrored = { true, true, true },
      .scale = 0.3,
      .moved = true,
      .splats = 8 },
};

enum { TRANSFORMS = sizeof transforms / sizeof *transforms };

static uint32_t seed;

static double uniform(double lo, double hi)
{
    seed = seed * 1664525u + 1013904223u;
    return lo + (hi - lo) * (double)(seed >> 8) / (1 << 24);
}

static void make_field(field *f, int number)
{
    seed = 77u + 1000u * (unsigned)number;
    for (int a = 0; a < 3; a++)
        f->dims[a] = 7 + (int)uniform(0, 6.99);
    for (int i = 0; i < 16; i++)
        f->waves[i / 4][i % 4] = i % 4 == 3 ? uniform(0, 6.28) : uniform(-1.3, 1.3);
    f->gaps = number % 2;
}

/* A field under a transformation. */
typedef struct turned {
    const field *field;
    const transform *by;
} turned;

static bool value_at(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const turned *t = user;
    const field *f = t->field;
    const int own[3] = { i, j, k };
    int at[3] = { 0 };
    double value = 0.5;
    (void)gradient;
    for (int a = 0; a < 3; a++) {
        int axis = t->by->axis[a];
        at[axis] = t->by->mirrored[a] ? f->dims[axis] - 1 - own[a] : own[a];
    }
    for (int w = 0; w < 4; w++)
        value += 0.12 * sin(f->waves[w][0] * at[0] + f->waves[w][1] * at[1] +
                            f->waves[w][2] * at[2] + f->waves[w][3]);
    *code = (unsigned)lround(65535 * value);
    return !f->gaps || scene_hash(at[0], at[1], at[2]) % 97 != 0;
}

/* Returns the movement: a rotation about an oblique axis, and a translation. */
static trip_affine move_of(const transform *t)
{
    const double s = t->scale;
    if (!t->moved)
        return (trip_affine){ { { s, 0, 0, 0 }, { 0, s, 0, 0 }, { 0, 0, s, 0 } } };
    const double turn[3][3] = { { 2, -1, 2 }, { 2, 2, -1 }, { -1, 2, 2 } }; /* thirds */
    const double shift[3] = { 31, -17, 1203 };
    trip_affine m;
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++)
            m.m[r][c] = s * turn[r][c] / 3;
        m.m[r][3] = shift[r];
    }
    return m;
}

/* Returns the map of the transformed grid: the field's own map, then the movement. */
static trip_affine world_of(const turned *t, const trip_affine *own)
{
    trip_affine to_field = { 0 };
    for (int a = 0; a < 3; a++) {
        int axis = t->by->axis[a];
        to_field.m[axis][a] = t->by->mirrored[a] ? -1 : 1;
        to_field.m[axis][3] = t->by->mirrored[a] ? t->field->dims[axis] - 1 : 0;
    }
    trip_affine move = move_of(t->by), inner = trip_affine_multiply(own, &to_field);
    return trip_affine_multiply(&move, &inner);
}

static void make_scene(scene *s, const turned *t, const trip_affine *own)
{
    trip_affine world = world_of(t, own);
    turned user = *t;
    scene_create(s, &(scene_params){ .dims = { t->field->dims[t->by->axis[0]],
                                               t->field->dims[t->by->axis[1]],
                                               t->field->dims[t->by->axis[2]] },
                                     .index_to_world = world,
                                     .tile_voxels = 16,
                                     .voxel = value_at,
                                     .user = &user });
    for (int code = 0; code < 65536; code++) {
        double v = code / 65535.0, more = fmax(0, v - 0.6);
        s->table[code] = (trip_tf_entry){ (float)v, (float)(0.5 + 0.4 * sin(9 * v)), (float)(1 - v),
                                          (float)((0.05 * v + 6 * more) / t->by->scale) };
    }
}

static trip_camera_params move_camera(const trip_camera_params *c, const transform *t)
{
    trip_affine move = move_of(t);
    trip_camera_params out = *c;
    out.eye = trip_affine_point(&move, c->eye);
    out.look = trip_affine_point(&move, c->look);
    out.up = trip_affine_vector(&move, c->up);
    out.ortho_height *= t->scale;
    return out;
}

/* Creates a grid of random spacing with a slight shear, and a view of it: parallel, from outside,
 * or from inside the volume. */
static void make_view(const field *f, int number, trip_affine *own, hard_view *v)
{
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 4; c++)
            own->m[r][c] = c == 3   ? uniform(-40, 40)
                           : r == c ? uniform(0.6, 1.7)
                                    : uniform(-0.1, 0.1);
    const trip_vec3 middle = trip_affine_point(
        own, trip_v3(0.5 * (f->dims[0] - 1), 0.5 * (f->dims[1] - 1), 0.5 * (f->dims[2] - 1)));
    const trip_vec3 to_eye =
        trip_normalize(trip_v3(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)));
    const bool inside = number % 3 == 2;
    *v = (hard_view){ .settings = hard_settings() };
    v->camera = (trip_camera_params){
        .eye = trip_add(middle, trip_scale(to_eye, inside ? 2.3 : uniform(12, 20))),
        .look = middle,
        .up = { uniform(-0.2, 0.2), uniform(-0.2, 0.2), 1 },
        .fov_degrees = inside ? 100 : 45,
        .ortho_height = number % 3 == 1 ? 11 : 0,
        .width = SIZE,
        .height = SIZE,
    };
    v->settings.h = uniform(0, 0.95);
    v->settings.samples_per_sheet = 1 + number % 3;
    v->settings.method = number == 3 ? TRIP_METHOD_CLIP : TRIP_METHOD_MERGE;
}

/* Returns the bound in 1/255. If the order of splats stays the same, only rounding differs. */
static double bound_of(const transform *t, unsigned form, bool reference)
{
    if (form == HARD_SPLATS && t->splats > 0)
        return t->splats;
    return reference ? 1e-4 : 0.15;
}

static double worst[2][TRANSFORMS][8];

static void expect_same(const scene *a, const scene *b, const hard_view *v, const hard_view *moved,
                        const transform *t, const scene_renderer *r, unsigned form)
{
    scene_picture before = hard_draw(a, r, v, form), after = hard_draw(b, r, moved, form);
    const bool reference = r == &cpu_scenes_reference;
    double apart = 255 * scene_difference(&before, &after);
    double *max = &worst[reference][t - transforms][form];
    *max = fmax(*max, apart);
    if (!(apart <= bound_of(t, form, reference)))
        fail_msg("%s, form %u, %s: %.6f of 255 apart", t->name, form, r->name, apart);
    scene_picture_free(&before);
    scene_picture_free(&after);
}

static void draw_pair(const scene *a, const scene *b, const hard_view *v, const hard_view *moved,
                      const transform *t, unsigned form)
{
    expect_same(a, b, v, moved, t, &cpu_scenes_reference, form);
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        expect_same(a, b, v, moved, t, &cpu_scenes_cpu, form);
    }
    unsetenv("TRIPTYCH_ISA");
}

static void check_scene(int number)
{
    static const transform as_it_is = { .axis = { 0, 1, 2 }, .scale = 1 };
    field f;
    trip_affine own;
    hard_view v;
    scene a, b;
    make_field(&f, number);
    make_view(&f, number, &own, &v);
    make_scene(&a, &(turned){ &f, &as_it_is }, &own);
    for (int i = 0; i < TRANSFORMS; i++) {
        const transform *t = &transforms[i];
        hard_view moved = v;
        moved.camera = move_camera(&v.camera, t);
        make_scene(&b, &(turned){ &f, t }, &own);
        for (unsigned form = HARD_SPLATS; form <= HARD_POST; form *= 2) {
            v.settings.shading = moved.settings.shading = form == HARD_POST;
            draw_pair(&a, &b, &v, &moved, t, form);
        }
        scene_destroy(&b);
    }
    scene_destroy(&a);
}

static void transformed_scenes_give_the_same_picture(void **state)
{
    (void)state;
    for (int number = 0; number < SCENES; number++)
        check_scene(number);
    for (int i = 0; i < TRANSFORMS; i++)
        print_message("%s: by splats %.4f, by sheets %.4f, post %.4f of 255; reference %.2g, %.2g, "
                      "%.2g\n",
                      transforms[i].name, worst[0][i][1], worst[0][i][2], worst[0][i][4],
                      worst[1][i][1], worst[1][i][2], worst[1][i][4]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(transformed_scenes_give_the_same_picture),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
