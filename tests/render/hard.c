#include "hard.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cpu/kernels/isa.h"
#include "test.h"

trip_settings hard_settings(void)
{
    trip_settings s = trip_settings_default();
    s.shading = false;
    s.background[3] = 0;
    return s;
}

static const char *name_of(unsigned form)
{
    return form == HARD_POST ? "post" : form == HARD_SHEETS ? "pre by sheets" : "pre by splats";
}

scene_picture hard_draw(const scene *s, const scene_renderer *r, const hard_view *view,
                        unsigned form)
{
    trip_settings settings = view->settings;
    settings.classify = form == HARD_POST ? TRIP_CLASSIFY_POST : TRIP_CLASSIFY_PRE;
    settings.compositing = form == HARD_SHEETS ? TRIP_COMPOSITING_SHEET : TRIP_COMPOSITING_SPLAT;
    return scene_draw(s, r, &view->camera, &settings);
}

static void expect_near(const hard_view *view, unsigned form, const scene_picture *expected,
                        const scene_picture *p, double tolerance, const char *name)
{
    double apart = scene_difference(expected, p);
    if (!(apart <= tolerance))
        fail_msg("%s, %s: %s is %.3f of 255 apart", view->name, name_of(form), name, 255 * apart);
}

static double tolerance_of(const hard_view *view, unsigned form, const scene_renderer *r)
{
    return form == HARD_POST && view->tie > 0 ? view->tie : r->tolerance;
}

static void check_cpu(const scene *s, const hard_view *view, unsigned form,
                      const scene_picture *expected)
{
    for (const trip_cpu_kernels *const *isa = trip_cpu_isas(); *isa; isa++) {
        setenv("TRIPTYCH_ISA", (*isa)->isa, 1);
        scene_picture p = hard_draw(s, &cpu_scenes_cpu, view, form);
        expect_near(view, form, expected, &p, tolerance_of(view, form, &cpu_scenes_cpu),
                    (*isa)->isa);
        scene_picture_free(&p);
    }
    unsetenv("TRIPTYCH_ISA");
}

static void check_gl(const scene *s, const hard_view *view, unsigned form,
                     const scene_picture *expected)
{
    for (const scene_renderer *r = scene_renderers() + 2; r->name; r++) {
        scene_picture p = hard_draw(s, r, view, form);
        expect_near(view, form, expected, &p, tolerance_of(view, form, r), r->name);
        scene_picture_free(&p);
    }
}

static void expect_shown(const hard_view *view, unsigned form, const scene_picture *p)
{
    const double max = scene_max_opaque(p);
    if (view->shows && !(max > 0.5))
        fail_msg("%s, %s: the reference shows %g at most", view->name, name_of(form), max);
}

void hard_check(const scene *s, const hard_view *view)
{
    for (unsigned form = HARD_SPLATS; form <= HARD_POST; form *= 2) {
        if (!(view->forms & form))
            continue;
        scene_picture expected = hard_draw(s, &cpu_scenes_reference, view, form);
        expect_shown(view, form, &expected);
        check_cpu(s, view, form, &expected);
        if (view->gl & form)
            check_gl(s, view, form, &expected);
        scene_picture_free(&expected);
    }
}

static bool lump(void *user, int i, int j, int k, unsigned *code, double gradient[3])
{
    const int64_t *dims = user;
    double x = i - 0.5 * (double)(dims[0] - 1), y = j - 0.5 * (double)(dims[1] - 1);
    double z = k - 0.5 * (double)(dims[2] - 1);
    double r2 = x * x + y * y + z * z, wave = sin(0.7 * x + 0.2) * cos(0.6 * y) * sin(0.5 * z + 1);
    (void)gradient;
    *code = (unsigned)(65535 * (0.75 * exp(-r2 / 20) + 0.1 + 0.1 * wave));
    return true;
}

void hard_lumps(scene *s, const int64_t dims[3], const trip_affine *index_to_world)
{
    int64_t kept[3] = { dims[0], dims[1], dims[2] };
    scene_params params = {
        .dims = { dims[0], dims[1], dims[2] }, .tile_voxels = 16, .voxel = lump, .user = kept
    };
    if (index_to_world)
        params.index_to_world = *index_to_world;
    scene_create(s, &params);
    double voxel = cbrt(fabs(trip_affine_determinant(&s->data->index_to_world)));
    for (int code = 0; code < 65536; code++) {
        double v = code / 65535.0, more = fmax(0, v - 0.3);
        s->table[code] = (trip_tf_entry){ (float)v, (float)(0.5 + 0.4 * sin(9 * v)), (float)(1 - v),
                                          (float)((0.05 * v + 4 * more * more) / voxel) };
    }
}
