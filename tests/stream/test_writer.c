#include "fixture.h"

#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

/* Decodes a whole list through the iterator and a plain read of the plane files. */
static void read_list(const trip_dataset *d, int axis, bool descending, fixture_voxel *out,
                      size_t room)
{
    trip_selection s;
    trip_run run;
    size_t n = 0;
    uint32_t voxels[128 * 128], normals[128 * 128];
    const trip_list *l = &d->lists[axis];
    assert_int_equal(trip_selection_create(&s, d, axis, descending, 0, INT32_MAX, d->budget),
                     TRIP_OK);
    for (uint64_t b = 0; b < l->brick_count; b++)
        trip_selection_add(&s, b);
    for (trip_run_iterator it = trip_run_begin(&s); trip_run_next(&it, &run);) {
        ssize_t bytes = (ssize_t)run.count * 4;
        assert_int_equal(pread(d->plane_fd[axis][0], voxels, (size_t)bytes, (off_t)run.first * 4),
                         bytes);
        if (d->header.planes & 2)
            assert_int_equal(
                pread(d->plane_fd[axis][1], normals, (size_t)bytes, (off_t)run.first * 4), bytes);
        for (uint32_t i = 0; i < run.count; i++) {
            uint32_t at = descending ? run.count - 1 - i : i;
            assert_true(n < room);
            fixture_voxel *x = &out[n++];
            x->p[axis] = (uint32_t)run.sheet;
            x->p[(axis + 1) % 3] = (uint32_t)run.u + trip_voxel_u(voxels[at]);
            x->p[(axis + 2) % 3] = (uint32_t)run.v + trip_voxel_v(voxels[at]);
            x->code = trip_voxel_code(voxels[at]);
            x->normal = d->header.planes & 2 ? normals[at] : 0;
        }
    }
    assert_int_equal(n, room);
    trip_selection_destroy(&s, d->budget);
}

static void check_round_trip(const fixture_params *params)
{
    fixture f;
    trip_dataset *d;
    fixture_make(&f, params);
    assert_int_equal(trip_dataset_open(&d, f.path, f.budget), TRIP_OK);
    assert_int_equal(d->header.kept, f.count);
    fixture_voxel *out = calloc(f.count + 1, sizeof *out);
    for (int axis = 0; axis < 3; axis++) {
        for (size_t i = 0; i < f.count && !params->normals; i++)
            f.lists[axis][i].normal = 0;
        read_list(d, axis, false, out, f.count);
        assert_memory_equal(out, f.lists[axis], f.count * sizeof *out);
        read_list(d, axis, true, out, f.count);
        for (size_t i = 0; i < f.count; i++)
            assert_memory_equal(&out[i], &f.lists[axis][f.count - 1 - i], sizeof *out);
    }
    free(out);
    trip_dataset_close(d);
    fixture_free(&f);
}

static void what_is_written_is_read_in_both_directions(void **state)
{
    (void)state;
    check_round_trip(&(fixture_params){ .normals = true });
}

static void the_voxels_of_a_list_do_not_depend_on_tiles_slabs_or_pages(void **state)
{
    (void)state;
    unsigned slabs[] = { 1, 3, 8, 64 };
    for (unsigned tile = 16; tile <= 128; tile *= 2)
        for (int s = 0; s < 4; s++)
            check_round_trip(&(fixture_params){ .dims = { 70, 33, 135 },
                                                .density = 0.05,
                                                .tile_voxels = tile,
                                                .slab_sheets = slabs[s],
                                                .page_bytes = 4096u << s });
}

static void an_empty_and_a_full_volume_are_written(void **state)
{
    (void)state;
    check_round_trip(&(fixture_params){ .empty = true });
    check_round_trip(&(fixture_params){ .density = 1.1, .dims = { 1, 64, 200 }, .normals = true });
    check_round_trip(&(fixture_params){ .density = 1.1, .dims = { 1, 1, 1 } });
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_written_is_read_in_both_directions),
        cmocka_unit_test(the_voxels_of_a_list_do_not_depend_on_tiles_slabs_or_pages),
        cmocka_unit_test(an_empty_and_a_full_volume_are_written),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
