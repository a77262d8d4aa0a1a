/* Tests that settings are compared member by member. Every member counts, and padding between
 * members does not. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "same_settings.h"

/* Copies all members. The other bytes of `to` become `filler`. */
static void lay_out(triptych_settings *to, const triptych_settings *s, int filler)
{
    memset(to, filler, sizeof *to);
#define MEMBER(name) memcpy(&to->name, &s->name, sizeof to->name)
    MEMBER(classify);
    MEMBER(compositing);
    MEMBER(footprint);
    MEMBER(low_pass);
    MEMBER(vertex_weights);
    MEMBER(normalise);
    MEMBER(flatten);
    MEMBER(samples_per_sheet);
    MEMBER(method);
    MEMBER(traversal);
    MEMBER(target);
    MEMBER(indexed);
    MEMBER(triangles);
    MEMBER(shading);
    MEMBER(headlight);
    MEMBER(point_light);
    MEMBER(light);
    MEMBER(h);
    MEMBER(early_termination);
    MEMBER(kernel_radius);
    MEMBER(background);
    MEMBER(lod_px);
    MEMBER(max_bytes);
    MEMBER(max_ms);
    MEMBER(depth);
    MEMBER(field);
    MEMBER(kernel);
    MEMBER(tolerance);
    MEMBER(samples);
    MEMBER(count);
    MEMBER(show);
    MEMBER(clip.box);
    MEMBER(clip.box_of_voxels);
    MEMBER(clip.box_lo);
    MEMBER(clip.box_hi);
    MEMBER(clip.planes);
    MEMBER(effects);
    MEMBER(anisotropy);
    MEMBER(cueing);
    MEMBER(kelvin);
    MEMBER(light_cells);
    memcpy(to->clip.plane, s->clip.plane, (size_t)s->clip.planes * sizeof *to->clip.plane);
#undef MEMBER
}

static void padding_between_members_does_not_count(void **state)
{
    (void)state;
    triptych_settings s = triptych_default_settings(), a, b;
    s.clip.planes = 2;
    lay_out(&a, &s, 0);
    lay_out(&b, &s, 0x55);
    assert_true(trip_same_settings(&a, &b));
}

static void every_member_counts(void **state)
{
    (void)state;
    const triptych_settings s = triptych_default_settings();
    triptych_settings other = s;
#define COUNTS(name)                                                                               \
    do {                                                                                           \
        other.name += 1;                                                                           \
        assert_false(trip_same_settings(&s, &other));                                              \
        other = s;                                                                                 \
    } while (0)
    COUNTS(classify);
    COUNTS(compositing);
    COUNTS(footprint);
    COUNTS(low_pass);
    COUNTS(vertex_weights);
    COUNTS(normalise);
    COUNTS(flatten);
    COUNTS(samples_per_sheet);
    COUNTS(method);
    COUNTS(traversal);
    COUNTS(target);
    COUNTS(indexed);
    COUNTS(triangles);
    COUNTS(shading);
    COUNTS(headlight);
    COUNTS(point_light);
    COUNTS(light[2]);
    COUNTS(h);
    COUNTS(early_termination);
    COUNTS(kernel_radius);
    COUNTS(background[3]);
    COUNTS(lod_px);
    COUNTS(max_bytes);
    COUNTS(max_ms);
    COUNTS(depth);
    COUNTS(field);
    COUNTS(kernel);
    COUNTS(tolerance);
    COUNTS(samples);
    COUNTS(count);
    COUNTS(show);
    COUNTS(clip.box);
    COUNTS(clip.box_of_voxels);
    COUNTS(clip.box_lo[2]);
    COUNTS(clip.box_hi[0]);
    COUNTS(clip.planes);
    COUNTS(effects);
    COUNTS(anisotropy);
    COUNTS(cueing);
    COUNTS(kelvin[1]);
    COUNTS(light_cells);
#undef COUNTS
}

static void only_clip_planes_in_use_count(void **state)
{
    (void)state;
    triptych_settings a = triptych_default_settings(), b;
    a.clip.planes = 2;
    b = a;
    b.clip.plane[2][0] = 1;
    assert_true(trip_same_settings(&a, &b));
    b.clip.plane[1][3] = 1;
    assert_false(trip_same_settings(&a, &b));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(padding_between_members_does_not_count),
        cmocka_unit_test(every_member_counts),
        cmocka_unit_test(only_clip_planes_in_use_count),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
